"""The order of one step, and the loop over steps. Start reading here."""

from numba import uint64

from softbrake.core.arrays import Outcome, Scheme
from softbrake.core.cargo import push_cargo, vertical_forces
from softbrake.core.columns import History
from softbrake.core.contact.self_contact import overflown, watch_shell, window_of
from softbrake.core.jit import kernel
from softbrake.core.lanes import FIRST, ONE, clear_row, close_edges, lanes, take_row, total
from softbrake.core.loop.contact_work import add_contact_work_of_shell, begin_contact, resolve_contact
from softbrake.core.loop.ledger import (
    add_belt_work,
    add_cargo_work,
    add_cell_work,
    add_edge_work,
    add_shear_work,
    clear_sums,
    record_energies,
    record_forces,
    record_history,
    update_maximum,
)
from softbrake.core.loop.push import hold_row, lift_row, push_row
from softbrake.core.loop.step_size import stable_step
from softbrake.core.loop.time_loop import begin_step, choose_step, end_step
from softbrake.core.membrane.area import update_area_vectors
from softbrake.core.membrane.belts import add_belt_forces, update_belt_tension
from softbrake.core.membrane.edges import add_cell_forces, clear_edges, clear_forces, update_edge_forces, update_edges
from softbrake.core.membrane.shear import add_diagonal_tension, add_shear_forces, update_shear
from softbrake.core.membrane.tension import update_cell_tension, update_generatrix_tension, update_hoop_tension
from softbrake.core.obstacles import any_above, foresee, may_touch, press_row, rub_row
from softbrake.core.pressure import pressure_at, update_damped_pressure


@kernel
def sweep_rows(model, state, workspace, folding):
    """Advance fabric and cargo by one step, row by row from the ground up. Returns the cover's new height (m).

    folding: whether lobes or folds may meet.

    Row i needs its cells above and below, so the sweep keeps two rows of cells and three of hoop edges. Rows are pushed in
    place as soon as their forces are whole: their old places live on in the edges.
    """
    n1, n2 = model.n1, model.n2
    stride = uint64(model.stride)
    fabric, belts, mass, belt_width = model.fabric, model.belts, model.mass, model.belts.width
    nodes, now, peaks, self_contact = state.nodes, state.now, state.peaks, state.self_contact
    g, h, belt, cells, mean, on_nodes = (
        workspace.generatrix,
        workspace.hoop,
        workspace.belt,
        workspace.cells,
        workspace.mean,
        workspace.pressure,
    )
    force, force_above, area = workspace.force, workspace.force_above, workspace.area
    tension_1, tension_2 = workspace.tension_1, workspace.tension_2
    work, by_column, maximum_1, maximum_2, maximum_belt = (
        state.work,
        workspace.by_column,
        workspace.maximum_generatrix,
        workspace.maximum_hoop,
        workspace.maximum_belt,
    )
    heights, rising = nodes.z, nodes.w
    edge_scheme = model.scheme == Scheme.EDGE
    shear = fabric.g12 > 0.0
    corners = shear or not edge_scheme
    damped = model.pressure.damping > 0.0
    pressure, length = now[History.PRESSURE], now[History.TIME_STEP]
    dt = 0.5 * (state.last_step[0] + length)
    gas_on_cover, on_chords = pressure * model.cover_area, pressure * model.hoop.gas
    gravity, contact, whole = model.gravity, model.obstacles, model.hoop.whole
    step = foresee(now, nodes.w[uint64(n1) * stride + FIRST], gravity, dt, length)
    touching = may_touch(contact, step)
    on_nodes[:] = on_chords
    height, wrinkled, wrinkled_below = 0.0, False, False
    clear_row(force_above)
    clear_sums(maximum_1, maximum_2, maximum_belt, by_column)
    update_edges(nodes, h, FIRST, ONE, FIRST, n2, fabric.h2)  # (2.6)
    close_edges(h, FIRST, n2)
    clear_edges(h, uint64(2) * stride + FIRST, n2)  # below the first row
    clear_edges(g, stride + FIRST, n2)
    for i in range(n1 + 1):
        node = uint64(i) * stride + FIRST
        row = uint64(i % 2) * stride + FIRST  # of mean velocities, and of the cells and generatrix edges above them
        below = uint64((i + 1) % 2) * stride + FIRST  # of the row below, and of the cells and edges below row i
        hoop = uint64(i % 3) * stride + FIRST
        hoop_above = uint64((i + 1) % 3) * stride + FIRST
        hoop_below = uint64((i + 2) % 3) * stride + FIRST
        inside = 0 < i < n1  # else of a cover
        belted = inside and belt_width[i] > 0.0

        if i < n1:
            update_edges(nodes, h, node + stride, ONE, hoop_above, n2, fabric.h2)  # (2.6)
            close_edges(h, hoop_above, n2)
            update_edges(nodes, g, node, stride, row, n2, fabric.h1)
            close_edges(g, row, n2)
        else:
            clear_edges(h, hoop_above, n2)
            clear_edges(g, row, n2)
        update_area_vectors(g, h, area, row, below, hoop, hoop_above, hoop_below, n2)  # (2.7)

        if belted:
            update_belt_tension(belts, i, h, g, belt, tension_2, hoop, below, row, n2)  # (2.3)
            update_maximum(tension_2, maximum_belt, float(i), n2)
        if edge_scheme:
            if i < n1:
                update_generatrix_tension(fabric, g, h, tension_1, row, hoop, hoop_above, n2)  # (2.9)
                update_maximum(tension_1, maximum_1, i + 0.5, n2)
            if inside:
                update_hoop_tension(fabric, h, g, tension_2, hoop, below, row, n2)
                update_maximum(tension_2, maximum_2, float(i), n2)
            else:
                clear_forces(h, hoop, n2)
            update_edge_forces(g, h, force, row, below, hoop, n2)  # (2.8)
        else:
            clear_row(force)
        if corners:
            take_row(force, force_above)
        if i < n1 and not edge_scheme:
            update_cell_tension(fabric, g, h, cells, tension_1, tension_2, row, hoop, hoop_above, row, n2)  # (2.9)
            update_maximum(tension_1, maximum_1, i + 0.5, n2)
            update_maximum(tension_2, maximum_2, i + 0.5, n2)
        wrinkled, wrinkled_below = False, wrinkled
        if i < n1 and shear:
            wrinkled = update_shear(fabric, g, h, cells, row, hoop, hoop_above, row, n2)
            add_shear_forces(g, h, cells, force, force_above, row, hoop, hoop_above, row, n2)  # (2.2)
        if wrinkled:
            add_diagonal_tension(fabric, g, h, cells, tension_1, tension_2, row, hoop, hoop_above, row, n2, not edge_scheme)
            update_maximum(tension_1, maximum_1, i + 0.5, n2)
            update_maximum(tension_2, maximum_2, i + 0.5, n2)
        if i < n1 and (wrinkled or not edge_scheme):
            add_cell_forces(g, h, cells, force, force_above, row, hoop, hoop_above, row, n2)  # (3.2)
        if belted:
            add_belt_forces(belt, h, force, hoop, n2)
        if damped:
            update_damped_pressure(model.pressure, on_chords, nodes, area, on_nodes, node, lanes(n2))  # (2.11)

        if i == 0:
            tension, gas = vertical_forces(force, area, on_nodes, n2)
            now[History.GROUND_FORCE] = whole * (gas_on_cover - gas - tension + n2 * mass[i] * gravity)
            for j in range(lanes(n2)):
                by_column.on_ground[j] -= min(area.z[FIRST + j], 0.0)
            hold_row(mean, row, n2, 0.0)
        elif inside:
            push_row(nodes, force, area, on_nodes, mean, work, by_column, contact, step, mass[i], node, row, n2)  # (3.2)
            if contact.friction > 0.0:
                rub_row(nodes, force, area, on_nodes, mean, work, by_column, contact, step, mass[i], node, row, n2)
            if touching and any_above(heights, rising, step, node, n2):
                press_row(nodes, force, area, on_nodes, mean, work, by_column, contact, step, mass[i], node, row, n2)
        else:
            if folding:
                resolve_contact(model, nodes, work, by_column, workspace.before_contact, self_contact, step, touching)  # (2.5)
            tension, gas = vertical_forces(force, area, on_nodes, n2)
            impulse = total(by_column.on_cargo, n2)
            now[History.CONTACT_FORCE] = whole * (impulse / dt)
            now[History.COVER_FORCE] = whole * (gas_on_cover + gas + tension + impulse / dt)
            moving = model.cargo_mass + n2 * mass[i]
            velocity, height = push_cargo(now, nodes.w[node], step, whole * moving)  # (2.4)
            hold_row(mean, row, n2, 0.5 * (nodes.w[node] + velocity))
            lift_row(nodes, node, n2, velocity, height)
            add_cargo_work(work, by_column, gas_on_cover + gas, gravity * moving, moving, mean.z[row], velocity, dt)
            work.contact[0] += impulse * mean.z[row]
            record_forces(now, peaks, maximum_1, maximum_2, maximum_belt, by_column, n2, dt, whole)
            now[History.GROUND_AREA] = whole * (model.cover_area + model.hoop.gas * total(by_column.on_ground, n2))

        if i > 0 and edge_scheme:
            add_edge_work(g, h, mean, work.elastic, work.viscous, below, row, hoop, dt, n2)
        if belted:
            add_belt_work(belt, h, mean, work.belts, work.viscous, row, hoop, dt, n2)
        if i > 0 and (wrinkled_below or not edge_scheme):
            add_cell_work(g, h, cells, mean, work.elastic, work.viscous, below, hoop_below, hoop, below, below, row, dt, n2)
        if i > 0 and shear:
            add_shear_work(g, h, cells, mean, work.elastic, below, hoop_below, hoop, below, below, row, dt, n2)
    return height


@kernel
def self_contact_step(model, state, by_column):
    """Return the longest step (s) for self-contact, and look whether that is possible until the next choice of the step."""
    return watch_shell(model, state.nodes, state.self_contact, by_column, window_of(model, state))


@kernel
def advance(model, state, workspace, history, interval, most, until):
    """Advance by steps until an event, the time until (s), most steps, or a full history. Returns its rows and the Outcome.

    Every interval-th step writes a row of state.now at its time n to history, shape (rows, len(History)), and an event one
    for its own time.
    """
    now, work, by_column = state.now, state.work, workspace.by_column
    rows = 0
    done = 0
    while done < most and now[History.TIME] < until and rows + 1 < history.shape[0]:
        if state.steps[0] >= state.choice[0]:
            choose_step(state, stable_step(model, state.nodes, workspace))  # (3.3)
            state.stable_step[0] = min(state.stable_step[0], self_contact_step(model, state, by_column) / model.courant)
        length, dt = begin_step(model, state)
        folding = begin_contact(model, state, workspace.before_contact)
        now[History.PRESSURE] = pressure_at(model.pressure, now[History.TIME])  # (2.10)
        height = sweep_rows(model, state, workspace, folding)
        if folding:
            add_contact_work_of_shell(model, state, workspace, dt, length)
        if state.steps[0] % interval == 0:
            record_history(history, rows, now)
            rows += 1
        record_energies(now, work, by_column, model.hoop.whole, model.n2)
        outcome = end_step(model, state, length, height)
        done += 1
        if outcome != Outcome.RUNNING:
            record_history(history, rows, now)
            return rows + 1, outcome
        if overflown(state.self_contact):
            break
    return rows, Outcome.RUNNING
