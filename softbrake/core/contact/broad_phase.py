"""Broad phase: which nodes and faces, and which edges, of the shell are near one another, by boxes sorted along x.

Boxes are around blocks of cloth (sweep and prune). Those that overlap are looked into, but for smooth cloth, whose normals nearly
agree: in self-contact normals are opposed, since either the gas or the air between is on the same side of both. Smooth cloth thus
costs next to nothing.
After P. Volino, N. Magnenat-Thalmann, Efficient self-collision detection on smoothly discretized surface animations using
geometrical shape regularity (1994), and X. Provot, Collision and self-collision handling in cloth model dedicated to design
garments (1997).
"""

from math import acos, cos, inf, sqrt

from numba import float32, uint64

from softbrake.core.arrays import Box, ContactCount
from softbrake.core.contact.constants import BLOCK, SINGLE, SMOOTH_COSINE
from softbrake.core.contact.pairs import corners_of, end_of
from softbrake.core.contact.records import row_start
from softbrake.core.jit import kernel
from softbrake.core.lanes import ONE


@kernel
def find_pairs(nodes, self_contact, sheet, near):
    """Find all pairs of a node and a face, or two edges, that may be near each other (m) within their margins, at n+1.

    Not those of a face and its corners, of edges with one end, nor of smooth cloth. All are counted, but only those kept for
    which self_contact.pairs has room. Reads nodes, sheet, self_contact.margin. Writes self_contact.pairs (active_from: m,
    distance of boxes less near), counts, scratch.
    """
    blocks, order, counts, widest = self_contact.blocks, self_contact.order, self_contact.counts, 0.0
    update_normals(nodes, self_contact.normal, sheet)
    update_blocks(nodes, self_contact, sheet)
    update_cells(nodes, self_contact, sheet)
    sort_blocks(blocks, order)
    for a in range(order.size):
        widest = max(widest, blocks[a, Box.MARGIN])
    counts[ContactCount.FACES] = 0
    counts[ContactCount.EDGES] = 0
    for p in range(order.size):
        a = order[p]
        reach = blocks[a, Box.MARGIN] + near
        for q in range(p, order.size):
            b = order[q]
            if blocks[b, Box.LOW_X] > blocks[a, Box.HIGH_X] + reach + widest:
                break
            if may_touch_each_other(blocks, a, b, reach + blocks[b, Box.MARGIN], sheet.columns > 1):
                add_pairs(nodes, self_contact, sheet, a, b, near)
        counts[ContactCount.TESTS] += q - p + 1


@kernel
def update_normals(nodes, normal, sheet):
    """Write the normals of all nodes by central differences; shorter than 1 where the cloth is creased."""
    for i in range(sheet.rows + 1):
        start = row_start(sheet, i)
        for a in range(start, start + uint64(sheet.columns)):
            up = a + uint64(sheet.stride if i < sheet.rows else 0)
            down = a - uint64(sheet.stride if i > 0 else 0)
            x1, y1, z1, scale = difference(nodes, down, a, up)
            x2, y2, z2 = 0.0, 1.0, 0.0
            if sheet.columns > 1:
                x2, y2, z2, scale_2 = difference(nodes, a - ONE, a, a + ONE)
                scale *= scale_2
            scale = 1.0 / scale if scale > 0.0 else 0.0
            normal[a, 0] = scale * (y1 * z2 - z1 * y2)
            normal[a, 1] = scale * (z1 * x2 - x1 * z2)
            normal[a, 2] = scale * (x1 * y2 - y1 * x2)


@kernel
def difference(nodes, a, b, c):
    """Return the vector (m) from node a to c, and the length of the way by b."""
    x, y, z = nodes.x, nodes.y, nodes.z
    way = sqrt((x[b] - x[a]) ** 2 + (y[b] - y[a]) ** 2 + (z[b] - z[a]) ** 2)
    way += sqrt((x[c] - x[b]) ** 2 + (y[c] - y[b]) ** 2 + (z[c] - z[b]) ** 2)
    return x[c] - x[a], y[c] - y[a], z[c] - z[a], way


@kernel
def rows_of(block, sheet):
    """Return the first row and column of faces of a block, and those after its last."""
    across = blocks_along(sheet.columns)
    row, column = BLOCK * (block // across), BLOCK * (block % across)
    return row, min(row + BLOCK, sheet.rows), column, min(column + BLOCK, sheet.columns)


@kernel
def blocks_along(faces):
    """Return how many blocks a row or column of faces has."""
    return (faces + BLOCK - 1) // BLOCK


@kernel
def update_blocks(nodes, self_contact, sheet):
    """Write the box (m) around each block of faces, the mean of its normals, and the angle within which they lie about it."""
    blocks, normal, x, y, z = self_contact.blocks, self_contact.normal, nodes.x, nodes.y, nodes.z
    for block in range(blocks.shape[0]):
        row, row_end, column, column_end = rows_of(block, sheet)
        right = uint64(sheet.columns > 1)  # a face of a meridian has no other side
        low_x, low_y, low_z, high_x, high_y, high_z = inf, inf, inf, -inf, -inf, -inf
        nx, ny, nz, margin = 0.0, 0.0, 0.0, 0.0
        for i in range(row, row_end + 1):
            start = row_start(sheet, i)
            for a in range(start + uint64(column), start + uint64(column_end) + right):
                margin = max(margin, self_contact.margin[a])
                low_x, low_y, low_z = min(low_x, x[a]), min(low_y, y[a]), min(low_z, z[a])
                high_x, high_y, high_z = max(high_x, x[a]), max(high_y, y[a]), max(high_z, z[a])
                b = a if a - start < uint64(sheet.columns) else start
                nx, ny, nz = nx + normal[b, 0], ny + normal[b, 1], nz + normal[b, 2]
        length = sqrt(nx * nx + ny * ny + nz * nz)
        scale = 1.0 / length if length > 0.0 else 0.0
        nx, ny, nz, least = scale * nx, scale * ny, scale * nz, 1.0
        for i in range(row, row_end + 1):
            start = row_start(sheet, i)
            for a in range(start + uint64(column), start + uint64(column_end) + right):
                b = a if a - start < uint64(sheet.columns) else start
                least = min(least, nx * normal[b, 0] + ny * normal[b, 1] + nz * normal[b, 2])
        box = blocks[block]
        box[Box.LOW_X], box[Box.LOW_Y], box[Box.LOW_Z] = low_x, low_y, low_z
        box[Box.HIGH_X], box[Box.HIGH_Y], box[Box.HIGH_Z] = high_x, high_y, high_z
        box[Box.NORMAL_X], box[Box.NORMAL_Y], box[Box.NORMAL_Z] = nx, ny, nz
        box[Box.SPREAD] = acos(max(least, -1.0))
        box[Box.MARGIN] = margin


@kernel
def sort_blocks(blocks, order):
    """Sort the blocks by the lower x of their boxes, from the order of the last search: by insertion."""
    for p in range(1, order.size):
        block = order[p]
        low, q = blocks[block, Box.LOW_X], p
        while q > 0 and blocks[order[q - 1], Box.LOW_X] > low:
            order[q] = order[q - 1]
            q -= 1
        order[q] = block


@kernel
def may_touch_each_other(blocks, a, b, reach, wide):
    """Return whether two blocks, or parts of one, are within reach (m) of each other; not of wide cloth that is smooth there."""
    box, other = blocks[a], blocks[b]
    over_y = box[Box.LOW_Y] <= other[Box.HIGH_Y] + reach and other[Box.LOW_Y] <= box[Box.HIGH_Y] + reach
    over_z = box[Box.LOW_Z] <= other[Box.HIGH_Z] + reach and other[Box.LOW_Z] <= box[Box.HIGH_Z] + reach
    if not (over_y and over_z):
        return False
    rest = acos(SMOOTH_COSINE) - box[Box.SPREAD] - other[Box.SPREAD]
    if not wide or rest < 0.0:
        return True
    cosine = box[Box.NORMAL_X] * other[Box.NORMAL_X] + box[Box.NORMAL_Y] * other[Box.NORMAL_Y]
    return cosine + box[Box.NORMAL_Z] * other[Box.NORMAL_Z] < cos(rest)


@kernel
def update_cells(nodes, self_contact, sheet):
    """Write the boxes (m) of all cells, with their margins.

    A cell is a face with its lower left node and the edges that start there; of the row on the cover an edge.
    """
    box, margin = self_contact.cell_box, self_contact.margin
    above, right = uint64(sheet.stride), uint64(sheet.columns > 1)
    x, y, z = nodes.x, nodes.y, nodes.z
    for i in range(sheet.rows + 1):
        start, up = row_start(sheet, i), above if i < sheet.rows else uint64(0)
        for a in range(start, start + uint64(sheet.columns)):
            b, c, d = a + right, a + up + right, a + up
            box[0, a], box[1, a] = min(min(x[a], x[b]), min(x[c], x[d])), max(max(x[a], x[b]), max(x[c], x[d]))
            box[2, a], box[3, a] = min(min(y[a], y[b]), min(y[c], y[d])), max(max(y[a], y[b]), max(y[c], y[d]))
            box[4, a], box[5, a] = min(min(z[a], z[b]), min(z[c], z[d])), max(max(z[a], z[b]), max(z[c], z[d]))
            box[6, a] = max(max(margin[a], margin[b]), max(margin[c], margin[d]))


@kernel
def add_pairs(nodes, self_contact, sheet, a, b, near):
    """Add the pairs of block a and block b near each other (m): node and face, and two edges."""
    first = collect_cells(self_contact, sheet, a, b, near, uint64(0))
    last = collect_cells(self_contact, sheet, b, a, near, first) if a != b else first
    cells, boxes = self_contact.cells, self_contact.boxes
    for p in range(first):
        low_x, high_x, low_y, high_y = boxes[0, p], boxes[1, p], boxes[2, p], boxes[3, p]
        low_z, high_z, reach, begin = boxes[4, p], boxes[5, p], near + boxes[6, p], p + ONE if a == b else first
        for q in range(begin, last):  # a loop of its own, over vectors
            x = max(max(low_x - boxes[1, q], boxes[0, q] - high_x), 0.0)
            y = max(max(low_y - boxes[3, q], boxes[2, q] - high_y), 0.0)
            z = max(max(low_z - boxes[5, q], boxes[4, q] - high_z), 0.0)
            boxes[7, q] = (reach + boxes[6, q]) ** 2 - (x * x + y * y + z * z)
        for q in range(begin, last):
            if boxes[7, q] >= 0.0:
                one, other = uint64(cells[p]), uint64(cells[q])
                add_node_and_face(nodes, self_contact, sheet, one, other, q, near)
                add_node_and_face(nodes, self_contact, sheet, other, one, p, near)
                if sheet.columns > 1:
                    add_edges(nodes, self_contact, sheet, one, other, near)
    own, other = int(first), int(last - first)
    self_contact.counts[ContactCount.TESTS] += own * (own - 1) // 2 if a == b else own * other


@kernel
def collect_cells(self_contact, sheet, block, other, near, count):
    """Write the cells of a block that are near (m) the box around the other, and their own boxes, after so many.

    Returns how many there are then. Writes self_contact.cells, boxes.
    """
    box, boxes, cells, there = self_contact.cell_box, self_contact.boxes, self_contact.cells, self_contact.blocks
    low_x, low_y, low_z = there[other, Box.LOW_X], there[other, Box.LOW_Y], there[other, Box.LOW_Z]
    high_x, high_y, high_z = there[other, Box.HIGH_X], there[other, Box.HIGH_Y], there[other, Box.HIGH_Z]
    more = near + there[other, Box.MARGIN]
    row, row_end, column, column_end = rows_of(block, sheet)
    for i in range(row, row_end + int(row_end == sheet.rows)):  # the row on the cover belongs to the blocks below
        start = row_start(sheet, i)
        for a in range(start + uint64(column), start + uint64(column_end)):
            x = max(max(box[0, a] - high_x, low_x - box[1, a]), 0.0)
            y = max(max(box[2, a] - high_y, low_y - box[3, a]), 0.0)
            z = max(max(box[4, a] - high_z, low_z - box[5, a]), 0.0)
            reach = more + box[6, a]
            if x * x + y * y + z * z <= reach * reach:
                cells[count] = a
                for k in range(7):
                    boxes[k, count] = box[k, a]
                count += ONE
    return count


@kernel
def add_node_and_face(nodes, self_contact, sheet, node, face, column, near):
    """Add the pair of a node and a face where they are near (m): by its box, which stands in a column of self_contact.boxes."""
    boxes, px, py, pz = self_contact.boxes, nodes.x[node], nodes.y[node], nodes.z[node]
    x = max(max(boxes[0, column] - px, px - boxes[1, column]), 0.0)
    y = max(max(boxes[2, column] - py, py - boxes[3, column]), 0.0)
    z = max(max(boxes[4, column] - pz, pz - boxes[5, column]), 0.0)
    square, reach = x * x + y * y + z * z, near + self_contact.margin[node] + boxes[6, column]
    if square > reach * reach or face >= row_start(sheet, sheet.rows):
        return
    a, b, c, d = corners_of(face, sheet)
    home = self_contact.home
    if node != home[a] and node != home[b] and node != home[c] and node != home[d]:
        keep(self_contact, 0, node, face, square, near)


@kernel
def add_edges(nodes, self_contact, sheet, cell, other, near):
    """Add the pairs of edges of two cells that are near (m), but for those that share a node."""
    x, y, z, margin, home, top = nodes.x, nodes.y, nodes.z, self_contact.margin, self_contact.home, row_start(sheet, sheet.rows)
    for edge in range(cell + cell, cell + cell + ONE + uint64(cell < top)):
        i, j = end_of(edge, sheet)
        low_x, low_y, low_z = min(x[i], x[j]), min(y[i], y[j]), min(z[i], z[j])
        high_x, high_y, high_z = max(x[i], x[j]), max(y[i], y[j]), max(z[i], z[j])
        more = near + max(margin[i], margin[j])
        for second in range(other + other, other + other + ONE + uint64(other < top)):
            k, m = end_of(second, sheet)
            off_x = max(max(low_x - max(x[k], x[m]), min(x[k], x[m]) - high_x), 0.0)
            off_y = max(max(low_y - max(y[k], y[m]), min(y[k], y[m]) - high_y), 0.0)
            off_z = max(max(low_z - max(z[k], z[m]), min(z[k], z[m]) - high_z), 0.0)
            square, reach = off_x * off_x + off_y * off_y + off_z * off_z, more + max(margin[k], margin[m])
            if square > reach * reach:
                continue
            if home[k] != home[i] and home[k] != home[j] and home[m] != home[i] and home[m] != home[j]:
                keep(self_contact, 1, edge, second, square, near)


@kernel
def keep(self_contact, edges, first, second, square, near):
    """Keep a pair by the distance squared (m^2) of its boxes if there is room, and count it. edges: 1 of two edges, else 0."""
    counts, pairs = self_contact.counts, self_contact.pairs
    capacity, faces, lines = pairs.first.size, counts[ContactCount.FACES], counts[ContactCount.EDGES]
    if faces + lines < capacity:
        slot = uint64(capacity - 1 - lines if edges == 1 else faces)
        pairs.first[slot] = first
        pairs.second[slot] = second
        pairs.active_from[slot] = float32((1.0 - SINGLE) * sqrt(square) - near)
    counts[ContactCount.FACES] = faces + 1 - edges
    counts[ContactCount.EDGES] = lines + edges
