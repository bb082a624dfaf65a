"""Contact of the folds of the shell with one another: unilateral, smooth, without rebound. Nodes against faces.

After the push of all free rows, impulses at n+1/2 change velocities, and places by what that makes until n+1. Each face has a
cushion: a node and the corners of a face that would come nearer than it is thick take equal and opposite impulses along the
line between them at n, which end the closing and give back half of what the cushion is pressed in; pair after pair, a few times
over (Gauss-Seidel). What would pass through a face all the same is found by continuous detection, and parted when and where it
does, until none is left. Edges may cut edges. After Bridson, Fedkiw, Anderson, Robust treatment of collisions, contact
and friction for cloth animation (2002), and their order: what never passes is on the side where it was.
"""

from math import inf, sqrt

from numba import uint64

from softbrake.kernels.contact import GAP, allowed_place, jolt
from softbrake.kernels.jit import kernel
from softbrake.kernels.meet import APART, PASSES, SMALLEST, closing_along, corners_of, meet, nearest_on_face, seen_from
from softbrake.kernels.near import find_pairs
from softbrake.state import PAD, Blows, FoldCount, Sheet

CUSHION = 0.02  # of an unloaded cell, kept between folds; of what is left between ground and cover where that is less
SPRING = 0.5  # of what a cushion is pressed in, given back in a step,
REBOUND = 0.5  # but at no more than this part of the speed of closing: what rests in it is left there
CUSHIONINGS = 4  # passes over the cushions
GAP_PASSED = 1e-3  # of the same, at which what would pass is held, if it was as far
AIM = 1.2  # of the impulse needed, after the first passes: a rebound, but fewer passes for pairs that others push back
LAST = 0.5  # of the height of the cover, what a step leaves of it; where it leaves less, the run ends, and folds no longer meet
FIRM = 4  # passes that take what is needed and no more
PUSHES = 60  # passes over what would pass a face, and as many more over a meridian; what still does then is counted
LEAST_GIVE = 0.01  # of a free node's: a lever shorter than a tenth of a cell would multiply impulses without bound
TINY = 1e-3  # of the cushion; nearer than this the direction from face to node says nothing
REST = 0.1  # of an unloaded cell, margin of a node at rest in the search
STEPS = 10.0  # steps at the present speed, margin of one that moves
SLACK = 1.25  # on the travel before contact: blows make some nodes faster
WIDEST, LEAST = 2.0, 0.125  # by which margins are scaled
FEW, MANY = 0.1, 1.0  # pairs per face
BESIDE = 1e-9  # part of the cargo's radius
UPRIGHT = 0.1  # of an unloaded cell, that each edge climbs or goes round at least where no folds can meet
FACE = 2**32 - 1  # bits of a pair that name the face


@kernel
def part_shell(model, nodes, work, by_column, folds, course, touching):
    """Keep the folds of the full shell apart in the step to n+1.

    Reads model, course; touching: whether cover and cargo are in the way. Writes nodes, work.contact; by_column.kinetic,
    on_cargo, impulse; folds.
    """
    sheet = shell_sheet(model, touching)
    part_moved(nodes, model.mass, work.contact, by_column.kinetic, folds, course, sheet)
    by_column.on_cargo[0] += folds.impulse[0]
    by_column.impulse[0] += folds.impulse[1]


@kernel
def part_meridian(model, nodes, meridian, folds, course):
    """Keep the folds of a meridian apart in the step to n+1: node i of nodes at radius x, height z; y and v zero.

    Reads model, course. Writes nodes, folds, with the impulses on cargo and ground in folds.impulse; add_contact_work books them.
    """
    sheet = meridian_sheet(model, course)
    part_moved(nodes, model.mass, meridian.contact, meridian.kinetic, folds, course, sheet)


@kernel
def shell_sheet(model, touching):
    """Return the Sheet of a shell; touching: whether cover and cargo are in the way."""
    edge = min(model.fabric.h1, model.fabric.h2)
    return sheet_of(model, model.n2, model.stride, PAD, 0.0, edge, touching, 0)


@kernel
def meridian_sheet(model, course):
    """Return the Sheet of a meridian in the step."""
    contact, edge = model.contact, model.fabric.h1
    touching = (contact.cover == 1 or contact.cargo == 1) and course.next_cover > 0.0
    return sheet_of(model, 1, 1, 0, 0.5 * edge, edge, touching, contact.axis)


@kernel
def sheet_of(model, columns, stride, first, breadth, edge, touching, axis):
    """Return the Sheet of a model: its faces, and what else is in the way."""
    wall, there = model.contact, int(touching)
    round_wall = (wall.cover * there, wall.cover_radius, wall.cargo * there, wall.cargo_radius, wall.cargo_height)
    return Sheet(model.n1, columns, stride, first, breadth, edge, wall.ground, *round_wall, axis)


@kernel
def part_moved(nodes, mass, contact, kinetic, folds, course, sheet):
    """Keep folds apart, while the row on the cover, which is pushed last, stands where it is foreseen. See part_folds."""
    folds.impulse[0] = 0.0
    folds.impulse[1] = 0.0
    if folds.counts[FoldCount.DUE] == 0 or course.next_cover <= LAST * course.cover:
        return
    top = sheet.rows * sheet.stride + sheet.first
    copies = int(sheet.columns > 1)
    old, speed = nodes.w[top], (course.next_cover - course.cover) / course.length
    for a in range(top - copies, top + sheet.columns + copies):
        nodes.z[a] = course.next_cover
        nodes.w[a] = speed
    part_folds(nodes, mass, Blows(contact, kinetic, folds.impulse, folds.stamp), folds, course, sheet)
    for a in range(top - copies, top + sheet.columns + copies):
        nodes.z[a] = course.cover
        nodes.w[a] = old


@kernel
def part_folds(nodes, mass, blows, folds, course, sheet):
    """Keep the folds apart in the step to n+1. Reads mass (kg, by row). Writes nodes, blows, folds."""
    counts, length = folds.counts, course.length
    if add_travel(nodes, folds, sheet, length) or counts[FoldCount.STALE] == 1:
        look_around(folds, nodes, sheet)
    awake = wake_pairs(nodes, folds, course, sheet)
    if awake == 0:
        return
    for _ in range(CUSHIONINGS):
        counts[FoldCount.PASSES] += 1
        for k in range(awake):
            press_cushion(nodes, mass, blows, folds, course, sheet, k)
    tries, pushed, most = 0, 1, PUSHES if sheet.columns > 1 else 2 * PUSHES
    while pushed > 0 and tries < most:
        pushed = try_pairs(nodes, mass, blows, folds, course, sheet, awake, tries)
        tries += 1
    if pushed > 0:
        book_failure(nodes, folds, course, sheet, awake)


@kernel
def room(course, sheet):
    """Return what cushions are a part of (m): the cell, or the space between ground and cover where that is narrower.

    Cloth has no thickness to be squeezed. Cushions of fixed thickness would fill what is left under the cover, and ground and
    cover, both rigid, would drive the cloth between them to and fro in each step anew: a force that grows as steps shrink.
    """
    return min(sheet.edge, course.next_cover - sheet.ground)


@kernel
def add_travel(nodes, folds, sheet, length):
    """Add what the nodes travel in the step (s) to their paths. Returns whether one has used up its margin.

    Writes folds.step, path, face_step, face_path.
    """
    u, v, w, path, step, margin = nodes.u, nodes.v, nodes.w, folds.path, folds.step, folds.margin
    used_up = 0
    for a in range(uint64(path.size)):
        way = SLACK * length * sqrt(u[a] * u[a] + v[a] * v[a] + w[a] * w[a])
        step[a] = way
        path[a] += way
        used_up |= int(path[a] > margin[a])
    if folds.counts[FoldCount.PAIRS] > 0:
        update_faces(folds, sheet)
    return used_up > 0


@kernel
def update_faces(folds, sheet):
    """Write the largest path and step of the corners of each face, by its lower left one; rows end in copies."""
    path, step, face_path, face_step = folds.path, folds.step, folds.face_path, folds.face_step
    above, right = uint64(sheet.stride), uint64(sheet.columns > 1)
    for a in range(uint64(path.size) - above - right):
        b, c, d = a + right, a + above, a + above + right
        face_path[a] = max(path[a], path[b], path[c], path[d])
        face_step[a] = max(step[a], step[b], step[c], step[d])


@kernel
def look_around(folds, nodes, sheet):
    """Search for near pairs anew: all that may meet before a node has travelled its margin.

    The fewer pairs there are, the wider the margins, and the later the next search. Where the arrays do not hold them all,
    margins are narrowed for now, and the arrays enlarged before the next step.
    """
    counts, scale, path, margin = folds.counts, folds.scale, folds.path, folds.margin
    for a in range(path.size):
        path[a] = 0.0
    count = -1
    while count < 0 or (count > folds.pairs.size and scale[0] > LEAST):
        scale[0] *= 1.0 if count < 0 else 0.5
        for a in range(path.size):
            margin[a] = scale[0] * (REST * sheet.edge + STEPS * folds.step[a])
        count = find_pairs(nodes, folds, sheet, CUSHION * sheet.edge)
        counts[FoldCount.SEARCHES] += 1
        if count > folds.pairs.size:
            counts[FoldCount.CRAMPED] = 1
    faces = sheet.rows * sheet.columns
    if count < FEW * faces:
        scale[0] = min(2.0 * scale[0], WIDEST)
    elif count > MANY * faces:
        scale[0] = max(0.5 * scale[0], 1.0)
    counts[FoldCount.PAIRS] = min(count, folds.pairs.size)
    counts[FoldCount.STALE] = 0
    update_faces(folds, sheet)


@kernel
def wake_pairs(nodes, folds, course, sheet):
    """Put the pairs that may meet in this step in front, and write how they stand at n to folds.contacts. Returns their number.

    A pair at some distance sleeps until node and face can have travelled it.
    """
    pairs, wake, contacts = folds.pairs, folds.wake, folds.contacts
    thick, length = CUSHION * room(course, sheet), course.length
    awake = 0
    for k in range(folds.counts[FoldCount.PAIRS]):
        pair = pairs[k]
        node, face = pair >> 32, pair & FACE
        travelled = folds.path[node] + folds.face_path[face]
        if travelled < wake[k]:
            continue
        start = seen_from(nodes, node, corners_of(face, sheet), sheet.breadth, length)
        distance, x, y, z, weights = nearest_on_face(start)
        step = folds.step[node] + folds.face_step[face]
        wake[k] = travelled - step + distance - thick
        if distance > thick + step:
            continue
        pairs[k], pairs[awake] = pairs[awake], pair
        wake[k], wake[awake] = wake[awake], wake[k]
        write_contact(contacts[awake], start, distance, x, y, z, weights, thick, length)
        awake += 1
    return awake


@kernel
def write_contact(contact, start, distance, x, y, z, weights, thick, length):
    """Write how a pair stands at n, see Folds.contacts: x, y, z (m) from the face to the node; start: corners seen from it."""
    scale = 1.0 / max(distance, SMALLEST)
    qx, qy, qz = start
    nearest = -inf
    for k in range(4):
        nearest = max(nearest, scale * (x * qx[k] + y * qy[k] + z * qz[k]))
    allowed = (distance - thick) / length
    contact[0], contact[1], contact[2] = scale * x, scale * y, scale * z
    contact[3], contact[4], contact[5], contact[6] = weights
    contact[7] = allowed if allowed > 0.0 else SPRING * allowed
    contact[8] = nearest if distance > TINY * thick else inf


@kernel
def press_cushion(nodes, mass, blows, folds, course, sheet, k):
    """Take from a pair what it closes faster than its cushion allows.

    No energy arises, since it never parts faster than it closed. Writes nodes, blows.
    """
    contact = folds.contacts[k]
    if contact[8] == inf:
        return
    node, corners = folds.pairs[k] >> 32, corners_of(folds.pairs[k] & FACE, sheet)
    nx, ny, nz, weights = contact[0], contact[1], contact[2], (contact[3], contact[4], contact[5], contact[6])
    closing = closing_along(nodes, node, corners, weights, nx, ny, nz)
    slowing = min(closing - contact[7], (1.0 + REBOUND) * closing)
    if slowing > 0.0:
        now = folds.counts[FoldCount.PASSES]
        part_pair(nodes, mass, blows, course, sheet, now, node, corners, weights, slowing, nx, ny, nz)


@kernel
def may_pass(nodes, contact, node, corners, length):
    """Return whether a node may pass through a face in the step: not where all corners stay on their side of it, as at n."""
    nx, ny, nz = contact[0], contact[1], contact[2]
    fastest = 0.0
    for a in corners:
        closing = nx * (nodes.u[a] - nodes.u[node]) + ny * (nodes.v[a] - nodes.v[node]) + nz * (nodes.w[a] - nodes.w[node])
        fastest = max(fastest, closing)
    return contact[8] + length * fastest > 0.0


@kernel
def try_pairs(nodes, mass, blows, folds, course, sheet, awake, tries):
    """Part the pairs that would pass, one after the other. Returns how many of them took an impulse.

    After the first pass only those are looked at of which a node was pushed in this pass or the one before. What no impulse
    along the normal parts takes its common velocity, as does all that still passes in the last passes over a meridian.
    Writes nodes, blows.
    """
    pairs, stamp, counts = folds.pairs, folds.stamp, folds.counts
    before = counts[FoldCount.PASSES]
    counts[FoldCount.PASSES] += 1
    gap, pushed = GAP_PASSED * room(course, sheet), 0
    for k in range(awake):
        node, corners = pairs[k] >> 32, corners_of(pairs[k] & FACE, sheet)
        a, b, c, d = corners
        if tries > 0 and max(stamp[node], stamp[a], stamp[b], stamp[c], stamp[d]) < before:
            continue
        if not may_pass(nodes, folds.contacts[k], node, corners, course.length):
            continue
        _, how, slowing, nx, ny, nz, weights = meet(nodes, node, corners, sheet.breadth, course.length, gap)
        if how == APART:
            continue
        if tries >= PUSHES or slowing <= 0.0:
            merge_nodes(nodes, mass, blows, course, sheet, before + 1, node, corners)
            pushed += 1
        else:
            aim = slowing if tries < FIRM else AIM * slowing
            pushed += part_pair(nodes, mass, blows, course, sheet, before + 1, node, corners, weights, aim, nx, ny, nz)
    return pushed


@kernel
def part_pair(nodes, mass, blows, course, sheet, now, node, corners, weights, slowing, nx, ny, nz):
    """Take so much (m/s) from the speed at which a node nears a face along the normal. Returns 1, 0 where both are held.

    The impulse p on the node, -weight p on each corner, is that of the masses 1/m = 1/m_node + sum weight^2/m_corner.
    """
    w0, w1, w2, w3 = weights
    if sheet.columns == 1:  # both ends of the strip are one node
        w0, w1, w2, w3 = w0 + w1, 0.0, w2 + w3, 0.0
    a, b, c, d = corners
    give = inverse_mass(mass, sheet, node) + w0 * w0 * inverse_mass(mass, sheet, a) + w1 * w1 * inverse_mass(mass, sheet, b)
    give += w2 * w2 * inverse_mass(mass, sheet, c) + w3 * w3 * inverse_mass(mass, sheet, d)
    if give * mass[1] < LEAST_GIVE:
        return 0
    p = slowing / give
    px, py, pz = p * nx, p * ny, p * nz
    for other, share in ((node, 1.0), (a, -w0), (b, -w1), (c, -w2), (d, -w3)):
        if share != 0.0:
            push_node(nodes, mass, blows, course, sheet, now, other, share * px, share * py, share * pz)
    return 1


@kernel
def inverse_mass(mass, sheet, node):
    """Return 1/m (1/kg) of a node, 0 of one that ground or cover holds."""
    row = node // sheet.stride
    return 1.0 / mass[row] if 0 < row < sheet.rows else 0.0


@kernel
def merge_nodes(nodes, mass, blows, course, sheet, now, node, corners):
    """Give a node and the corners of a face one velocity, at which they neither near nor part.

    That of their common centre of mass; of the cover or of the ground where these hold one of them, so that all stay there.
    """
    a, b, c, d = corners
    all_mass, pu, pv, pw, held, resting, pressed = 0.0, 0.0, 0.0, 0.0, -1, False, False
    for other in (node, a, b, c, d):
        m = mass[other // sheet.stride]
        all_mass, pu, pv, pw = all_mass + m, pu + m * nodes.u[other], pv + m * nodes.v[other], pw + m * nodes.w[other]
        resting = resting or nodes.z[other] <= sheet.ground
        pressed = pressed or is_pressed(nodes, course, sheet, other)
        if inverse_mass(mass, sheet, other) == 0.0:
            held = other
    u, v, w = pu / all_mass, pv / all_mass, pw / all_mass
    speed = (course.next_cover - course.cover) / course.length
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
            push_node(nodes, mass, blows, course, sheet, now, other, pu, pv, pw)
            given += pw
    if pressed or held // sheet.stride == sheet.rows:
        blows.impulse[0] -= given
    elif resting or held >= 0:
        blows.impulse[1] += given


@kernel
def is_pressed(nodes, course, sheet, node):
    """Return whether a node lies on the cover, or on the cargo or at its side."""
    x, y, z = nodes.x[node], nodes.y[node], nodes.z[node] - course.next_cover
    on_cover = sheet.cover == 1 and abs(z) <= course.gap and x * x + y * y < sheet.cover_radius**2
    beside = x * x + y * y <= ((1.0 + BESIDE) * sheet.cargo_radius) ** 2
    on_cargo = sheet.cargo == 1 and beside and 0.0 < z <= sheet.cargo_height + course.gap
    return on_cover or on_cargo


@kernel
def push_node(nodes, mass, blows, course, sheet, now, node, pu, pv, pw):
    """Give a node an impulse (N s) in pass `now`; cover, cargo, axis and ground have the last word on where it goes.

    What a held row takes goes to blows.impulse: on the cargo, of the ground on the fabric.
    """
    row, column = node // sheet.stride, node % sheet.stride - sheet.first
    if row == 0:
        blows.impulse[1] -= pw
    elif row == sheet.rows:
        blows.impulse[0] += pw
    else:
        m = mass[row]
        slot = row if sheet.columns == 1 else column
        blows.stamp[node] = now
        jolt(nodes, blows, node, slot, m, course.length, pu / m, pv / m, pw / m)
        low = nodes.z[node] < sheet.ground or (sheet.axis == 1 and nodes.x[node] < GAP)
        high = max(nodes.z[node] - course.next_cover, nodes.z[node] - course.length * nodes.w[node] - course.cover) > -course.gap
        if low or high:
            hold_node(nodes, blows, course, sheet, node, slot, m)
        if sheet.columns > 1 and column == 0:
            copy_node(nodes, node, node + sheet.columns)
        if sheet.columns > 1 and column == sheet.columns - 1:
            copy_node(nodes, node, node - sheet.columns)


@kernel
def hold_node(nodes, blows, course, sheet, node, slot, mass):
    """Put a node where cover, cargo, axis and ground leave it. Writes nodes, blows."""
    length = course.length
    x, y, z = nodes.x[node], nodes.y[node], nodes.z[node] - course.next_cover
    old_x, old_y = x - length * nodes.u[node], y - length * nodes.v[node]
    old_z = nodes.z[node] - length * nodes.w[node] - course.cover
    new_x, new_y, new_z = allowed_place(sheet, course.gap, old_x, old_y, old_z, x, y, z)
    if new_x != x or new_y != y or new_z != z:
        rise = (new_z - z) / length
        jolt(nodes, blows, node, slot, mass, length, (new_x - x) / length, (new_y - y) / length, rise)
        blows.impulse[0] -= mass * rise
    if sheet.axis == 1 and nodes.x[node] < GAP:
        jolt(nodes, blows, node, slot, mass, length, (GAP - nodes.x[node]) / length, 0.0, 0.0)
    if nodes.z[node] < sheet.ground:
        rise = (sheet.ground - nodes.z[node]) / length
        jolt(nodes, blows, node, slot, mass, length, 0.0, 0.0, rise)
        blows.impulse[1] += mass * rise


@kernel
def copy_node(nodes, node, copy):
    """Copy a node to its place at the other end of the row."""
    nodes.x[copy] = nodes.x[node]
    nodes.y[copy] = nodes.y[node]
    nodes.z[copy] = nodes.z[node]
    nodes.u[copy] = nodes.u[node]
    nodes.v[copy] = nodes.v[node]
    nodes.w[copy] = nodes.w[node]


@kernel
def book_failure(nodes, folds, course, sheet, awake):
    """Count the pairs that pass though the passes are used up, and raise the largest penetration, over the unloaded cell."""
    gap, length = GAP_PASSED * room(course, sheet), course.length
    for k in range(awake):
        node, corners = folds.pairs[k] >> 32, corners_of(folds.pairs[k] & FACE, sheet)
        if may_pass(nodes, folds.contacts[k], node, corners, length):
            found = meet(nodes, node, corners, sheet.breadth, length, gap)
            if found[1] == PASSES:
                folds.counts[FoldCount.PIERCED] += 1
                folds.penetration[0] = max(folds.penetration[0], found[0] / sheet.edge)


@kernel
def window_of(model, state):
    """Return the time (s) from a choice of the step, just made, until the next one, when it is looked again."""
    return state.choice[1] * model.courant * state.stable_step[0]


@kernel
def watch_shell(nodes, folds, by_column, n1, n2, stride, h1, h2, radius, window):
    """Update whether folds may meet within a window (s), and return the longest step (s) by their speed.

    As long as each cell, seen from the axis, lies the right way round, the shell is a graph over the cylinder between its held
    rows and cannot meet itself: sure where each generatrix edge climbs and each hoop edge goes round, and neither does as much of
    the other. Rates are taken to last for the window. In a step two nodes then near each other by a quarter cell at most.
    Reads nodes. Writes folds.counts; scratch in by_column.rate, lift.
    """
    x, y, z, u, v, w = nodes.x, nodes.y, nodes.z, nodes.u, nodes.v, nodes.w
    least, speed = by_column.rate, by_column.lift
    climb, turn = UPRIGHT * h1, UPRIGHT * h2 / radius
    columns, above = uint64(n2), uint64(stride)
    for j in range(columns):
        least[j] = 1.0
        speed[j] = 0.0
    for i in range(uint64(n1)):
        start = i * above + uint64(PAD)
        for j in range(columns):
            a = start + j
            b = a + above
            c = a + uint64(1)
            square = x[a] * x[a] + y[a] * y[a]
            up = z[b] - z[a] + window * min(w[b] - w[a], 0.0)
            off = abs(z[c] - z[a]) + window * abs(w[c] - w[a])
            round_rate = u[a] * y[c] + x[a] * v[c] - v[a] * x[c] - y[a] * u[c]
            round = x[a] * y[c] - y[a] * x[c] + window * min(round_rate, 0.0)
            along_rate = u[a] * y[b] + x[a] * v[b] - v[a] * x[b] - y[a] * u[b]
            along = abs(x[a] * y[b] - y[a] * x[b]) + window * abs(along_rate)
            least[j] = min(least[j], up - climb, climb - off, round - turn * square, turn * square - along)
            speed[j] = max(speed[j], u[b] * u[b] + v[b] * v[b] + w[b] * w[b])
    worst, fastest = 1.0, 0.0
    for j in range(n2):
        worst = min(worst, least[j])
        fastest = max(fastest, speed[j])
    return note_watch(folds, int(worst <= 0.0), fastest, min(h1, h2))


@kernel
def watch_meridian(nodes, folds, n1, h1, window):
    """Update whether folds of a meridian may meet within a window (s), and return the longest step (s) by their speed.

    As long as each edge climbs, the meridian is a graph over the axis. As watch_shell.
    """
    z, u, w = nodes.z, nodes.u, nodes.w
    least, fastest = inf, 0.0
    for i in range(n1):
        least = min(least, z[i + 1] - z[i] + window * min(w[i + 1] - w[i], 0.0))
        fastest = max(fastest, u[i + 1] * u[i + 1] + w[i + 1] * w[i + 1])
    return note_watch(folds, int(least <= UPRIGHT * h1), fastest, h1)


@kernel
def note_watch(folds, due, square, edge):
    """Note whether folds may meet; returns the longest step (s) at the largest speed squared (m^2/s^2), if they may."""
    if due == 1 and folds.counts[FoldCount.DUE] == 0:
        folds.counts[FoldCount.STALE] = 1
    folds.counts[FoldCount.DUE] = due
    return 0.125 * edge / sqrt(square) if due == 1 and square > 0.0 else inf
