"""Slow, obvious twins of the contact of folds: distances, crossings in a step, what is entangled, crossing segments."""

from fractions import Fraction

import numpy as np

from softbrake.core.arrays import Floats, Ints

DIRECTIONS = [(x, y, z) for x in (1, 0, -1) for y in (1, 0, -1) for z in (1, 0, -1) if (x, y, z) > (0, 0, 0)]
AXES = np.array(sorted(DIRECTIONS, key=lambda way: sum(map(abs, way))), float)  # those of x, y and z first
AXES /= np.linalg.norm(AXES, axis=1)[:, None]


def triangles(places: Floats) -> tuple[Floats, Ints]:
    """Return the four triangles about the centre of each cell of a closed hoop, (faces, 4, 3, 3), and the cells' corner nodes.

    places: (n1+1, n2, 3); nodes are counted i*n2 + j, corners (faces, 4).
    """
    n1, n2 = places.shape[0] - 1, places.shape[1]
    i, j = np.meshgrid(np.arange(n1), np.arange(n2), indexing="ij")
    k = (j + 1) % n2
    nodes = np.stack((i * n2 + j, i * n2 + k, (i + 1) * n2 + k, (i + 1) * n2 + j), axis=-1).reshape(-1, 4)
    corners = places.reshape(-1, 3)[nodes]
    centre = np.broadcast_to(corners.mean(axis=1, keepdims=True), corners.shape)
    return np.stack((centre, corners, np.roll(corners, -1, axis=1)), axis=2), nodes


def distance_to_triangle(point: Floats, triangle: Floats) -> float:
    """Return the distance of a point from a triangle (3, 3): from its plane if the foot lies inside, else from its edges."""
    a, b, c = triangle
    shares, *_ = np.linalg.lstsq(np.stack((b - a, c - a), axis=1), point - a, rcond=None)
    if shares.min() >= 0.0 and shares.sum() <= 1.0:
        return float(np.linalg.norm(point - a - shares @ np.stack((b - a, c - a))))
    found = []
    for start, end in ((a, b), (b, c), (c, a)):
        along = end - start
        length = along @ along
        share = np.clip((point - start) @ along / length, 0.0, 1.0) if length > 0.0 else 0.0
        found.append(np.linalg.norm(point - start - share * along))
    return float(min(found))


def near_pairs(places: Floats, reach: float) -> set[tuple[int, int]]:
    """Return all pairs (node, face) within reach of each other, but for a face's own corners."""
    parts, corners = triangles(places)
    points = places.reshape(-1, 3)
    return {
        (int(node), int(face))
        for node, face in near_hulls(points[:, None], parts.reshape(len(parts), -1, 3), reach)
        if node not in corners[face] and min(distance_to_triangle(points[node], part) for part in parts[face]) <= reach
    }


def near_hulls(some: Floats, others: Floats, reach: float = 0.0) -> Ints:
    """Return the pairs of convex hulls that no direction of AXES shows to be further apart than reach, (pairs, 2).

    some, others: the points of each hull, (n, k, 3) and (m, l, 3).
    """
    (low, high), (other_low, other_high) = (
        ((hulls @ AXES.T).min(axis=1), (hulls @ AXES.T).max(axis=1)) for hulls in (some, others)
    )
    boxes = (low[:, None, :3] <= other_high[:, :3] + reach) & (high[:, None, :3] >= other_low[:, :3] - reach)
    i, k = np.nonzero(boxes.all(axis=-1))
    near = ((low[i] <= other_high[k] + reach) & (high[i] >= other_low[k] - reach)).all(axis=-1)
    return np.stack((i[near], k[near]), axis=-1)


def missed_collisions(old: Floats, new: Floats) -> list[tuple[int, int, float]]:
    """Return (node, face, time) of all nodes that pass through a face in a step, all moving evenly from old to new places.

    The volume of node and triangle is a cubic in time, its roots from the companion matrix; hulls swept are compared first.
    """
    before, corners = triangles(old)
    after, _ = triangles(new)
    swept = np.concatenate((before, after), axis=2).reshape(len(before), -1, 3)
    start, end = old.reshape(-1, 3), new.reshape(-1, 3)
    found = []
    for node, face in near_hulls(np.stack((start, end), axis=1), swept):
        if node in corners[face]:
            continue
        times = [passing_time(start[node], end[node], before[face, k], after[face, k]) for k in range(4)]
        if min(times) <= 1.0:
            found.append((int(node), int(face), min(times)))
    return found


def passing_time(start: Floats, end: Floats, before: Floats, after: Floats) -> float:
    """Return when (0 … 1) a point first passes through a triangle, both moving evenly; 2 if it does not."""
    v = np.stack((start - before[0], before[1] - before[0], before[2] - before[0]))
    d = np.stack((end - after[0], after[1] - after[0], after[2] - after[0])) - v

    def det(a: Floats, b: Floats, c: Floats) -> float:
        return float(a @ np.cross(b, c))

    cubic = [
        det(d[0], d[1], d[2]),
        det(v[0], d[1], d[2]) + det(d[0], v[1], d[2]) + det(d[0], d[1], v[2]),
        det(d[0], v[1], v[2]) + det(v[0], d[1], v[2]) + det(v[0], v[1], d[2]),
        det(v[0], v[1], v[2]),
    ]
    for time in sorted(root.real for root in np.roots(cubic) if abs(root.imag) < 1e-9 and 0.0 < root.real < 1.0):
        r, a, b = v + time * d
        s, t = np.linalg.lstsq(np.stack((a, b), axis=1), r, rcond=None)[0]
        if s >= 0.0 and t >= 0.0 and s + t <= 1.0:
            return float(time)
    return 2.0


def edges_of(rows: int, columns: int) -> Ints:
    """Return the nodes at the ends of all edges of a closed hoop, (edges, 2): around the hoop, then along the generatrix."""
    nodes = np.arange((rows + 1) * columns).reshape(rows + 1, columns)
    around = np.stack((nodes, np.roll(nodes, -1, axis=1)), axis=-1).reshape(-1, 2)
    return np.concatenate((around, np.stack((nodes[:-1], nodes[1:]), axis=-1).reshape(-1, 2)))


def distance_of_segments(a: Floats, b: Floats, c: Floats, d: Floats) -> float:
    """Return the distance of the segments ab and cd: of inner points where both lines are nearest there, else from an end."""
    found = [
        distance_to_triangle(point, np.stack((start, end, end)))
        for point, start, end in ((a, c, d), (b, c, d), (c, a, b), (d, a, b))
    ]
    directions = np.stack((b - a, c - d), axis=1)
    shares, *_ = np.linalg.lstsq(directions, c - a, rcond=None)
    if shares.min() >= 0.0 and shares.max() <= 1.0:
        found.append(float(np.linalg.norm(directions @ shares - (c - a))))
    return min(found)


def near_edges(places: Floats, reach: float) -> set[tuple[tuple[int, ...], tuple[int, ...]]]:
    """Return the pairs of edges, by their nodes, within reach of each other, but for those that share a node."""
    rows, columns = places.shape[0] - 1, places.shape[1]
    edges, points = edges_of(rows, columns), places.reshape(-1, 3)
    found = set()
    for i, k in near_hulls(points[edges], points[edges], reach):
        (a, b), (c, d) = edges[i], edges[k]
        if i < k and not {a, b} & {c, d} and distance_of_segments(points[a], points[b], points[c], points[d]) <= reach:
            found.add((tuple(edges[i].tolist()), tuple(edges[k].tolist())))
    return found


def edge_crossings(old: Floats, new: Floats) -> list[tuple[int, int]]:
    """Return the pairs of edges, as edges_of counts them, that pass each other in a step, all moving evenly."""
    edges = edges_of(old.shape[0] - 1, old.shape[1])
    before, after = old.reshape(-1, 3)[edges], new.reshape(-1, 3)[edges]
    swept = np.concatenate((before, after), axis=1)
    return [
        (int(i), int(k))
        for i, k in near_hulls(swept, swept)
        if i < k and not {*edges[i]} & {*edges[k]} and edges_pass(before[i], before[k], after[i], after[k]) <= 1.0
    ]


def edges_pass(first: Floats, second: Floats, first_after: Floats, second_after: Floats) -> float:
    """Return when (0 … 1) two edges, (2, 3) each, first pass each other, moving evenly; 2 if they do not."""
    start = np.stack((first[1] - first[0], second[0] - first[0], second[1] - second[0]))
    end = np.stack((first_after[1] - first_after[0], second_after[0] - first_after[0], second_after[1] - second_after[0]))
    times = np.linspace(0.0, 1.0, 4)
    volumes = [float(np.linalg.det((1.0 - time) * start + time * end)) for time in times]
    roots = np.roots(np.linalg.solve(np.vander(times, 4), volumes))
    for time in sorted(root.real for root in roots if abs(root.imag) < 1e-9 and 0.0 < root.real < 1.0):
        along, apart, other = (1.0 - time) * start + time * end
        shares = np.linalg.lstsq(np.stack((along, -other), axis=1), apart, rcond=None)[0]
        if shares.min() >= 0.0 and shares.max() <= 1.0:
            return float(time)
    return 2.0


def entangled(places: Floats) -> int:
    """Return how many edges thread a face: have an odd number of its triangles between their ends, so no way round its middle."""
    parts, corners = triangles(places)
    edges, points = edges_of(places.shape[0] - 1, places.shape[1]), places.reshape(-1, 3)
    ends, span = points[edges], points[corners]
    meets = ((ends.min(axis=1)[:, None] <= span.max(axis=1)) & (ends.max(axis=1)[:, None] >= span.min(axis=1))).all(axis=-1)
    meets &= (edges[:, :, None, None] != corners[None, None]).all(axis=(1, 3))
    edge, face = np.nonzero(meets)
    a, b = ends[edge, 0], ends[edge, 1]
    count = np.zeros(edge.size, int)
    for part in range(4):
        p, q, r = (parts[face, part, k] for k in range(3))
        aside = volumes_of(a, p, q, r) * volumes_of(b, p, q, r) < 0.0
        through = np.stack((volumes_of(a, b, p, q), volumes_of(a, b, q, r), volumes_of(a, b, r, p)))
        count += aside & ((through > 0.0).all(axis=0) | (through < 0.0).all(axis=0))
    return int((count % 2).sum())


def volumes_of(a: Floats, b: Floats, c: Floats, d: Floats) -> Floats:
    """Return six times the signed volumes of tetrahedra, (n,)."""
    volumes: Floats = np.einsum("ij,ij->i", b - a, np.cross(c - a, d - a))
    return volumes


def side(a: Floats, b: Floats, c: Floats) -> int:
    """Return on which side of the line from a to b the point c lies: -1, 0, 1; in exact arithmetic where floats are in doubt."""
    left, right = (b[0] - a[0]) * (c[1] - a[1]), (b[1] - a[1]) * (c[0] - a[0])
    if abs(left - right) > 1e-14 * (abs(left) + abs(right)):
        return 1 if left > right else -1
    ax, ay, bx, by, cx, cy = (Fraction(float(value)) for value in (*a, *b, *c))
    exact = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
    return (exact > 0) - (exact < 0)


def meridian_crossings(places: Floats) -> list[tuple[int, int]]:
    """Return the pairs of segments of a meridian (n, 2) that cross each other properly; by the sides of their ends, exactly."""
    low, high = np.minimum(places[:-1], places[1:]), np.maximum(places[:-1], places[1:])
    meets = ((low[:, None] <= high) & (high[:, None] >= low)).all(axis=-1)
    found = []
    for i, k in np.argwhere(np.triu(meets, 2)):
        a, b, c, d = places[i], places[i + 1], places[k], places[k + 1]
        if side(a, b, c) * side(a, b, d) < 0 and side(c, d, a) * side(c, d, b) < 0:
            found.append((int(i), int(k)))
    return found
