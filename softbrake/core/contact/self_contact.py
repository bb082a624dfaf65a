"""Self-contact of the shell: unilateral, smooth, without rebound. Nodes against faces, edges against edges.

After the push of all free rows, impulses at n+1/2 change velocities, and places by what that makes until n+1. The cloth has a
thickness: an active pair that would come nearer than that takes equal and opposite impulses along the line between its nearest
points at n, which end the closing and give back half of what the thickness is compressed; pair after pair, a few times over
(Gauss-Seidel). What would pass all the same is found by continuous collision detection, and separated when and where it does,
until none is left or the passes are used up: missed collisions. After Bridson, Fedkiw, Anderson, Robust treatment of collisions,
contact and friction for cloth animation (2002), and their order: what never passes is on the side where it was.
"""

from math import inf, sqrt

from numba import uint64

from softbrake.core.arrays import PAD, ContactCount, Impulses
from softbrake.core.contact.broad_phase import find_pairs
from softbrake.core.contact.constants import (
    COLLISION_GAP,
    COLLISION_PASSES,
    EXACT_PASSES,
    FEW_PAIRS,
    LAST_GAPS,
    LEAST_SCALE,
    MANY_PAIRS,
    MARGIN_STEPS,
    MOST_SCALE,
    OVERRELAXATION,
    REST_MARGIN,
    SMALLEST,
    SPRING,
    THICKNESS,
    THICKNESS_PASSES,
    THICKNESS_REBOUND,
    TINY_THICKNESS,
    TRAVEL_ALLOWANCE,
    UPRIGHT,
    WATCHED_TRAVEL,
)
from softbrake.core.contact.impulses import may_pass, rigidify, separate_pair
from softbrake.core.contact.narrow_phase import Found, closing_along, detect_collision, nearest, seen_from
from softbrake.core.contact.pairs import PairState, load_state, pair_of, store_state, travel_of
from softbrake.core.contact.scene import available_space, scene_of_meridian, scene_of_shell
from softbrake.core.jit import kernel


@kernel
def resolve_self_contact(model, nodes, work, by_column, impulse, self_contact, step, touching):
    """Resolve self-contact of the full shell in the step to n+1, where it is asked for: self_contact is not None.

    Reads model, step; touching: whether cover and cargo are in the way. Writes nodes, work.contact; by_column.kinetic; impulse
    (N s, upwards: on the cargo, of the ground on the fabric); self_contact.
    """
    if self_contact is None:  # decided by type: the rest is not compiled
        return
    impulses = Impulses(work.contact, by_column.kinetic, impulse, self_contact.stamp)
    resolve_under_cover(nodes, impulses, self_contact, scene_of_shell(model, step, touching))


@kernel
def resolve_self_contact_of_meridian(model, nodes, meridian, self_contact, step):
    """Resolve self-contact of a meridian in the step to n+1: node i of nodes at radius x, height z; y and v zero.

    Reads model, step. Writes nodes, self_contact, meridian.contact, kinetic, impulse. Returns whether a node may have moved, for
    add_contact_work_of_meridian to record; nothing is done where self_contact is None.
    """
    if self_contact is None:
        return 0
    impulses = Impulses(meridian.contact, meridian.kinetic, meridian.impulse, self_contact.stamp)
    resolve_under_cover(nodes, impulses, self_contact, scene_of_meridian(model, step))
    return self_contact.counts[ContactCount.DUE]


@kernel
def resolve_under_cover(nodes, impulses, self_contact, scene):
    """Resolve self-contact while the row on the cover, which is pushed last, stands where it is foreseen. See resolve_pairs."""
    step, sheet = scene.step, scene.sheet
    space = step.next_cover - sheet.obstacles.ground
    if self_contact.counts[ContactCount.DUE] == 0 or space <= LAST_GAPS * step.gap:
        return
    top = sheet.rows * sheet.stride + sheet.first
    copies = int(sheet.columns > 1)
    old, speed = nodes.w[top], (step.next_cover - step.cover) / step.length
    for a in range(top - copies, top + sheet.columns + copies):
        nodes.z[a] = step.next_cover
        nodes.w[a] = speed
    resolve_pairs(nodes, impulses, self_contact, scene)
    for a in range(top - copies, top + sheet.columns + copies):
        nodes.z[a] = step.cover
        nodes.w[a] = old


@kernel
def resolve_pairs(nodes, impulses, self_contact, scene):
    """Resolve self-contact in the step to n+1. Reads scene. Writes nodes, impulses, self_contact."""
    counts, sheet = self_contact.counts, scene.sheet
    if add_travel(nodes, self_contact, sheet, scene.step.length) or counts[ContactCount.STALE] == 1:
        update_pairs(self_contact, nodes, sheet)
    active = activate_pairs(nodes, self_contact, scene)
    if active == (0, 0):
        return
    for _ in range(THICKNESS_PASSES):
        counts[ContactCount.PASSES] += 1
        for k in range(active[0] + active[1]):
            keep_thickness(nodes, impulses, self_contact, scene, slot_of(k, active, self_contact))
    tries, pushed, stuck = 0, 1, 0
    most = COLLISION_PASSES if sheet.columns > 1 else 2 * COLLISION_PASSES
    while pushed > 0 and tries < most:
        pushed, stuck = separate_pairs(nodes, impulses, self_contact, scene, active, tries)
        tries += 1
    if pushed + stuck > 0:
        record_missed_collisions(nodes, self_contact, scene, active)


@kernel
def add_travel(nodes, self_contact, sheet, length):
    """Add what the nodes travel in the step (s) to their paths. Returns whether one has used up its margin.

    Reads nodes, sheet. Writes self_contact.travel, path, face_travel, face_path.
    """
    u, v, w, path, travel, margin = nodes.u, nodes.v, nodes.w, self_contact.path, self_contact.travel, self_contact.margin
    used_up, count = 0, uint64(sheet.columns + int(sheet.columns > 1))
    for i in range(uint64(sheet.rows + 1)):
        start = i * uint64(sheet.stride) + uint64(sheet.first)
        for a in range(start, start + count):
            way = TRAVEL_ALLOWANCE * length * sqrt(u[a] * u[a] + v[a] * v[a] + w[a] * w[a])
            travel[a] = way
            path[a] += way
            used_up |= int(path[a] > margin[a])
    if self_contact.counts[ContactCount.PAIRS] > 0:
        update_faces(self_contact, sheet)
    return used_up > 0


@kernel
def update_faces(self_contact, sheet):
    """Write the largest path and travel of the corners of each face, by its lower left one; rows end in copies, and padding.

    Reads self_contact.path, travel, sheet. Writes self_contact.face_path, face_travel.
    """
    path, travel, face_path, face_travel = (
        self_contact.path,
        self_contact.travel,
        self_contact.face_path,
        self_contact.face_travel,
    )
    above, right = uint64(sheet.stride), uint64(sheet.columns > 1)
    for a in range(uint64(path.size) - above - right):
        b, c, d = a + right, a + above, a + above + right
        face_path[a] = max(path[a], path[b], path[c], path[d])
        face_travel[a] = max(travel[a], travel[b], travel[c], travel[d])
    for a in range(uint64(path.size) - above - right, uint64(path.size)):  # a row of nodes above all faces, each as the cover
        face_path[a] = path[a]
        face_travel[a] = travel[a]


@kernel
def update_pairs(self_contact, nodes, sheet):
    """Search for near pairs anew (broad phase): all that may become active before a node has travelled its margin.

    The fewer pairs there are, the wider the margins, and the later the next search. Where the arrays do not hold them all,
    margins are narrowed for now, and the arrays enlarged before the next step. Reads nodes, sheet. Writes self_contact.
    """
    counts, scale, path, margin = self_contact.counts, self_contact.scale, self_contact.path, self_contact.margin
    capacity = self_contact.pairs.key.size
    for a in range(path.size):
        path[a] = self_contact.travel[a]  # what is searched for stands at n+1, what is active at n
    count = -1
    while count < 0 or (count > capacity and scale[0] > LEAST_SCALE):
        scale[0] *= 1.0 if count < 0 else 0.5
        for a in range(path.size):
            margin[a] = scale[0] * (REST_MARGIN * sheet.edge + MARGIN_STEPS * self_contact.travel[a])
        count = find_pairs(nodes, self_contact, sheet, THICKNESS * sheet.edge)
        counts[ContactCount.SEARCHES] += 1
        if count > capacity:
            counts[ContactCount.OVERFLOW] = 1
    faces = sheet.rows * sheet.columns
    if count < FEW_PAIRS * faces:
        scale[0] = min(2.0 * scale[0], MOST_SCALE)
    elif count > MANY_PAIRS * faces:
        scale[0] = max(0.5 * scale[0], 1.0)
    counts[ContactCount.PAIRS] = min(count, capacity)
    counts[ContactCount.STALE] = 0
    update_faces(self_contact, sheet)


@kernel
def activate_pairs(nodes, self_contact, scene):
    """Find the pairs active in this step, and how they stand at n. Returns how many of each kind.

    A pair at some distance is active once it can have travelled it. Slots of pairs.active and state are taken from the front by
    nodes and faces, from the end by edges. Reads nodes, scene. Writes self_contact.pairs.active_from, active, state.
    """
    pairs, sheet, length = self_contact.pairs, scene.sheet, scene.step.length
    thick = THICKNESS * available_space(scene)
    front, back = 0, 0
    for k in range(self_contact.counts[ContactCount.PAIRS]):
        key = pairs.key[k]
        travelled = travel_of(self_contact.path, self_contact.face_path, key)
        if travelled < pairs.active_from[k]:
            continue
        pair = pair_of(key, sheet)
        start = seen_from(nodes, pair, sheet.breadth, length)
        points = nearest(pair.edges, start)
        travel = travel_of(self_contact.travel, self_contact.face_travel, key)
        pairs.active_from[k] = travelled - travel + points.distance - thick
        if points.distance > thick + travel:
            continue
        front, back = front + int(not pair.edges), back + int(pair.edges)
        slot = pairs.key.size - back if pair.edges else front - 1
        pairs.active[slot] = key
        store_state(pairs.state, slot, state_of(pair.edges, start, points, thick, length))
    return front, back


@kernel
def slot_of(k, active, self_contact):
    """Return the slot of the k-th pair active: nodes and faces first, for edges then often find nothing left to separate."""
    return k if k < active[0] else self_contact.pairs.active.size - 1 - (k - active[0])


@kernel
def state_of(edges, start, points, thick, length):
    """Return the PairState at n of a pair with a thickness (m), for a step (s).

    start: its corners seen from the node; points: its Nearest.
    """
    scale = 1.0 / max(points.distance, SMALLEST)
    x, y, z = points.vector
    qx, qy, qz = start
    own, reach = 0.0, scale * (x * qx[0] + y * qy[0] + z * qz[0])
    if edges:
        own, reach = min(reach, 0.0), -inf
    for k in range(1, 4):
        reach = max(reach, scale * (x * qx[k] + y * qy[k] + z * qz[k]))
    reach -= own
    allowed = (points.distance - thick) / length
    return PairState(
        (scale * x, scale * y, scale * z),
        points.weights,
        inf if not points.presses else allowed if allowed > 0.0 else SPRING * allowed,
        reach if points.distance > TINY_THICKNESS * thick else inf,
    )


@kernel
def keep_thickness(nodes, impulses, self_contact, scene, slot):
    """Take from an active pair what it closes faster than its thickness allows.

    No energy arises, since it never separates faster than it closed. Reads self_contact.pairs, counts; scene. Writes nodes,
    impulses.
    """
    state = load_state(self_contact.pairs.state, slot)
    if state.reach == inf:
        return
    pair = pair_of(self_contact.pairs.active[slot], scene.sheet)
    closing = closing_along(nodes, pair, state.weights, state.normal)
    slowing = min(closing - state.allowed, (1.0 + THICKNESS_REBOUND) * closing)
    if slowing > 0.0:
        now = self_contact.counts[ContactCount.PASSES]
        separate_pair(nodes, impulses, scene, now, pair, state.weights, slowing, state.normal)


@kernel
def separate_pairs(nodes, impulses, self_contact, scene, active, tries):
    """Separate the active pairs that would pass, one after the other. Returns how many took an impulse, and how many could not.

    After the first pass only those are looked at of which a node was pushed in this pass or the one before. What no impulse
    along the normal separates is rigidified, as is all that still passes in the last passes over a meridian.
    Reads self_contact.pairs, scene. Writes nodes, impulses, self_contact.stamp, counts[PASSES].
    """
    stamp, counts = self_contact.stamp, self_contact.counts
    before = counts[ContactCount.PASSES]
    counts[ContactCount.PASSES] += 1
    gap, pushed, stuck = COLLISION_GAP * available_space(scene), 0, 0
    for k in range(active[0] + active[1]):
        slot = slot_of(k, active, self_contact)
        pair = pair_of(self_contact.pairs.active[slot], scene.sheet)
        a, b, c, d = pair.corners
        if tries > 0 and max(stamp[pair.node], stamp[a], stamp[b], stamp[c], stamp[d]) < before:
            continue
        if not may_pass(nodes, pair, load_state(self_contact.pairs.state, slot), scene.step.length):
            continue
        collision = detect_collision(nodes, pair, scene, gap)
        if collision.found == Found.APART:
            continue
        if tries >= COLLISION_PASSES or collision.slowing <= 0.0:
            rigidify(nodes, impulses, scene, before + 1, pair)
            pushed += 1
        else:
            slowing = collision.slowing if tries < EXACT_PASSES else OVERRELAXATION * collision.slowing
            took = separate_pair(nodes, impulses, scene, before + 1, pair, collision.weights, slowing, collision.normal)
            pushed, stuck = pushed + took, stuck + 1 - took
    return pushed, stuck


@kernel
def record_missed_collisions(nodes, self_contact, scene, active):
    """Count the pairs that pass though the passes are used up, and raise the largest penetration, over the unloaded cell.

    Reads nodes, self_contact.pairs, scene. Writes self_contact.counts[MISSED], penetration.
    """
    gap = COLLISION_GAP * available_space(scene)
    for k in range(active[0] + active[1]):
        slot = slot_of(k, active, self_contact)
        pair = pair_of(self_contact.pairs.active[slot], scene.sheet)
        if may_pass(nodes, pair, load_state(self_contact.pairs.state, slot), scene.step.length):
            collision = detect_collision(nodes, pair, scene, gap)
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

    As long as each cell, seen from the axis, lies the right way round, the shell is a graph over the cylinder between its held
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
def self_contact_due(self_contact):
    """Return whether self-contact is asked for and possible."""
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
    """Note whether self-contact is possible (due); returns the longest step (s) at the largest speed squared (m^2/s^2), if so."""
    if due == 1 and self_contact.counts[ContactCount.DUE] == 0:
        self_contact.counts[ContactCount.STALE] = 1
    self_contact.counts[ContactCount.DUE] = due
    return WATCHED_TRAVEL * edge / sqrt(square) if due == 1 and square > 0.0 else inf
