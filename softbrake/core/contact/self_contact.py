"""Contact of the folds of the shell with one another: unilateral, smooth, without rebound. Nodes meet faces, edges meet edges.

After the push of all free rows, impulses at n+1/2 change velocities, and places by what that makes until n+1. Faces and edges
have thicknesses: a pair that would come nearer than these are thick takes equal and opposite impulses along the line between its
nearest points at n, which end the closing and give back half of what the thickness is pressed in; pair after pair, a few times
over (Gauss-Seidel). What would pass all the same is found by continuous detection, and parted when and where it does, until none
is left. After Bridson, Fedkiw, Anderson, Robust treatment of collisions, contact and friction for cloth animation (2002), and
their order: what never passes is on the side where it was.
"""

from math import inf, sqrt

from numba import uint64

from softbrake.core.arrays import PAD, ContactCount, Impulses, Sheet
from softbrake.core.contact.broad_phase import find_pairs
from softbrake.core.contact.impulses import GAP_PASSED, available_space, may_pass, rigidify, separate_pair
from softbrake.core.contact.narrow_phase import (
    APART,
    EDGES,
    PASSES,
    SECOND,
    SMALLEST,
    closing_along,
    detect_collision,
    members_of,
    nearest,
    seen_from,
)
from softbrake.core.jit import kernel

THICKNESS = 0.02  # of an unloaded cell, kept between folds; of what is left between ground and cover where that is less
SPRING = 0.5  # of what a thickness is pressed in, given back in a step,
REBOUND = 0.5  # but at no more than this part of the speed of closing: what rests in it is left there
THICKNESS_PASSES = 4  # passes over the thicknesses
AIM = 1.2  # of the impulse needed, after the first passes: a rebound, but fewer passes for pairs that others push back
LAST = 10.0  # of the gap kept from the cover: in less space above the ground, in the last few steps, folds no longer meet
FIRM = 4  # passes that take what is needed and no more
PUSHES = 60  # passes over what would pass a face, and as many more over a meridian; what still does then is counted
TINY = 1e-3  # of the thickness; nearer than this the direction from face to node says nothing
REST = 0.1  # of an unloaded cell, margin of a node at rest in the search
STEPS = 10.0  # steps at the present speed, margin of one that moves
SLACK = 1.25  # on the travel before contact: impulses make some nodes faster
WIDEST, LEAST = 2.0, 0.125  # by which margins are scaled
FEW, MANY = 0.3, 3.0  # pairs per face
UPRIGHT = 0.1  # of an unloaded cell, that each edge climbs or goes round at least where no folds can meet


@kernel
def resolve_self_contact(model, nodes, work, by_column, impulse, self_contact, step, touching):
    """Keep the folds of the full shell apart in the step to n+1, where they are asked for: self_contact is not None.

    Reads model, step; touching: whether cover and cargo are in the way. Writes nodes, work.contact; by_column.kinetic; impulse
    (N s, upwards: on the cargo, of the ground on the fabric); self_contact.
    """
    if self_contact is None:  # decided by type: the rest is not compiled
        return
    sheet = shell_sheet(model, touching)
    resolve_under_cover(
        nodes, model.mass, Impulses(work.contact, by_column.kinetic, impulse, self_contact.stamp), self_contact, step, sheet
    )


@kernel
def resolve_self_contact_of_meridian(model, nodes, meridian, self_contact, step):
    """Keep the folds of a meridian apart in the step to n+1: node i of nodes at radius x, height z; y and v zero.

    Reads model, step. Writes nodes, self_contact, meridian.impulse. Returns whether a node may have moved, for
    add_contact_work_of_meridian to record; nothing is done where self_contact is None.
    """
    if self_contact is None:
        return 0
    sheet = meridian_sheet(model, step)
    resolve_under_cover(
        nodes,
        model.mass,
        Impulses(meridian.contact, meridian.kinetic, meridian.impulse, self_contact.stamp),
        self_contact,
        step,
        sheet,
    )
    return self_contact.counts[ContactCount.DUE]


@kernel
def shell_sheet(model, touching):
    """Return the Sheet of a shell; touching: whether cover and cargo are in the way."""
    edge = min(model.fabric.h1, model.fabric.h2)
    return sheet_of(model, model.n2, model.stride, PAD, 0.0, edge, touching, 0)


@kernel
def meridian_sheet(model, step):
    """Return the Sheet of a meridian in the step."""
    contact, edge = model.contact, model.fabric.h1
    touching = (contact.cover == 1 or contact.cargo == 1) and step.next_cover > step.gap
    return sheet_of(model, 1, 1, 0, 0.5 * edge, edge, touching, contact.axis)


@kernel
def sheet_of(model, columns, stride, first, breadth, edge, touching, axis):
    """Return the Sheet of a model: its faces, and what else is in the way."""
    wall, there = model.contact, int(touching)
    round_wall = (wall.cover * there, wall.cover_radius, wall.cargo * there, wall.cargo_radius, wall.cargo_height)
    return Sheet(model.n1, columns, stride, first, breadth, edge, wall.ground, *round_wall, axis)


@kernel
def resolve_under_cover(nodes, mass, impulses, self_contact, step, sheet):
    """Keep folds apart, while the row on the cover, which is pushed last, stands where it is foreseen. See resolve_pairs."""
    if self_contact.counts[ContactCount.DUE] == 0 or step.next_cover - sheet.ground <= LAST * step.gap:
        return
    top = sheet.rows * sheet.stride + sheet.first
    copies = int(sheet.columns > 1)
    old, speed = nodes.w[top], (step.next_cover - step.cover) / step.length
    for a in range(top - copies, top + sheet.columns + copies):
        nodes.z[a] = step.next_cover
        nodes.w[a] = speed
    resolve_pairs(nodes, mass, impulses, self_contact, step, sheet)
    for a in range(top - copies, top + sheet.columns + copies):
        nodes.z[a] = step.cover
        nodes.w[a] = old


@kernel
def resolve_pairs(nodes, mass, impulses, self_contact, step, sheet):
    """Keep the folds apart in the step to n+1. Reads mass (kg, by row). Writes nodes, impulses, self_contact."""
    counts, length = self_contact.counts, step.length
    if add_travel(nodes, self_contact, sheet, length) or counts[ContactCount.STALE] == 1:
        update_pairs(self_contact, nodes, sheet)
    active = activate_pairs(nodes, self_contact, step, sheet)
    if active == (0, 0):
        return
    for _ in range(THICKNESS_PASSES):
        counts[ContactCount.PASSES] += 1
        for k in range(active[0] + active[1]):
            keep_thickness(nodes, mass, impulses, self_contact, step, sheet, slot_of(k, active, self_contact))
    tries, pushed, stuck, most = 0, 1, 0, PUSHES if sheet.columns > 1 else 2 * PUSHES
    while pushed > 0 and tries < most:
        pushed, stuck = try_pairs(nodes, mass, impulses, self_contact, step, sheet, active, tries)
        tries += 1
    if pushed + stuck > 0:
        record_missed_collisions(nodes, self_contact, step, sheet, active)


@kernel
def add_travel(nodes, self_contact, sheet, length):
    """Add what the nodes travel in the step (s) to their paths. Returns whether one has used up its margin.

    Writes self_contact.step, path, face_step, face_path.
    """
    u, v, w, path, step, margin = nodes.u, nodes.v, nodes.w, self_contact.path, self_contact.step, self_contact.margin
    used_up, count = 0, uint64(sheet.columns + int(sheet.columns > 1))
    for i in range(uint64(sheet.rows + 1)):
        start = i * uint64(sheet.stride) + uint64(sheet.first)
        for a in range(start, start + count):
            way = SLACK * length * sqrt(u[a] * u[a] + v[a] * v[a] + w[a] * w[a])
            step[a] = way
            path[a] += way
            used_up |= int(path[a] > margin[a])
    if self_contact.counts[ContactCount.PAIRS] > 0:
        update_faces(self_contact, sheet)
    return used_up > 0


@kernel
def update_faces(self_contact, sheet):
    """Write the largest path and step of the corners of each face, by its lower left one; rows end in copies, and padding."""
    path, step, face_path, face_step = self_contact.path, self_contact.step, self_contact.face_path, self_contact.face_step
    above, right = uint64(sheet.stride), uint64(sheet.columns > 1)
    for a in range(uint64(path.size) - above - right):
        b, c, d = a + right, a + above, a + above + right
        face_path[a] = max(path[a], path[b], path[c], path[d])
        face_step[a] = max(step[a], step[b], step[c], step[d])
    for a in range(uint64(path.size) - above - right, uint64(path.size)):  # a row of nodes above all faces, each as the cover
        face_path[a] = path[a]
        face_step[a] = step[a]


@kernel
def update_pairs(self_contact, nodes, sheet):
    """Search for near pairs anew: all that may meet before a node has travelled its margin.

    The fewer pairs there are, the wider the margins, and the later the next search. Where the arrays do not hold them all,
    margins are narrowed for now, and the arrays enlarged before the next step.
    """
    counts, scale, path, margin = self_contact.counts, self_contact.scale, self_contact.path, self_contact.margin
    for a in range(path.size):
        path[a] = self_contact.step[a]  # what is searched for stands at n+1, what meets at n
    count = -1
    while count < 0 or (count > self_contact.pairs.size and scale[0] > LEAST):
        scale[0] *= 1.0 if count < 0 else 0.5
        for a in range(path.size):
            margin[a] = scale[0] * (REST * sheet.edge + STEPS * self_contact.step[a])
        count = find_pairs(nodes, self_contact, sheet, THICKNESS * sheet.edge)
        counts[ContactCount.SEARCHES] += 1
        if count > self_contact.pairs.size:
            counts[ContactCount.OVERFLOW] = 1
    faces = sheet.rows * sheet.columns
    if count < FEW * faces:
        scale[0] = min(2.0 * scale[0], WIDEST)
    elif count > MANY * faces:
        scale[0] = max(0.5 * scale[0], 1.0)
    counts[ContactCount.PAIRS] = min(count, self_contact.pairs.size)
    counts[ContactCount.STALE] = 0
    update_faces(self_contact, sheet)


@kernel
def activate_pairs(nodes, self_contact, step, sheet):
    """Find the pairs that may meet in this step, and how they stand at n. Returns how many of each kind.

    A pair at some distance is active once it can have travelled it. Slots of self_contact.active and contacts are taken from the
    front by nodes and faces, from the end by edges. Writes self_contact.active_from, active, contacts.
    """
    pairs, active_from, contacts = self_contact.pairs, self_contact.active_from, self_contact.contacts
    thick, length = THICKNESS * available_space(step, sheet), step.length
    front, back = 0, 0
    for k in range(self_contact.counts[ContactCount.PAIRS]):
        pair = pairs[k]
        travelled = travel_of(self_contact.path, self_contact.face_path, pair)
        if travelled < active_from[k]:
            continue
        edges, node, corners = members_of(pair, sheet)
        start = seen_from(nodes, node, corners, sheet.breadth, length)
        distance, x, y, z, weights, presses = nearest(edges, start)
        travel = travel_of(self_contact.step, self_contact.face_step, pair)
        active_from[k] = travelled - travel + distance - thick
        if distance > thick + travel:
            continue
        front, back = front + int(not edges), back + int(edges)
        slot = pairs.size - back if edges else front - 1
        self_contact.active[slot] = pair
        write_contact(contacts[slot], edges, start, distance, x, y, z, weights, presses, thick, length)
    return front, back


@kernel
def slot_of(k, active, self_contact):
    """Return the slot of the k-th pair active: nodes and faces first, for edges then often find nothing left to part."""
    return k if k < active[0] else self_contact.active.size - 1 - (k - active[0])


@kernel
def travel_of(nodes, faces, pair):
    """Return what node and face, or two edges, travel together (m), by the ways of nodes and those of faces."""
    if pair & EDGES == 0:
        return nodes[pair >> 32] + faces[pair & SECOND]
    return faces[(pair ^ EDGES) >> 33] + faces[(pair & SECOND) >> 1]


@kernel
def write_contact(contact, edges, start, distance, x, y, z, weights, presses, thick, length):
    """Write how a pair stands at n, see SelfContact.contacts.

    x, y, z (m): from the face to the node; start: corners seen from it.
    """
    scale = 1.0 / max(distance, SMALLEST)
    qx, qy, qz = start
    own, reach = 0.0, scale * (x * qx[0] + y * qy[0] + z * qz[0])
    if edges:
        own, reach = min(reach, 0.0), -inf
    for k in range(1, 4):
        reach = max(reach, scale * (x * qx[k] + y * qy[k] + z * qz[k]))
    reach -= own
    allowed = (distance - thick) / length
    contact[0], contact[1], contact[2] = scale * x, scale * y, scale * z
    contact[3], contact[4], contact[5], contact[6] = weights
    contact[7] = inf if not presses else allowed if allowed > 0.0 else SPRING * allowed
    contact[8] = reach if distance > TINY * thick else inf


@kernel
def keep_thickness(nodes, mass, impulses, self_contact, step, sheet, slot):
    """Take from a pair what it closes faster than its thickness allows.

    No energy arises, since it never parts faster than it closed. Writes nodes, impulses.
    """
    contact = self_contact.contacts[slot]
    if contact[8] == inf:
        return
    _, node, corners = members_of(self_contact.active[slot], sheet)
    nx, ny, nz, weights = contact[0], contact[1], contact[2], (contact[3], contact[4], contact[5], contact[6])
    closing = closing_along(nodes, node, corners, weights, nx, ny, nz)
    slowing = min(closing - contact[7], (1.0 + REBOUND) * closing)
    if slowing > 0.0:
        now = self_contact.counts[ContactCount.PASSES]
        separate_pair(nodes, mass, impulses, step, sheet, now, node, corners, weights, slowing, nx, ny, nz)


@kernel
def try_pairs(nodes, mass, impulses, self_contact, step, sheet, active, tries):
    """Part the pairs that would pass, one after the other. Returns how many of them took an impulse, and how many could not.

    After the first pass only those are looked at of which a node was pushed in this pass or the one before. What no impulse
    along the normal parts takes its common velocity, as does all that still passes in the last passes over a meridian.
    Writes nodes, impulses.
    """
    stamp, counts = self_contact.stamp, self_contact.counts
    before = counts[ContactCount.PASSES]
    counts[ContactCount.PASSES] += 1
    gap, pushed, stuck = GAP_PASSED * available_space(step, sheet), 0, 0
    for k in range(active[0] + active[1]):
        slot = slot_of(k, active, self_contact)
        edges, node, corners = members_of(self_contact.active[slot], sheet)
        a, b, c, d = corners
        if tries > 0 and max(stamp[node], stamp[a], stamp[b], stamp[c], stamp[d]) < before:
            continue
        if not may_pass(nodes, self_contact.contacts[slot], edges, node, corners, step.length):
            continue
        _, how, slowing, nx, ny, nz, weights = detect_collision(nodes, edges, node, corners, sheet.breadth, step.length, gap)
        if how == APART:
            continue
        if tries >= PUSHES or slowing <= 0.0:
            rigidify(nodes, mass, impulses, step, sheet, before + 1, node, corners)
            pushed += 1
        else:
            aim = slowing if tries < FIRM else AIM * slowing
            parted = separate_pair(nodes, mass, impulses, step, sheet, before + 1, node, corners, weights, aim, nx, ny, nz)
            pushed, stuck = pushed + parted, stuck + 1 - parted
    return pushed, stuck


@kernel
def record_missed_collisions(nodes, self_contact, step, sheet, active):
    """Count the pairs that pass though the passes are used up, and raise the largest penetration, over the unloaded cell."""
    gap, length = GAP_PASSED * available_space(step, sheet), step.length
    for k in range(active[0] + active[1]):
        slot = slot_of(k, active, self_contact)
        edges, node, corners = members_of(self_contact.active[slot], sheet)
        if may_pass(nodes, self_contact.contacts[slot], edges, node, corners, length):
            found = detect_collision(nodes, edges, node, corners, sheet.breadth, length, gap)
            if found[1] == PASSES:
                self_contact.counts[ContactCount.MISSED] += 1
                self_contact.penetration[0] = max(self_contact.penetration[0], found[0] / sheet.edge)


@kernel
def window_of(model, state):
    """Return the time (s) from a choice of the step, just made, until the next one, when it is looked again."""
    return state.choice[1] * model.courant * state.stable_step[0]


@kernel
def watch_shell(nodes, self_contact, by_column, n1, n2, stride, h1, h2, radius, window):
    """Update whether folds may meet within a window (s), and return the longest step (s) by their speed.

    As long as each cell, seen from the axis, lies the right way round, the shell is a graph over the cylinder between its held
    rows and cannot meet itself: sure where each generatrix edge climbs and each hoop edge goes round, and neither does as much of
    the other. Rates are taken to last for the window. In a step two nodes then near each other by a quarter cell at most.
    Reads nodes. Writes self_contact.counts; scratch in by_column.rate, ground_impulse. No step is too long where self_contact is
    None.
    """
    if self_contact is None:
        return inf
    x, y, z, u, v, w = nodes.x, nodes.y, nodes.z, nodes.u, nodes.v, nodes.w
    least, speed = by_column.rate, by_column.ground_impulse
    refine, turn = UPRIGHT * h1, UPRIGHT * h2 / radius
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
            least[j] = min(least[j], up - refine, refine - off, round - turn * square, turn * square - along)
            speed[j] = max(speed[j], u[b] * u[b] + v[b] * v[b] + w[b] * w[b])
    worst, fastest = 1.0, 0.0
    for j in range(n2):
        worst = min(worst, least[j])
        fastest = max(fastest, speed[j])
    return note_watch(self_contact, int(worst <= 0.0), fastest, min(h1, h2))


@kernel
def watch_meridian(nodes, self_contact, n1, h1, window):
    """Update whether folds of a meridian may meet within a window (s), and return the longest step (s) by their speed.

    As long as each edge climbs, the meridian is a graph over the axis. As watch_shell.
    """
    if self_contact is None:
        return inf
    z, u, w = nodes.z, nodes.u, nodes.w
    least, fastest = inf, 0.0
    for i in range(n1):
        least = min(least, z[i + 1] - z[i] + window * min(w[i + 1] - w[i], 0.0))
        fastest = max(fastest, u[i + 1] * u[i + 1] + w[i + 1] * w[i + 1])
    return note_watch(self_contact, int(least <= UPRIGHT * h1), fastest, h1)


@kernel
def self_contact_due(self_contact):
    """Return whether folds are asked for and may meet."""
    if self_contact is None:
        return False
    return self_contact.counts[ContactCount.DUE] == 1


@kernel
def overflown(self_contact):
    """Return whether the arrays are too small for the pairs there are."""
    if self_contact is None:
        return False
    return self_contact.counts[ContactCount.OVERFLOW] == 1


@kernel
def note_watch(self_contact, due, square, edge):
    """Note whether folds may meet; returns the longest step (s) at the largest speed squared (m^2/s^2), if they may."""
    if due == 1 and self_contact.counts[ContactCount.DUE] == 0:
        self_contact.counts[ContactCount.STALE] = 1
    self_contact.counts[ContactCount.DUE] = due
    return 0.125 * edge / sqrt(square) if due == 1 and square > 0.0 else inf
