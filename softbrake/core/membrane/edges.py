"""Edges of the deformed grid, Eq. (2.6) and the first lines of section 3, and their pull on the nodes, Eqs. (2.8), (3.2)."""

from math import sqrt

from softbrake.core.jit import kernel
from softbrake.core.lanes import FIRST, ONE, lanes


@kernel
def update_edge_forces(generatrix, hoop, force, above, below, row, columns):
    """Update the pull of the edges on a row of nodes. First and second difference of (2.8).

    Reads x, y, z, force of generatrix at offsets above, below and of hoop at row. Writes force (N).
    """
    gx, gy, gz, gf = generatrix.x, generatrix.y, generatrix.z, generatrix.force
    hx, hy, hz, hf = hoop.x, hoop.y, hoop.z, hoop.force
    for j in range(lanes(columns)):
        a = above + j
        b = below + j
        c = row + j
        up, down, right, left = gf[a], gf[b], hf[c], hf[c - ONE]
        force.x[FIRST + j] = up * gx[a] - down * gx[b] + right * hx[c] - left * hx[c - ONE]
        force.y[FIRST + j] = up * gy[a] - down * gy[b] + right * hy[c] - left * hy[c - ONE]
        force.z[FIRST + j] = up * gz[a] - down * gz[b] + right * hz[c] - left * hz[c - ONE]


# Kernels of a row have long parameter lists; softbrake/core/__init__.py says why.
@kernel
def add_cell_forces(generatrix, hoop, cells, force, force_above, edge, lower, upper, cell, columns):
    """Add the corner forces of one row of cells to the rows below and above. Sums over ± of (3.2).

    A corner force is force_1 (N/m) times the sum of the cell's generatrix edges, upwards on the lower corners and downwards on
    the upper ones, and force_2 times the sum of its hoop edges, to the right on the left corners and to the left on the right.
    Writes force (N) of the row below and force_above of the row above.
    """
    for j in range(lanes(columns)):
        g = edge + j
        a = lower + j
        b = upper + j
        right_1 = cells.force_1[cell + j]
        left_1 = cells.force_1[cell + j - ONE]
        right_2 = cells.force_2[cell + j]
        left_2 = cells.force_2[cell + j - ONE]
        d = FIRST + j
        x1 = right_1 * (generatrix.x[g] + generatrix.x[g + ONE]) + left_1 * (generatrix.x[g - ONE] + generatrix.x[g])
        y1 = right_1 * (generatrix.y[g] + generatrix.y[g + ONE]) + left_1 * (generatrix.y[g - ONE] + generatrix.y[g])
        z1 = right_1 * (generatrix.z[g] + generatrix.z[g + ONE]) + left_1 * (generatrix.z[g - ONE] + generatrix.z[g])
        x2 = right_2 * (hoop.x[a] + hoop.x[b]) - left_2 * (hoop.x[a - ONE] + hoop.x[b - ONE])
        y2 = right_2 * (hoop.y[a] + hoop.y[b]) - left_2 * (hoop.y[a - ONE] + hoop.y[b - ONE])
        z2 = right_2 * (hoop.z[a] + hoop.z[b]) - left_2 * (hoop.z[a - ONE] + hoop.z[b - ONE])
        force.x[d] += x1 + x2
        force.y[d] += y1 + y2
        force.z[d] += z1 + z2
        force_above.x[d] += x2 - x1
        force_above.y[d] += y2 - y1
        force_above.z[d] += z2 - z1


SMALLEST_SQUARE = 1e-60  # m^2: two nodes on one place have an edge of no direction and no force


@kernel
def update_edges(nodes, edges, node, step, edge, count, spacing):
    """Update vectors, inverse lengths, elongations and rates of one row of edges. Eq. (2.6) on edges, lambda of section 3.

        node ──────edge──────> node + step          step: 1 around the hoop, stride along the generatrix

    Reads nodes; node, edge: offsets of the first node and edge; count; spacing: unloaded length (m).
    Writes edges.x, y, z (m), e, inverse (1/m), rate (1/s, from the velocities at n-1/2).
    """
    x, y, z, u, v, w = nodes.x, nodes.y, nodes.z, nodes.u, nodes.v, nodes.w
    per_spacing = 1.0 / spacing
    for j in range(lanes(count)):
        a = node + j
        b = a + step
        c = edge + j
        dx = x[b] - x[a]
        dy = y[b] - y[a]
        dz = z[b] - z[a]
        square = SMALLEST_SQUARE + dx * dx + dy * dy + dz * dz
        inverse = 1.0 / sqrt(square)
        per_both = inverse * per_spacing
        edges.x[c] = dx
        edges.y[c] = dy
        edges.z[c] = dz
        edges.inverse[c] = inverse
        edges.e[c] = square * per_both - 1.0
        edges.rate[c] = (dx * (u[b] - u[a]) + dy * (v[b] - v[a]) + dz * (w[b] - w[a])) * per_both


@kernel
def clear_edges(edges, edge, columns):
    """Set a row of edges from column -1 on to no length and no force: one beyond a cover. Writes edges but for e."""
    for j in range(lanes(columns + 1)):
        c = edge - ONE + j
        edges.x[c] = 0.0
        edges.y[c] = 0.0
        edges.z[c] = 0.0
    clear_forces(edges, edge, columns)


@kernel
def clear_forces(edges, edge, columns):
    """Set the forces of a row of edges from column -1 on to zero: hoops held by a cover. Writes edges.force, elastic."""
    for j in range(lanes(columns + 1)):
        edges.force[edge - ONE + j] = 0.0
        edges.elastic[edge - ONE + j] = 0.0
