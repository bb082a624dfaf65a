"""The cargo and the cover under it. Eqs. (2.4), (3.4)."""

from numba import uint64

from softbrake.core.columns import History
from softbrake.core.jit import kernel
from softbrake.core.lanes import FIRST


@kernel
def vertical_forces(force, area, pressure, columns):
    """Return the vertical forces (N) of the tensions and of the pressure on the nodes of a row on a cover."""
    tension, gas = 0.0, 0.0
    for j in range(uint64(columns)):
        tension += force.z[FIRST + j]
        gas += pressure[j] * area.z[FIRST + j]
    return tension, gas


@kernel
def push_cargo(now, old, step, mass):
    """Push cargo, upper cover and the row of fabric on it from n to n+1. Eqs. (2.4), (3.4).

    Reads now: cover force (N), height (m); old: velocity at n-1/2 (m/s); step: a Step; mass (kg) of all that moves.
    Writes now: velocity, acceleration. Returns the velocity at n+1/2 (m/s) and the new height (m).
    """
    now[History.ACCELERATION] = now[History.COVER_FORCE] / mass - step.gravity
    new = old + step.dt * now[History.ACCELERATION]
    now[History.VELOCITY] = new - 0.5 * step.length * now[History.ACCELERATION]
    return new, now[History.HEIGHT] + step.length * new
