"""Rigid impact zones: nodes of pairs that no impulses keep from passing get one velocity, so that they neither near nor part.

The nodes of such a pair are one zone, and zones that share a node are one. A zone that others still pass grows by their nodes;
in the end nothing passes, for what moves alike does not. After X. Provot (1997), and Bridson, Fedkiw, Anderson (2002).
A zone is named by one of its nodes, its root; each node of `SelfContact.zone` leads there by others, or is in NO_ZONE.
"""

from numba import uint32, uint64

from softbrake.core.arrays import Place, Speed
from softbrake.core.contact.impulses import end_place, push_node
from softbrake.core.contact.obstacles import on_cover_or_cargo, on_ground
from softbrake.core.jit import kernel

NO_ZONE = uint32(2**32 - 1)


@kernel
def root_of(zone, a):
    """Return the root of the zone of a node."""
    while uint64(zone[a]) != a:
        a = uint64(zone[a])
    return a


@kernel
def join_zone(zone, nodes):
    """Make one zone of some nodes and of the zones in which they are."""
    for a in nodes:
        if zone[a] == NO_ZONE:
            zone[a] = a
    root = root_of(zone, nodes[0])
    for a in nodes:
        zone[root_of(zone, a)] = root


@kernel
def settle_zones(record, impulses, scene, zone, now):
    """Give the nodes of each zone the velocity of it. Reads scene; now: the pass. Writes record, impulses, zone: the roots."""
    for a in range(uint64(zone.size)):
        if zone[a] != NO_ZONE:
            zone[a] = root_of(zone, a)
    for root in range(uint64(zone.size)):
        if uint64(zone[root]) == root:
            settle_zone(record, impulses, scene, zone, root, now)


@kernel
def settle_zone(record, impulses, scene, zone, root, now):
    """Give the nodes of a zone one velocity: that of their common centre of mass, or of cover or ground where these hold some.

    Between both it is squeezed, each node as fast as it is high: what is squeezed alike does not pass either. Both take their
    parts of the impulses by that height. Reads scene, zone. Writes record, impulses.
    """
    step, sheet, speed, obstacles = scene.step, scene.sheet, record.speed, scene.sheet.obstacles
    all_mass, pu, pv, pw, held, resting, pressed = 0.0, 0.0, 0.0, 0.0, -1, False, False
    grounded = False
    for a in range(uint64(zone.size)):
        if uint64(zone[a]) != root:
            continue
        row = int(a) // sheet.stride
        m = scene.mass[row]
        all_mass += m
        pu, pv, pw = pu + m * speed[a, Speed.U], pv + m * speed[a, Speed.V], pw + m * speed[a, Speed.W]
        x, y, z = end_place(record, a, step.length)
        resting = resting or on_ground(obstacles, z)
        pressed = pressed or on_cover_or_cargo(obstacles, step, x, y, z)
        if speed[a, Speed.PER_MASS] == 0.0:
            held, grounded = max(held, row), grounded or row == 0
    u, v, w = pu / all_mass, pv / all_mass, pw / all_mass
    cover, rising = pressed or held == sheet.rows, (step.next_cover - step.cover) / step.length
    squeezed = cover and (resting or grounded)
    if cover:
        u, v, w = 0.0, 0.0, rising
    elif held == 0:
        u, v, w = 0.0, 0.0, 0.0
    elif resting:
        w = max(w, 0.0)
    for a in range(uint64(zone.size)):
        if uint64(zone[a]) != root or speed[a, Speed.PER_MASS] == 0.0:
            continue
        m = 1.0 / speed[a, Speed.PER_MASS]
        by_cover = 1.0 if cover else 0.0
        if squeezed:
            by_cover = min(record.place[a, Place.Z] / step.cover, 1.0)
            w = rising * by_cover
        push = m * (u - speed[a, Speed.U]), m * (v - speed[a, Speed.V]), m * (w - speed[a, Speed.W])
        push_node(record, impulses, scene, now, a, push)
        if cover or resting or held == 0:
            impulses.impulse[0] -= by_cover * push[2]
            impulses.impulse[1] += (1.0 - by_cover) * push[2]
