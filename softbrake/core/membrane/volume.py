"""Volume of the shell, whose gradient the area vectors are: see core.membrane.area.

It is a third of the flux of the places through the area vectors, exactly, since it is a cubic of the places. A step has both at
hand for its start, and the rate of the volume over its end: so the next volume costs two products a node. What they leave out,
of second order in the step, changes little from step to step, and is known of the last one; errors do not add up.
"""

from numba import uint64

from softbrake.core.arrays import GasState
from softbrake.core.jit import kernel
from softbrake.core.lanes import FIRST, ONE, lanes, total


@kernel
def shell_volume(model, nodes, sums):
    """Return the volume (m^3) below the bilinear patches of the wall and the covers, with that of the arcs.

    A third of the flux of the places. Through a patch it is the mean place times the product of the mean edges; over all patches
    that comes to a twelfth of x·(h×g), h and g the differences between the neighbours on both sides, or at a cover on one.
    Writes sums, scratch, (n2 in whole PADs,).
    """
    n1, n2, stride = model.n1, model.n2, uint64(model.stride)
    x, y, z = nodes.x, nodes.y, nodes.z
    sums[:] = 0.0
    for i in range(n1 + 1):
        row = uint64(i) * stride + FIRST
        above = row + stride if i < n1 else row
        below = row - stride if i > 0 else row
        for j in range(lanes(n2)):
            a, r, s = row + j, above + j, below + j
            hx, hy, hz = x[a + ONE] - x[a - ONE], y[a + ONE] - y[a - ONE], z[a + ONE] - z[a - ONE]
            gx, gy, gz = x[r] - x[s], y[r] - y[s], z[r] - z[s]
            sums[j] += x[a] * (hy * gz - hz * gy) + y[a] * (hz * gx - hx * gz) + z[a] * (hx * gy - hy * gx)
    wall = model.hoop.gas * total(sums, n2) / 12.0
    top = nodes.z[uint64(n1) * stride + FIRST]
    return model.hoop.whole * (wall + model.cover_area * top / 3.0)


@kernel
def add_flux(nodes, area, by_column, node, columns):
    """Add the flux of the places and velocities of a row that has moved, through its area vectors before. Writes by_column."""
    for j in range(lanes(columns)):
        a, b = node + j, FIRST + j
        by_column.flux[j] += nodes.x[a] * area.x[b] + nodes.y[a] * area.y[b] + nodes.z[a] * area.z[b]
        by_column.swept[j] += nodes.u[a] * area.x[b] + nodes.v[a] * area.y[b] + nodes.w[a] * area.z[b]


@kernel
def next_volume(model, chamber, by_column, height, velocity, length):
    """Return the volume (m^3) of the shell at the end of a step (s) from the flux at its start.

    height, velocity: of the cover at its start (m), and over it (m/s). Reads by_column. Writes chamber.
    """
    whole, n2, arcs, cover = model.hoop.whole, model.n2, model.hoop.gas, model.cover_area
    swept = total(by_column.swept, n2)
    volume = whole * (arcs * (total(by_column.flux, n2) - length * swept) + cover * height) / 3.0
    if chamber[GasState.EXPECTED_AFTER] > 0.0:
        chamber[GasState.CURVATURE] = (volume - chamber[GasState.EXPECTED_VOLUME]) / chamber[GasState.EXPECTED_AFTER] ** 2
    chamber[GasState.EXPECTED_VOLUME] = volume + length * whole * (arcs * swept + cover * velocity)
    chamber[GasState.EXPECTED_AFTER] = length
    return chamber[GasState.EXPECTED_VOLUME] + chamber[GasState.CURVATURE] * length * length
