"""Static inflation: dynamic relaxation of the shell under a held cover, by pseudo-viscosity (note at the end of section 3).

The run's own step moves the shell; after each step all velocities are cut as a damping force 2 w m v would do it, w being the
frequency of what still moves. So the lowest mode is damped critically, and no other one faster than it can be.
"""

from __future__ import annotations

from collections.abc import Callable
from math import inf, isfinite, sqrt
from typing import NamedTuple

import numpy as np

from softbrake.kernels.pressure import pressure_at
from softbrake.state import PAD, Floats, History, Model, Outcome, State

TOLERANCE = 1e-6
MOST_STEPS = 200_000
STEPS_PER_LOOK = 8
LARGEST_CUT = 0.5  # of w times the step, for a frequency that is none yet
HEAVY = 1e12  # kg, of a cover that no force moves
SINKING = 1e-8  # m/s, at which it is pushed: nothing ends the run of a cargo that falls
BURST = 10.0  # radii plus heights, beyond which no shell is at rest


class Relaxation(NamedTuple):
    """Where a relaxation ended."""

    converged: bool
    residual: float  # the larger one of the two of `relax`
    frequency: float  # Hz, of what moved last, by Rayleigh's quotient
    steps: int


def relax(
    model: Model, state: State, step: Callable[[Model], Outcome], tolerance: float = TOLERANCE, most: int = MOST_STEPS
) -> Relaxation:
    """Bring the shell to rest between ground and cover, which stays at its height, under the pressure of t = 0.

    Writes state; step: advances it by one step of the model given. The shell counts as at rest where two residuals are within the tolerance: forces
    out of balance over those of the pressure, and what is left to go, v/w, over the radius; both are root mean squares over
    the free nodes. w^2 = -v·m(a' - a)/(step v·m v) is Rayleigh's quotient of the motion, a and a' the accelerations before and
    after a step.
    """
    nodes, now = state.nodes, state.now
    width = nodes.x.size // (model.n1 + 1)
    columns = slice(PAD, PAD + model.n2) if width > 1 else slice(None)
    free = [part.reshape(model.n1 + 1, width)[1:-1, columns] for part in (nodes.u, nodes.v, nodes.w)]
    mass = model.mass[1:-1, None]
    load = pressure_at(model.pressure, 0.0) * model.fabric.h1 * model.fabric.h2
    cover, height = slice(-width, None), now[History.HEIGHT]
    held, limit = model._replace(cargo_mass=HEAVY), BURST * (model.radius + height)
    for part in (nodes.u, nodes.v, nodes.w):
        part[:] = 0.0
    now[History.KINETIC_ENERGY] = state.kinetic_start[0] = 0.0

    def velocities() -> Floats:
        return np.stack(free)

    def pushed() -> tuple[Floats, Floats, float]:
        """Velocities and accelerations after one step with the cover held, and its length."""
        now[History.TIME], now[History.HEIGHT], now[History.ACCELERATION] = 0.0, height, 0.0
        nodes.z[cover], nodes.w[cover] = height, -SINKING
        before = velocities()
        last = float(state.last_step[0])
        if step(held) != Outcome.RUNNING or abs(nodes.x).max() > limit:
            raise FloatingPointError
        length = float(state.last_step[0])
        after = velocities()
        return after, (after - before) / (0.5 * (last + length)), length

    done, residual, frequency = 0, inf, 0.0
    try:
        while done < most:
            velocity, acceleration, length = pushed()
            _, later, _ = pushed()
            moving = float((mass * velocity**2).sum())
            if moving > 0.0:
                stiffness = -float((mass * velocity * (later - acceleration)).sum()) / (length * moving)
                frequency = sqrt(max(stiffness, 0.0))
            unbalanced = sqrt(float(((mass * later) ** 2).sum() / later[0].size)) / load if load > 0.0 else inf
            left = sqrt(float((velocity**2).sum() / velocity[0].size)) / (max(frequency, 1e-30) * model.radius)
            residual = max(unbalanced, left)
            done += 2
            if not isfinite(residual):
                break
            if residual <= tolerance:
                return Relaxation(True, residual, frequency / (2.0 * np.pi), done)
            decay = min(frequency * length, LARGEST_CUT)
            kept = (1.0 - decay) / (1.0 + decay)
            for part in (nodes.u, nodes.v, nodes.w):
                part *= kept
            for _ in range(STEPS_PER_LOOK):
                pushed()
                for part in (nodes.u, nodes.v, nodes.w):
                    part *= kept
            done += STEPS_PER_LOOK
    except FloatingPointError:
        residual = inf
    finally:
        nodes.z[cover], now[History.HEIGHT] = height, height
        for part in (nodes.u, nodes.v, nodes.w):
            part[:] = 0.0
    return Relaxation(False, residual, frequency / (2.0 * np.pi), done)
