"""Broad phase: which nodes and faces, and which edges, of the shell are near one another, by boxes sorted along x.

Boxes are around blocks of cloth (sweep and prune). Those that overlap are looked into, but for smooth cloth, whose normals nearly
agree: in self-contact normals are opposed, since either the gas or the air between is on the same side of both. Smooth cloth thus
costs next to nothing.
After P. Volino, N. Magnenat-Thalmann, Efficient self-collision detection on smoothly discretized surface animations using
geometrical shape regularity (1994), and X. Provot, Collision and self-collision handling in cloth model dedicated to design
garments (1997).
"""

from math import acos, inf, sqrt

from numba import uint64

from softbrake.core.arrays import Box, ContactCount
from softbrake.core.contact.constants import BLOCK, SMOOTH_COSINE
from softbrake.core.contact.pairs import corners_of, end_of, key_of_edges
from softbrake.core.jit import kernel


@kernel
def find_pairs(nodes, self_contact, sheet, near):
    """Find all pairs of a node and a face, or two edges, that may be near each other (m) within their margins, at n+1.

    Not those of a face and its corners, of edges with one end, nor of smooth cloth. Returns their number; those beyond the
    capacity of self_contact.pairs are counted, not kept. Reads nodes, sheet, self_contact.margin. Writes self_contact.pairs.key,
    active_from (m: distance of boxes less near), counts[TESTS], scratch.
    """
    blocks, order, widest = self_contact.blocks, self_contact.order, 0.0
    update_normals(nodes, self_contact, sheet)
    update_blocks(nodes, self_contact, sheet)
    sort_blocks(blocks, order)
    for a in range(order.size):
        widest = max(widest, blocks[a, Box.MARGIN])
    count = 0
    for p in range(order.size):
        a = order[p]
        reach = blocks[a, Box.MARGIN] + near
        for q in range(p, order.size):
            b = order[q]
            if blocks[b, Box.LOW_X] > blocks[a, Box.HIGH_X] + reach + widest:
                break
            if not may_touch_each_other(blocks, a, b, reach + blocks[b, Box.MARGIN], sheet.columns > 1):
                continue
            count = add_pairs(nodes, self_contact, sheet, a, b, near, count)
        self_contact.counts[ContactCount.TESTS] += q - p + 1
    return count


@kernel
def update_normals(nodes, self_contact, sheet):
    """Write the normals of all nodes by central differences; shorter than 1 where the cloth is creased."""
    for i in range(sheet.rows + 1):
        for j in range(sheet.columns):
            a = uint64(i * sheet.stride + sheet.first + j)
            up = a + uint64(sheet.stride if i < sheet.rows else 0)
            down = a - uint64(sheet.stride if i > 0 else 0)
            x1, y1, z1, scale = difference(nodes, down, a, up)
            x2, y2, z2 = 0.0, 1.0, 0.0
            if sheet.columns > 1:
                x2, y2, z2, scale_2 = difference(nodes, a - uint64(1), a, a + uint64(1))
                scale *= scale_2
            scale = 1.0 / scale if scale > 0.0 else 0.0
            self_contact.normal_x[a] = scale * (y1 * z2 - z1 * y2)
            self_contact.normal_y[a] = scale * (z1 * x2 - x1 * z2)
            self_contact.normal_z[a] = scale * (x1 * y2 - y1 * x2)


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
    blocks, x, y, z = self_contact.blocks, nodes.x, nodes.y, nodes.z
    normal_x, normal_y, normal_z = self_contact.normal_x, self_contact.normal_y, self_contact.normal_z
    for block in range(blocks.shape[0]):
        row, row_end, column, column_end = rows_of(block, sheet)
        right = int(sheet.columns > 1)  # a face of a meridian has no other side
        low_x, low_y, low_z, high_x, high_y, high_z = inf, inf, inf, -inf, -inf, -inf
        nx, ny, nz, margin = 0.0, 0.0, 0.0, 0.0
        for i in range(row, row_end + 1):
            start = i * sheet.stride + sheet.first
            for a in range(start + column, start + column_end + right):
                margin = max(margin, self_contact.margin[a])
                low_x, low_y, low_z = min(low_x, x[a]), min(low_y, y[a]), min(low_z, z[a])
                high_x, high_y, high_z = max(high_x, x[a]), max(high_y, y[a]), max(high_z, z[a])
                b = a if a - start < sheet.columns else start
                nx, ny, nz = nx + normal_x[b], ny + normal_y[b], nz + normal_z[b]
        length = sqrt(nx * nx + ny * ny + nz * nz)
        scale = 1.0 / length if length > 0.0 else 0.0
        nx, ny, nz, least = scale * nx, scale * ny, scale * nz, 1.0
        for i in range(row, row_end + 1):
            start = i * sheet.stride + sheet.first
            for a in range(start + column, start + column_end + right):
                b = a if a - start < sheet.columns else start
                least = min(least, nx * normal_x[b] + ny * normal_y[b] + nz * normal_z[b])
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
    cosine = box[Box.NORMAL_X] * other[Box.NORMAL_X] + box[Box.NORMAL_Y] * other[Box.NORMAL_Y]
    cosine += box[Box.NORMAL_Z] * other[Box.NORMAL_Z]
    between = acos(min(max(cosine, -1.0), 1.0)) + box[Box.SPREAD] + other[Box.SPREAD]
    return not wide or between > acos(SMOOTH_COSINE)


@kernel
def add_pairs(nodes, self_contact, sheet, a, b, near, count):
    """Add the pairs of block a and block b near each other (m): node and face, and two edges. Returns the count of pairs.

    By cells: a cell is a face with its lower left node, and the edges that start there; on the cover there is no face.
    """
    first = collect_cells(nodes, self_contact, sheet, a, b, near, 0)
    last = collect_cells(nodes, self_contact, sheet, b, a, near, first) if a != b else first
    cells, boxes = self_contact.cells, self_contact.boxes
    for p in range(first):
        for q in range(p + 1 if a == b else first, last):
            reach = near + boxes[p, Box.MARGIN] + boxes[q, Box.MARGIN]
            if square_between(spans_of(boxes[p]), spans_of(boxes[q])) > reach * reach:
                continue
            count = add_node_and_face(nodes, self_contact, sheet, cells[p], boxes[q], cells[q], near, count)
            count = add_node_and_face(nodes, self_contact, sheet, cells[q], boxes[p], cells[p], near, count)
            if sheet.columns > 1:
                count = add_edges(nodes, self_contact, sheet, cells[p], cells[q], near, count)
        self_contact.counts[ContactCount.TESTS] += last - p - 1 if a == b else last - first
    return count


@kernel
def collect_cells(nodes, self_contact, sheet, block, other, near, count):
    """Write the cells of a block that are near (m) the box around the other, and their own boxes, after so many.

    Returns how many there are then. Writes self_contact.cells, boxes.
    """
    x, y, z, margin, box = nodes.x, nodes.y, nodes.z, self_contact.margin, self_contact.blocks[other]
    row, row_end, column, column_end = rows_of(block, sheet)
    for i in range(row, row_end + int(row_end == sheet.rows)):  # the row on the cover belongs to the blocks below
        start = i * sheet.stride + sheet.first
        for node in range(start + column, start + column_end):
            corners = corners_of(node, sheet)
            if i == sheet.rows:
                corners = (node, corners[1], corners[1], node)
            own = self_contact.boxes[count]
            own[Box.LOW_X], own[Box.HIGH_X] = span(x, corners)
            own[Box.LOW_Y], own[Box.HIGH_Y] = span(y, corners)
            own[Box.LOW_Z], own[Box.HIGH_Z] = span(z, corners)
            own[Box.MARGIN] = max(margin[corners[0]], margin[corners[1]], margin[corners[2]], margin[corners[3]])
            reach = near + box[Box.MARGIN] + own[Box.MARGIN]
            if square_between(spans_of(own), spans_of(box)) <= reach * reach:
                self_contact.cells[count] = node
                count += 1
    return count


@kernel
def spans_of(box):
    """Return a box as its spans (m) along x, y and z."""
    return (box[Box.LOW_X], box[Box.HIGH_X]), (box[Box.LOW_Y], box[Box.HIGH_Y]), (box[Box.LOW_Z], box[Box.HIGH_Z])


@kernel
def square_between(spans, others):
    """Return the square of the distance (m^2) of two boxes, by their spans."""
    square = 0.0
    for k in range(3):
        low, high = spans[k]
        other_low, other_high = others[k]
        off = max(low - other_high, other_low - high, 0.0)
        square += off * off
    return square


@kernel
def add_node_and_face(nodes, self_contact, sheet, node, box, face, near, count):
    """Add the pair of a node and a face with its box, where they are near (m). Returns the count of pairs."""
    if face // sheet.stride == sheet.rows:
        return count
    corners = corners_of(face, sheet)
    if node == corners[0] or node == corners[1] or node == corners[2] or node == corners[3]:
        return count
    x, y, z = nodes.x[node], nodes.y[node], nodes.z[node]
    square, reach = square_between(((x, x), (y, y), (z, z)), spans_of(box)), near + self_contact.margin[node] + box[Box.MARGIN]
    return keep(self_contact, (node << 32) | face, square, reach, near, count)


@kernel
def add_edges(nodes, self_contact, sheet, cell, other, near, count):
    """Add the pairs of edges of two cells that are near (m), but for those that share a node. Returns the count of pairs."""
    margin = self_contact.margin
    for edge in range(2 * cell, 2 * cell + 1 + int(cell // sheet.stride < sheet.rows)):
        i, j = end_of(edge, sheet)
        spans = spans_along(nodes, i, j)
        for second in range(2 * other, 2 * other + 1 + int(other // sheet.stride < sheet.rows)):
            k, m = end_of(second, sheet)
            if k in (i, j) or m in (i, j):
                continue
            reach = near + max(margin[i], margin[j]) + max(margin[k], margin[m])
            square = square_between(spans, spans_along(nodes, k, m))
            count = keep(self_contact, key_of_edges(edge, second), square, reach, near, count)
    return count


@kernel
def spans_along(nodes, a, b):
    """Return the spans (m) of the edge between two nodes."""
    ends = (a, b, a, b)
    return span(nodes.x, ends), span(nodes.y, ends), span(nodes.z, ends)


@kernel
def keep(self_contact, key, square, reach, near, count):
    """Keep the key of a pair whose boxes' distance squared (m^2) is within reach (m), if there is room. Returns their count."""
    if square > reach * reach:
        return count
    pairs = self_contact.pairs
    if count < pairs.key.size:
        pairs.key[count] = key
        pairs.active_from[count] = sqrt(square) - near
    return count + 1


@kernel
def span(values, corners):
    """Return the least and the largest of the corners' values."""
    a, b, c, d = values[corners[0]], values[corners[1]], values[corners[2]], values[corners[3]]
    return min(a, b, c, d), max(a, b, c, d)
