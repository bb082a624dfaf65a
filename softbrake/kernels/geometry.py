"""Edge vectors, elongations and area vectors of the deformed grid: Eqs. (2.6), (2.7) and the first lines of section 3."""

from math import sqrt

from numba import uint64

from softbrake.kernels.jit import kernel
from softbrake.state import PAD

ONE = uint64(1)
FIRST = uint64(PAD)
TWIST = 1.0 / 24.0
SMALLEST_SQUARE = 1e-60  # m^2: two nodes on one place have an edge of no direction and no force


@kernel
def update_edges(nodes, edges, node, step, edge, count, spacing):
    """Update vectors, inverse lengths, elongations and rates of one row of edges. Eq. (2.6) on edges, lambda of section 3.

        node ──────edge──────> node + step          step: 1 around the hoop, stride along the generatrix

    Reads nodes; node, edge: offsets of the first node and edge; count; spacing: unloaded length (m).
    Writes edges.x, y, z (m), inverse (1/m), e, rate (1/s, from the velocities at n-1/2).
    """
    x, y, z, u, v, w = nodes.x, nodes.y, nodes.z, nodes.u, nodes.v, nodes.w
    per_spacing = 1.0 / spacing
    for j in range(uint64(count)):
        a = node + j
        b = a + step
        c = edge + j
        dx = x[b] - x[a]
        dy = y[b] - y[a]
        dz = z[b] - z[a]
        square = max(dx * dx + dy * dy + dz * dz, SMALLEST_SQUARE)
        inverse = 1.0 / sqrt(square)
        edges.x[c] = dx
        edges.y[c] = dy
        edges.z[c] = dz
        edges.inverse[c] = inverse
        edges.e[c] = square * inverse * per_spacing - 1.0
        edges.rate[c] = (dx * (u[b] - u[a]) + dy * (v[b] - v[a]) + dz * (w[b] - w[a])) * inverse * per_spacing


@kernel
def add_area_vectors(nodes, area, area_above, node, stride, columns):
    """Add one row of cells to the area vectors of the nodes on it. F of section 3, l3 sqrt(G) of (2.7).

    The gradient of the volume below the bilinear patch over the cell's corners, so that constant pressure has a potential and
    a closed shell feels neither force nor moment; the eight triangles of (3.2) give the same sum over a cell but no exact
    volume. With diagonals d = x11 - x00, e = x01 - x10 and twist t = x11 - x10 - x01 + x00 the corners take

        01 ─── 11        N/4 - d×t/24    N/4 - e×t/24
        │       │                                        N = d×e/2
        00 ─── 10        N/4 + e×t/24    N/4 + d×t/24    (columns along the hoop, rows upwards)

    Reads nodes; node: offset of the lower row's node 0. Writes area (m^2) of the lower row and area_above of the upper one.
    """
    for j in range(uint64(columns)):
        a = node + j
        b = a + stride
        c = FIRST + j
        # The cell to the right of the node (r) and the one to its left (l), component by component.
        dx = nodes.x[b + ONE] - nodes.x[a]
        dy = nodes.y[b + ONE] - nodes.y[a]
        dz = nodes.z[b + ONE] - nodes.z[a]
        ex = nodes.x[b] - nodes.x[a + ONE]
        ey = nodes.y[b] - nodes.y[a + ONE]
        ez = nodes.z[b] - nodes.z[a + ONE]
        tx = (nodes.x[b + ONE] - nodes.x[b]) - (nodes.x[a + ONE] - nodes.x[a])
        ty = (nodes.y[b + ONE] - nodes.y[b]) - (nodes.y[a + ONE] - nodes.y[a])
        tz = (nodes.z[b + ONE] - nodes.z[b]) - (nodes.z[a + ONE] - nodes.z[a])
        fx = nodes.x[b] - nodes.x[a - ONE]
        fy = nodes.y[b] - nodes.y[a - ONE]
        fz = nodes.z[b] - nodes.z[a - ONE]
        gx = nodes.x[b - ONE] - nodes.x[a]
        gy = nodes.y[b - ONE] - nodes.y[a]
        gz = nodes.z[b - ONE] - nodes.z[a]
        sx = (nodes.x[b] - nodes.x[b - ONE]) - (nodes.x[a] - nodes.x[a - ONE])
        sy = (nodes.y[b] - nodes.y[b - ONE]) - (nodes.y[a] - nodes.y[a - ONE])
        sz = (nodes.z[b] - nodes.z[b - ONE]) - (nodes.z[a] - nodes.z[a - ONE])
        nx = (dy * ez - dz * ey + fy * gz - fz * gy) * 0.125
        ny = (dz * ex - dx * ez + fz * gx - fx * gz) * 0.125
        nz = (dx * ey - dy * ex + fx * gy - fy * gx) * 0.125
        area.x[c] += nx + (ey * tz - ez * ty + fy * sz - fz * sy) * TWIST
        area.y[c] += ny + (ez * tx - ex * tz + fz * sx - fx * sz) * TWIST
        area.z[c] += nz + (ex * ty - ey * tx + fx * sy - fy * sx) * TWIST
        area_above.x[c] += nx - (dy * tz - dz * ty + gy * sz - gz * sy) * TWIST
        area_above.y[c] += ny - (dz * tx - dx * tz + gz * sx - gx * sz) * TWIST
        area_above.z[c] += nz - (dx * ty - dy * tx + gx * sy - gy * sx) * TWIST
