"""Which nodes and faces of the shell are near one another: a search by cells of space, its work linear in the nodes."""

from math import floor

from softbrake.kernels.jit import kernel
from softbrake.kernels.meet import corners_of, nearest_on_face, seen_from
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
            b = bucket(int(floor(x[a] * per_edge)), int(floor(y[a] * per_edge)), int(floor(z[a] * per_edge)), mask)
            following[a] = head[b]
            head[b] = a


@kernel
def span(values, corners, reach):
    """Return the least and the largest of the corners' values, widened by reach."""
    a, b, c, d = values[corners[0]], values[corners[1]], values[corners[2]], values[corners[3]]
    return min(a, b, c, d) - reach, max(a, b, c, d) + reach


@kernel
def add_near_nodes(nodes, folds, sheet, face, reach, per_edge, count):
    """Add the nodes within reach (m) of a face to the pairs, but for its corners. Returns the count of pairs, -1 for a torn face.

    Pairs beyond the capacity are counted, not kept. Writes folds.pairs, wake (for now their distance, m), counts.
    """
    x, y, z, head, following, pairs, wake = nodes.x, nodes.y, nodes.z, folds.head, folds.following, folds.pairs, folds.wake
    mask = head.size - 1
    corners = corners_of(face, sheet)
    low_x, high_x = span(x, corners, reach)
    low_y, high_y = span(y, corners, reach)
    low_z, high_z = span(z, corners, reach)
    if not max(high_x - low_x, high_y - low_y, high_z - low_z) * per_edge < WIDEST:
        return -1
    for i in range(int(floor(low_x * per_edge)), int(floor(high_x * per_edge)) + 1):
        for j in range(int(floor(low_y * per_edge)), int(floor(high_y * per_edge)) + 1):
            for k in range(int(floor(low_z * per_edge)), int(floor(high_z * per_edge)) + 1):
                a = head[bucket(i, j, k, mask)]
                while a != NOBODY:
                    in_box = low_x <= x[a] <= high_x and low_y <= y[a] <= high_y and low_z <= z[a] <= high_z
                    here = int(floor(x[a] * per_edge)) == i and int(floor(y[a] * per_edge)) == j
                    own = a == corners[0] or a == corners[1] or a == corners[2] or a == corners[3]
                    if in_box and here and int(floor(z[a] * per_edge)) == k and not own:
                        folds.counts[FoldCount.TESTS] += 1
                        distance = nearest_on_face(seen_from(nodes, a, corners, sheet.breadth, 0.0))[0]
                        if distance <= reach:
                            if count < pairs.size:
                                pairs[count] = (a << 32) | face
                                wake[count] = distance
                            count += 1
                    a = following[a]
    return count


@kernel
def find_pairs(nodes, folds, sheet, reach, edge):
    """Find all pairs of a node and a face within reach (m) of each other, at n+1. Returns their number, -1 for a torn shell.

    A number beyond the capacity of folds.pairs tells that some are missing. edge (m): of the unloaded cells.
    """
    per_edge = 1.0 / (EDGE * edge)
    sort_nodes(nodes, folds, sheet, per_edge)
    count = 0
    for i in range(sheet.rows):
        for j in range(sheet.columns):
            if count >= 0:
                count = add_near_nodes(nodes, folds, sheet, i * sheet.stride + sheet.first + j, reach, per_edge, count)
    return count
