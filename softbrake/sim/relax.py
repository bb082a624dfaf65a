"""Static inflation: dynamic relaxation of the shell under a held cover, by pseudo-viscosity (note at the end of section 3).

The run's own step moves the shell; after each step all velocities are cut as a damping force 2 w m v would do it, w being the
frequency of what still moves. So the lowest mode is damped critically, and no other one faster than it can be.
"""

from __future__ import annotations

from collections.abc import Callable
from math import inf, isfinite, sqrt
from typing import NamedTuple

import numpy as np

from softbrake.core.arrays import PAD, Floats, Model, Outcome, State
from softbrake.core.columns import History
from softbrake.core.loop.rest import LARGEST_CUT
from softbrake.sim.build import without_viscosity
from softbrake.sim.interrupt import held_interrupt

TOLERANCE = 1e-6
MOST_COURANT = 0.5  # most, without viscosity
MOST_STEPS = 200_000
STEPS_PER_LOOK = 8
HEAVY = 1e12  # kg, of a cover that no force moves
SINKING = 1e-8  # m/s, at which it is pushed: nothing ends the run of a cargo that falls
GROWN = 10.0  # radii plus heights, beyond which no shell is at rest
Advance = Callable[[Model], Outcome]  # by one step of the model given


class Relaxation(NamedTuple):
    """Where a relaxation ended."""

    converged: bool
    residual: float  # the larger one of the two of `relax`; infinite where the shell grew without end
    steps: int


class Push(NamedTuple):
    """One step of a held shell."""

    velocity: Floats  # m/s, after it, of the free nodes, (3, n1-1, columns)
    acceleration: Floats  # m/s^2, at its start
    length: float  # s


class Held:
    """A shell under a cover that stays where it is, and the pressure of t = 0."""

    def __init__(self, model: Model, state: State, advance: Advance) -> None:
        """Stop all motion."""
        self.model, self.state, self._advance = model._replace(cargo_mass=HEAVY), state, advance
        nodes, width, end = state.nodes, model.stride, (model.n1 + 1) * model.stride
        columns = slice(PAD, PAD + model.n2) if width > 1 else slice(None)
        self._height, self._cover = float(state.now[History.HEIGHT]), slice(end - width, end)
        # Not the columns beyond those of the shell: what they hold is nothing.
        self._x, _, _, *self._free = (part[:end].reshape(model.n1 + 1, width)[1:-1, columns] for part in nodes)
        self._limit = GROWN * (model.shape.widest + self._height)
        self.damp(0.0)
        state.steps[0], state.choice[:], state.stable_step[1] = 0, (0, 1), 0.0  # the step is chosen anew
        sinking = 0.5 * model.hoop.whole * HEAVY * SINKING**2
        state.now[History.KINETIC_ENERGY] = state.kinetic_start[0] = sinking
        state.stored[:] = inf  # what the shell has stored is not known
        state.made[:] = 0.0
        for part in state.work:
            part[:] = 0.0

    def push(self) -> Push | None:
        """Advance by one step; None where the shell has burst or the computation failed."""
        now, nodes = self.state.now, self.state.nodes
        now[History.TIME], now[History.HEIGHT], now[History.ACCELERATION] = 0.0, self._height, 0.0
        nodes.z[self._cover], nodes.w[self._cover] = self._height, -SINKING
        before, last = np.stack(self._free), float(self.state.last_step[0])
        if self._advance(self.model) != Outcome.RUNNING or abs(self._x).max() > self._limit:
            return None
        length, after = float(self.state.last_step[0]), np.stack(self._free)
        return Push(after, (after - before) / (0.5 * (last + length)), length)

    def damp(self, kept: float) -> None:
        """Multiply all velocities."""
        for part in self.state.nodes[3:]:
            part *= kept

    def rest(self) -> None:
        """Stop all motion, the cover at its height."""
        self.damp(0.0)
        self.state.nodes.z[self._cover] = self.state.now[History.HEIGHT] = self._height


def relax(model: Model, state: State, advance: Advance, tolerance: float = TOLERANCE, most: int = MOST_STEPS) -> Relaxation:
    """Bring the shell to rest between ground and cover, which stays at its height, under the pressure of t = 0.

    Writes state. The fabric's own viscosity, which alters no shape of rest, is left out: it would shorten the step. The shell
    counts as at rest where two residuals are within the tolerance: forces out of balance over those of the pressure, and what is
    left to go, v/w, over the radius; both are root mean squares over the free nodes. w² = -v·m(a' - a)/(step v·m v) is Rayleigh's
    quotient of the motion, a and a' the accelerations before and after a step. Raises KeyboardInterrupt between two steps.
    """
    with held_interrupt() as interrupted:
        return _relax(model, state, advance, tolerance, most, interrupted)


def _relax(
    model: Model, state: State, advance: Advance, tolerance: float, most: int, interrupted: Callable[[], bool]
) -> Relaxation:
    """As `relax`, told of Ctrl-C."""
    held = Held(without_viscosity(model)._replace(courant=min(model.courant, MOST_COURANT)), state, advance)
    mass = model.mass[1:-1, None]
    cell = float((model.shape.h1 * model.shape.h2).mean())
    done, residual, frequency = 0, inf, 0.0
    while done < most:
        if interrupted():
            raise KeyboardInterrupt
        first, second = held.push(), held.push()
        if first is None or second is None:
            return Relaxation(False, inf, done)
        moving = float((mass * first.velocity**2).sum())
        if moving > 0.0:
            change = float((mass * first.velocity * (second.acceleration - first.acceleration)).sum())
            frequency = sqrt(max(-change / (first.length * moving), 0.0))
        nodes = first.velocity[0].size
        load = float(state.now[History.PRESSURE]) * cell
        unbalanced = sqrt(float(((mass * second.acceleration) ** 2).sum()) / nodes) / load if load > 0.0 else inf
        left = sqrt(float((first.velocity**2).sum()) / nodes) / (max(frequency, 1e-30) * model.shape.widest)
        residual = max(unbalanced, left)
        done += 2
        if not isfinite(residual) or residual <= tolerance:
            break
        decay = min(frequency * first.length, LARGEST_CUT)
        kept = (1.0 - decay) / (1.0 + decay)
        held.damp(kept)
        for _ in range(STEPS_PER_LOOK):
            held.push()
            held.damp(kept)
        done += STEPS_PER_LOOK
    held.rest()
    return Relaxation(residual <= tolerance, residual, done)
