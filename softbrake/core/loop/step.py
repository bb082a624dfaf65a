"""The order of one step, and the loop over steps. Start reading here."""

from numba import uint64

from softbrake.core.arrays import GasState, Meeting, Outcome
from softbrake.core.cargo import push_cargo, vertical_forces
from softbrake.core.columns import History
from softbrake.core.contact.obstacles import add_free_area, any_above, foresee, may_touch, press_row, rub_row
from softbrake.core.contact.self_contact import contact_open, overflown, watch_shell, window_of
from softbrake.core.gas import limit_with_gas
from softbrake.core.jit import kernel
from softbrake.core.lanes import FIRST, clear_row, lanes, total
from softbrake.core.loop.contact_work import add_contact_work_of_shell, begin_contact, leave_contact, resolve_contact
from softbrake.core.loop.ledger import (
    add_cargo_work,
    clear_sums,
    record_energies,
    record_forces,
    record_history,
)
from softbrake.core.loop.push import hold_row, move_cover_row, push_row
from softbrake.core.loop.rows import (
    add_row_work,
    begin_walk,
    row_at,
    update_row_areas,
    update_row_edges,
    update_row_forces,
    update_row_pressure,
    update_row_shear,
    update_row_tensions,
)
from softbrake.core.loop.step_size import stable_step
from softbrake.core.loop.time_loop import begin_step, choose_step, end_step
from softbrake.core.membrane.volume import add_flux, next_volume, shell_volume


@kernel
def take_step(model, state, workspace, step, meeting):
    """Advance fabric and cargo by one step, row by row from the ground up. Returns the cover's new height (m).

    Rows are pushed in place as soon as their forces are whole: their old places live on in the edges.
    meeting: the Meeting of lobes and folds. Writes state, scratch in workspace.
    """
    n1, now = model.n1, state.now
    dt, uniform = step.dt, now[History.PRESSURE] * model.hoop.gas
    touching = may_touch(model.obstacles)
    height, wrinkled = 0.0, False
    begin_step_of_shell(model, state.nodes, workspace, uniform)
    for i in range(n1 + 1):
        at, wrinkled_below = row_at(model, i, 0, n1), wrinkled
        update_row_edges(model, state.nodes, workspace, at)  # (2.6)
        update_row_areas(model, workspace, at)  # (2.7)
        update_row_tensions(model, workspace, at, True)  # (2.3), (2.9)
        wrinkled = update_row_shear(model, workspace, at, True)  # (2.2)
        update_row_forces(model, workspace, at, wrinkled)  # (2.2), (2.3), (2.8), (3.2)
        update_row_pressure(model, state.nodes, workspace, at, uniform)  # (2.11)
        if i == 0:
            hold_ground_row(model, now, workspace, at)
        elif i < n1:
            push_free_row(model, state, workspace, step, at, touching)  # (3.2), (3.4)
        else:
            if meeting == Meeting.NOW:
                resolve_contact(model, state, workspace, step, touching)  # (2.5)
            elif meeting == Meeting.LATER:
                leave_contact(model, state, step)
            height = push_cover_row(model, state, workspace, step, at)  # (2.4), (3.4)
        if model.gas.exponent > 0.0:
            add_flux(state.nodes, workspace.area, workspace.by_column, at.node, model.n2)
        add_row_work(model, state.work, workspace, at, wrinkled_below, dt)
    if model.gas.exponent > 0.0:
        update_volume(model, state, workspace, step, meeting == Meeting.NOW)
    return height


@kernel
def update_volume(model, state, workspace, step, meeting):
    """Write the volume (m^3) at the end of the step, of a shell whose rows have all moved, to state.gas.

    meeting: whether contact between rows has moved them besides.
    """
    chamber, velocity = state.gas, state.nodes.w[uint64(model.n1) * uint64(model.stride) + FIRST]
    volume = next_volume(model, chamber, workspace.by_column, state.now[History.HEIGHT], velocity, step.length)
    if meeting:
        volume = shell_volume(model, state.nodes, workspace.by_column.rate)
        chamber[GasState.EXPECTED_AFTER] = 0.0
    chamber[GasState.NEXT_VOLUME] = volume
    chamber[GasState.FREE_AREA] = model.hoop.whole * model.hoop.gas * total(workspace.by_column.free, model.n2)


@kernel
def begin_step_of_shell(model, nodes, workspace, uniform):
    """Clear sums and scratch, and set the pressure (Pa) of all nodes. Writes workspace."""
    workspace.pressure[:] = uniform
    clear_row(workspace.force_above)
    clear_sums(workspace.maximum_generatrix, workspace.maximum_hoop, workspace.maximum_belt, workspace.by_column)
    begin_walk(model, nodes, workspace, row_at(model, 0, 0, model.n1))


@kernel
def hold_ground_row(model, now, workspace, at):
    """Hold the row on the ground, and write what lies on it and presses it there to now, by_column.on_ground."""
    n2, on_ground = model.n2, workspace.by_column.on_ground
    tension, gas = vertical_forces(workspace.force, workspace.area, workspace.pressure, n2)
    gas_on_cover = now[History.PRESSURE] * model.base_area
    now[History.GROUND_FORCE] = model.hoop.whole * (gas_on_cover - gas - tension + n2 * model.mass[0] * model.gravity)
    for j in range(lanes(n2)):
        on_ground[j] -= min(workspace.area.z[FIRST + j], 0.0)
    hold_row(workspace.mean, at.row, n2, 0.0)


@kernel
def push_free_row(model, state, workspace, step, at, touching):
    """Push a row of free nodes, and stop it at ground, cover and cargo. touching: of cover and cargo."""
    nodes, work, obstacles, mass, n2 = state.nodes, state.work, model.obstacles, model.mass[at.i], model.n2
    force, area, pressure, mean, by_column = (
        workspace.force,
        workspace.area,
        workspace.pressure,
        workspace.mean,
        workspace.by_column,
    )
    push_row(nodes, force, area, pressure, mean, work, by_column, obstacles, step, mass, at.node, at.row, n2)
    if obstacles.friction > 0.0:
        rub_row(nodes, force, area, pressure, mean, work, by_column, obstacles, step, mass, at.node, at.row, n2)
    if touching and any_above(nodes.z, nodes.w, step, at.node, n2):
        press_row(nodes, force, area, pressure, mean, work, by_column, obstacles, step, mass, at.node, at.row, n2)
    if model.gas.leaks == 1:
        halves = 0.5 * (int(at.i == 1) + int(at.i == model.n1 - 1))  # of the cells next to the covers
        add_free_area(nodes, area, by_column.free, obstacles, step, at.node, FIRST, n2, 1.0 + halves)


@kernel
def push_cover_row(model, state, workspace, step, at):
    """Push the cargo with its row of fabric, and write forces and maxima of the step to now. Returns the height (m) at n+1."""
    nodes, now, work, by_column, n2, whole = state.nodes, state.now, state.work, workspace.by_column, model.n2, model.hoop.whole
    tension, gas = vertical_forces(workspace.force, workspace.area, workspace.pressure, n2)
    impulse, gas_on_cover = total(by_column.on_cargo, n2), now[History.PRESSURE] * model.cover_area
    now[History.CONTACT_FORCE] = whole * (impulse / step.dt)
    now[History.COVER_FORCE] = whole * (gas_on_cover + gas + tension + impulse / step.dt)
    moving = model.cargo_mass + n2 * model.mass[at.i]
    velocity, height = push_cargo(now, nodes.w[at.node], step, whole * moving)  # (2.4)
    hold_row(workspace.mean, at.row, n2, 0.5 * (nodes.w[at.node] + velocity))
    move_cover_row(nodes, at.node, n2, velocity, height)
    between = workspace.mean.z[at.row]
    add_cargo_work(work, by_column, gas_on_cover + gas, model.gravity * moving, moving, between, velocity, step.dt)
    work.contact[0] += impulse * between
    record_forces(now, state.peaks, workspace, n2, step.dt, whole)
    now[History.GROUND_AREA] = whole * (model.base_area + model.hoop.gas * total(by_column.on_ground, n2))
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
    now, work, by_column, top = state.now, state.work, workspace.by_column, uint64(model.n1) * uint64(model.stride) + FIRST
    rows = 0
    done = 0
    while done < most and (now[History.TIME] < until or contact_open(state.self_contact)) and rows + 1 < history.shape[0]:
        if state.steps[0] >= state.choice[0]:
            limit = stable_step(model, state.nodes, workspace)
            choose_step(state, limit_with_gas(model, state, workspace.by_row, limit))  # (3.3)
            state.stable_step[0] = min(state.stable_step[0], self_contact_step(model, state, by_column) / model.courant)
        length, dt = begin_step(model, state)
        step = foresee(now, state.nodes.w[top], model.gravity, dt, length)
        meeting = begin_contact(model, state, workspace, step)
        height = take_step(model, state, workspace, step, meeting)
        if meeting == Meeting.NOW:
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
