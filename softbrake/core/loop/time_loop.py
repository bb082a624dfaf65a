"""The loop over steps, whatever moves the nodes: length of each step, checks of energy, events within a step, the end."""

from math import exp, sqrt

from softbrake.core.arrays import After, GasState, Motion, Outcome, Peak, Source
from softbrake.core.columns import History
from softbrake.core.contact.obstacles import end_on_ground
from softbrake.core.jit import kernel
from softbrake.core.peaks import raise_peak
from softbrake.core.pressure import update_pressure

STEPS_PER_STEP_CHOICE = 16  # most; a choice costs a third of a step, 0.7 of one of the axisymmetric shell
STEADY = 0.99  # a limit that has fallen to less of the last one is looked at more often
LENGTHENED = 1.2  # a step becomes longer by no less
FILTER_TIME = 1.6e-4  # s, time constant of the one-way low-pass before the peak deceleration: 1 kHz, and no channel class
RUNAWAY = 4.0  # kinetic energy above this many times what start, gravity and pressure gave: it came from nowhere
MADE = 0.25  # the same of what fabric, belts or viscosity gave beyond what they had


@kernel
def choose_step(state, limit):
    """Take a limit (s) of the stable step until the next choice; where it falls, as far as it will have fallen by then.

    The step is kept where it is not too long, and not much too short: a leapfrog whose steps swing with the shell is not
    symplectic, and pumps energy into it. Writes state.stable_step, choice.
    """
    before, step = state.stable_step[1], state.stable_step[0]
    safe = limit * min(limit / before, 1.0)
    if before == 0.0 or safe < step or safe > LENGTHENED * step:
        state.stable_step[0] = safe
    state.stable_step[1] = limit
    falls = limit < STEADY * before
    state.choice[1] = max(state.choice[1] // 2, 1) if falls else min(2 * state.choice[1], STEPS_PER_STEP_CHOICE)
    state.choice[0] = state.steps[0] + state.choice[1]


@kernel
def begin_step(model, state):
    """Return the next step (s): from n to n+1, and from n-1/2 to n+1/2. Writes the first and p~ to state.now. Eq. (2.10).

    The staggered start: the first half-step has no velocity at -1/2 to start from, but that at 0.
    """
    length = min(model.courant * state.stable_step[0], model.end - state.now[History.TIME])
    state.now[History.TIME_STEP] = length
    update_pressure(model, state, 0.5 * state.last_step[0], 0.5 * length)  # (2.10)
    return length, 0.5 * (state.last_step[0] + length)


@kernel
def end_step(model, state, length, height):
    """Move state.now from n to n+1, or to the event within the step. Returns the Outcome.

    Reads length (s) of the step; height (m) of the cover at n+1; energies of state.now at n+1/2. Writes state but for its works.
    """
    now = state.now
    before, velocity, acceleration = now[History.HEIGHT], now[History.VELOCITY], now[History.ACCELERATION]
    filter_deceleration(model, state, length)
    high = state.motion[Motion.LOWEST] > model.crushing
    within, outcome = event_time(before, velocity, acceleration, length)
    if outcome == Outcome.STOPPED:
        lowest = before + within * (velocity + 0.5 * within * acceleration)
        state.motion[Motion.LOWEST] = min(state.motion[Motion.LOWEST], lowest)
        state.motion[Motion.REST_TIME] = min(state.motion[Motion.REST_TIME], now[History.TIME] + within)
        if model.after != After.STOP:
            within, outcome = length, Outcome.RUNNING
    if outcome == Outcome.RUNNING and height >= model.height and (model.height > before or velocity < 0.0):
        within, outcome = rises_to(model.height - before, velocity, acceleration), Outcome.REBOUND
    elif outcome == Outcome.RUNNING and model.after == After.TOP and velocity > 0.0 >= velocity + length * acceleration:
        within, outcome = -velocity / acceleration, Outcome.STOPPED
    if outcome == Outcome.RUNNING and length == model.end - now[History.TIME]:
        outcome = Outcome.TIME_LIMIT
    if ran_away(model, state):
        outcome = Outcome.DIVERGED
    if outcome == Outcome.RUNNING:
        now[History.HEIGHT] = height
    elif outcome == Outcome.IMPACT:
        now[History.HEIGHT] = 0.0
    else:
        now[History.HEIGHT] += within * (velocity + 0.5 * within * acceleration)
    if high and before > model.crushing >= now[History.HEIGHT]:  # for the first time
        begin_crushing(state.peaks, state.overshoot)
    if model.gas.exponent > 0.0:
        reached = within / length * (state.gas[GasState.NEXT_VOLUME] - state.gas[GasState.VOLUME])
        state.gas[GasState.NEXT_VOLUME] = state.gas[GasState.VOLUME] + reached
    now[History.TIME] += within
    now[History.VELOCITY] = velocity + within * acceleration
    state.steps[0] += 1
    state.last_step[0] = length
    if outcome != Outcome.RUNNING:
        rewind(state.nodes, length - within)
        if outcome == Outcome.IMPACT and model.obstacles.cover == 1 and model.obstacles.ground == 0.0:
            end_on_ground(state.nodes, model.obstacles, before, within)
        update_pressure(model, state, 0.0, 0.0)
        now[History.TIME_STEP] = 0.0
    return outcome


@kernel
def begin_crushing(peaks, overshoot):
    """Keep the peaks so far as those of the overshoot, and begin anew. Writes both, (len(Peak), 3)."""
    for which in range(peaks.shape[0]):
        for part in range(peaks.shape[1]):
            overshoot[which, part] = peaks[which, part]
            peaks[which, part] = 0.0


@kernel
def ran_away(model, state):
    """Return whether the kinetic energy of state.now is more than what was given or not a number, or a Source made of it."""
    record_made(state)
    given, made = energy_given(model, state), state.made
    most = max(made[Source.FABRIC], made[Source.BELTS], made[Source.VISCOSITY])
    return not (state.now[History.KINETIC_ENERGY] <= RUNAWAY * given and most <= MADE * given)


@kernel
def record_made(state):
    """Raise state.made to what works of state.now exceed what was there: a potential gives back no more, viscosity nothing."""
    now, stored, made = state.now, state.stored, state.made
    made[Source.FABRIC] = max(made[Source.FABRIC], now[History.WORK_ELASTIC] - stored[0])
    made[Source.BELTS] = max(made[Source.BELTS], now[History.WORK_BELTS] - stored[1])
    made[Source.VISCOSITY] = max(made[Source.VISCOSITY], now[History.WORK_VISCOUS])


@kernel
def energy_given(model, state):
    """Return what start, gravity and gas have given (J): the most that can be kinetic energy."""
    gas = min(max(state.now[History.WORK_PRESSURE], 0.0), model.most_gas_work)
    return state.kinetic_start[0] + max(state.now[History.WORK_GRAVITY], 0.0) + gas


@kernel
def event_time(height, velocity, acceleration, step):
    """Return when within a step the cover first reaches the ground or stands still (s), and which: an Outcome.

    The motion of the leapfrog within a step: uniform acceleration from the place and velocity at its start.
    """
    stops = velocity <= 0.0 and velocity + step * acceleration > 0.0
    lowest = -velocity / acceleration if stops else step
    if height + lowest * (velocity + 0.5 * lowest * acceleration) <= 0.0:
        discriminant = max(velocity * velocity - 2.0 * acceleration * height, 0.0)
        return 2.0 * height / (sqrt(discriminant) - velocity), Outcome.IMPACT
    return lowest, Outcome.STOPPED if stops else Outcome.RUNNING


@kernel
def rises_to(distance, velocity, acceleration):
    """Return when within a step (s) the cover has risen by a distance (m), from below: the motion as in event_time."""
    root = sqrt(max(velocity * velocity + 2.0 * acceleration * distance, 0.0))
    return (root - velocity) / acceleration if velocity < 0.0 else 2.0 * distance / (velocity + root)


@kernel
def filter_deceleration(model, state, length):
    """Raise the peak of the deceleration as the cargo feels it, behind a first-order low-pass of FILTER_TIME.

    Cloth that meets the cover gives its momentum within one step, so that the force itself is as high as the step is short. Where
    there is no cloth nothing is filtered.
    """
    now, filtered_deceleration = state.now, state.filtered_deceleration
    acceleration = now[History.ACCELERATION]
    filtered_deceleration[0] = (
        acceleration
        if state.steps[0] == 0 or model.mass[0] == 0.0
        else filtered_deceleration[0] + (1.0 - exp(-length / FILTER_TIME)) * (acceleration - filtered_deceleration[0])
    )
    raise_peak(state.peaks, Peak.DECELERATION, filtered_deceleration[0], now[History.TIME], float(model.n1))


@kernel
def rewind(nodes, late):
    """Move the nodes back by a time (s) at their velocities: from n+1 to an event within the step."""
    for a in range(nodes.x.size):
        nodes.x[a] -= late * nodes.u[a]
        nodes.y[a] -= late * nodes.v[a]
        nodes.z[a] -= late * nodes.w[a]
