"""Contact of the folds of the shell with one another: unilateral, smooth, without rebound. Nodes against faces.

After the push of all free rows, impulses at n+1/2 change velocities, and places by what that makes until n+1. A node that would
pass through a face in the step, or come within a gap of it, and the face's corners take equal and opposite impulses along the
normal, which end the closing and no more; pair by pair and over again until none is left (Gauss-Seidel). Continuous detection as
in Bridson, Fedkiw, Anderson 2002, and their order: what never passes is on the side where it was. Edges may cut edges.
"""

from math import inf, sqrt

from softbrake.kernels.contact import GAP, allowed_place, jolt
from softbrake.kernels.course import STEPS_PER_STEP_CHOICE
from softbrake.kernels.jit import kernel
from softbrake.kernels.meet import APART, PASSES, corners_of, meet
from softbrake.kernels.near import find_pairs
from softbrake.state import PAD, Blows, FoldCount, FoldTravel, Sheet

FOLD_GAP = 1e-3  # of an unloaded cell, kept between folds
MARGIN = 0.5  # of an unloaded cell, to which the search looks
AIM = 1.2  # of the impulse needed, after the first passes: a rebound, but fewer passes for pairs that others push back
LEAST_GIVE = 0.01  # of a free node's: a lever shorter than a tenth of a cell would multiply impulses without bound
FORESIGHT = 2.0  # times until the next choice of the step
FIRM = 4  # passes that take what is needed and no more
GENTLE = 12  # passes that look after the gap as well; then what stays too near, as in a narrow wedge, is left there
BESIDE = 1e-9  # part of the cargo's radius
PUSHES = 60  # passes over a meridian, and as many more that merge what still passes
SHELL_PUSHES = 60  # passes over the full shell; what still passes then is counted
CLOSING = 3.0  # two nodes near each other by twice the largest travel, by sqrt(2) more where blows turned it
FACE = 2**32 - 1  # bits of a pair that name the face


@kernel
def part_shell(model, nodes, work, by_column, folds, course, touching):
    """Keep the folds of the full shell apart in the step to n+1.

    Reads model, course; touching: whether cover and cargo are in the way. Writes nodes, work.contact; by_column.kinetic,
    on_cargo, impulse; folds.
    """
    edge = min(model.fabric.h1, model.fabric.h2)
    sheet = sheet_of(model, model.n2, model.stride, PAD, 0.0, edge, touching, 0)
    part_moved(nodes, model.mass, work.contact, by_column.kinetic, folds, course, sheet)
    by_column.on_cargo[0] += folds.impulse[0]
    by_column.impulse[0] += folds.impulse[1]


@kernel
def part_meridian(model, nodes, meridian, folds, course):
    """Keep the folds of a meridian apart in the step to n+1: node i of nodes at radius x, height z; y and v zero.

    Reads model, course. Writes nodes, folds, with the impulses on cargo and ground in folds.impulse; add_contact_work books them.
    """
    contact = model.contact
    touching = (contact.cover == 1 or contact.cargo == 1) and course.next_cover > 0.0
    sheet = sheet_of(model, 1, 1, 0, 0.5 * model.fabric.h1, model.fabric.h1, touching, contact.axis)
    part_moved(nodes, model.mass, meridian.contact, meridian.kinetic, folds, course, sheet)


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
    if folds.counts[FoldCount.DUE] == 0 or course.next_cover <= 0.0:  # the run ends where cover and ground meet
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
    gap = FOLD_GAP * sheet.edge
    travel = course.length * largest_speed(nodes, sheet)
    if not look_around(nodes, folds, sheet, gap, travel):
        folds.counts[FoldCount.FAULT] = 1
        return
    reach = gap + CLOSING * travel
    awake = sort_out(nodes, folds, sheet, course.length, gap, reach)
    tries = 0
    pushed = awake
    most = 2 * PUSHES if sheet.columns == 1 else SHELL_PUSHES
    while pushed > 0 and tries < most:
        pushed = try_pairs(nodes, mass, blows, folds, course, sheet, awake, gap, reach, tries)
        tries += 1
    if pushed > 0:
        book_failure(nodes, folds, sheet, awake, course.length, gap, reach)


@kernel
def largest_speed(nodes, sheet):
    """Return the largest speed (m/s) of a node."""
    u, v, w = nodes.u, nodes.v, nodes.w
    largest = 0.0
    for i in range(1, sheet.rows + 1):
        start = i * sheet.stride + sheet.first
        for a in range(start, start + sheet.columns):
            largest = max(largest, u[a] * u[a] + v[a] * v[a] + w[a] * w[a])
    return sqrt(largest)


@kernel
def look_around(nodes, folds, sheet, gap, travel):
    """Search for near pairs anew where nodes may have come near unseen. Returns whether the pairs are all there.

    Where they are too many for the arrays, the margin is halved; one below what the step closes is of no use.
    """
    counts, totals, wake = folds.counts, folds.travel, folds.wake
    totals[FoldTravel.TOTAL] += travel
    total = totals[FoldTravel.TOTAL]
    if CLOSING * (total - totals[FoldTravel.SEARCHED]) <= totals[FoldTravel.MARGIN]:
        return True
    margin = min(2.0 * totals[FoldTravel.MARGIN], MARGIN * sheet.edge)
    while margin >= CLOSING * travel:
        count = find_pairs(nodes, folds, sheet, margin + gap, sheet.edge)
        counts[FoldCount.SEARCHES] += 1
        if count < 0:
            return False
        if count <= wake.size:
            for k in range(count):
                wake[k] = total + (wake[k] - gap) / CLOSING - travel
            counts[FoldCount.PAIRS] = count
            totals[FoldTravel.SEARCHED] = total
            totals[FoldTravel.MARGIN] = margin
            return True
        margin *= 0.5
    return False


@kernel
def sort_out(nodes, folds, sheet, length, gap, reach):
    """Put the pairs that may meet in this step in front. Returns their number.

    A pair at some distance sleeps until the travel of the nodes can have used it up. Writes folds.pairs, wake.
    """
    pairs, wake, total = folds.pairs, folds.wake, folds.travel[FoldTravel.TOTAL]
    awake = 0
    for k in range(folds.counts[FoldCount.PAIRS]):
        if wake[k] > total:
            continue
        pair = pairs[k]
        corners = corners_of(pair & FACE, sheet)
        distance = meet(nodes, pair >> 32, corners, sheet.breadth, length, gap, 0.0)[0]
        wake[k] = total + (distance - gap) / CLOSING
        if distance <= reach:
            pairs[k], pairs[awake] = pairs[awake], pair
            wake[k], wake[awake] = wake[awake], wake[k]
            awake += 1
    return awake


@kernel
def try_pairs(nodes, mass, blows, folds, course, sheet, awake, gap, reach, tries):
    """Part the pairs that are awake, one after the other. Returns how many of them took an impulse.

    After the first pass only those are looked at of which a node was pushed in this pass or the one before. In the last passes,
    against pairs that still pass, all five nodes take their common velocity. Writes nodes, blows.
    """
    pairs, stamp, counts = folds.pairs, folds.stamp, folds.counts
    before, merge = counts[FoldCount.PASSES], tries >= PUSHES
    counts[FoldCount.PASSES] += 1
    pushed = 0
    for k in range(awake):
        node, corners = pairs[k] >> 32, corners_of(pairs[k] & FACE, sheet)
        a, b, c, d = corners
        if tries > 0 and max(stamp[node], stamp[a], stamp[b], stamp[c], stamp[d]) < before:
            continue
        _, how, slowing, nx, ny, nz, weights = meet(nodes, node, corners, sheet.breadth, course.length, gap, reach)
        if how != APART and (merge or slowing <= 0.0):
            merge_nodes(nodes, mass, blows, course, sheet, before + 1, node, corners)
            pushed += 1
        elif slowing > 0.0 and not merge and (how != APART or tries < GENTLE):
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
    """Return whether a node lies on the cover or at the side of the cargo."""
    x, y, z = nodes.x[node], nodes.y[node], nodes.z[node] - course.next_cover
    on_cover = sheet.cover == 1 and abs(z) <= course.gap and x * x + y * y < sheet.cover_radius**2
    beside = sheet.cargo == 1 and 0.0 < z < sheet.cargo_height and x * x + y * y <= ((1.0 + BESIDE) * sheet.cargo_radius) ** 2
    return on_cover or beside


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
        jolt(nodes, blows, blows, node, slot, m, course.length, pu / m, pv / m, pw / m)
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
        jolt(nodes, blows, blows, node, slot, mass, length, (new_x - x) / length, (new_y - y) / length, rise)
        blows.impulse[0] -= mass * rise
    if sheet.axis == 1 and nodes.x[node] < GAP:
        jolt(nodes, blows, blows, node, slot, mass, length, (GAP - nodes.x[node]) / length, 0.0, 0.0)
    if nodes.z[node] < sheet.ground:
        rise = (sheet.ground - nodes.z[node]) / length
        jolt(nodes, blows, blows, node, slot, mass, length, 0.0, 0.0, rise)
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
def book_failure(nodes, folds, sheet, awake, length, gap, reach):
    """Count the pairs that pass though the passes are used up, and raise the largest penetration, over the unloaded cell."""
    for k in range(awake):
        pair = folds.pairs[k]
        corners = corners_of(pair & FACE, sheet)
        found = meet(nodes, pair >> 32, corners, sheet.breadth, length, gap, reach)
        if found[1] == PASSES:
            folds.counts[FoldCount.PIERCED] += 1
            folds.penetration[0] = max(folds.penetration[0], found[0] / sheet.edge)


@kernel
def window_of(step):
    """Return for how long (s) present speeds are drawn out to foresee folds, steps being so long."""
    return FORESIGHT * STEPS_PER_STEP_CHOICE * step


@kernel
def watch_shell(nodes, folds, by_column, n1, n2, stride, h1, h2, radius, window):
    """Update whether folds may meet within a window (s), and return the longest step (s) by their speed.

    As long as each cell, seen from the axis, lies the right way round, the shell is a graph over the cylinder between its held
    rows and cannot meet itself: sure where each generatrix edge climbs and each hoop edge goes round, and neither does much of
    the other. Rates are taken to last for the window. In a step two nodes then near each other by a quarter cell at most.
    Reads nodes. Writes folds.counts, travel; scratch in by_column.rate, lift.
    """
    x, y, z, u, v, w = nodes.x, nodes.y, nodes.z, nodes.u, nodes.v, nodes.w
    least, speed = by_column.rate, by_column.lift
    climb, slip = 0.2 * h1, 0.05 * h1
    turn, twist = 0.2 * h2 / radius, 0.05 * h2 / radius
    for j in range(n2):
        least[j] = 1.0
        speed[j] = 0.0
    for i in range(n1):
        start = i * stride + PAD
        for j in range(n2):
            a = start + j
            b = a + stride
            c = a + 1
            square = x[a] * x[a] + y[a] * y[a]
            up = z[b] - z[a] + window * min(w[b] - w[a], 0.0)
            off = abs(z[c] - z[a]) + window * abs(w[c] - w[a])
            round_rate = u[a] * y[c] + x[a] * v[c] - v[a] * x[c] - y[a] * u[c]
            round = x[a] * y[c] - y[a] * x[c] + window * min(round_rate, 0.0)
            along_rate = u[a] * y[b] + x[a] * v[b] - v[a] * x[b] - y[a] * u[b]
            along = abs(x[a] * y[b] - y[a] * x[b]) + window * abs(along_rate)
            least[j] = min(least[j], up - climb, slip - off, round - turn * square, twist * square - along)
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
    return note_watch(folds, int(least <= 0.2 * h1), fastest, h1)


@kernel
def note_watch(folds, due, square, edge):
    """Note whether folds may meet; returns the longest step (s) at the largest speed squared (m^2/s^2)."""
    if due == 1 and folds.counts[FoldCount.DUE] == 0:
        folds.travel[FoldTravel.SEARCHED] = -inf
    folds.counts[FoldCount.DUE] = due
    return 0.125 * edge / sqrt(square) if square > 0.0 else inf
