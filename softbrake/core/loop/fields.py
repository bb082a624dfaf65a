"""Fields at the nodes for pictures: stretches and tensions of the current state."""

from numba import uint64

from softbrake.core.arrays import Scheme
from softbrake.core.jit import kernel
from softbrake.core.lanes import FIRST, ONE
from softbrake.core.loop.rows import begin_walk, row_at, update_row_edges, update_row_tensions


@kernel
def sample_fields(model, nodes, workspace, stretch_1, stretch_2, tension_1, tension_2):
    """Write stretches and tensions (N/m) of the fabric at the nodes, means of what stands around them; each (n1+1, n2).

    A row on a cover takes the generatrix values of the edges next to it; its hoop edges are held and carry nothing.
    Reads model, nodes (viscous tensions from the velocities at n-1/2). Writes scratch in workspace as a step does.
    """
    n1, n2, g, h = model.n1, model.n2, workspace.generatrix, workspace.hoop
    along, around, edge_scheme = workspace.tension_1, workspace.tension_2, model.scheme == Scheme.EDGE
    begin_walk(model, nodes, workspace, row_at(model, 0, 0, n1))
    for i in range(n1 + 1):
        at = row_at(model, i, 0, n1)
        update_row_edges(model, nodes, workspace, at)
        update_row_tensions(model, workspace, at, False)
        hoop = at.hoop
        up = at.row if at.has_above else at.below
        down = at.below if at.has_below else at.row
        for j in range(n2):
            c = uint64(j)
            stretch_2[i, j] = 1.0 + 0.5 * (h.e[hoop + c - ONE] + h.e[hoop + c])
            stretch_1[i, j] = 1.0 + 0.5 * (g.e[down + c] + g.e[up + c])
            t1 = along[FIRST + c] if edge_scheme else 0.5 * (along[FIRST + c - ONE] + along[FIRST + c])
            t2 = 0.5 * (around[FIRST + c - ONE] + around[FIRST + c])
            if edge_scheme:
                tension_2[i, j] = t2 if at.inside else 0.0
            else:
                share(tension_2, i, j, n1, t2)
            share(tension_1, i, j, n1, t1)


@kernel
def share(values, i, j, rows, value):
    """Give a value between node rows i and i + 1 to both: each takes the mean of those below and above it, or the only one."""
    if i < rows:
        values[i, j] = 0.5 * (values[i, j] + value) if i > 0 else value
        values[i + 1, j] = value
