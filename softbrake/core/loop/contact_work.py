"""Works over the jumps of velocity by contact between rows: at belts, and self-contact.

Rows are pushed and their works booked before that contact is resolved, as if there were none. The jumps belong to the same step:
half of each is in the mean of the velocities at n-1/2 and n+1/2, over which gas, weight and tensions work. So here the rows that
jumped are gone through once more, as they were at n, and the works over half the jumps are added. What the others do less
against contact, contact takes less: its own work changes by the opposite of theirs. That of the ground is as the push left it.
"""

from numba import uint64

from softbrake.core.arrays import Scheme
from softbrake.core.columns import History
from softbrake.core.contact.belt_contact import may_fold, resolve_belt_contact
from softbrake.core.contact.self_contact import resolve_self_contact, self_contact_due
from softbrake.core.jit import kernel
from softbrake.core.lanes import FIRST, ONE, close_edges, close_vectors, lanes
from softbrake.core.loop.ledger import add_belt_work, add_cell_work, add_edge_work, add_shear_work
from softbrake.core.loop.push import hold_row
from softbrake.core.membrane.area import update_area_vectors
from softbrake.core.membrane.belts import update_belt_tension
from softbrake.core.membrane.edges import update_edges
from softbrake.core.membrane.shear import add_diagonal_tension, update_shear
from softbrake.core.membrane.tension import update_cell_tension, update_generatrix_tension, update_hoop_tension
from softbrake.core.pressure import update_damped_pressure


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
def resolve_contact(model, nodes, work, by_column, before_contact, self_contact, step, touching):
    """Resolve contact at belts and self-contact after all rows are pushed, and keep the velocities at n+1/2 before.

    Reads model, step; touching: whether cover and cargo are in the way. Writes nodes, work.contact; by_column.kinetic,
    on_cargo, impulse; before_contact, of whose before only scratch in its places; self_contact.
    """
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

    dt: from n-1/2 to n+1/2; length: from n to n+1 (s). Reads model, state.nodes at n+1, now[PRESSURE] of n,
    workspace.before_contact. Writes state.work; scratch in workspace, which it goes through as sweep_rows does.
    """
    n1, n2, stride, fabric, belts = model.n1, model.n2, uint64(model.stride), model.fabric, model.belts
    nodes, work, on_chords = state.nodes, state.work, state.now[History.PRESSURE] * model.hoop.gas
    before, free = workspace.before_contact.before, workspace.before_contact.free
    first, last = find_jumps(nodes, free, n1, stride, n2)
    if first > last:
        return
    g, h, belt, cells, mean, on_nodes = (
        workspace.generatrix,
        workspace.hoop,
        workspace.belt,
        workspace.cells,
        workspace.mean,
        workspace.pressure,
    )
    tension_1, tension_2 = workspace.tension_1, workspace.tension_2
    edge_scheme, shear, sums = model.scheme == Scheme.EDGE, fabric.g12 > 0.0, workspace.force.x
    for j in range(lanes(n2)):
        sums[j] = works_of(work, j)
    for i in range(first - 1, last + 2):
        return_row(nodes, before, uint64(i) * stride, stride, length)
    start, wrinkled, wrinkled_below = uint64((first - 1) % 3) * stride + FIRST, False, False
    update_edges(before, h, uint64(first - 1) * stride + FIRST, ONE, start, n2, fabric.h2)  # (2.6)
    close_edges(h, start, n2)
    for i in range(first - 1, last + 2):
        node = uint64(i) * stride + FIRST
        row, below = uint64(i % 2) * stride + FIRST, uint64((i + 1) % 2) * stride + FIRST
        hoop, hoop_above = uint64(i % 3) * stride + FIRST, uint64((i + 1) % 3) * stride + FIRST
        hoop_below = uint64((i + 2) % 3) * stride + FIRST
        belted = first <= i <= last and belts.width[i] > 0.0
        hold_row(mean, row, n2, 0.0)
        if i <= last:
            update_edges(before, h, node + stride, ONE, hoop_above, n2, fabric.h2)
            close_edges(h, hoop_above, n2)
            update_edges(before, g, node, stride, row, n2, fabric.h1)
            close_edges(g, row, n2)
        if belted:
            update_belt_tension(belts, i, h, g, belt, tension_2, hoop, below, row, n2)  # (2.3)
        if i <= last and edge_scheme:
            update_generatrix_tension(fabric, g, h, tension_1, row, hoop, hoop_above, n2)  # (2.9)
        if first <= i <= last and edge_scheme:
            update_hoop_tension(fabric, h, g, tension_2, hoop, below, row, n2)
        if i <= last and not edge_scheme:
            update_cell_tension(fabric, g, h, cells, tension_1, tension_2, row, hoop, hoop_above, row, n2)
        wrinkled, wrinkled_below = False, wrinkled
        if i <= last and shear:
            wrinkled = update_shear(fabric, g, h, cells, row, hoop, hoop_above, row, n2)
        if wrinkled:
            add_diagonal_tension(fabric, g, h, cells, tension_1, tension_2, row, hoop, hoop_above, row, n2, not edge_scheme)
        if first <= i <= last:
            halve_jumps(nodes, free, mean, node, row, n2)
            update_area_vectors(g, h, workspace.area, row, below, hoop, hoop_above, hoop_below, n2)  # (2.7)
            if model.pressure.damping > 0.0:
                update_damped_pressure(model.pressure, on_chords, before, workspace.area, on_nodes, node, lanes(n2))  # (2.11)
            add_node_work(workspace.area, on_nodes, mean, work, dt, model.gravity * model.mass[i], row, n2)
        if belted:
            add_belt_work(belt, h, mean, work.belts, work.viscous, row, hoop, dt, n2)
        if i >= first and edge_scheme:
            add_edge_work(g, h, mean, work.elastic, work.viscous, below, row, hoop, dt, n2)
        if i >= first and (wrinkled_below or not edge_scheme):
            add_cell_work(g, h, cells, mean, work.elastic, work.viscous, below, hoop_below, hoop, below, below, row, dt, n2)
        if i >= first and shear:
            add_shear_work(g, h, cells, mean, work.elastic, below, hoop_below, hoop, below, below, row, dt, n2)
    for j in range(lanes(n2)):
        work.contact[j] -= works_of(work, j) - sums[j]
