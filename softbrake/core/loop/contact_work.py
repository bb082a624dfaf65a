"""Works over the jumps of velocity by contact between rows: at belts, and self-contact.

Rows are pushed and their works recorded before that contact is resolved, as if there were none. Jumps belong to the same step:
half of each is in the mean of the velocities at n-1/2 and n+1/2, over which gas, weight and tensions work. So here the rows that
jumped are gone through once more, as they were at n, and the works over half the jumps are added. What the others do less
against contact, contact takes less: its own work changes by the opposite of theirs. That of the ground is as the push left it.
"""

from numba import uint64

from softbrake.core.columns import History
from softbrake.core.contact.belt_contact import may_fold, resolve_belt_contact
from softbrake.core.contact.self_contact import resolve_self_contact, self_contact_due
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
def begin_contact(model, state, before_contact):
    """Return whether rows may touch in the step; if so keep the velocities at n-1/2.

    Reads model, state. Writes before_contact.before.
    """
    nodes, before = state.nodes, before_contact.before
    if not self_contact_due(state.self_contact) and not may_fold(nodes, model.belt_contact, uint64(model.stride), model.n2):
        return False
    for a in range(uint64(nodes.u.size)):
        before.u[a] = nodes.u[a]
        before.v[a] = nodes.v[a]
        before.w[a] = nodes.w[a]
    return True


@kernel
def resolve_contact(model, state, workspace, step, touching):
    """Resolve contact at belts and self-contact after all rows are pushed, and keep the velocities at n+1/2 before.

    Reads model, step; touching: whether cover and cargo are in the way. Writes state.nodes, work.contact, self_contact;
    workspace.by_column; before_contact, of whose before only scratch in its places.
    """
    nodes, work, self_contact = state.nodes, state.work, state.self_contact
    by_column, before_contact = workspace.by_column, workspace.before_contact
    free, impulse = before_contact.free, before_contact.impulse
    for a in range(uint64(nodes.u.size)):
        free.x[a] = nodes.u[a]
        free.y[a] = nodes.v[a]
        free.z[a] = nodes.w[a]
    impulse[0] = 0.0
    impulse[1] = 0.0
    resolve_belt_contact(model, nodes, work, by_column, before_contact, step, touching)  # (2.5)
    resolve_self_contact(model, nodes, work, by_column, impulse, self_contact, step, touching)
    by_column.on_cargo[0] += impulse[0]
    by_column.impulse[0] += impulse[1]


@kernel
def jumped(nodes, free, node, columns):
    """Return whether a node of the row that starts with this one has another velocity than before contact, free."""
    some = 0
    for a in range(node, node + uint64(columns)):
        some |= int(nodes.u[a] != free.x[a]) | int(nodes.v[a] != free.y[a]) | int(nodes.w[a] != free.z[a])
    return some > 0


@kernel
def find_jumps(nodes, free, n1, stride, columns):
    """Return the first and the last free row that jumped; (n1, 0) where none did."""
    first, last = 1, n1 - 1
    while first < n1 and not jumped(nodes, free, uint64(first) * stride + FIRST, columns):
        first += 1
    if first == n1:
        return n1, 0
    while not jumped(nodes, free, uint64(last) * stride + FIRST, columns):
        last -= 1
    return first, last


@kernel
def return_row(nodes, before, start, stride, length):
    """Write the places (m) at n of the row that starts there to before."""
    for a in range(start, start + stride):
        before.x[a] = nodes.x[a] - length * nodes.u[a]
        before.y[a] = nodes.y[a] - length * nodes.v[a]
        before.z[a] = nodes.z[a] - length * nodes.w[a]


@kernel
def halve_jumps(nodes, free, mean, node, row, columns):
    """Write half the jumps (m/s) of a row of nodes to mean at offset row. Reads nodes, free at offset node."""
    for j in range(lanes(columns)):
        a, c = node + j, row + j
        mean.x[c] = 0.5 * (nodes.u[a] - free.x[a])
        mean.y[c] = 0.5 * (nodes.v[a] - free.y[a])
        mean.z[c] = 0.5 * (nodes.w[a] - free.z[a])
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
    Writes state.work; scratch in workspace, which it goes through as take_step does.
    """
    n1, n2, stride, nodes, work = model.n1, model.n2, uint64(model.stride), state.nodes, state.work
    before, free, uniform = (
        workspace.before_contact.before,
        workspace.before_contact.free,
        state.now[History.PRESSURE] * model.hoop.gas,
    )
    first, last = find_jumps(nodes, free, n1, stride, n2)
    if first > last:
        return
    sums, bottom, top, wrinkled = workspace.force.x, first - 1, last + 1, False
    for j in range(lanes(n2)):
        sums[j] = works_of(work, j)
    for i in range(bottom, top + 1):
        return_row(nodes, before, uint64(i) * stride, stride, length)
    begin_walk(model, before, workspace, row_at(model, bottom, bottom, top))
    for i in range(bottom, top + 1):
        at, wrinkled_below = row_at(model, i, bottom, top), wrinkled
        update_row_edges(model, before, workspace, at)  # (2.6)
        update_row_tensions(model, workspace, at, False)  # (2.3), (2.9)
        wrinkled = update_row_shear(model, workspace, at, False)  # (2.2)
        hold_row(workspace.mean, at.row, n2, 0.0)
        if at.inside:
            halve_jumps(nodes, free, workspace.mean, at.node, at.row, n2)
            update_row_areas(model, workspace, at)  # (2.7)
            update_row_pressure(model, before, workspace, at, uniform)  # (2.11)
            weight = model.gravity * model.mass[i]
            add_node_work(workspace.area, workspace.pressure, workspace.mean, work, dt, weight, at.row, n2)
        add_row_work(model, work, workspace, at, wrinkled_below, dt)
    for j in range(lanes(n2)):
        work.contact[j] -= works_of(work, j) - sums[j]
