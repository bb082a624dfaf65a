"""The nodes in the time since the last contact, one record each, as contact between rows sees and changes them.

A node goes evenly from where it was at the last contact to where it is now: what its way was in between is forgotten. Contact
changes its velocity, and its place by what that makes over all that time. So what did not pass at the last contact has not passed
at this one either, however many steps lie between.
"""

from math import sqrt

from numba import float32, uint64

from softbrake.core.arrays import ContactCount, Place, Speed, Step
from softbrake.core.contact.constants import TRAVEL_ALLOWANCE
from softbrake.core.contact.obstacles import change_velocity
from softbrake.core.jit import kernel
from softbrake.core.lanes import close_nodes


@kernel
def row_start(sheet, i):
    """Return the first node of a row."""
    return uint64(i) * uint64(sheet.stride) + uint64(sheet.first)


@kernel
def stored_columns(sheet):
    """Return how many nodes of a row have records: its own, and the copy of the first behind the last."""
    return uint64(sheet.columns + int(sheet.columns > 1))


@kernel
def leave_to_next(nodes, self_contact, sheet, step):
    """Leave contact to a later step: keep where the nodes were before this one, if the last one did not.

    Reads nodes as pushed, but for those on the cover. Writes self_contact; nothing where it is None.
    """
    if self_contact is None:
        return
    counts, since, record = self_contact.counts, self_contact.since, self_contact.record
    if counts[ContactCount.OPEN] == 0:
        since[0], since[1] = 0.0, step.cover
        for i in range(sheet.rows + 1):
            start = row_start(sheet, i)
            for a in range(start, start + stored_columns(sheet)):
                record.place[a, Place.X] = nodes.x[a] - step.length * nodes.u[a]
                record.place[a, Place.Y] = nodes.y[a] - step.length * nodes.v[a]
                record.place[a, Place.Z] = nodes.z[a] - step.length * nodes.w[a] if i < sheet.rows else step.cover
    since[0] += step.length
    counts[ContactCount.OPEN] += 1


@kernel
def step_since(self_contact, step):
    """Return the Step from the last contact to n+1."""
    if self_contact.counts[ContactCount.OPEN] == 0:
        self_contact.since[0], self_contact.since[1] = 0.0, step.cover
    since = self_contact.since
    return Step(step.dt, since[0] + step.length, step.gravity, since[1], step.next_cover, step.gap)


@kernel
def add_travel(nodes, self_contact, scene):
    """Add what the nodes have travelled since the last contact to their paths. Returns whether one has used up its margin.

    Reads nodes, scene, self_contact.record of contact left to this step. Writes self_contact.travel, reached, path.
    """
    place, margin, path, sheet = self_contact.record.place, self_contact.margin, self_contact.path, scene.sheet
    travel, reached, length, used_up = self_contact.travel, self_contact.reached, scene.step.length, 0
    opened, count = self_contact.counts[ContactCount.OPEN] > 0, stored_columns(sheet)
    x, y, z, u, v, w = nodes.x, nodes.y, nodes.z, nodes.u, nodes.v, nodes.w
    for i in range(sheet.rows + 1):
        start = row_start(sheet, i)
        if opened:
            for a in range(start, start + count):
                off_x, off_y, off_z = x[a] - place[a, Place.X], y[a] - place[a, Place.Y], z[a] - place[a, Place.Z]
                travel[a] = TRAVEL_ALLOWANCE * sqrt(off_x * off_x + off_y * off_y + off_z * off_z)
        else:
            for a in range(start, start + count):
                travel[a] = TRAVEL_ALLOWANCE * length * sqrt(u[a] * u[a] + v[a] * v[a] + w[a] * w[a])
        for a in range(start, start + count):
            reached[a] = path[a] + travel[a]
            path[a] += float32(1.0 / TRAVEL_ALLOWANCE) * travel[a]
            used_up |= int(reached[a] > margin[a])
    return used_up > 0


@kernel
def load_records(nodes, self_contact, scene):
    """Write the records of all nodes. Reads nodes, scene. Writes self_contact.record."""
    record, sheet, length = self_contact.record, scene.sheet, scene.step.length
    opened, count, per_length = self_contact.counts[ContactCount.OPEN] > 0, stored_columns(sheet), 1.0 / scene.step.length
    x, y, z, u, v, w = nodes.x, nodes.y, nodes.z, nodes.u, nodes.v, nodes.w
    for i in range(sheet.rows + 1):
        start = row_start(sheet, i)
        per_mass = 1.0 / scene.mass[i] if 0 < i < sheet.rows else 0.0
        for a in range(start, start + count):
            if opened:
                record.speed[a, Speed.U] = per_length * (x[a] - record.place[a, Place.X])
                record.speed[a, Speed.V] = per_length * (y[a] - record.place[a, Place.Y])
                record.speed[a, Speed.W] = per_length * (z[a] - record.place[a, Place.Z])
            else:
                record.place[a, Place.X] = x[a] - length * u[a]
                record.place[a, Place.Y] = y[a] - length * v[a]
                record.place[a, Place.Z] = z[a] - length * w[a]
                record.speed[a, Speed.U] = u[a]
                record.speed[a, Speed.V] = v[a]
                record.speed[a, Speed.W] = w[a]
            record.speed[a, Speed.PER_MASS] = per_mass
            record.stamp[a] = 0


@kernel
def update_faces(self_contact, sheet):
    """Write the largest travel of the corners of each face, and the farthest reached. Writes self_contact.travel, reached."""
    travel, reached, faces = self_contact.travel, self_contact.reached, uint64(self_contact.margin.size)
    above, right = uint64(sheet.stride), uint64(sheet.columns > 1)
    for i in range(sheet.rows + 1):
        start = row_start(sheet, i)
        up = above if i < sheet.rows else uint64(0)  # of the row on the cover, which has no faces, edges
        for a in range(start, start + uint64(sheet.columns)):
            b, c, d = a + right, a + up, a + up + right
            reached[faces + a] = max(max(reached[a], reached[b]), max(reached[c], reached[d]))
            travel[faces + a] = max(max(travel[a], travel[b]), max(travel[c], travel[d]))


@kernel
def store_records(nodes, impulses, self_contact, scene):
    """Move the nodes that took impulses: velocities change by as much as their means, places by what that makes since.

    Reads self_contact.record, scene. Writes nodes; impulses: the work of contact on the velocities at n+1/2.
    """
    record, path, sheet, length = self_contact.record, self_contact.path, scene.sheet, scene.step.length
    opened = self_contact.counts[ContactCount.OPEN] > 0
    per_length = 1.0 / length
    for i in range(1, sheet.rows):
        start, mass, moved = row_start(sheet, i), scene.mass[i], False
        for j in range(uint64(sheet.columns)):
            a = start + j
            if record.stamp[a] == 0:
                continue
            moved = True
            x, y, z = record.place[a, Place.X], record.place[a, Place.Y], record.place[a, Place.Z]
            mean_u, mean_v, mean_w = nodes.u[a], nodes.v[a], nodes.w[a]
            if opened:
                mean_u, mean_v, mean_w = (
                    per_length * (nodes.x[a] - x),
                    per_length * (nodes.y[a] - y),
                    per_length * (nodes.z[a] - z),
                )
            u, v, w = record.speed[a, Speed.U] - mean_u, record.speed[a, Speed.V] - mean_v, record.speed[a, Speed.W] - mean_w
            v = v if sheet.columns > 1 else 0.0  # what round-off pushes out of the half-plane
            path[a] += length * sqrt(u * u + v * v + w * w)
            gain = mass * (u * (nodes.u[a] + 0.5 * u) + v * (nodes.v[a] + 0.5 * v) + w * (nodes.w[a] + 0.5 * w))
            slot = uint64(i) if sheet.columns == 1 else j
            impulses.contact[slot] += gain
            impulses.kinetic[slot] += gain
            change_velocity(nodes, a, length, u, v, w)
        if moved and sheet.columns > 1:
            close_nodes(nodes, start, sheet.columns)
            path[start + uint64(sheet.columns)] = path[start]
