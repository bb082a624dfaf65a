"""Area vectors of the nodes. Eq. (2.7)."""

from softbrake.core.jit import kernel
from softbrake.core.lanes import FIRST, ONE, lanes

TWELFTH = 1.0 / 12.0


@kernel
def update_area_vectors(generatrix, hoop, area, above, below, row, row_above, row_below, columns):
    """Update the area vectors of a row of nodes. F of section 3, l3 sqrt(G) of (2.7).

    The gradient of the volume below the bilinear patches over the cells, so that constant pressure has a potential and a closed
    shell feels neither force nor moment; the eight triangles of (3.2) give the same sum over a cell but no exact volume. A cell
    between hoop edges h, H and to the right of a generatrix edge g gives its corners, times 12,

        01 ──H── 11        h×g + 2 H×g + h×H        h×g + 2 H×g + 2 h×H
        g         │
        00 ──h── 10        2 h×g + H×g + h×H        2 h×g + H×g + 2 h×H      (columns along the hoop, rows upwards)

    and at node 0 the four cells around are summed, with g of the left ones taken on their right. Edges beyond a cover are zero.
    Reads generatrix.x, y, z at offsets above, below; hoop.x, y, z at row, row_above, row_below. Writes area (m^2).
    """
    gx, gy, gz, hx, hy, hz = generatrix.x, generatrix.y, generatrix.z, hoop.x, hoop.y, hoop.z
    for j in range(lanes(columns)):
        a = above + j
        b = below + j
        r = row + j
        u = row_above + j
        d = row_below + j
        # Hoop edges to the left and right of the node, twice, with those above (u) and below it (d).
        sx, sy, sz = hx[r - ONE] + hx[r], hy[r - ONE] + hy[r], hz[r - ONE] + hz[r]
        ux, uy, uz = sx + sx + hx[u - ONE] + hx[u], sy + sy + hy[u - ONE] + hy[u], sz + sz + hz[u - ONE] + hz[u]
        dx, dy, dz = sx + sx + hx[d - ONE] + hx[d], sy + sy + hy[d - ONE] + hy[d], sz + sz + hz[d - ONE] + hz[d]
        # Those above less those below, to the right (r) and to the left (l).
        rx, ry, rz = hx[u] - hx[d], hy[u] - hy[d], hz[u] - hz[d]
        lx, ly, lz = hx[u - ONE] - hx[d - ONE], hy[u - ONE] - hy[d - ONE], hz[u - ONE] - hz[d - ONE]
        x = uy * gz[a] - uz * gy[a] + dy * gz[b] - dz * gy[b]
        y = uz * gx[a] - ux * gz[a] + dz * gx[b] - dx * gz[b]
        z = ux * gy[a] - uy * gx[a] + dx * gy[b] - dy * gx[b]
        x += hy[r] * rz - hz[r] * ry - (hy[r - ONE] * lz - hz[r - ONE] * ly)
        y += hz[r] * rx - hx[r] * rz - (hz[r - ONE] * lx - hx[r - ONE] * lz)
        z += hx[r] * ry - hy[r] * rx - (hx[r - ONE] * ly - hy[r - ONE] * lx)
        area.x[FIRST + j] = TWELFTH * x
        area.y[FIRST + j] = TWELFTH * y
        area.z[FIRST + j] = TWELFTH * z
