"""Threads: sides that stand through a face. Counted from the places alone, whatever the search for pairs has found.

A side is an edge of the grid, a face the four triangles about the mean of its corners. A side that passes an odd number of the
four, and has no end at a corner of the face, is a thread: one of its ends has gone through the face, or the side past its rim. An
even number is a side that dips over a warped face and out again. A side with an end at a corner of the face may dip from there
and passes once on its way out: that is a hinge, cloth folded back onto its neighbour, and no thread. The signs of volumes decide,
in doubles. Nothing passes where an end lies in the plane of a triangle, or the side on its rim, but for round-off: cloth that
lies on the ground.
"""

from math import inf, sqrt

from softbrake.core.contact.narrow_phase import centre_of, triple_product
from softbrake.core.jit import kernel

TOUCHES = 1e-10  # of a side: nearer than that its ends lie in a triangle's plane, and itself on the rim; far above round-off


@kernel
def find_threads(nodes, faces, cover, boxes, found):
    """Find all pairs of a side and a face of the shell where the side passes an odd number of the face's triangles.

    Reads nodes; faces (n, 4): nodes at the corners of each, as of pairs.corners_of, neighbours near one another; cover: the first
    node of the row on the cover. Writes boxes (2*leaves, 6), scratch, leaves a power of two that holds all faces; and to found
    (most, 3) the pairs, as many as it holds: both ends of the side, and the first corner of the face. Returns the number of
    threads, and that of hinges.
    """
    update_tree(nodes, faces, boxes)
    leaves, counts = boxes.shape[0] // 2, (0, 0)
    for k in range(faces.shape[0]):
        own = boxes[leaves + k]
        place = following(leaves + k)  # what stands before has looked for pairs with this one
        while place > 0:
            if not overlap(own, boxes[place]):
                place = following(place)
            elif place < leaves:
                place *= 2
            else:
                other = place - leaves
                counts = add_threads(nodes, faces[k], cover, faces[other], boxes[place], found, counts)
                counts = add_threads(nodes, faces[other], cover, faces[k], own, found, counts)
                place = following(place)
    return counts


@kernel
def update_tree(nodes, faces, boxes):
    """Write the boxes of a binary tree over the faces: low and high x, y, z (m). Root 1; below k are 2k and 2k + 1."""
    leaves = boxes.shape[0] // 2
    for k in range(leaves):
        box = (inf, inf, inf, -inf, -inf, -inf)  # overlaps with nothing
        if k < faces.shape[0]:
            box = box_around(nodes, corners_in(faces[k]))
        for m in range(6):
            boxes[leaves + k, m] = box[m]
    for k in range(leaves - 1, 0, -1):
        for m in range(3):
            boxes[k, m] = min(boxes[2 * k, m], boxes[2 * k + 1, m])
            boxes[k, m + 3] = max(boxes[2 * k, m + 3], boxes[2 * k + 1, m + 3])


@kernel
def corners_in(face):
    """Return the corners in a row of `faces`."""
    return face[0], face[1], face[2], face[3]


@kernel
def following(place):
    """Return the place of the tree behind all that is below a place, in depth-first order; 0 after the last."""
    place += 1
    while place & 1 == 0:
        place >>= 1
    return place if place > 1 else 0


@kernel
def box_around(nodes, four):
    """Return the box around four nodes: low and high x, y, z (m)."""
    x, y, z, (a, b, c, d) = nodes.x, nodes.y, nodes.z, four
    low_x, low_y, low_z = min(x[a], x[b], x[c], x[d]), min(y[a], y[b], y[c], y[d]), min(z[a], z[b], z[c], z[d])
    high_x, high_y, high_z = max(x[a], x[b], x[c], x[d]), max(y[a], y[b], y[c], y[d]), max(z[a], z[b], z[c], z[d])
    return low_x, low_y, low_z, high_x, high_y, high_z


@kernel
def overlap(box, other):
    """Return whether two boxes overlap. Those that only touch hold no pass: it is in the open inside of side and triangle."""
    along_x = (box[0] < other[3]) & (other[0] < box[3])
    along_y = (box[1] < other[4]) & (other[1] < box[4])
    return along_x & along_y & (box[2] < other[5]) & (other[2] < box[5])  # & and not `and`: a branch less at each


@kernel
def add_threads(nodes, cell, cover, face, box, found, counts):
    """Add threads and hinges of the sides below and left of a face, and on the cover above it, with another face in its box."""
    threads, hinges = counts
    p, q, r, s = corners_in(cell)
    for k in range(3 if s >= cover else 2):
        a, b = (p, q) if k == 0 else (p, s) if k == 1 else (s, r)
        if not overlap(box_around(nodes, (a, b, a, b)), box):
            continue
        passed, shared = triangles_passed(nodes, a, b, corners_in(face))
        if passed & 1 == 1:
            if threads + hinges < found.shape[0]:
                row = found[threads + hinges]
                row[0], row[1], row[2] = a, b, face[0]
            threads, hinges = threads + 1 - shared, hinges + shared
    return threads, hinges


@kernel
def triangles_passed(nodes, a, b, corners):
    """Return how many triangles of a face the side from node a to b passes, and 1 where it has an end at a corner, else 0.

    Triangles that have that corner are not passed, and a side of the face itself passes none.
    """
    shared, at = 0, -1
    for k in range(4):
        if corners[k] == a or corners[k] == b:
            shared, at = shared + 1, k
    if shared > 1:
        return 0, 0
    x, y, z, (p, q, r, s) = nodes.x, nodes.y, nodes.z, corners
    qx = (x[p] - x[a], x[q] - x[a], x[r] - x[a], x[s] - x[a])  # as seen from a
    qy = (y[p] - y[a], y[q] - y[a], y[r] - y[a], y[s] - y[a])
    qz = (z[p] - z[a], z[q] - z[a], z[r] - z[a], z[s] - z[a])
    dx, dy, dz = x[b] - x[a], y[b] - y[a], z[b] - z[a]
    cx, cy, cz = centre_of(qx), centre_of(qy), centre_of(qz)
    wx, wy, wz = dy * cz - dz * cy, dz * cx - dx * cz, dx * cy - dy * cx
    spokes = (  # one volume for both triangles at a spoke: whatever its round-off, the side passes one of them there
        wx * qx[0] + wy * qy[0] + wz * qz[0],
        wx * qx[1] + wy * qy[1] + wz * qz[1],
        wx * qx[2] + wy * qy[2] + wz * qz[2],
        wx * qx[3] + wy * qy[3] + wz * qz[3],
    )
    passed = 0
    for k in range(4):
        n = (k + 1) % 4
        if at in (k, n) or spokes[k] * spokes[n] >= 0.0:
            continue
        ax, ay, az, bx, by, bz = qx[k] - cx, qy[k] - cy, qz[k] - cz, qx[n] - cx, qy[n] - cy, qz[n] - cz
        nx, ny, nz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
        least = TOUCHES * sqrt((nx * nx + ny * ny + nz * nz) * (dx * dx + dy * dy + dz * dz))
        here = -(nx * cx + ny * cy + nz * cz)
        there = here + nx * dx + ny * dy + nz * dz
        rim = triple_product(dx, dy, dz, qx[k], qy[k], qz[k], qx[n], qy[n], qz[n])
        if here * there < 0.0 and spokes[k] * rim > 0.0:
            passed += int(min(abs(here), abs(there), abs(rim)) > least)
    return passed, shared


@kernel
def meridian_threads(x, z, rows):
    """Return how many pairs of segments of a meridian cross each other. x, z: radius and height (m) of its nodes, rows + 1."""
    number = 0
    for i in range(rows - 2):
        low_x, high_x = min(x[i], x[i + 1]), max(x[i], x[i + 1])
        low_z, high_z = min(z[i], z[i + 1]), max(z[i], z[i + 1])
        dx, dz = x[i + 1] - x[i], z[i + 1] - z[i]
        for k in range(i + 2, rows):
            if min(x[k], x[k + 1]) > high_x or max(x[k], x[k + 1]) < low_x:
                continue
            if min(z[k], z[k + 1]) > high_z or max(z[k], z[k + 1]) < low_z:
                continue
            ex, ez = x[k + 1] - x[k], z[k + 1] - z[k]
            here = dx * (z[k] - z[i]) - dz * (x[k] - x[i])
            there = dx * (z[k + 1] - z[i]) - dz * (x[k + 1] - x[i])
            own = ex * (z[i] - z[k]) - ez * (x[i] - x[k])
            other = ex * (z[i + 1] - z[k]) - ez * (x[i + 1] - x[k])
            number += int(here * there < 0.0 and own * other < 0.0)
    return number
