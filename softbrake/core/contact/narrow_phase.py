"""Narrow phase: the nearest points of a pair, and continuous collision detection within a step.

A face is the four triangles about the centre of its corners, so that no diagonal is preferred. All places are relative to the
node of the pair, which thus stands at the origin. Of the axisymmetric shell a face is a strip across the half-plane, seen
edge-on.
"""

from enum import IntEnum
from math import sqrt
from typing import NamedTuple

from numba import uint64

from softbrake.core.arrays import Place, Speed
from softbrake.core.contact.constants import (
    HELD_PART,
    NEAR_REBOUND,
    PARALLEL,
    RIM,
    ROOT_PRECISION,
    ROOT_STEPS,
    ROUND_OFF,
    SMALLEST,
    TINY_GAP,
    TOO_NEAR,
)
from softbrake.core.jit import kernel

BEYOND = 2.0  # a time beyond the step, which lasts from 0 to 1


class Nearest(NamedTuple):
    """The nearest points of a pair."""

    distance: float  # m
    vector: tuple[float, float, float]  # m, to the node from the face, or to the first edge from the second
    weights: tuple[float, float, float, float]  # of the corners
    presses: bool  # False: edges of which one is nearest at its end; there it is a node that presses on a face


class Crossing(NamedTuple):
    """When and where the parts of a pair first pass each other."""

    time: float  # 0 … 1 within the step, or BEYOND
    normal: tuple[float, float, float]  # to the side from which the node, or the first edge, came
    weights: tuple[float, float, float, float]  # of the corners


class Found(IntEnum):
    """What continuous detection finds of a pair in a step."""

    APART = 0
    TOUCHES = 1  # its parts pass each other but for round-off
    PASSES = 2  # the node passes the face, or edge edge


class Collision(NamedTuple):
    """A pair in the step to n+1."""

    distance: float  # m, at its end
    found: int  # Found
    slowing: float  # m/s, that the speed of closing along the normal has to lose; 0 where nothing is to do
    normal: tuple[float, float, float]
    weights: tuple[float, float, float, float]  # of the corners


@kernel
def seen_from(record, nodes, breadth, after):
    """Return the corners' places (m) relative to the node of a pair, a time (s) after the last contact: four x, four y, four z.

    Reads record; nodes: of the pair; breadth (m): of a Sheet.
    """
    n, a, b, c, d = nodes
    px = record.place[n, Place.X] + after * record.speed[n, Speed.U]
    py = record.place[n, Place.Y] + after * record.speed[n, Speed.V]
    pz = record.place[n, Place.Z] + after * record.speed[n, Speed.W]
    qx = (
        record.place[a, Place.X] + after * record.speed[a, Speed.U] - px,
        record.place[b, Place.X] + after * record.speed[b, Speed.U] - px,
        record.place[c, Place.X] + after * record.speed[c, Speed.U] - px,
        record.place[d, Place.X] + after * record.speed[d, Speed.U] - px,
    )
    qy = (
        record.place[a, Place.Y] + after * record.speed[a, Speed.V] - py - breadth,
        record.place[b, Place.Y] + after * record.speed[b, Speed.V] - py + breadth,
        record.place[c, Place.Y] + after * record.speed[c, Speed.V] - py + breadth,
        record.place[d, Place.Y] + after * record.speed[d, Speed.V] - py - breadth,
    )
    qz = (
        record.place[a, Place.Z] + after * record.speed[a, Speed.W] - pz,
        record.place[b, Place.Z] + after * record.speed[b, Speed.W] - pz,
        record.place[c, Place.Z] + after * record.speed[c, Speed.W] - pz,
        record.place[d, Place.Z] + after * record.speed[d, Speed.W] - pz,
    )
    return qx, qy, qz


@kernel
def centre_of(q):
    """Return the mean of four values."""
    return 0.25 * (q[0] + q[1] + q[2] + q[3])


@kernel
def corner_weights(k, s, t):
    """Return the corners' weights of the point s, t of triangle k: s of corner k, t of the next, the rest of the centre."""
    rest = 0.25 * (1.0 - s - t)
    return (
        rest + (s if k == 0 else 0.0) + (t if k == 3 else 0.0),
        rest + (s if k == 1 else 0.0) + (t if k == 0 else 0.0),
        rest + (s if k == 2 else 0.0) + (t if k == 1 else 0.0),
        rest + (s if k == 3 else 0.0) + (t if k == 2 else 0.0),
    )


@kernel
def clamp(share):
    """Return a share, or the end of 0 … 1 next to it."""
    return min(max(share, 0.0), 1.0)


@kernel
def nearest_on_triangle(aa, ab, bb, ar, br):
    """Return the shares s, t of a and b in the point of the triangle 0, a, b nearest to r, from the scalar products.

    With the square of its distance, less that of r from 0. The point below r if it lies inside, else the nearest of the points
    nearest on the three sides; without branches, as loops over vectors of pairs have it.
    """
    per_square = 1.0 / (aa * bb - ab * ab)
    s, t = (bb * ar - ab * br) * per_square, (aa * br - ab * ar) * per_square
    within = s * (s * aa - 2.0 * ar) + t * (t * bb - 2.0 * br) + 2.0 * s * t * ab
    on_a, on_b, on_ab = clamp(ar / aa), clamp(br / bb), clamp((br - ar - ab + aa) / (aa - 2.0 * ab + bb))
    rest = 1.0 - on_ab
    from_a, from_b = on_a * (on_a * aa - 2.0 * ar), on_b * (on_b * bb - 2.0 * br)
    from_ab = rest * (rest * aa - 2.0 * ar) + on_ab * (on_ab * bb - 2.0 * br) + 2.0 * rest * on_ab * ab
    a_first = from_a <= from_b
    least, s_there, t_there = from_a if a_first else from_b, on_a if a_first else 0.0, 0.0 if a_first else on_b
    ab_first = from_ab < least
    least, s_there, t_there = from_ab if ab_first else least, rest if ab_first else s_there, on_ab if ab_first else t_there
    inside = (s >= 0.0) & (t >= 0.0) & (s + t <= 1.0)
    return s if inside else s_there, t if inside else t_there, within if inside else least


@kernel
def nearest_on_face(q):
    """Return the Nearest points of a node and a face. Reads q: the corners seen from the node."""
    (x0, x1, x2, x3), (y0, y1, y2, y3), (z0, z1, z2, z3) = q
    cx, cy, cz = centre_of(q[0]), centre_of(q[1]), centre_of(q[2])
    x0, x1, x2, x3 = x0 - cx, x1 - cx, x2 - cx, x3 - cx
    y0, y1, y2, y3 = y0 - cy, y1 - cy, y2 - cy, y3 - cy
    z0, z1, z2, z3 = z0 - cz, z1 - cz, z2 - cz, z3 - cz
    s00, s11 = x0 * x0 + y0 * y0 + z0 * z0, x1 * x1 + y1 * y1 + z1 * z1
    s22, s33 = x2 * x2 + y2 * y2 + z2 * z2, x3 * x3 + y3 * y3 + z3 * z3
    s01, s12 = x0 * x1 + y0 * y1 + z0 * z1, x1 * x2 + y1 * y2 + z1 * z2
    s23, s30 = x2 * x3 + y2 * y3 + z2 * z3, x3 * x0 + y3 * y0 + z3 * z0
    r0, r1 = -(x0 * cx + y0 * cy + z0 * cz), -(x1 * cx + y1 * cy + z1 * cz)
    r2, r3 = -(x2 * cx + y2 * cy + z2 * cz), -(x3 * cx + y3 * cy + z3 * cz)
    s, t, least = nearest_on_triangle(s00, s01, s11, r0, r1)
    w0, w1, w2, w3 = s, t, 0.0, 0.0
    s, t, square = nearest_on_triangle(s11, s12, s22, r1, r2)
    less = square < least
    least, w0, w1, w2 = square if less else least, 0.0 if less else w0, s if less else w1, t if less else 0.0
    s, t, square = nearest_on_triangle(s22, s23, s33, r2, r3)
    less = square < least
    least, w0, w1 = square if less else least, 0.0 if less else w0, 0.0 if less else w1
    w2, w3 = s if less else w2, t if less else 0.0
    s, t, square = nearest_on_triangle(s33, s30, s00, r3, r0)
    less = square < least
    w0, w1, w2, w3 = t if less else w0, 0.0 if less else w1, 0.0 if less else w2, s if less else w3
    x, y, z = (
        -(cx + w0 * x0 + w1 * x1 + w2 * x2 + w3 * x3),
        -(cy + w0 * y0 + w1 * y1 + w2 * y2 + w3 * y3),
        -(cz + w0 * z0 + w1 * z1 + w2 * z2 + w3 * z3),
    )
    rest = 0.25 * (1.0 - w0 - w1 - w2 - w3)
    return Nearest(sqrt(x * x + y * y + z * z), (x, y, z), (rest + w0, rest + w1, rest + w2, rest + w3), True)


@kernel
def nearest_on_edges(q):
    """Return the Nearest points of two edges. Reads q: the corners seen from the node.

    By clamping the shares in turn: C. Ericson, Real-Time Collision Detection (2005), 5.1.9.
    """
    qx, qy, qz = q
    ax, ay, az = qx[0], qy[0], qz[0]
    bx, by, bz = qx[2] - qx[1], qy[2] - qy[1], qz[2] - qz[1]
    aa, bb, ab = ax * ax + ay * ay + az * az, bx * bx + by * by + bz * bz, ax * bx + ay * by + az * bz
    ar, br = -(ax * qx[1] + ay * qy[1] + az * qz[1]), -(bx * qx[1] + by * qy[1] + bz * qz[1])
    square = aa * bb - ab * ab
    share = clamp((ab * br - ar * bb) / square)
    s = share if square > PARALLEL * aa * bb else 0.5
    t = (ab * s + br) / bb
    inside = (t > 0.0) & (t < 1.0)
    t = clamp(t)
    s = (ab * t - ar) / aa
    inside = inside & (s > 0.0) & (s < 1.0)
    s = clamp(s)
    x, y, z = s * ax - qx[1] - t * bx, s * ay - qy[1] - t * by, s * az - qz[1] - t * bz
    return Nearest(sqrt(x * x + y * y + z * z), (x, y, z), (-s, 1.0 - t, t, 0.0), inside)


@kernel
def nearest(edges, q):
    """Return the Nearest points of a pair of edges, or of a node and a face. Reads q: the corners seen from the node."""
    if edges:
        return nearest_on_edges(q)
    return nearest_on_face(q)


@kernel
def find_nearest(edges, given, found, count):
    """Write the Nearest points of so many pairs to found, a row each: distance, vector, weights, 1 where they press.

    Reads given: rows of the corners' x, y and z seen from the node. Loops over vectors.
    """
    for i in range(uint64(count)):
        qx = (given[0, i], given[1, i], given[2, i], given[3, i])
        qy = (given[4, i], given[5, i], given[6, i], given[7, i])
        qz = (given[8, i], given[9, i], given[10, i], given[11, i])
        points = nearest_on_edges((qx, qy, qz)) if edges else nearest_on_face((qx, qy, qz))
        found[0, i] = points.distance
        found[1, i], found[2, i], found[3, i] = points.vector
        found[4, i], found[5, i], found[6, i], found[7, i] = points.weights
        found[8, i] = 1.0 if points.presses else 0.0


@kernel
def triple_product(ax, ay, az, bx, by, bz, cx, cy, cz):
    """Return a · (b × c)."""
    return ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx)


@kernel
def cubic(b0, b1, b2, b3, time):
    """Return the cubic with these Bernstein coefficients on 0 … 1."""
    rest = 1.0 - time
    return rest * rest * (rest * b0 + 3.0 * time * b1) + time * time * (3.0 * rest * b2 + time * b3)


@kernel
def crossing_of(edges, r0, a0, b0, r1, a1, b1):
    """Return when within the step the node r first passes through the triangle 0, a, b, with s, t and the unit normal there.

    Or, of edges, when that from 0 to b passes the one from r to r + a, at t of b and s of a.
    Vectors at the start and at the end of the step, each moving evenly. The volume r · (a × b) is a cubic in time: with Bernstein
    coefficients of one sign it has no root; else its changes of sign between turning points are looked for, and the shares there
    tell inside from outside. The normal points to the side from which the node came. The time is BEYOND where it does not pass.
    """
    v0 = triple_product(*r0, *a0, *b0)
    v3 = triple_product(*r1, *a1, *b1)
    v1 = (triple_product(*r1, *a0, *b0) + triple_product(*r0, *a1, *b0) + triple_product(*r0, *a0, *b1)) / 3.0
    v2 = (triple_product(*r0, *a1, *b1) + triple_product(*r1, *a0, *b1) + triple_product(*r1, *a1, *b0)) / 3.0
    if min(v0, v1, v2, v3) > 0.0 or max(v0, v1, v2, v3) < 0.0:
        return BEYOND, 0.0, 0.0, 0.0, 0.0, 0.0
    turn, last_turn = turning_points(v1 - v0, v2 - v1, v3 - v2)
    before, low = v0, 0.0
    for end in (turn, last_turn, 1.0):
        value = cubic(v0, v1, v2, v3, end)
        if before * value < 0.0:
            time = root_between(v0, v1, v2, v3, before, low, end)
            rest = 1.0 - time
            rx, ry, rz = rest * r0[0] + time * r1[0], rest * r0[1] + time * r1[1], rest * r0[2] + time * r1[2]
            ax, ay, az = rest * a0[0] + time * a1[0], rest * a0[1] + time * a1[1], rest * a0[2] + time * a1[2]
            bx, by, bz = rest * b0[0] + time * b1[0], rest * b0[1] + time * b1[1], rest * b0[2] + time * b1[2]
            nx, ny, nz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
            square = nx * nx + ny * ny + nz * nz
            s = triple_product(nx, ny, nz, rx, ry, rz, bx, by, bz) / square
            t = triple_product(nx, ny, nz, ax, ay, az, rx, ry, rz) / square
            if edges:
                s = -s
            if s >= -RIM and t >= -RIM and (max(s, t) if edges else s + t) <= 1.0 + RIM:
                scale = (1.0 if before > 0.0 else -1.0) / sqrt(square)
                return time, s, t, scale * nx, scale * ny, scale * nz
        if value != 0.0:
            before = value
        low = end
    return BEYOND, 0.0, 0.0, 0.0, 0.0, 0.0


@kernel
def crossing_of_edges(start, end):
    """Return the Crossing of two edges. Reads start, end: the corners at both ends of it, seen from the node."""
    x0, y0, z0 = start
    x1, y1, z1 = end
    time, s, t, x, y, z = crossing_of(
        True,
        (-x0[1], -y0[1], -z0[1]),
        (x0[0], y0[0], z0[0]),
        (x0[2] - x0[1], y0[2] - y0[1], z0[2] - z0[1]),
        (-x1[1], -y1[1], -z1[1]),
        (x1[0], y1[0], z1[0]),
        (x1[2] - x1[1], y1[2] - y1[1], z1[2] - z1[1]),
    )
    return Crossing(time, (x, y, z), (-s, 1.0 - t, t, 0.0))


@kernel
def turning_points(d0, d1, d2):
    """Return the two times of 0 … 1, in order, between which a cubic is monotone; from Bernstein coefficients of its slope.

    0 or 1 where a turning point lies outside or there is none.
    """
    square, half, rest = d0 - 2.0 * d1 + d2, d1 - d0, d0
    root = sqrt(max(half * half - square * rest, 0.0))
    middle = -(half + (root if half > 0.0 else -root))
    first = rest / middle if middle != 0.0 else 0.0
    second = middle / square if square != 0.0 else 1.0
    first, second = min(max(first, 0.0), 1.0), min(max(second, 0.0), 1.0)
    return min(first, second), max(first, second)


@kernel
def root_between(v0, v1, v2, v3, before, low, high):
    """Return where a cubic that is monotone between two times, and changes sign from that of before, does so: Newton's steps.

    Where one leads out of what is left between the two, that is halved.
    """
    time = 0.5 * (low + high)
    for _ in range(ROOT_STEPS):
        value, rest = cubic(v0, v1, v2, v3, time), 1.0 - time
        if before * value > 0.0:
            low = time
        else:
            high = time
        slope = 3.0 * (rest * rest * (v1 - v0) + 2.0 * rest * time * (v2 - v1) + time * time * (v3 - v2))
        new = time - value / slope
        if not low < new < high:
            new = 0.5 * (low + high)
        if abs(new - time) <= ROOT_PRECISION:
            return new
        time = new
    return time


@kernel
def crossing_of_face(start, end):
    """Return the Crossing of the node and a face. Reads start, end: the corners at both ends of it, seen from the node."""
    x0, y0, z0 = start
    x1, y1, z1 = end
    c0 = (centre_of(x0), centre_of(y0), centre_of(z0))
    c1 = (centre_of(x1), centre_of(y1), centre_of(z1))
    r0, r1 = (-c0[0], -c0[1], -c0[2]), (-c1[0], -c1[1], -c1[2])
    first, triangle, share, share_next, nx, ny, nz = BEYOND, 0, 0.0, 0.0, 0.0, 0.0, 0.0
    for k in range(4):
        n = (k + 1) % 4
        time, s, t, x, y, z = crossing_of(
            False,
            r0,
            (x0[k] - c0[0], y0[k] - c0[1], z0[k] - c0[2]),
            (x0[n] - c0[0], y0[n] - c0[1], z0[n] - c0[2]),
            r1,
            (x1[k] - c1[0], y1[k] - c1[1], z1[k] - c1[2]),
            (x1[n] - c1[0], y1[n] - c1[1], z1[n] - c1[2]),
        )
        if time < first:
            first, triangle, share, share_next, nx, ny, nz = time, k, s, t, x, y, z
    return Crossing(first, (nx, ny, nz), corner_weights(triangle, share, share_next))


@kernel
def speed_along(record, a, normal):
    """Return the speed (m/s) of a node along a unit vector."""
    return normal[0] * record.speed[a, Speed.U] + normal[1] * record.speed[a, Speed.V] + normal[2] * record.speed[a, Speed.W]


@kernel
def closing_along(record, nodes, weights, normal):
    """Return the speed (m/s) at which the points of a pair with these weights near each other along the normal to the node."""
    n, a, b, c, d = nodes
    lower = weights[0] * speed_along(record, a, normal) + weights[1] * speed_along(record, b, normal)
    upper = weights[2] * speed_along(record, c, normal) + weights[3] * speed_along(record, d, normal)
    return lower + upper - (weights[0] + weights[1] + weights[2] + weights[3]) * speed_along(record, n, normal)


@kernel
def detect_collision(record, nodes, edges, scene, gap):
    """Return the Collision of a pair since the last contact, by continuous detection. Reads record, scene.

    edges: whether it is of two edges. What would pass stays on its side, a gap (m) apart if it was so then, else no nearer than
    then. The speed of closing has to lose what that takes, at most all of it: rest is always allowed, so no energy arises.
    """
    breadth, length = scene.sheet.breadth, scene.step.length
    end = seen_from(record, nodes, breadth, length)
    there = nearest(edges, end)
    start = seen_from(record, nodes, breadth, 0.0)
    crossing = crossing_of_edges(start, end) if edges else crossing_of_face(start, end)
    time, distance, apart = crossing.time, there.distance, (0.0, 0.0, 0.0)
    if time <= 1.0:
        closing = closing_along(record, nodes, crossing.weights, crossing.normal)
        if abs(closing) * length <= ROUND_OFF * gap:  # all in one plane, as on the ground: there are no sides
            return Collision(distance, Found.APART, 0.0, apart, there.weights)
        if closing > 0.0:
            old = time * closing * length
            slowing = slowing_of(closing, old, gap, length)
            return Collision(distance, Found.PASSES, slowing, crossing.normal, crossing.weights)
    elif distance >= gap or not there.presses:
        return Collision(distance, Found.APART, 0.0, apart, there.weights)
    before = nearest(edges, start)
    old = before.distance
    if time > 1.0 and (distance > TINY_GAP * gap or distance >= HELD_PART * min(gap, old) or not before.presses):
        return Collision(distance, Found.APART, 0.0, apart, there.weights)
    # In the plane of the face, or turned right over since: the direction then still tells the sides.
    scale = 1.0 / max(old, SMALLEST)
    x, y, z = before.vector
    normal = (scale * x, scale * y, scale * z)
    closing = closing_along(record, nodes, before.weights, normal)
    slowing = slowing_of(closing, old, gap, length)
    found = Found.PASSES if time <= 1.0 else Found.TOUCHES if slowing > 0.0 else Found.APART
    return Collision(distance, found, slowing, normal, before.weights)


@kernel
def slowing_of(closing, old, gap, length):
    """Return what a speed of closing (m/s) has to lose: the lesser of a gap and the distance old (m) before is left.

    What was far too near rebounds by half, lest round-off decide.
    """
    if closing <= 0.0:
        return 0.0
    if old < TOO_NEAR * gap:
        return (1.0 + NEAR_REBOUND) * closing
    there = old - closing * length  # negative beyond the face
    return max(min((min(gap, old) - there) / length, closing), 0.0)
