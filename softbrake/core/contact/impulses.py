"""Impulses on the nodes of pairs that would pass or come too near, and on nodes that these push against obstacles.

They act on the records of nodes: velocities are means since the last contact, places at n+1 follow from them.
"""

from math import inf
from typing import NamedTuple

from numba import uint64

from softbrake.core.arrays import Place, Speed
from softbrake.core.contact.constants import LEAST_MOBILITY
from softbrake.core.contact.narrow_phase import speed_along
from softbrake.core.contact.obstacles import blocked_part, change_velocity, least_radius, place_left
from softbrake.core.jit import kernel


class Clear(NamedTuple):
    """Between which heights, and from which radius on, a node meets no obstacle."""

    low: float  # m
    high: float  # m, at n+1
    high_before: float  # m, at the last contact
    inner: float  # m


@kernel
def clear_of(scene):
    """Return where a node is Clear of obstacles: with room for round-off."""
    step, obstacles = scene.step, scene.sheet.obstacles
    there = obstacles.cover == 1 or obstacles.cargo == 1
    high = step.next_cover - 2.0 * step.gap if there else inf
    high_before = step.cover - 2.0 * step.gap if there else inf
    return Clear(obstacles.ground, high, high_before, 2.0 * least_radius(obstacles))


@kernel
def is_clear(record, a, length, clear):
    """Return whether a node is free, and clear of obstacles."""
    z = record.place[a, Place.Z] + length * record.speed[a, Speed.W]
    x = record.place[a, Place.X] + length * record.speed[a, Speed.U]
    level = (z > clear.low) & (z < clear.high) & (record.place[a, Place.Z] < clear.high_before)
    return level & (x > clear.inner) & (record.speed[a, Speed.PER_MASS] > 0.0)


@kernel
def end_place(record, a, length):
    """Return the place (m) of a node at n+1."""
    x = record.place[a, Place.X] + length * record.speed[a, Speed.U]
    y = record.place[a, Place.Y] + length * record.speed[a, Speed.V]
    z = record.place[a, Place.Z] + length * record.speed[a, Speed.W]
    return x, y, z


@kernel
def may_pass(record, nodes, edges, state, length):
    """Return whether a pair may pass: not where all of each part stays on its side of the other, as at the last contact.

    Reads record; state: its PairState.
    """
    normal = state.normal
    n, a, b, c, d = nodes
    own, fastest = speed_along(record, n, normal), speed_along(record, a, normal)
    upper = max(max(speed_along(record, b, normal), speed_along(record, c, normal)), speed_along(record, d, normal))
    lower = min(own, fastest) if edges else own
    fastest = upper if edges else max(upper, fastest)
    return state.reach + length * max(fastest - lower, 0.0) > 0.0


@kernel
def push(record, a, speed, normal, now):
    """Change the velocity of a node by a speed (m/s) along a unit vector in pass `now`."""
    record.speed[a, Speed.U] += speed * normal[0]
    record.speed[a, Speed.V] += speed * normal[1]
    record.speed[a, Speed.W] += speed * normal[2]
    record.stamp[a] = now


@kernel
def separate_pair(record, impulses, scene, clear, now, nodes, weights, slowing, normal):
    """Take so much (m/s) from the speed at which a pair closes along the normal. Returns 1, or 0 where none gives way.

    The impulse p, times the sum of the weights on the node and -weight on each corner, is that of 1/m = sum weight^2/m_i, with
    what obstacles leave of each 1/m_i where it is pushed against them. Reads scene; now: the pass. Writes record, impulses.
    """
    w0, w1, w2, w3 = weights
    if scene.sheet.columns == 1:  # both ends of the strip are one node
        w0, w1, w2, w3 = w0 + w1, 0.0, w2 + w3, 0.0
    n, a, b, c, d = nodes
    own, length = w0 + w1 + w2 + w3, scene.step.length
    free = is_clear(record, n, length, clear) & is_clear(record, a, length, clear) & is_clear(record, b, length, clear)
    if not (free & is_clear(record, c, length, clear) & is_clear(record, d, length, clear)):
        return separate_near_obstacles(record, impulses, scene, now, nodes, (own, -w0, -w1, -w2, -w3), slowing, normal)
    m, ma, mb, mc, md = (
        record.speed[n, Speed.PER_MASS],
        record.speed[a, Speed.PER_MASS],
        record.speed[b, Speed.PER_MASS],
        record.speed[c, Speed.PER_MASS],
        record.speed[d, Speed.PER_MASS],
    )
    mobility = own * own * m + w0 * w0 * ma + w1 * w1 * mb + w2 * w2 * mc + w3 * w3 * md
    if mobility * scene.mass[1] < LEAST_MOBILITY:
        return 0
    p = slowing / mobility
    push(record, n, own * p * m, normal, now)
    push(record, a, -w0 * p * ma, normal, now)
    push(record, b, -w1 * p * mb, normal, now)
    push(record, c, -w2 * p * mc, normal, now)
    push(record, d, -w3 * p * md, normal, now)
    free = is_clear(record, n, length, clear) & is_clear(record, a, length, clear) & is_clear(record, b, length, clear)
    if not (free & is_clear(record, c, length, clear) & is_clear(record, d, length, clear)):
        for other in nodes:
            hold_record(record, impulses, scene, other)
    return 1


@kernel
def separate_near_obstacles(record, impulses, scene, now, nodes, shares, slowing, normal):
    """As separate_pair, where a node may be held or lie on an obstacle. shares: of the impulse, on each node."""
    nx, ny, nz = normal
    mobility = 0.0
    for k in range(5):
        share = shares[k]
        if share != 0.0:
            side = 1.0 if share > 0.0 else -1.0
            freedom = freedom_of(record, scene, nodes[k], (side * nx, side * ny, side * nz))
            mobility += share * share * freedom * record.speed[nodes[k], Speed.PER_MASS]
    if mobility * scene.mass[1] < LEAST_MOBILITY:
        return 0
    p = slowing / mobility
    for k in range(5):
        if shares[k] != 0.0:
            push_node(record, impulses, scene, now, nodes[k], (shares[k] * p * nx, shares[k] * p * ny, shares[k] * p * nz))
    return 1


@kernel
def freedom_of(record, scene, a, direction):
    """Return the part of its 1/m with which a node gives way to a push along a unit vector: less where an obstacle blocks that.

    A push against ground, cover, the cargo's side or the axis changes only the velocity along it.
    """
    x, y, z = end_place(record, a, scene.step.length)
    return 1.0 - min(blocked_part(scene.sheet.obstacles, scene.step, x, y, z, direction), 0.0) ** 2


@kernel
def push_node(record, impulses, scene, now, a, push):
    """Give a node an impulse (N s, three components) in pass `now`; obstacles have the last word on where it goes.

    What a held row takes goes to impulses.impulse: on the cargo, of the ground on the fabric. Writes record, impulses.
    """
    per_mass = record.speed[a, Speed.PER_MASS]
    if per_mass > 0.0:
        record.speed[a, Speed.U] += push[0] * per_mass
        record.speed[a, Speed.V] += push[1] * per_mass
        record.speed[a, Speed.W] += push[2] * per_mass
        record.stamp[a] = now
        hold_record(record, impulses, scene, a)
    elif a < uint64(scene.sheet.stride):  # of row 0
        impulses.impulse[1] -= push[2]
    else:
        impulses.impulse[0] += push[2]


@kernel
def hold_record(record, impulses, scene, a):
    """Put a node that obstacles do not leave where it is at n+1 to where they do. Writes record, impulses."""
    step, per_mass = scene.step, record.speed[a, Speed.PER_MASS]
    if per_mass == 0.0:
        return
    start = record.place[a, Place.X], record.place[a, Place.Y], record.place[a, Place.Z]
    u, v, w, on_cargo, on_ground = place_left(scene.sheet.obstacles, step, start, end_place(record, a, step.length))
    record.speed[a, Speed.U] += u / step.length
    record.speed[a, Speed.V] += v / step.length
    record.speed[a, Speed.W] += w / step.length
    impulses.impulse[0] -= on_cargo / (per_mass * step.length)
    impulses.impulse[1] += on_ground / (per_mass * step.length)


@kernel
def hold_node(nodes, impulses, scene, a, slot):
    """Put a node of a shell where obstacles leave it. Writes nodes, impulses, works to its slot."""
    step, mass = scene.step, scene.mass[int(a) // scene.sheet.stride]
    length, x, y, z = step.length, nodes.x[a], nodes.y[a], nodes.z[a]
    start = x - length * nodes.u[a], y - length * nodes.v[a], z - length * nodes.w[a]
    u, v, w, on_cargo, on_ground = place_left(scene.sheet.obstacles, step, start, (x, y, z))
    if u != 0.0 or v != 0.0 or w != 0.0:
        add_velocity_jump(nodes, impulses, a, slot, mass, length, u / length, v / length, w / length)
    impulses.impulse[0] -= mass * on_cargo / length
    impulses.impulse[1] += mass * on_ground / length


@kernel
def add_velocity_jump(nodes, impulses, a, slot, mass, length, u, v, w):
    """Give node a a jump of velocity (m/s) at n+1/2, after the step that pushed it.

    For contact between rows, whose works are recorded already; add_contact_work_of_shell and add_contact_work_of_meridian amend
    them. Writes nodes, and the work (J) to a slot of impulses.
    """
    gain = mass * (u * (nodes.u[a] + 0.5 * u) + v * (nodes.v[a] + 0.5 * v) + w * (nodes.w[a] + 0.5 * w))
    impulses.contact[slot] += gain
    impulses.kinetic[slot] += gain
    change_velocity(nodes, a, length, u, v, w)
