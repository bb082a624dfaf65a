"""Self-contact of the shell: unilateral, smooth, without rebound. Nodes against faces, edges against edges.

After the push of all free rows, impulses at n+1/2 change velocities, and places by what that makes until n+1. The cloth has a
thickness: an active pair that would come nearer than that takes equal and opposite impulses along the line between its nearest
points at n, which end the closing and give back half of what the thickness is compressed; pair after pair, a few times over
(Gauss-Seidel). What would pass all the same is found by continuous collision detection, and separated when and where it does,
until none is left or the passes are used up: missed collisions. After Bridson, Fedkiw, Anderson, Robust treatment of collisions,
contact and friction for cloth animation (2002), and their order: what never passes is on the side where it was.
"""

from math import inf, sqrt

from numba import float32, float64, uint64

from softbrake.core.arrays import PAD, ContactCount, Impulses, Meeting, Place
from softbrake.core.contact.broad_phase import find_pairs
from softbrake.core.contact.constants import (
    BATCH,
    COLLISION_GAP,
    COLLISION_PASSES,
    EXACT_PASSES,
    FEW_PAIRS,
    IDLE_STEPS,
    LAST_SPACE,
    MANY_PAIRS,
    MARGIN_STEPS,
    MOST_SCALE,
    NEARLY_THERE,
    OVERRELAXATION,
    REST_MARGIN,
    SINGLE,
    SMALLEST,
    SPRING,
    THICKNESS,
    THICKNESS_PASSES,
    THICKNESS_REBOUND,
    TINY_THICKNESS,
    UPRIGHT,
    WATCHED_TRAVEL,
)
from softbrake.core.contact.impact_zones import NO_ZONE, join_zone, settle_zones
from softbrake.core.contact.impulses import clear_of, may_pass, separate_pair
from softbrake.core.contact.narrow_phase import Found, closing_along, detect_collision, find_nearest
from softbrake.core.contact.pairs import PairState, load_state, nodes_in, nodes_of, store_state
from softbrake.core.contact.records import add_travel, load_records, step_since, store_records, update_faces
from softbrake.core.contact.scene import available_space, scene_of_meridian, scene_of_shell
from softbrake.core.jit import kernel
from softbrake.core.lanes import ONE


@kernel
def resolve_self_contact(model, nodes, work, by_column, impulse, self_contact, step, touching):
    """Resolve self-contact of the full shell since the last contact, where it is asked for: self_contact is not None.

    Reads model, step; touching: whether cover and cargo are in the way. Writes nodes, work.contact; by_column.kinetic; impulse
    (N s, upwards: on the cargo, of the ground on the fabric); self_contact.
    """
    if self_contact is None:  # decided by type: the rest is not compiled
        return
    impulses = Impulses(work.contact, by_column.kinetic, impulse)
    resolve_under_cover(nodes, impulses, self_contact, scene_of_shell(model, step_since(self_contact, step), touching))


@kernel
def resolve_self_contact_of_meridian(model, nodes, meridian, self_contact, step):
    """Resolve self-contact of a meridian in the step to n+1: node i of nodes at radius x, height z; y and v zero.

    Reads model, step. Writes nodes, self_contact, meridian.contact, kinetic, impulse. Returns whether a node may have moved, for
    add_contact_work_of_meridian to record; nothing is done where self_contact is None.
    """
    if self_contact is None:
        return 0
    impulses = Impulses(meridian.contact, meridian.kinetic, meridian.impulse)
    resolve_under_cover(nodes, impulses, self_contact, scene_of_meridian(model, step_since(self_contact, step)))
    return self_contact.counts[ContactCount.DUE]


@kernel
def resolve_under_cover(nodes, impulses, self_contact, scene):
    """Resolve self-contact while the row on the cover, which is pushed last, stands where it is foreseen. See resolve_pairs."""
    step, sheet = scene.step, scene.sheet
    if self_contact.counts[ContactCount.DUE] == 0 or step.next_cover <= LAST_SPACE:
        return
    top = sheet.rows * sheet.stride + sheet.first
    copies = int(sheet.columns > 1)
    old_height, old, speed = nodes.z[top], nodes.w[top], (step.next_cover - step.cover) / step.length
    for a in range(top - copies, top + sheet.columns + copies):
        nodes.z[a] = step.next_cover
        nodes.w[a] = speed
    if resolve_pairs(nodes, impulses, self_contact, scene):
        self_contact.since[0], self_contact.since[1] = step.length, step.cover
        self_contact.counts[ContactCount.OPEN] += 1
    else:
        if self_contact.counts[ContactCount.ACTIVE] > 0:
            store_records(nodes, impulses, self_contact, scene)
            self_contact.since[2] = self_contact.since[0]
        self_contact.counts[ContactCount.OPEN] = 0
    for a in range(top - copies, top + sheet.columns + copies):
        nodes.z[a] = old_height
        nodes.w[a] = old


@kernel
def resolve_pairs(nodes, impulses, self_contact, scene):
    """Resolve self-contact since the last contact, in the records of the nodes. Returns whether there was no room for all pairs.

    Then nothing has been done yet. Reads nodes, scene. Writes impulses, self_contact.
    """
    counts, sheet, record, active = self_contact.counts, scene.sheet, self_contact.record, self_contact.active
    if add_travel(nodes, self_contact, scene) or counts[ContactCount.STALE] == 1:
        update_pairs(self_contact, nodes, sheet)
    counts[ContactCount.ACTIVE] = 0
    if counts[ContactCount.FACES] + counts[ContactCount.EDGES] == 0:
        return False
    load_records(nodes, self_contact, scene)
    if overflown(self_contact):
        return True
    update_faces(self_contact, sheet)
    thick, gap, length = THICKNESS * available_space(scene), COLLISION_GAP * available_space(scene), scene.step.length
    faces = activate_pairs(self_contact, sheet, False, thick, length, 0)
    count = activate_pairs(self_contact, sheet, True, thick, length, faces)
    counts[ContactCount.ACTIVE] = count
    if count > active.nodes.shape[0]:
        return True
    clear = clear_of(scene)
    now = 0
    for _ in range(THICKNESS_PASSES if count > 0 else 0):
        now += 1
        keep_thickness(record, impulses, active, scene, clear, now, count)
    tries, passing, zone = 0, count, self_contact.zone
    while passing > 0 and tries < COLLISION_PASSES:
        now += 1
        passing = separate_pairs(record, impulses, active, scene, clear, (faces, count, now, tries), gap)
        tries += 1
    if passing > 0:
        zone[:] = NO_ZONE
    while passing > 0 and tries < 2 * COLLISION_PASSES:
        now += 1
        passing = find_zones(record, active, scene, zone, faces, count, gap)
        settle_zones(record, impulses, scene, zone, now)
        tries += 1
    counts[ContactCount.PASSES] += now
    if passing > 0:
        record_missed_collisions(self_contact, scene, faces, count, gap)
    return False


@kernel
def update_pairs(self_contact, nodes, sheet):
    """Search for near pairs anew (broad phase): all that may become active before a node has travelled its margin.

    The fewer pairs there are, the wider the margins, and the later the next search. Reads nodes, sheet. Writes self_contact.
    """
    counts, scale, margin = self_contact.counts, self_contact.scale, self_contact.margin
    path, reached, travel = self_contact.path, self_contact.reached, self_contact.travel
    steps = MARGIN_STEPS / (counts[ContactCount.OPEN] + 1)
    for a in range(uint64(margin.size)):
        path[a] = travel[a]
        reached[a] = travel[a]  # what is searched for stands at n+1, what is active at the last contact
        margin[a] = scale[0] * (REST_MARGIN * sheet.edge + steps * travel[a])
    find_pairs(nodes, self_contact, sheet, THICKNESS * sheet.edge)
    counts[ContactCount.SEARCHES] += 1
    counts[ContactCount.STALE] = 0
    count, faces = counts[ContactCount.FACES] + counts[ContactCount.EDGES], sheet.rows * sheet.columns
    if count < FEW_PAIRS * faces:
        scale[0] = min(2.0 * scale[0], MOST_SCALE)
    elif count > MANY_PAIRS * faces:
        scale[0] = max(0.5 * scale[0], 1.0)


@kernel
def activate_pairs(self_contact, sheet, edges, thick, length, count):
    """Find the active pairs of one kind, and how they stood at the last contact, and add them to so many. Returns how many then.

    A pair at some distance is active once it can have travelled it. All are counted, but only those written for which
    self_contact.active has room. edges: whether those of two edges; thick: thickness, m; length: since then, s. Writes
    self_contact.pairs.active_from, active.
    """
    pairs, reached, due, counts = self_contact.pairs, self_contact.reached, self_contact.due, self_contact.counts
    first, second, active_from = pairs.first, pairs.second, pairs.active_from
    size, lines = uint64(self_contact.margin.size), counts[ContactCount.EDGES]
    k, end = uint64(first.size - lines if edges else 0), uint64(first.size if edges else counts[ContactCount.FACES])
    offset, shift = size if edges else uint64(0), uint64(1 if edges else 0)  # travel of edges is that of their faces
    while k < end:
        found = uint64(0)
        while k < end and found + uint64(BATCH // 8) < uint64(BATCH):
            for m in range(k, min(k + uint64(BATCH) - found, end)):
                due[0, found] = m
                way = reached[offset + (uint64(first[m]) >> shift)] + reached[size + (uint64(second[m]) >> shift)]
                found += uint64(way >= active_from[m])
                k = m + ONE
        gather(self_contact, sheet, edges, found)
        find_nearest(edges, self_contact.given, self_contact.found, found)
        count = sort_out(self_contact, sheet, edges, thick, length, found, count)
    return count


@kernel
def gather(self_contact, sheet, edges, count):
    """Write the corners' places (m) at the last contact, as seen from the node, of the pairs due to self_contact.given."""
    given, record, due, pairs = self_contact.given, self_contact.record, self_contact.due, self_contact.pairs
    for i in range(count):
        k = uint64(due[0, i])
        n, a, b, c, d = nodes_of(edges, uint64(pairs.first[k]), uint64(pairs.second[k]), sheet)
        px, py, pz = record.place[n, Place.X], record.place[n, Place.Y], record.place[n, Place.Z]
        low, high = py + sheet.breadth, py - sheet.breadth
        given[0, i], given[1, i] = record.place[a, Place.X] - px, record.place[b, Place.X] - px
        given[2, i], given[3, i] = record.place[c, Place.X] - px, record.place[d, Place.X] - px
        given[4, i], given[5, i] = record.place[a, Place.Y] - low, record.place[b, Place.Y] - high
        given[6, i], given[7, i] = record.place[c, Place.Y] - high, record.place[d, Place.Y] - low
        given[8, i], given[9, i] = record.place[a, Place.Z] - pz, record.place[b, Place.Z] - pz
        given[10, i], given[11, i] = record.place[c, Place.Z] - pz, record.place[d, Place.Z] - pz


@kernel
def sort_out(self_contact, sheet, edges, thick, length, some, count):
    """Let the pairs due, whose nearest points are found, wait until they may meet, or add them to so many active ones.

    Returns how many there are then.
    """
    found, given, due, pairs, active = (
        self_contact.found,
        self_contact.given,
        self_contact.due,
        self_contact.pairs,
        self_contact.active,
    )
    reached, travel, home, size = self_contact.reached, self_contact.travel, self_contact.home, uint64(self_contact.margin.size)
    offset, shift, kept = size if edges else uint64(0), uint64(1 if edges else 0), uint64(0)
    for i in range(some):
        k = uint64(due[0, i])
        one, other = offset + (uint64(pairs.first[k]) >> shift), size + (uint64(pairs.second[k]) >> shift)
        over, way = found[0, i] - thick, travel[one] + travel[other]
        pairs.active_from[k] = float32(reached[one] + reached[other] - way + over - SINGLE * found[0, i])
        due[1, kept] = i
        kept += uint64(over <= way)
    for m in range(kept):
        i, slot = uint64(due[1, m]), uint64(count)
        count += 1
        if slot >= uint64(active.nodes.shape[0]):
            continue
        k = uint64(due[0, i])
        nodes = nodes_of(edges, uint64(pairs.first[k]), uint64(pairs.second[k]), sheet)
        for corner in range(5):
            active.nodes[slot, corner] = home[nodes[corner]]
        store_state(active.state, slot, state_of(edges, given, found, i, thick, length))
    return count


@kernel
def state_of(edges, given, found, i, thick, length):
    """Return the PairState at the last contact of pair i of given, found, with a thickness (m), for a time since (s)."""
    distance, scale = found[0, i], 1.0 / max(found[0, i], SMALLEST)
    # Rounded as it will be stored: what reaches over along another normal would not be seen.
    x, y, z = float64(float32(scale * found[1, i])), float64(float32(scale * found[2, i])), float64(float32(scale * found[3, i]))
    r0 = x * given[0, i] + y * given[4, i] + z * given[8, i]
    r1 = x * given[1, i] + y * given[5, i] + z * given[9, i]
    r2 = x * given[2, i] + y * given[6, i] + z * given[10, i]
    r3 = x * given[3, i] + y * given[7, i] + z * given[11, i]
    upper = max(max(r1, r2), r3)
    reach = upper - min(r0, 0.0) if edges else max(r0, upper)
    allowed = (distance - thick) / length
    return PairState(
        (x, y, z),
        (found[4, i], found[5, i], found[6, i], found[7, i]),
        inf if found[8, i] == 0.0 else allowed if allowed > 0.0 else SPRING * allowed,
        (1.0 - SINGLE) * reach if distance > TINY_THICKNESS * thick else inf,
    )


@kernel
def keep_thickness(record, impulses, active, scene, clear, now, count):
    """Take from active pairs what they close faster than their thickness allows, one after the other.

    No energy arises, since they never separate faster than they closed. Reads active, scene; now: the pass. Writes record,
    impulses.
    """
    for slot in range(count):
        state, nodes = load_state(active.state, slot), nodes_in(slot, active)
        closing = closing_along(record, nodes, state.weights, state.normal)
        slowing = min(closing - state.allowed, (1.0 + THICKNESS_REBOUND) * closing)
        if slowing > 0.0 and state.reach < inf:
            separate_pair(record, impulses, scene, clear, now, nodes, state.weights, slowing, state.normal)


@kernel
def separate_pairs(record, impulses, active, scene, clear, which, gap):
    """Separate the active pairs that would pass, one after the other. Returns how many there were.

    After the first pass only those are looked at of which a node was pushed in this pass or the one before.
    which: the number of pairs of a node and a face, of all, the pass, and how many were made before. Writes record, impulses.
    """
    faces, count, now, tries = which
    passing, before, stamp = 0, now - 1, record.stamp
    for slot in range(count):
        nodes, edges = nodes_in(slot, active), slot >= faces
        n, a, b, c, d = nodes
        if tries > 0 and max(max(max(stamp[n], stamp[a]), stamp[b]), max(stamp[c], stamp[d])) < before:
            continue
        if not may_pass(record, nodes, edges, load_state(active.state, slot), scene.step.length):
            continue
        collision = detect_collision(record, nodes, edges, scene, gap)
        if collision.found != Found.APART:
            slowing = collision.slowing if tries < EXACT_PASSES else OVERRELAXATION * collision.slowing
            separate_pair(record, impulses, scene, clear, now, nodes, collision.weights, slowing, collision.normal)
            passing += 1
    return passing


@kernel
def find_zones(record, active, scene, zone, faces, count, gap):
    """Make zones of the active pairs that still pass. Returns how many there were. Reads record, active, scene. Writes zone."""
    passing = 0
    for slot in range(count):
        nodes, edges = nodes_in(slot, active), slot >= faces
        if not may_pass(record, nodes, edges, load_state(active.state, slot), scene.step.length):
            continue
        if detect_collision(record, nodes, edges, scene, gap).found == Found.PASSES:
            join_zone(zone, nodes)
            passing += 1
    return passing


@kernel
def record_missed_collisions(self_contact, scene, faces, count, gap):
    """Count the pairs that pass though the passes are used up, and raise the largest penetration, over the unloaded cell.

    Reads self_contact.record, active, scene. Writes self_contact.counts[MISSED], penetration.
    """
    record, active = self_contact.record, self_contact.active
    for slot in range(count):
        nodes, edges = nodes_in(slot, active), slot >= faces
        if may_pass(record, nodes, edges, load_state(active.state, slot), scene.step.length):
            collision = detect_collision(record, nodes, edges, scene, gap)
            if collision.found == Found.PASSES:
                self_contact.counts[ContactCount.MISSED] += 1
                deepest = max(self_contact.penetration[0], collision.distance / scene.sheet.edge)
                self_contact.penetration[0] = deepest


@kernel
def window_of(model, state):
    """Return the time (s) from a choice of the step, just made, until the next one, when it is looked again."""
    return state.choice[1] * model.courant * state.stable_step[0]


@kernel
def watch_shell(model, nodes, self_contact, by_column, window):
    """Update whether self-contact is possible within a window (s), and return the longest step (s) by the nodes' speed.

    As long as each cell, seen from the axis, lies the right way round, the shell is a graph over a cylinder between its held
    rows and cannot touch itself: sure where each generatrix edge climbs and each hoop edge goes round, and neither does as much
    of the other. Rates are taken to last for the window. In a step two nodes then near each other by a quarter cell at most.
    Reads model, nodes. Writes self_contact.counts; scratch in by_column.rate, ground_impulse. No step is too long where
    self_contact is None.
    """
    if self_contact is None:
        return inf
    n1, n2, stride, shape = model.n1, model.n2, model.stride, model.shape
    x, y, z, u, v, w = nodes.x, nodes.y, nodes.z, nodes.u, nodes.v, nodes.w
    least, speed = by_column.rate, by_column.ground_impulse
    turn = UPRIGHT * shape.side
    columns, above = uint64(n2), uint64(stride)
    for j in range(columns):
        least[j] = 1.0
        speed[j] = 0.0
    for i in range(uint64(n1)):
        start, refine = i * above + uint64(PAD), UPRIGHT * shape.h1[i]
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
    return note_watch(self_contact, int(worst <= 0.0), fastest, min(shape.least_1, shape.least_2))


@kernel
def watch_meridian(model, nodes, self_contact, window):
    """Update whether self-contact of a meridian is possible within a window (s), and return the longest step (s) by its speed.

    As long as each edge climbs, the meridian is a graph over the axis. Reads and writes as watch_shell.
    """
    if self_contact is None:
        return inf
    n1, h1 = model.n1, model.shape.h1
    z, u, w = nodes.z, nodes.u, nodes.w
    least, fastest = inf, 0.0
    for i in range(n1):
        least = min(least, z[i + 1] - z[i] + window * min(w[i + 1] - w[i], 0.0) - UPRIGHT * h1[i])
        fastest = max(fastest, u[i + 1] * u[i + 1] + w[i + 1] * w[i + 1])
    return note_watch(self_contact, int(least <= 0.0), fastest, model.shape.least_1)


@kernel
def self_contact_in(self_contact, step, last):
    """Return what a step has of self-contact: nothing, none yet, or all since the last contact; see Meeting.

    Where no pair was active it is looked at every few steps only, and before the cargo reaches the ground or turns. last: whether
    it is the last step for another reason. Reads self_contact, step.
    """
    if self_contact is None:
        return Meeting.NONE
    if self_contact.counts[ContactCount.DUE] == 0:
        return Meeting.NONE
    travel = step.next_cover - step.cover
    ends = last or step.next_cover + NEARLY_THERE * travel <= 0.0 or travel >= 0.0
    busy = self_contact.counts[ContactCount.ACTIVE] > 0 or self_contact.counts[ContactCount.OPEN] + 1 >= IDLE_STEPS
    stale = self_contact.counts[ContactCount.STALE] == 1  # as where there was no room for pairs
    return Meeting.NOW if ends or busy or stale else Meeting.LATER


@kernel
def contact_open(self_contact):
    """Return whether contact has been left to the next step."""
    if self_contact is None:
        return False
    return self_contact.counts[ContactCount.OPEN] > 0


@kernel
def shift_of(self_contact):
    """Return the time (s) from the last contact but one to the step that resolved the last: impulses move nodes over it, too."""
    if self_contact is None:
        return 0.0
    return self_contact.since[2]


@kernel
def take_shift(self_contact):
    """Return shift_of once."""
    if self_contact is None:
        return 0.0
    shift = self_contact.since[2]
    self_contact.since[2] = 0.0
    return shift


@kernel
def overflown(self_contact):
    """Return whether the arrays are too small for the pairs there are."""
    if self_contact is None:
        return False
    counts, pairs = self_contact.counts, self_contact.pairs
    listed = counts[ContactCount.FACES] + counts[ContactCount.EDGES]
    return listed > pairs.first.size or counts[ContactCount.ACTIVE] > self_contact.active.nodes.shape[0]


@kernel
def note_watch(self_contact, due, square, edge):
    """Note whether self-contact is possible (due); returns the longest step (s) at the largest speed squared (m^2/s^2), if so."""
    if due == 1 and self_contact.counts[ContactCount.DUE] == 0:
        self_contact.counts[ContactCount.STALE] = 1
    self_contact.counts[ContactCount.DUE] = due
    if due == 0:
        self_contact.counts[ContactCount.OPEN] = 0
    return WATCHED_TRAVEL * edge / sqrt(square) if due == 1 and square > 0.0 else inf
