"""Works over the jumps of velocity by contact between rows: at belts, and self-contact.

Rows are pushed and their works recorded before that contact is resolved, as if there were none. Jumps belong to the same step:
half of each is in the mean of the velocities at n-1/2 and n+1/2, over which gas, weight and tensions work. Where contact had been
left to this step, jumps also move nodes over the steps before. So here the rows that jumped are gone through once more, as they
were at n, and the works over half the jumps and over that way are added. What the others do less
against contact, contact takes less: its own work changes by the opposite of theirs. That of the ground is as the push left it.
"""

from numba import uint64

from softbrake.core.arrays import Meeting
from softbrake.core.columns import History
from softbrake.core.contact.belt_contact import may_fold, resolve_belt_contact
from softbrake.core.contact.records import leave_to_next
from softbrake.core.contact.scene import scene_of_shell
from softbrake.core.contact.self_contact import resolve_self_contact, self_contact_in, shift_of, take_shift
from softbrake.core.jit import kernel
from softbrake.core.lanes import FIRST, close_vectors, lanes
from softbrake.core.loop.push import hold_row
from softbrake.core.loop.rows import (
    add_row_work,
    begin_walk,
    row_at,
    update_row_areas,
    update_row_edges,
    update_row_pressure,
    update_row_shear,
    update_row_tensions,
)


@kernel
def begin_contact(model, state, workspace, step):
    """Return the Meeting of rows in the step; if they may touch keep the velocities at n-1/2.

    Adds the works that the last contact left to this step. Reads model, state, step. Writes state.work, workspace.
    """
    nodes, before = state.nodes, workspace.before_contact.before
    if shift_of(state.self_contact) > 0.0:
        add_works_over_jumps(model, state, nodes, workspace, 0.0, 0.5 * take_shift(state.self_contact) / step.dt, step.dt)
    last = step.length == model.end - state.now[History.TIME]
    meeting = self_contact_in(state.self_contact, step, last or model.belt_contact.below.size > 0)
    if may_fold(nodes, model.belt_contact, uint64(model.stride), model.n2):
        meeting = Meeting.NOW
    if meeting != Meeting.NOW:
        return meeting
    for a in range(uint64(nodes.u.size)):
        before.u[a] = nodes.u[a]
        before.v[a] = nodes.v[a]
        before.w[a] = nodes.w[a]
    return meeting


@kernel
def leave_contact(model, state, step):
    """Leave self-contact to a later step, after all free rows are pushed. Writes state.self_contact."""
    leave_to_next(state.nodes, state.self_contact, scene_of_shell(model, step, False).sheet, step)


@kernel
def resolve_contact(model, state, workspace, step, touching):
    """Resolve contact at belts and self-contact after all rows are pushed, and keep the jumps of velocity.

    Reads model, step; touching: whether cover and cargo are in the way. Writes state.nodes, work.contact, self_contact;
    workspace.by_column; before_contact, of whose before only scratch in its places.
    """
    nodes, work, self_contact = state.nodes, state.work, state.self_contact
    by_column, before_contact = workspace.by_column, workspace.before_contact
    jump, impulse = before_contact.jump, before_contact.impulse
    for a in range(uint64(nodes.u.size)):
        jump.x[a] = nodes.u[a]
        jump.y[a] = nodes.v[a]
        jump.z[a] = nodes.w[a]
    impulse[0] = 0.0
    impulse[1] = 0.0
    resolve_belt_contact(model, nodes, work, by_column, before_contact, step, touching)  # (2.5)
    resolve_self_contact(model, nodes, work, by_column, impulse, self_contact, step, touching)
    by_column.on_cargo[0] += impulse[0]
    by_column.impulse[0] += impulse[1]
    for a in range(uint64(nodes.u.size)):
        jump.x[a] = nodes.u[a] - jump.x[a]
        jump.y[a] = nodes.v[a] - jump.y[a]
        jump.z[a] = nodes.w[a] - jump.z[a]


@kernel
def jumped(jump, node, columns):
    """Return whether a node of the row that starts with this one had its velocity changed by contact."""
    some = 0
    for a in range(node, node + uint64(columns)):
        some |= int(jump.x[a] != 0.0) | int(jump.y[a] != 0.0) | int(jump.z[a] != 0.0)
    return some > 0


@kernel
def find_jumps(jump, n1, stride, columns):
    """Return the first and the last free row that jumped; (n1, 0) where none did."""
    first, last = 1, n1 - 1
    while first < n1 and not jumped(jump, uint64(first) * stride + FIRST, columns):
        first += 1
    if first == n1:
        return n1, 0
    while not jumped(jump, uint64(last) * stride + FIRST, columns):
        last -= 1
    return first, last


@kernel
def return_row(nodes, jump, before, start, stride, length, shift):
    """Write the places (m) at n of the row that starts there to before. Its jumps have moved it over the time shift (s), too."""
    for a in range(start, start + stride):
        before.x[a] = nodes.x[a] - length * nodes.u[a] - shift * jump.x[a]
        before.y[a] = nodes.y[a] - length * nodes.v[a] - shift * jump.y[a]
        before.z[a] = nodes.z[a] - length * nodes.w[a] - shift * jump.z[a]


@kernel
def take_jumps(jump, mean, part, node, row, columns):
    """Write a part of the jumps (m/s) of a row of nodes to mean at offset row. Reads jump at offset node."""
    for j in range(lanes(columns)):
        a, c = node + j, row + j
        mean.x[c] = part * jump.x[a]
        mean.y[c] = part * jump.y[a]
        mean.z[c] = part * jump.z[a]
    close_vectors(mean, row, columns)


@kernel
def add_node_work(area, pressure, mean, work, dt, weight, row, columns):
    """Add the works of gas and weight (N) on a row of nodes over its mean velocities."""
    for j in range(lanes(columns)):
        b, c = FIRST + j, row + j
        through = area.x[b] * mean.x[c] + area.y[b] * mean.y[c] + area.z[b] * mean.z[c]
        work.pressure[j] += dt * pressure[j] * through
        work.gravity[j] -= dt * weight * mean.z[c]


@kernel
def works_of(work, j):
    """Return the sum (J) of the works on a column that jumps change."""
    return work.pressure[j] + work.gravity[j] + work.elastic[j] + work.viscous[j] + work.belts[j]


@kernel
def add_contact_work_of_shell(model, state, workspace, dt, length):
    """Add what contact between rows changed of the works of the step, after all rows are pushed.

    dt: from n-1/2 to n+1/2; length: from n to n+1 (s). Reads state.nodes at n+1, now[PRESSURE] of n, workspace.before_contact.
    Writes state.work; scratch in workspace.
    """
    stride, before, jump = uint64(model.stride), workspace.before_contact.before, workspace.before_contact.jump
    shift, (first, last) = shift_of(state.self_contact), find_jumps(jump, model.n1, stride, model.n2)
    for i in range(first - 1, last + 2):
        return_row(state.nodes, jump, before, uint64(i) * stride, stride, length, shift)
    add_works_over_jumps(model, state, before, workspace, 0.5, 0.5 * shift / dt, dt)


@kernel
def add_works_over_jumps(model, state, nodes, workspace, part, part_of_way, dt):
    """Add the works of gas, weight and tensions over parts of the jumps during dt (s), and take them from that of contact.

    Over part_of_way nodes move without a strain rate: viscosity does not work. nodes: places where the forces act, and velocities
    of their viscosity. Reads now[PRESSURE], workspace.before_contact.jump. Writes state.work; scratch in workspace, which it goes
    through as take_step does.
    """
    n1, n2, work, jump = model.n1, model.n2, state.work, workspace.before_contact.jump
    uniform, whole = state.now[History.PRESSURE] * model.hoop.gas, part + part_of_way
    first, last = find_jumps(jump, n1, uint64(model.stride), n2)
    if first > last:
        return
    sums, viscous, bottom, top, wrinkled = workspace.force.x, workspace.force.y, first - 1, last + 1, False
    for j in range(lanes(n2)):
        sums[j] = works_of(work, j)
        viscous[j] = work.viscous[j]
    begin_walk(model, nodes, workspace, row_at(model, bottom, bottom, top))
    for i in range(bottom, top + 1):
        at, wrinkled_below = row_at(model, i, bottom, top), wrinkled
        update_row_edges(model, nodes, workspace, at)  # (2.6)
        update_row_tensions(model, workspace, at, False)  # (2.3), (2.9)
        wrinkled = update_row_shear(model, workspace, at, False)  # (2.2)
        hold_row(workspace.mean, at.row, n2, 0.0)
        if at.inside:
            take_jumps(jump, workspace.mean, whole, at.node, at.row, n2)
            update_row_areas(model, workspace, at)  # (2.7)
            update_row_pressure(model, nodes, workspace, at, uniform)  # (2.11)
            weight = model.gravity * model.mass[i]
            add_node_work(workspace.area, workspace.pressure, workspace.mean, work, dt, weight, at.row, n2)
        add_row_work(model, work, workspace, at, wrinkled_below, dt)
    for j in range(lanes(n2)):
        work.viscous[j] = viscous[j] + part / whole * (work.viscous[j] - viscous[j])
        work.contact[j] -= works_of(work, j) - sums[j]
