"""Work of each force over a step, so that the change of kinetic energy can be accounted for to round-off.

The leapfrog turns a force F at time n into the work F (V^{n-1/2} + V^{n+1/2})/2 (n+1/2 - (n-1/2)) exactly; inner forces are
booked where they arise, as tension times change of length, which checks their assembly. Sums run by column: they vectorise
without reordering, and no digit depends on how.
"""

from numba import uint64

from softbrake.kernels.jit import kernel

ONE = uint64(1)


@kernel
def add_edge_work(edges, pull, elastic, mean, work_elastic, work_viscous, edge, first, start, end, dt, columns):
    """Add the work of a row of edges, fabric or belt, on the nodes at their starts and ends.

    Reads edges.x, y, z (m) at offset edge; pull, elastic (N/m: edge force over edge length) at offset first; mean (m/s) at
    offsets start, end; dt (s). Writes work_elastic, work_viscous (J), (n2,).
    """
    for j in range(uint64(columns)):
        c = edge + j
        a = start + j
        b = end + j
        d = first + j
        closing = dt * (
            edges.x[c] * (mean.x[a] - mean.x[b]) + edges.y[c] * (mean.y[a] - mean.y[b]) + edges.z[c] * (mean.z[a] - mean.z[b])
        )
        work_elastic[j] += elastic[d] * closing
        work_viscous[j] += (pull[d] - elastic[d]) * closing


@kernel
def add_cell_work(generatrix, hoop, cells, mean, work, edge, lower_hoop, upper_hoop, cell, lower, upper, dt, columns):
    """Add the work of one row of cells of the printed scheme on their corners.

    Reads the edges and cells as add_cell_forces does, mean (m/s) at offsets lower, upper. Writes work.elastic, viscous (J).
    """
    for j in range(uint64(columns)):
        g = edge + j
        a = lower_hoop + j
        b = upper_hoop + j
        c = cell + j
        k = lower + j
        m = upper + j
        up = 0.0
        right = 0.0
        up += (generatrix.x[g] + generatrix.x[g + ONE]) * (mean.x[k] + mean.x[k + ONE] - mean.x[m] - mean.x[m + ONE])
        up += (generatrix.y[g] + generatrix.y[g + ONE]) * (mean.y[k] + mean.y[k + ONE] - mean.y[m] - mean.y[m + ONE])
        up += (generatrix.z[g] + generatrix.z[g + ONE]) * (mean.z[k] + mean.z[k + ONE] - mean.z[m] - mean.z[m + ONE])
        right += (hoop.x[a] + hoop.x[b]) * (mean.x[k] + mean.x[m] - mean.x[k + ONE] - mean.x[m + ONE])
        right += (hoop.y[a] + hoop.y[b]) * (mean.y[k] + mean.y[m] - mean.y[k + ONE] - mean.y[m + ONE])
        right += (hoop.z[a] + hoop.z[b]) * (mean.z[k] + mean.z[m] - mean.z[k + ONE] - mean.z[m + ONE])
        elastic = dt * (cells.elastic_1[c] * up + cells.elastic_2[c] * right)
        work.elastic[j] += elastic
        work.viscous[j] += dt * (cells.force_1[c] * up + cells.force_2[c] * right) - elastic


@kernel
def add_shear_work(generatrix, hoop, cells, mean, work, edge, lower_hoop, upper_hoop, cell, lower, upper, dt, columns):
    """Add the work of T12 of one row of cells on their corners. Reads as add_cell_work. Writes work.elastic (J)."""
    for j in range(uint64(columns)):
        g = edge + j
        a = lower_hoop + j
        b = upper_hoop + j
        k = lower + j
        m = upper + j
        power = 0.0
        power += (hoop.x[a] + hoop.x[b]) * (mean.x[k] + mean.x[k + ONE] - mean.x[m] - mean.x[m + ONE])
        power += (hoop.y[a] + hoop.y[b]) * (mean.y[k] + mean.y[k + ONE] - mean.y[m] - mean.y[m + ONE])
        power += (hoop.z[a] + hoop.z[b]) * (mean.z[k] + mean.z[k + ONE] - mean.z[m] - mean.z[m + ONE])
        power += (generatrix.x[g] + generatrix.x[g + ONE]) * (mean.x[k] + mean.x[m] - mean.x[k + ONE] - mean.x[m + ONE])
        power += (generatrix.y[g] + generatrix.y[g + ONE]) * (mean.y[k] + mean.y[m] - mean.y[k + ONE] - mean.y[m + ONE])
        power += (generatrix.z[g] + generatrix.z[g + ONE]) * (mean.z[k] + mean.z[m] - mean.z[k + ONE] - mean.z[m + ONE])
        work.elastic[j] += dt * cells.shear[cell + j] * power


@kernel
def update_top(tension, first, top, top_row, row, columns):
    """Update the largest tension of the step by column, and the row where it stands. Reads tension at offset first."""
    for j in range(uint64(columns)):
        larger = tension[first + j] > top[j]
        top[j] = tension[first + j] if larger else top[j]
        top_row[j] = row if larger else top_row[j]
