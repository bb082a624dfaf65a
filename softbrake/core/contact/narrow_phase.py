"""Narrow phase: the nearest points of a pair, and continuous collision detection within a step.

A face is the four triangles about the centre of its corners, so that no diagonal is preferred. All places are relative to the
node of the pair, which thus stands at the origin. Of the axisymmetric shell a face is a strip across the half-plane, seen
edge-on.
"""

from enum import IntEnum
from math import inf, sqrt
from typing import NamedTuple

from softbrake.core.contact.constants import (
    BISECTIONS,
    HELD_PART,
    NEAR_REBOUND,
    PARALLEL,
    RIM,
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

    distance: float  # m, at n+1
    found: int  # Found
    slowing: float  # m/s, that the speed of closing along the normal has to lose; 0 where nothing is to do
    normal: tuple[float, float, float]
    weights: tuple[float, float, float, float]  # of the corners


@kernel
def seen_from(nodes, pair, breadth, back):
    """Return the corners' places (m) relative to the node of a Pair, a time back (s) before n+1: four x, four y, four z.

    Reads nodes; breadth (m): of a Sheet.
    """
    node, (a, b, c, d) = pair.node, pair.corners
    x, y, z, u, v, w = nodes.x, nodes.y, nodes.z, nodes.u, nodes.v, nodes.w
    px, py, pz = x[node] - back * u[node], y[node] - back * v[node], z[node] - back * w[node]
    qx = (x[a] - back * u[a] - px, x[b] - back * u[b] - px, x[c] - back * u[c] - px, x[d] - back * u[d] - px)
    qy = (
        y[a] - back * v[a] - py - breadth,
        y[b] - back * v[b] - py + breadth,
        y[c] - back * v[c] - py + breadth,
        y[d] - back * v[d] - py - breadth,
    )
    qz = (z[a] - back * w[a] - pz, z[b] - back * w[b] - pz, z[c] - back * w[c] - pz, z[d] - back * w[d] - pz)
    return qx, qy, qz


@kernel
def centre_of(q):
    """Return the mean of four values."""
    return 0.25 * (q[0] + q[1] + q[2] + q[3])


@kernel
def corner_weights(k, s, t):
    """Return the corners' weights of the point s, t of triangle k: s of corner k, t of the next, the rest of the centre."""
    rest = 0.25 * (1.0 - s - t)
    n = (k + 1) % 4
    return (
        rest + (s if k == 0 else 0.0) + (t if n == 0 else 0.0),
        rest + (s if k == 1 else 0.0) + (t if n == 1 else 0.0),
        rest + (s if k == 2 else 0.0) + (t if n == 2 else 0.0),
        rest + (s if k == 3 else 0.0) + (t if n == 3 else 0.0),
    )


@kernel
def nearest_on_triangle(aa, ab, bb, ar, br):
    """Return the shares s, t of a and b in the point of the triangle 0, a, b nearest to r, from the scalar products.

    By regions of the plane: C. Ericson, Real-Time Collision Detection (2005), 5.1.5.
    """
    if ar <= 0.0 and br <= 0.0:
        return 0.0, 0.0
    ar_a, br_a = ar - aa, br - ab  # of r as seen from a
    if ar_a >= 0.0 and br_a <= ar_a:
        return 1.0, 0.0
    ar_b, br_b = ar - ab, br - bb  # and from b
    if br_b >= 0.0 and ar_b <= br_b:
        return 0.0, 1.0
    of_centre_a = ar * br_a - ar_a * br
    if of_centre_a <= 0.0 and ar >= 0.0 and ar_a <= 0.0:
        return ar / (ar - ar_a), 0.0
    of_centre_b = ar_b * br - ar * br_b
    if of_centre_b <= 0.0 and br >= 0.0 and br_b <= 0.0:
        return 0.0, br / (br - br_b)
    of_a_b = ar_a * br_b - ar_b * br_a
    if of_a_b <= 0.0:
        t = (br_a - ar_a) / ((br_a - ar_a) + (ar_b - br_b))
        return 1.0 - t, t
    whole = of_a_b + of_centre_b + of_centre_a
    return of_centre_b / whole, of_centre_a / whole


@kernel
def nearest_on_face(q):
    """Return the Nearest points of a node and a face. Reads q: the corners seen from the node."""
    qx, qy, qz = q
    cx, cy, cz = centre_of(qx), centre_of(qy), centre_of(qz)
    least, least_x, least_y, least_z = inf, 0.0, 0.0, 0.0
    triangle, share, share_next = 0, 0.0, 0.0
    for k in range(4):
        n = (k + 1) % 4
        ax, ay, az = qx[k] - cx, qy[k] - cy, qz[k] - cz
        bx, by, bz = qx[n] - cx, qy[n] - cy, qz[n] - cz
        s, t = nearest_on_triangle(
            ax * ax + ay * ay + az * az,
            ax * bx + ay * by + az * bz,
            bx * bx + by * by + bz * bz,
            -(ax * cx + ay * cy + az * cz),
            -(bx * cx + by * cy + bz * cz),
        )
        x, y, z = -(cx + s * ax + t * bx), -(cy + s * ay + t * by), -(cz + s * az + t * bz)
        square = x * x + y * y + z * z
        if square < least:
            least, least_x, least_y, least_z = square, x, y, z
            triangle, share, share_next = k, s, t
    return Nearest(sqrt(least), (least_x, least_y, least_z), corner_weights(triangle, share, share_next), True)


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
    s = min(max((ab * br - ar * bb) / square, 0.0), 1.0) if square > PARALLEL * aa * bb else 0.5
    t = (ab * s + br) / bb
    inside = 0.0 < t < 1.0
    t = min(max(t, 0.0), 1.0)
    s = (ab * t - ar) / aa
    inside = inside and 0.0 < s < 1.0
    s = min(max(s, 0.0), 1.0)
    x, y, z = s * ax - qx[1] - t * bx, s * ay - qy[1] - t * by, s * az - qz[1] - t * bz
    return Nearest(sqrt(x * x + y * y + z * z), (x, y, z), (-s, 1.0 - t, t, 0.0), inside)


@kernel
def nearest(edges, q):
    """Return the Nearest points of a pair of edges, or of a node and a face. Reads q: the corners seen from the node."""
    if edges:
        return nearest_on_edges(q)
    return nearest_on_face(q)


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
    coefficients of one sign it has no root; else its changes of sign between turning points are bisected, and the shares there
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
            time = bisect(v0, v1, v2, v3, before, low, end)
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
    """Return the Crossing of two edges. Reads start, end: the corners at n and n+1, seen from the node."""
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
def bisect(v0, v1, v2, v3, before, low, high):
    """Return where a cubic that changes sign from that of before between two times does so, just after."""
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        if before * cubic(v0, v1, v2, v3, middle) > 0.0:
            low = middle
        else:
            high = middle
    return high


@kernel
def crossing_of_face(start, end):
    """Return the Crossing of the node and a face. Reads start, end: the corners at n and n+1, seen from the node."""
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
def closing_along(nodes, pair, weights, normal):
    """Return the speed (m/s) at which the points of a Pair with these weights near each other along the normal to the node."""
    u, v, w, node = nodes.u, nodes.v, nodes.w, pair.node
    nx, ny, nz = normal
    own = nx * u[node] + ny * v[node] + nz * w[node]
    closing = 0.0
    for k in range(4):
        a = pair.corners[k]
        closing += weights[k] * (nx * u[a] + ny * v[a] + nz * w[a] - own)
    return closing


@kernel
def detect_collision(nodes, pair, scene, gap):
    """Return the Collision of a Pair in the step to n+1, by continuous detection. Reads nodes, scene.

    What would pass stays on its side, a gap (m) apart if it was so at n, else no nearer than then. The speed of closing has to
    lose what that takes, at most all of it: rest is always allowed, so no energy arises.
    """
    breadth, length = scene.sheet.breadth, scene.step.length
    end = seen_from(nodes, pair, breadth, 0.0)
    there = nearest(pair.edges, end)
    start = seen_from(nodes, pair, breadth, length)
    crossing = crossing_of_edges(start, end) if pair.edges else crossing_of_face(start, end)
    time, distance, apart = crossing.time, there.distance, (0.0, 0.0, 0.0)
    if time <= 1.0:
        closing = closing_along(nodes, pair, crossing.weights, crossing.normal)
        if abs(closing) * length <= ROUND_OFF * gap:  # all in one plane, as on the ground: there are no sides
            return Collision(distance, Found.APART, 0.0, apart, there.weights)
        if closing > 0.0:
            old = time * closing * length
            slowing = slowing_of(closing, old, gap, length)
            return Collision(distance, Found.PASSES, slowing, crossing.normal, crossing.weights)
    elif distance >= gap or not there.presses:
        return Collision(distance, Found.APART, 0.0, apart, there.weights)
    before = nearest(pair.edges, start)
    old = before.distance
    if time > 1.0 and (distance > TINY_GAP * gap or distance >= HELD_PART * min(gap, old) or not before.presses):
        return Collision(distance, Found.APART, 0.0, apart, there.weights)
    # In the plane of the face, or turned right over within the step: the direction at n still tells the sides.
    scale = 1.0 / max(old, SMALLEST)
    x, y, z = before.vector
    normal = (scale * x, scale * y, scale * z)
    closing = closing_along(nodes, pair, before.weights, normal)
    slowing = slowing_of(closing, old, gap, length)
    found = Found.PASSES if time <= 1.0 else Found.TOUCHES if slowing > 0.0 else Found.APART
    return Collision(distance, found, slowing, normal, before.weights)


@kernel
def slowing_of(closing, old, gap, length):
    """Return what a speed of closing (m/s) has to lose: the lesser of a gap and the distance old (m) at n is left at n+1.

    What was far too near rebounds by half, lest round-off decide.
    """
    if closing <= 0.0:
        return 0.0
    if old < TOO_NEAR * gap:
        return (1.0 + NEAR_REBOUND) * closing
    there = old - closing * length  # negative beyond the face
    return max(min((min(gap, old) - there) / length, closing), 0.0)
