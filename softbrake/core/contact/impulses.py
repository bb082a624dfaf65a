"""Impulses on nodes and faces of the cloth that part folds and lobes, and what ground, cover and cargo say to them."""

from math import inf

from softbrake.core.jit import kernel
from softbrake.core.obstacles import GAP, add_velocity_jump, allowed_place

GAP_PASSED = 1e-3  # of room, at which what would pass is held, if it was as far
LEAST_GIVE = 0.01  # of a free node's: a lever shorter than a tenth of a cell would multiply impulses without bound
BESIDE = 1e-9  # part of the cargo's radius, or of the gap kept from the cover, for round-off


@kernel
def available_space(step, sheet):
    """Return what thicknesses are a part of (m): the cell, or the space between ground and cover where that is narrower.

    Cloth has no thickness to be squeezed. Thicknesses of fixed thickness would fill what is left under the cover, and ground and
    cover, both rigid, would drive the cloth between them to and fro in each step anew: a force that grows as steps shrink.
    """
    return min(sheet.edge, step.next_cover - sheet.ground) if sheet.cover == 1 else sheet.edge


@kernel
def may_pass(nodes, contact, edges, node, corners, length):
    """Return whether a pair may pass in the step: not where all of each part stays on its side of the other, as at n."""
    nx, ny, nz = contact[0], contact[1], contact[2]
    a, b, c, d = corners
    own = nx * nodes.u[node] + ny * nodes.v[node] + nz * nodes.w[node]
    fastest = nx * nodes.u[a] + ny * nodes.v[a] + nz * nodes.w[a]
    if edges:
        own, fastest = min(own, fastest), -inf
    for other in (b, c, d):
        fastest = max(fastest, nx * nodes.u[other] + ny * nodes.v[other] + nz * nodes.w[other])
    return contact[8] + length * max(fastest - own, 0.0) > 0.0


@kernel
def separate_pair(nodes, mass, impulses, step, sheet, now, node, corners, weights, slowing, nx, ny, nz):
    """Take so much (m/s) from the speed at which a pair closes along the normal. Returns 1, or 0 where none gives way.

    The impulse p, times the sum of the weights on the node and -weight on each corner, is that of 1/m = sum weight^2/m_i, with
    what ground, cover and cargo leave of each 1/m_i where it is pushed against them.
    """
    w0, w1, w2, w3 = weights
    if sheet.columns == 1:  # both ends of the strip are one node
        w0, w1, w2, w3 = w0 + w1, 0.0, w2 + w3, 0.0
    a, b, c, d = corners
    own = w0 + w1 + w2 + w3
    give = 0.0
    for other, share in ((node, own), (a, -w0), (b, -w1), (c, -w2), (d, -w3)):
        if share != 0.0:
            side = 1.0 if share > 0.0 else -1.0
            freedom = freedom_of(nodes, step, sheet, other, side * nx, side * ny, side * nz)
            give += share * share * freedom * inverse_mass(mass, sheet, other)
    if give * mass[1] < LEAST_GIVE:
        return 0
    p = slowing / give
    px, py, pz = p * nx, p * ny, p * nz
    for other, share in ((node, own), (a, -w0), (b, -w1), (c, -w2), (d, -w3)):
        if share != 0.0:
            push_node(nodes, mass, impulses, step, sheet, now, other, share * px, share * py, share * pz)
    return 1


@kernel
def inverse_mass(mass, sheet, node):
    """Return 1/m (1/kg) of a node, 0 of one that ground or cover holds."""
    row = node // sheet.stride
    return 1.0 / mass[row] if 0 < row < sheet.rows else 0.0


@kernel
def rigidify(nodes, mass, impulses, step, sheet, now, node, corners):
    """Give all nodes of a pair one velocity, at which they neither near nor part.

    That of their common centre of mass; of the cover or of the ground where these hold one of them, so that all stay there.
    """
    a, b, c, d = corners
    all_mass, pu, pv, pw, held, resting, pressed = 0.0, 0.0, 0.0, 0.0, -1, False, False
    last = -1
    for other in (node, a, b, c, d):
        m = 0.0 if other == last else mass[other // sheet.stride]  # of edges or of a strip one stands there twice
        last = other
        all_mass, pu, pv, pw = all_mass + m, pu + m * nodes.u[other], pv + m * nodes.v[other], pw + m * nodes.w[other]
        resting = resting or nodes.z[other] <= sheet.ground
        pressed = pressed or is_pressed(nodes, step, sheet, other)
        if inverse_mass(mass, sheet, other) == 0.0:
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
    for other in (node, a, b, c, d):
        if inverse_mass(mass, sheet, other) > 0.0:
            m = mass[other // sheet.stride]
            pu, pv, pw = m * (u - nodes.u[other]), m * (v - nodes.v[other]), m * (w - nodes.w[other])
            push_node(nodes, mass, impulses, step, sheet, now, other, pu, pv, pw)
            given += pw
    if pressed or held // sheet.stride == sheet.rows:
        impulses.impulse[0] -= given
    elif resting or held >= 0:
        impulses.impulse[1] += given


@kernel
def freedom_of(nodes, step, sheet, node, nx, ny, nz):
    """Return the part of its 1/m with which a node gives way to a push along a unit vector: less where that is against a wall.

    A push against ground, cover, the cargo's side or the axis changes only the velocity along it.
    """
    x, y, z = nodes.x[node], nodes.y[node], nodes.z[node] - step.next_cover
    against = 0.0
    if nodes.z[node] <= sheet.ground:
        against = nz
    elif on_cover(step, sheet, x, y, z):
        against = nz if z > 0.0 else -nz
    elif beside_cargo(step, sheet, x, y, z):
        against = nz if z > sheet.cargo_height else (x * nx + y * ny) / sheet.cargo_radius
    elif sheet.axis == 1 and x <= (1.0 + BESIDE) * GAP:
        against = nx
    return 1.0 - min(against, 0.0) ** 2


@kernel
def on_cover(step, sheet, x, y, z):
    """Return whether a node at x, y, and z above the cover (m) lies on it."""
    return sheet.cover == 1 and abs(z) <= (1.0 + BESIDE) * step.gap and x * x + y * y < sheet.cover_radius**2


@kernel
def beside_cargo(step, sheet, x, y, z):
    """Return whether a node at x, y, and z above the cover (m) lies at the cargo's side, or on it."""
    beside = x * x + y * y <= ((1.0 + BESIDE) * sheet.cargo_radius) ** 2
    return sheet.cargo == 1 and beside and 0.0 < z <= sheet.cargo_height + step.gap


@kernel
def is_pressed(nodes, step, sheet, node):
    """Return whether a node lies on the cover, or on the cargo or at its side."""
    x, y, z = nodes.x[node], nodes.y[node], nodes.z[node] - step.next_cover
    return on_cover(step, sheet, x, y, z) or beside_cargo(step, sheet, x, y, z)


@kernel
def push_node(nodes, mass, impulses, step, sheet, now, node, pu, pv, pw):
    """Give a node an impulse (N s) in pass `now`; cover, cargo, axis and ground have the last word on where it goes.

    What a held row takes goes to impulses.impulse: on the cargo, of the ground on the fabric.
    """
    row, column = node // sheet.stride, node % sheet.stride - sheet.first
    if sheet.columns > 1 and column == sheet.columns:
        node, column = node - sheet.columns, 0  # of which it is the copy
    if row == 0:
        impulses.impulse[1] -= pw
    elif row == sheet.rows:
        impulses.impulse[0] += pw
    else:
        m = mass[row]
        slot = row if sheet.columns == 1 else column
        impulses.stamp[node] = now
        add_velocity_jump(nodes, impulses, node, slot, m, step.length, pu / m, pv / m, pw / m)
        low = nodes.z[node] < sheet.ground or (sheet.axis == 1 and nodes.x[node] < GAP)
        high = max(nodes.z[node] - step.next_cover, nodes.z[node] - step.length * nodes.w[node] - step.cover) > -step.gap
        if low or high:
            hold_node(nodes, impulses, step, sheet, node, slot, m)
        if sheet.columns > 1 and column == 0:
            impulses.stamp[node + sheet.columns] = now
            copy_node(nodes, node, node + sheet.columns)
        if sheet.columns > 1 and column == sheet.columns - 1:
            copy_node(nodes, node, node - sheet.columns)


@kernel
def hold_node(nodes, impulses, step, sheet, node, slot, mass):
    """Put a node where cover, cargo, axis and ground leave it. Writes nodes, impulses."""
    length = step.length
    x, y, z = nodes.x[node], nodes.y[node], nodes.z[node] - step.next_cover
    old_x, old_y = x - length * nodes.u[node], y - length * nodes.v[node]
    old_z = nodes.z[node] - length * nodes.w[node] - step.cover
    new_x, new_y, new_z = allowed_place(sheet, step.gap, old_x, old_y, old_z, x, y, z)
    if new_x != x or new_y != y or new_z != z:
        rise = (new_z - z) / length
        add_velocity_jump(nodes, impulses, node, slot, mass, length, (new_x - x) / length, (new_y - y) / length, rise)
        impulses.impulse[0] -= mass * rise
    if sheet.axis == 1 and nodes.x[node] < GAP:
        add_velocity_jump(nodes, impulses, node, slot, mass, length, (GAP - nodes.x[node]) / length, 0.0, 0.0)
    if nodes.z[node] < sheet.ground:
        rise = (sheet.ground - nodes.z[node]) / length
        add_velocity_jump(nodes, impulses, node, slot, mass, length, 0.0, 0.0, rise)
        impulses.impulse[1] += mass * rise


@kernel
def copy_node(nodes, node, copy):
    """Copy a node to its place at the other end of the row."""
    nodes.x[copy] = nodes.x[node]
    nodes.y[copy] = nodes.y[node]
    nodes.z[copy] = nodes.z[node]
    nodes.u[copy] = nodes.u[node]
    nodes.v[copy] = nodes.v[node]
    nodes.w[copy] = nodes.w[node]
