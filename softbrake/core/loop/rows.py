"""The shell row by row, from the ground up: what a step, the work of contact and pictures have in common.

Row i of nodes needs the cells above and below it, so two rows of generatrix edges and cells and three of hoop edges are kept.

    hoop_above ──┬──────┬── i + 1
            row  │ cell │      generatrix edges and cells above row i
    hoop      ───┼──────┼── i
            below│ cell │
    hoop_below ──┴──────┴── i - 1

A walk goes from a row `bottom` to a row `top`, whose nodes are held: by the covers, or as what does not change.
"""

from numba import uint64

from softbrake.core.arrays import Row, Scheme
from softbrake.core.jit import kernel
from softbrake.core.lanes import FIRST, ONE, clear_row, close_edges, lanes, take_row
from softbrake.core.loop.ledger import add_belt_work, add_cell_work, add_edge_work, add_shear_work, update_maximum
from softbrake.core.membrane.area import update_area_vectors
from softbrake.core.membrane.belts import add_belt_forces, update_belt_tension
from softbrake.core.membrane.edges import add_cell_forces, clear_edges, clear_forces, update_edge_forces, update_edges
from softbrake.core.membrane.shear import add_diagonal_tension, add_shear_forces, update_shear
from softbrake.core.membrane.tension import update_cell_tension, update_generatrix_tension, update_hoop_tension
from softbrake.core.pressure import update_damped_pressure
from softbrake.core.shape import cloth_above, cloth_around


@kernel
def row_at(model, i, bottom, top):
    """Return the Row i of a walk from row bottom to row top."""
    stride = uint64(model.stride)
    inside = bottom < i < top
    return Row(
        i,
        uint64(i) * stride + FIRST,
        uint64(i % 2) * stride + FIRST,
        uint64((i + 1) % 2) * stride + FIRST,
        uint64(i % 3) * stride + FIRST,
        uint64((i + 1) % 3) * stride + FIRST,
        uint64((i + 2) % 3) * stride + FIRST,
        i > bottom,
        i < top,
        inside,
        inside and model.belts.width[i] > 0.0,
    )


@kernel
def begin_walk(model, nodes, workspace, at):
    """Update the hoop edges of the lowest row of a walk, and clear what would be below it. Reads nodes. Writes workspace."""
    h, n2 = workspace.hoop, model.n2
    update_edges(nodes, h, at.node, ONE, at.hoop, n2, model.shape.h2[at.i])  # (2.6)
    close_edges(h, at.hoop, n2)
    clear_edges(h, at.hoop_below, n2)
    clear_edges(workspace.generatrix, at.below, n2)


@kernel
def update_row_edges(model, nodes, workspace, at):
    """Update the generatrix edges above a row and the hoop edges of the next. Reads nodes. Writes workspace."""
    g, h, n2, stride = workspace.generatrix, workspace.hoop, model.n2, uint64(model.stride)
    if at.has_above:
        update_edges(nodes, h, at.node + stride, ONE, at.hoop_above, n2, model.shape.h2[at.i + 1])
        close_edges(h, at.hoop_above, n2)
        update_edges(nodes, g, at.node, stride, at.row, n2, model.shape.h1[at.i])
        close_edges(g, at.row, n2)
    else:
        clear_edges(h, at.hoop_above, n2)
        clear_edges(g, at.row, n2)


@kernel
def update_row_areas(model, workspace, at):
    """Update the area vectors of a row of nodes. Reads edges. Writes workspace.area (m^2)."""
    g, h, area = workspace.generatrix, workspace.hoop, workspace.area
    update_area_vectors(g, h, area, at.row, at.below, at.hoop, at.hoop_above, at.hoop_below, model.n2)


@kernel
def update_row_pressure(model, nodes, workspace, at, uniform):
    """Update the pressure (Pa) on a row of nodes, where the gas is damped. Writes workspace.pressure."""
    if model.pressure.damping > 0.0:
        count = lanes(model.n2)
        update_damped_pressure(model.pressure, uniform, nodes, workspace.area, workspace.pressure, at.node, count)


@kernel
def update_row_tensions(model, workspace, at, recording):
    """Update the tensions of the belt and the hoop edges of a row, and of the generatrix edges or cells above it.

    recording: whether running maxima are kept. Reads and writes workspace.
    """
    g, h, cells, n2 = workspace.generatrix, workspace.hoop, workspace.cells, model.n2
    tension_1, tension_2 = workspace.tension_1, workspace.tension_2
    row, hoop = float(at.i), at.hoop
    if at.belted:
        update_belt_tension(model.belts, at.i, h, g, workspace.belt, tension_2, hoop, at.below, at.row, n2)  # (2.3)
        if recording:
            update_maximum(tension_2, workspace.maximum_belt, row, n2)
    if model.scheme == Scheme.EDGE:
        if at.has_above:
            update_generatrix_tension(cloth_above(model, at.i), g, h, tension_1, at.row, hoop, at.hoop_above, n2)  # (2.9)
            if recording:
                update_maximum(tension_1, workspace.maximum_generatrix, row + 0.5, n2)
        if at.inside:
            update_hoop_tension(cloth_around(model, at.i), h, g, tension_2, hoop, at.below, at.row, n2)  # (2.9)
            if recording:
                update_maximum(tension_2, workspace.maximum_hoop, row, n2)
        else:
            clear_forces(h, hoop, n2)
    elif at.has_above:
        fabric = cloth_above(model, at.i)
        update_cell_tension(fabric, g, h, cells, tension_1, tension_2, at.row, hoop, at.hoop_above, at.row, n2)  # (2.9)
        if recording:
            record_cell_tensions(workspace, row, n2)


@kernel
def update_row_shear(model, workspace, at, recording):
    """Update the shear of the cells above a row, and the tension it brings. Returns whether it brings some."""
    g, h, cells, n2 = workspace.generatrix, workspace.hoop, workspace.cells, model.n2
    if model.fabric.g12 == 0.0 or not at.has_above:
        return False
    fabric = cloth_above(model, at.i)
    wrinkled = update_shear(fabric, g, h, cells, at.row, at.hoop, at.hoop_above, at.row, n2)
    if wrinkled:
        tension_1, tension_2, onto = workspace.tension_1, workspace.tension_2, model.scheme != Scheme.EDGE
        add_diagonal_tension(fabric, g, h, cells, tension_1, tension_2, at.row, at.hoop, at.hoop_above, at.row, n2, onto)
        if recording:
            record_cell_tensions(workspace, float(at.i), n2)
    return wrinkled


@kernel
def record_cell_tensions(workspace, row, columns):
    """Raise the running maxima by the tensions of the cells above a row."""
    update_maximum(workspace.tension_1, workspace.maximum_generatrix, row + 0.5, columns)
    update_maximum(workspace.tension_2, workspace.maximum_hoop, row + 0.5, columns)


@kernel
def update_row_forces(model, workspace, at, wrinkled):
    """Update the forces of all tensions on the nodes of a row; those of its upper cells on the next row are kept for that.

    wrinkled: of the cells above. Reads workspace. Writes workspace.force, force_above (N).
    """
    g, h, cells, n2 = workspace.generatrix, workspace.hoop, workspace.cells, model.n2
    force, force_above = workspace.force, workspace.force_above
    edge_scheme, shear = model.scheme == Scheme.EDGE, model.fabric.g12 > 0.0
    if edge_scheme:
        update_edge_forces(g, h, force, at.row, at.below, at.hoop, n2)  # (2.8)
    else:
        clear_row(force)
    if shear or not edge_scheme:
        take_row(force, force_above)
    if at.has_above and shear:
        add_shear_forces(g, h, cells, force, force_above, at.row, at.hoop, at.hoop_above, at.row, n2)  # (2.2)
    if at.has_above and (wrinkled or not edge_scheme):
        add_cell_forces(g, h, cells, force, force_above, at.row, at.hoop, at.hoop_above, at.row, n2)  # (3.2)
    if at.belted:
        add_belt_forces(workspace.belt, h, force, at.hoop, n2)  # (2.3)


@kernel
def add_row_work(model, work, workspace, at, wrinkled_below, dt):
    """Add the works of a row of hoop edges and of the cells and generatrix edges below it over the mean velocities.

    wrinkled_below: of the cells below. Reads workspace. Writes work (J).
    """
    g, h, cells, mean, n2 = workspace.generatrix, workspace.hoop, workspace.cells, workspace.mean, model.n2
    elastic, viscous, below, row, hoop = work.elastic, work.viscous, at.below, at.row, at.hoop
    edge_scheme = model.scheme == Scheme.EDGE
    if at.has_below and edge_scheme:
        add_edge_work(g, h, mean, elastic, viscous, below, row, hoop, dt, n2)
    if at.belted:
        add_belt_work(workspace.belt, h, mean, work.belts, viscous, row, hoop, dt, n2)
    if at.has_below and (wrinkled_below or not edge_scheme):
        add_cell_work(g, h, cells, mean, elastic, viscous, below, at.hoop_below, hoop, below, below, row, dt, n2)
    if at.has_below and model.fabric.g12 > 0.0:
        add_shear_work(g, h, cells, mean, elastic, below, at.hoop_below, hoop, below, below, row, dt, n2)
