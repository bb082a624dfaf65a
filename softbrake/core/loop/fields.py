"""Fields at the nodes for pictures: stretches and tensions of the current state."""

from numba import uint64

from softbrake.core.arrays import Scheme
from softbrake.core.jit import kernel
from softbrake.core.lanes import FIRST, ONE
from softbrake.core.membrane.edges import update_edges
from softbrake.core.membrane.tension import update_cell_tension, update_generatrix_tension, update_hoop_tension


@kernel
def sample_fields(model, nodes, workspace, stretch_1, stretch_2, tension_1, tension_2):
    """Write stretches and tensions (N/m) of the fabric at the nodes, means of what stands around them; each (n1+1, n2).

    A row on a cover takes the generatrix values of the edges next to it; its hoop edges are held and carry nothing.
    Reads model, nodes (viscous tensions from the velocities at n-1/2). Writes scratch in workspace as a step does.
    """
    n1, n2 = model.n1, model.n2
    stride = uint64(model.stride)
    fabric, g, h, along, around = model.fabric, workspace.generatrix, workspace.hoop, workspace.tension_1, workspace.tension_2
    edge_scheme = model.scheme == Scheme.EDGE
    update_edges(nodes, h, FIRST - ONE, ONE, FIRST - ONE, n2 + 1, fabric.h2)
    for i in range(n1 + 1):
        node = uint64(i) * stride + FIRST
        row = uint64(i % 2) * stride + FIRST
        below = uint64((i + 1) % 2) * stride + FIRST
        hoop = uint64(i % 3) * stride + FIRST
        hoop_above = uint64((i + 1) % 3) * stride + FIRST
        if i < n1:
            update_edges(nodes, g, node - ONE, stride, row - ONE, n2 + 2, fabric.h1)
            update_edges(nodes, h, node + stride - ONE, ONE, hoop_above - ONE, n2 + 1, fabric.h2)
        if i < n1 and edge_scheme:
            update_generatrix_tension(fabric, g, h, along, row, hoop, hoop_above, n2)
        if 0 < i < n1 and edge_scheme:
            update_hoop_tension(fabric, h, g, around, hoop, below, row, n2)
        if i < n1 and not edge_scheme:
            update_cell_tension(fabric, g, h, workspace.cells, along, around, row, hoop, hoop_above, row, n2)
        up = row if i < n1 else below
        down = below if i > 0 else row
        for j in range(n2):
            c = uint64(j)
            stretch_2[i, j] = 1.0 + 0.5 * (h.e[hoop + c - ONE] + h.e[hoop + c])
            stretch_1[i, j] = 1.0 + 0.5 * (g.e[down + c] + g.e[up + c])
            t1 = along[FIRST + c] if edge_scheme else 0.5 * (along[FIRST + c - ONE] + along[FIRST + c])
            t2 = 0.5 * (around[FIRST + c - ONE] + around[FIRST + c])
            if edge_scheme:
                tension_2[i, j] = t2 if 0 < i < n1 else 0.0
            else:
                share(tension_2, i, j, n1, t2)
            share(tension_1, i, j, n1, t1)


@kernel
def share(values, i, j, rows, value):
    """Give a value between node rows i and i + 1 to both: each takes the mean of those below and above it, or the only one."""
    if i < rows:
        values[i, j] = 0.5 * (values[i, j] + value) if i > 0 else value
        values[i + 1, j] = value
