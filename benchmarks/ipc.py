"""What stands through what by the IPC Toolkit: sides of the grid and faces of a closed hoop; a twin of core.contact.threads."""

from __future__ import annotations

import ipctk
import numpy as np

from softbrake.core.arrays import Floats, Ints

ipctk.set_num_threads(1)
TOUCHES = 1e-10  # of a side: nearer than that its ends lie in a triangle's plane, and itself on the rim; as in the twin
INFLATION = 1e-9  # m, of the boxes of its broad phase
Pair = tuple[tuple[int, int], int]  # a side by its nodes, a face by its lower left one, counted by rows


def grid_of(rows: int, columns: int) -> tuple[Ints, Ints]:
    """Return the sides, (n, 2), and the corners of the faces, (rows*columns, 4), counted around each."""
    node = np.arange((rows + 1) * columns).reshape(rows + 1, columns)
    beside = np.roll(node, -1, axis=1)
    faces = np.stack((node[:-1], beside[:-1], beside[1:], node[1:]), axis=-1).reshape(-1, 4)
    hoops, generatrices = np.stack((node, beside), axis=-1), np.stack((node[:-1], node[1:]), axis=-1)
    return np.concatenate((hoops.reshape(-1, 2), generatrices.reshape(-1, 2))), faces


def volumes(a: Floats, b: Floats, c: Floats, d: Floats) -> Floats:
    """Return six times the signed volumes of tetrahedra, (n,)."""
    found: Floats = np.einsum("ij,ij->i", b - a, np.cross(c - a, d - a))
    return found


def passes(places: Floats) -> dict[Pair, int]:
    """Return how many triangles of a face each side passes, where it passes any. places: (m+1, n, 3), m.

    The toolkit lists what may meet, signs of volumes decide, and the toolkit confirms each. Not triangles of which a side has a
    corner, nor a face with its own sides.
    """
    sides, faces = grid_of(places.shape[0] - 1, places.shape[1])
    points = np.concatenate((places.reshape(-1, 3), places.reshape(-1, 3)[faces].mean(axis=1)))
    middle = np.arange(places.shape[0] * places.shape[1], len(points))
    fans = np.stack([np.stack((faces[:, k], faces[:, (k + 1) % 4], middle), axis=-1) for k in range(4)], axis=1).reshape(-1, 3)
    broad = ipctk.LBVH()
    broad.build(np.asfortranarray(points), np.asfortranarray(sides, np.int32), np.asfortranarray(fans, np.int32), INFLATION)
    near = np.array([(pair.edge_id, pair.face_id) for pair in broad.detect_edge_face_candidates()], int).reshape(-1, 2)
    side, fan = sides[near[:, 0]], fans[near[:, 1]]
    common = (side[:, :, None] == fan[:, None]).any(axis=(1, 2))
    own = (side[:, :, None] == faces[near[:, 1] // 4][:, None]).any(axis=2).all(axis=1)
    near = near[~common & ~own]
    (a, b), (p, q, r) = points[sides[near[:, 0]].T], points[fans[near[:, 1]].T]
    here, there = volumes(a, p, q, r), volumes(b, p, q, r)
    least = TOUCHES * np.linalg.norm(np.cross(q - p, r - p), axis=1) * np.linalg.norm(b - a, axis=1)
    apart = here * there < 0.0
    around = np.stack((volumes(a, b, p, q), volumes(a, b, q, r), volumes(a, b, r, p)))
    proper = apart & ((around > 0.0).all(axis=0) | (around < 0.0).all(axis=0))
    proper &= np.abs((here, there, around[0])).min(axis=0) > least
    found: dict[Pair, int] = {}
    for edge, triangle in near[proper]:
        if ipctk.is_edge_intersecting_triangle(*points[sides[edge]], *points[fans[triangle]]):
            pair = (int(sides[edge, 0]), int(sides[edge, 1])), int(faces[triangle // 4, 0])
            found[pair] = found.get(pair, 0) + 1
    return found


def threads_and_hinges(places: Floats) -> tuple[set[Pair], set[Pair]]:
    """Return the sides that pass an odd number of a face's triangles: those that share no corner with it, and those that do."""
    corners = {int(face[0]): set(face.tolist()) for face in grid_of(places.shape[0] - 1, places.shape[1])[1]}
    odd = {pair for pair, number in passes(places).items() if number % 2 == 1}
    hinges = {(side, face) for side, face in odd if corners[face] & set(side)}
    return odd - hinges, hinges
