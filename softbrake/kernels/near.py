"""Which nodes and faces of the shell are near one another: a search by cells of space, its work linear in the nodes."""

from math import floor, sqrt

from softbrake.kernels.jit import kernel
from softbrake.kernels.meet import corners_of
from softbrake.state import FoldCount

EDGE = 2.0  # of a cell of space, unloaded cells of cloth: a face and its margin then lie in a few of them
WIDEST = 16  # cells of space; a face beyond is torn out of all shape
NOBODY = -1


@kernel
def bucket(i, j, k, mask):
    """Return the list that keeps the nodes of a cell of space; several cells may share it. Teschner et al. 2003."""
    return ((i * 73856093) ^ (j * 19349663) ^ (k * 83492791)) & mask


@kernel
def sort_nodes(nodes, folds, sheet, per_edge):
    """Sort all nodes into cells of space. Writes folds.head, the last node of each list, and following, the one before each."""
    head, following, x, y, z = folds.head, folds.following, nodes.x, nodes.y, nodes.z
    mask = head.size - 1
    for b in range(head.size):
        head[b] = NOBODY
    for i in range(sheet.rows + 1):
        for j in range(sheet.columns):
            a = i * sheet.stride + sheet.first + j
            b = bucket(floor(x[a] * per_edge), floor(y[a] * per_edge), floor(z[a] * per_edge), mask)
            following[a] = head[b]
            head[b] = a


@kernel
def span(values, corners, reach):
    """Return the least and the largest of the corners' values, widened by reach."""
    a, b, c, d = values[corners[0]], values[corners[1]], values[corners[2]], values[corners[3]]
    return min(a, b, c, d) - reach, max(a, b, c, d) + reach


@kernel
def add_pairs_of_row(nodes, folds, sheet, row, reach, per_edge, count):
    """Add the nodes within reach (m) of the boxes around the faces of a row to the pairs, but for its corners.

    Returns the count of pairs, -1 for a torn face; those beyond the capacity are counted, not kept. Writes folds.pairs, wake (for
    now the distance of node and box, m: no more than that of node and face).
    """
    x, y, z, head, following, pairs, wake = nodes.x, nodes.y, nodes.z, folds.head, folds.following, folds.pairs, folds.wake
    mask, tests = head.size - 1, 0
    start = row * sheet.stride + sheet.first
    for face in range(start, start + sheet.columns):
        corners = corners_of(face, sheet)
        low_x, high_x = span(x, corners, reach)
        low_y, high_y = span(y, corners, reach)
        low_z, high_z = span(z, corners, reach)
        if not max(high_x - low_x, high_y - low_y, high_z - low_z) * per_edge < WIDEST:
            return -1
        for i in range(floor(low_x * per_edge), floor(high_x * per_edge) + 1):
            for j in range(floor(low_y * per_edge), floor(high_y * per_edge) + 1):
                for k in range(floor(low_z * per_edge), floor(high_z * per_edge) + 1):
                    a = head[bucket(i, j, k, mask)]
                    while a != NOBODY:
                        in_box = low_x <= x[a] <= high_x and low_y <= y[a] <= high_y and low_z <= z[a] <= high_z
                        own = a == corners[0] or a == corners[1] or a == corners[2] or a == corners[3]
                        if in_box and not own and in_cell(x[a], y[a], z[a], per_edge, i, j, k):
                            tests += 1
                            square = outside(x[a], low_x + reach, high_x - reach) ** 2
                            square += outside(y[a], low_y + reach, high_y - reach) ** 2
                            distance = sqrt(square + outside(z[a], low_z + reach, high_z - reach) ** 2)
                            if distance <= reach:
                                if count < pairs.size:
                                    pairs[count] = (a << 32) | face
                                    wake[count] = distance
                                count += 1
                        a = following[a]
    folds.counts[FoldCount.TESTS] += tests
    return count


@kernel
def outside(value, low, high):
    """Return by how much a value is outside of a range."""
    return max(low - value, value - high, 0.0)


@kernel
def in_cell(x, y, z, per_edge, i, j, k):
    """Return whether a place lies in a cell of space: lists are shared by some."""
    return floor(x * per_edge) == i and floor(y * per_edge) == j and floor(z * per_edge) == k


@kernel
def find_pairs(nodes, folds, sheet, reach, edge):
    """Find all pairs of a node and a face within reach (m) of each other, at n+1. Returns their number, -1 for a torn shell.

    A number beyond the capacity of folds.pairs tells that some are missing. edge (m): of the unloaded cells.
    """
    per_edge = 1.0 / (EDGE * edge)
    sort_nodes(nodes, folds, sheet, per_edge)
    count = 0
    for row in range(sheet.rows):
        if count >= 0:
            count = add_pairs_of_row(nodes, folds, sheet, row, reach, per_edge, count)
    return count
