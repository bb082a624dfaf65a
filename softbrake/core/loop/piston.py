"""The drop without a shell: gas under the cover's area, a piston. Eqs. (2.4), (2.10), or core.gas."""

from math import pi, sqrt

from softbrake.core.arrays import GasState, Outcome
from softbrake.core.cargo import push_cargo
from softbrake.core.columns import History
from softbrake.core.contact.obstacles import foresee
from softbrake.core.gas import shrinking_limit, stiffness
from softbrake.core.jit import kernel
from softbrake.core.loop.ledger import record_history
from softbrake.core.loop.time_loop import begin_step, end_step

PART_OF_PERIOD = 0.04  # longest step times the gas's frequency: a stroke is off by a part of 7e-5 at most


@kernel
def advance_lumped(model, state, _, history, interval, most, until):
    """Advance the cargo alone, as advance does with the shell: (2.4), (2.10). Returns the rows of history and the Outcome.

    Exact for constant pressure, of second order else. The wall of a leaking gas is a cylinder below the cover.
    Nodes are drawn on a straight wall; they weigh and carry nothing.
    """
    now, nodes, rows, done, outcome = state.now, state.nodes, 0, 0, Outcome.RUNNING
    area, mass = model.hoop.whole * model.piston_area, model.hoop.whole * model.cargo_mass
    velocity, longest, perimeter = nodes.w[model.n1], state.stable_step[1], 2.0 * sqrt(pi * area)
    while outcome == Outcome.RUNNING and done < most and now[History.TIME] < until and rows + 1 < history.shape[0]:
        if model.gas.exponent > 0.0:
            stroke = PART_OF_PERIOD / sqrt(stiffness(model.gas, state.gas, area * area / mass))
            state.stable_step[0] = min(longest, stroke, shrinking_limit(state.gas, state.last_step[0]))
        length, dt = begin_step(model, state)
        force = now[History.PRESSURE] * area
        old = velocity
        step = foresee(now, old, model.gravity, dt, length)
        now[History.COVER_FORCE] = now[History.GROUND_FORCE] = force
        now[History.GROUND_AREA] = area
        velocity, height = push_cargo(now, old, step, mass)  # (2.4)
        if state.steps[0] % interval == 0:
            record_history(history, rows, now)
            rows += 1
        mean = 0.5 * (old + velocity)
        now[History.KINETIC_ENERGY] = 0.5 * mass * velocity * velocity
        now[History.WORK_PRESSURE] += dt * force * mean
        now[History.WORK_GRAVITY] -= dt * mass * model.gravity * mean
        state.gas[GasState.NEXT_VOLUME] = area * height
        state.gas[GasState.FREE_AREA] = perimeter * 0.5 * (now[History.HEIGHT] + max(height, 0.0))
        outcome = end_step(model, state, length, height)
        done += 1
    for i in range(nodes.z.size):
        nodes.z[i] = now[History.HEIGHT] * i / model.n1
        nodes.w[i] = velocity * i / model.n1
    if outcome != Outcome.RUNNING:
        record_history(history, rows, now)
        rows += 1
    return rows, outcome
