"""Impulses on the nodes of pairs that would pass or come too near, and on nodes that these push against obstacles."""

from math import inf

from softbrake.core.contact.constants import LEAST_MOBILITY
from softbrake.core.contact.obstacles import (
    allowed_place,
    blocked_part,
    change_velocity,
    least_radius,
    may_be_inside,
    on_cover_or_cargo,
    on_ground,
)
from softbrake.core.contact.scene import row_of
from softbrake.core.jit import kernel


@kernel
def may_pass(nodes, pair, state, length):
    """Return whether a Pair may pass in the step (s): not where all of each part stays on its side of the other, as at n.

    Reads nodes; state: its PairState.
    """
    nx, ny, nz = state.normal
    a, b, c, d = pair.corners
    own = nx * nodes.u[pair.node] + ny * nodes.v[pair.node] + nz * nodes.w[pair.node]
    fastest = nx * nodes.u[a] + ny * nodes.v[a] + nz * nodes.w[a]
    if pair.edges:
        own, fastest = min(own, fastest), -inf
    for other in (b, c, d):
        fastest = max(fastest, nx * nodes.u[other] + ny * nodes.v[other] + nz * nodes.w[other])
    return state.reach + length * max(fastest - own, 0.0) > 0.0


@kernel
def separate_pair(nodes, impulses, scene, now, pair, weights, slowing, normal):
    """Take so much (m/s) from the speed at which a Pair closes along the normal. Returns 1, or 0 where none gives way.

    The impulse p, times the sum of the weights on the node and -weight on each corner, is that of 1/m = sum weight^2/m_i, with
    what obstacles leave of each 1/m_i where it is pushed against them. Reads scene; now: the pass. Writes nodes, impulses.
    """
    nx, ny, nz = normal
    w0, w1, w2, w3 = weights
    if scene.sheet.columns == 1:  # both ends of the strip are one node
        w0, w1, w2, w3 = w0 + w1, 0.0, w2 + w3, 0.0
    a, b, c, d = pair.corners
    own = w0 + w1 + w2 + w3
    mobility = 0.0
    for other, share in ((pair.node, own), (a, -w0), (b, -w1), (c, -w2), (d, -w3)):
        if share != 0.0:
            side = 1.0 if share > 0.0 else -1.0
            freedom = freedom_of(nodes, scene, other, (side * nx, side * ny, side * nz))
            mobility += share * share * freedom * inverse_mass(scene, other)
    if mobility * scene.mass[1] < LEAST_MOBILITY:
        return 0
    p = slowing / mobility
    px, py, pz = p * nx, p * ny, p * nz
    for other, share in ((pair.node, own), (a, -w0), (b, -w1), (c, -w2), (d, -w3)):
        if share != 0.0:
            push_node(nodes, impulses, scene, now, other, (share * px, share * py, share * pz))
    return 1


@kernel
def inverse_mass(scene, node):
    """Return 1/m (1/kg) of a node, 0 of one that ground or cover holds."""
    row = row_of(scene.sheet, node)
    return 1.0 / scene.mass[row] if 0 < row < scene.sheet.rows else 0.0


@kernel
def freedom_of(nodes, scene, node, direction):
    """Return the part of its 1/m with which a node gives way to a push along a unit vector: less where an obstacle blocks that.

    A push against ground, cover, the cargo's side or the axis changes only the velocity along it.
    """
    x, y, z = nodes.x[node], nodes.y[node], nodes.z[node]
    return 1.0 - min(blocked_part(scene.sheet.obstacles, scene.step, x, y, z, direction), 0.0) ** 2


@kernel
def rigidify(nodes, impulses, scene, now, pair):
    """Make a Pair a rigid impact zone: give all its nodes one velocity, at which they neither near nor part.

    That of their common centre of mass; of the cover or of the ground where these hold one of them, so that all stay there.
    Reads scene; now: the pass. Writes nodes, impulses.
    """
    mass, step, sheet, obstacles = scene.mass, scene.step, scene.sheet, scene.sheet.obstacles
    a, b, c, d = pair.corners
    all_mass, pu, pv, pw, held, resting, pressed = 0.0, 0.0, 0.0, 0.0, -1, False, False
    last = -1
    for other in (pair.node, a, b, c, d):
        m = 0.0 if other == last else mass[row_of(sheet, other)]  # of edges or of a strip one stands there twice
        last = other
        all_mass, pu, pv, pw = all_mass + m, pu + m * nodes.u[other], pv + m * nodes.v[other], pw + m * nodes.w[other]
        resting = resting or on_ground(obstacles, nodes.z[other])
        pressed = pressed or on_cover_or_cargo(obstacles, step, nodes.x[other], nodes.y[other], nodes.z[other])
        if inverse_mass(scene, other) == 0.0:
            held = other
    u, v, w = pu / all_mass, pv / all_mass, pw / all_mass
    speed = (step.next_cover - step.cover) / step.length
    if held >= 0:
        u, v, w = 0.0, 0.0, nodes.w[held]
    elif pressed:
        u, v, w = 0.0, 0.0, speed
    elif resting and w < 0.0:
        w = 0.0
    given = 0.0
    for other in (pair.node, a, b, c, d):
        if inverse_mass(scene, other) > 0.0:
            m = mass[row_of(sheet, other)]
            pu, pv, pw = m * (u - nodes.u[other]), m * (v - nodes.v[other]), m * (w - nodes.w[other])
            push_node(nodes, impulses, scene, now, other, (pu, pv, pw))
            given += pw
    if pressed or held // sheet.stride == sheet.rows:
        impulses.impulse[0] -= given
    elif resting or held >= 0:
        impulses.impulse[1] += given


@kernel
def push_node(nodes, impulses, scene, now, node, push):
    """Give a node an impulse (N s, three components) in pass `now`; obstacles have the last word on where it goes.

    What a held row takes goes to impulses.impulse: on the cargo, of the ground on the fabric. Writes nodes, impulses.
    """
    step, sheet = scene.step, scene.sheet
    pu, pv, pw = push
    row, column = node // sheet.stride, node % sheet.stride - sheet.first
    if sheet.columns > 1 and column == sheet.columns:
        node, column = node - sheet.columns, 0  # of which it is the copy
    if row == 0:
        impulses.impulse[1] -= pw
    elif row == sheet.rows:
        impulses.impulse[0] += pw
    else:
        m = scene.mass[row]
        slot = row if sheet.columns == 1 else column
        impulses.stamp[node] = now
        add_velocity_jump(nodes, impulses, node, slot, m, step.length, pu / m, pv / m, pw / m)
        if may_be_inside(sheet.obstacles, step, nodes.x[node], nodes.z[node], nodes.w[node]):
            hold_node(nodes, impulses, scene, node, slot)
        if sheet.columns > 1 and column == 0:
            impulses.stamp[node + sheet.columns] = now
            copy_node(nodes, node, node + sheet.columns)
        if sheet.columns > 1 and column == sheet.columns - 1:
            copy_node(nodes, node, node - sheet.columns)


@kernel
def hold_node(nodes, impulses, scene, node, slot):
    """Put a node where obstacles leave it. Writes nodes, impulses, works to its slot."""
    step, obstacles, mass = scene.step, scene.sheet.obstacles, scene.mass[row_of(scene.sheet, node)]
    length, least = step.length, least_radius(obstacles)
    x, y, z = nodes.x[node], nodes.y[node], nodes.z[node] - step.next_cover
    old_x, old_y = x - length * nodes.u[node], y - length * nodes.v[node]
    old_z = nodes.z[node] - length * nodes.w[node] - step.cover
    new_x, new_y, new_z = allowed_place(obstacles, step.gap, old_x, old_y, old_z, x, y, z)
    if new_x != x or new_y != y or new_z != z:
        rise = (new_z - z) / length
        add_velocity_jump(nodes, impulses, node, slot, mass, length, (new_x - x) / length, (new_y - y) / length, rise)
        impulses.impulse[0] -= mass * rise
    if nodes.x[node] < least:
        add_velocity_jump(nodes, impulses, node, slot, mass, length, (least - nodes.x[node]) / length, 0.0, 0.0)
    if nodes.z[node] < obstacles.ground:
        rise = (obstacles.ground - nodes.z[node]) / length
        add_velocity_jump(nodes, impulses, node, slot, mass, length, 0.0, 0.0, rise)
        impulses.impulse[1] += mass * rise


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


@kernel
def copy_node(nodes, node, copy):
    """Copy a node to its place at the other end of the row."""
    nodes.x[copy] = nodes.x[node]
    nodes.y[copy] = nodes.y[node]
    nodes.z[copy] = nodes.z[node]
    nodes.u[copy] = nodes.u[node]
    nodes.v[copy] = nodes.v[node]
    nodes.w[copy] = nodes.w[node]
