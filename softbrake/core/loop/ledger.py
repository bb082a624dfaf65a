"""Work of each force over a step, so that the change of kinetic energy can be accounted for to round-off.

The leapfrog turns a force F at time n into the work F (V^{n-1/2} + V^{n+1/2})/2 (n+1/2 - (n-1/2)) exactly; inner forces are
recorded where they arise, as tension times change of length, which checks their assembly. Sums run by column: they vectorise
without reordering, and no digit depends on how.
"""

from softbrake.core.arrays import Peak
from softbrake.core.columns import History
from softbrake.core.jit import kernel
from softbrake.core.lanes import FIRST, ONE, lanes, total
from softbrake.core.peaks import raise_peak


@kernel
def clear_sums(maximum_1, maximum_2, maximum_belt, by_column):
    """Forget the last step's largest tensions, kinetic energy and impulses."""
    maximum_1.tension[:] = 0.0
    maximum_2.tension[:] = 0.0
    maximum_belt.tension[:] = 0.0
    by_column.kinetic[:] = 0.0
    by_column.impulse[:] = 0.0
    by_column.on_ground[:] = 0.0
    by_column.on_cargo[:] = 0.0
    by_column.flux[:] = 0.0
    by_column.swept[:] = 0.0
    by_column.free[:] = 0.0


@kernel
def record_maximum(now, peaks, top, columns, column, which):
    """Write the largest tension of the step (N/m) to a column of now, and raise its peak."""
    largest = 0
    for j in range(columns):
        if top.tension[j] > top.tension[largest]:
            largest = j
    now[column] = top.tension[largest]
    raise_peak(peaks, which, top.tension[largest], now[History.TIME], top.row[largest])


@kernel
def record_forces(now, peaks, workspace, columns, dt, whole):
    """Write the largest tensions of the step and the ground's impulse on the fabric to now, and raise the peaks."""
    record_maximum(now, peaks, workspace.maximum_generatrix, columns, History.TENSION_GENERATRIX, Peak.TENSION_GENERATRIX)
    record_maximum(now, peaks, workspace.maximum_hoop, columns, History.TENSION_HOOP, Peak.TENSION_HOOP)
    record_maximum(now, peaks, workspace.maximum_belt, columns, History.TENSION_BELT, Peak.TENSION_BELT)
    now[History.GROUND_FORCE] += whole * (total(workspace.by_column.impulse, columns) / dt)


@kernel
def record_energies(now, work, by_column, whole, columns):
    """Write kinetic energy and works of the whole shell at n+1/2 to now, for the row of time n+1."""
    now[History.KINETIC_ENERGY] = whole * total(by_column.kinetic, columns)
    now[History.WORK_PRESSURE] = whole * total(work.pressure, columns)
    now[History.WORK_ELASTIC] = whole * total(work.elastic, columns)
    now[History.WORK_VISCOUS] = whole * total(work.viscous, columns)
    now[History.WORK_BELTS] = whole * total(work.belts, columns)
    now[History.WORK_GRAVITY] = whole * total(work.gravity, columns)
    now[History.WORK_GROUND] = whole * total(work.ground, columns)
    now[History.WORK_CONTACT] = whole * total(work.contact, columns)


# Kernels of a row have long parameter lists; softbrake/core/__init__.py says why.
@kernel
def add_edge_work(generatrix, hoop, mean, elastic, viscous, below, row, edge, dt, columns):
    """Add the work of the generatrix edges below a row, and of the row's hoop edges, on the nodes at their starts and ends.

    Reads generatrix.x, y, z, force, elastic at offset below, hoop at edge; mean (m/s) at offsets below, row; dt (s).
    Writes elastic, viscous (J), by column.
    """
    for j in range(lanes(columns)):
        a = below + j
        b = row + j
        c = edge + j
        short_x, short_y, short_z = mean.x[a] - mean.x[b], mean.y[a] - mean.y[b], mean.z[a] - mean.z[b]
        narrow_x, narrow_y, narrow_z = mean.x[b] - mean.x[b + ONE], mean.y[b] - mean.y[b + ONE], mean.z[b] - mean.z[b + ONE]
        shorter = generatrix.x[a] * short_x + generatrix.y[a] * short_y + generatrix.z[a] * short_z
        narrower = hoop.x[c] * narrow_x + hoop.y[c] * narrow_y + hoop.z[c] * narrow_z
        returned = generatrix.elastic[a] * shorter + hoop.elastic[c] * narrower
        whole = generatrix.force[a] * shorter + hoop.force[c] * narrower
        elastic[j] += dt * returned
        viscous[j] += dt * (whole - returned)


@kernel
def add_belt_work(belt, hoop, mean, elastic, viscous, row, edge, dt, columns):
    """Add the work of the belt on a row of hoop edges, as add_edge_work does that of the fabric's."""
    for j in range(lanes(columns)):
        b = row + j
        c = edge + j
        d = FIRST + j
        narrow_x, narrow_y, narrow_z = mean.x[b] - mean.x[b + ONE], mean.y[b] - mean.y[b + ONE], mean.z[b] - mean.z[b + ONE]
        narrower = dt * (hoop.x[c] * narrow_x + hoop.y[c] * narrow_y + hoop.z[c] * narrow_z)
        elastic[j] += belt.elastic[d] * narrower
        viscous[j] += (belt.force[d] - belt.elastic[d]) * narrower


@kernel
def add_cell_work(generatrix, hoop, cells, mean, elastic, viscous, edge, lower_hoop, upper_hoop, cell, lower, upper, dt, columns):
    """Add the work of one row of cells of the printed scheme on their corners.

    Reads the edges and cells as add_cell_forces does, mean (m/s) at offsets lower, upper. Writes elastic, viscous (J), (n2,).
    """
    for j in range(lanes(columns)):
        g = edge + j
        a = lower_hoop + j
        b = upper_hoop + j
        c = cell + j
        k = lower + j
        m = upper + j
        up = 0.0
        right = 0.0
        up += (generatrix.x[g] + generatrix.x[g + ONE]) * (mean.x[k] + mean.x[k + ONE] - mean.x[m] - mean.x[m + ONE])
        up += (generatrix.y[g] + generatrix.y[g + ONE]) * (mean.y[k] + mean.y[k + ONE] - mean.y[m] - mean.y[m + ONE])
        up += (generatrix.z[g] + generatrix.z[g + ONE]) * (mean.z[k] + mean.z[k + ONE] - mean.z[m] - mean.z[m + ONE])
        right += (hoop.x[a] + hoop.x[b]) * (mean.x[k] + mean.x[m] - mean.x[k + ONE] - mean.x[m + ONE])
        right += (hoop.y[a] + hoop.y[b]) * (mean.y[k] + mean.y[m] - mean.y[k + ONE] - mean.y[m + ONE])
        right += (hoop.z[a] + hoop.z[b]) * (mean.z[k] + mean.z[m] - mean.z[k + ONE] - mean.z[m + ONE])
        returned = dt * (cells.elastic_1[c] * up + cells.elastic_2[c] * right)
        elastic[j] += returned
        viscous[j] += dt * (cells.force_1[c] * up + cells.force_2[c] * right) - returned


@kernel
def add_shear_work(generatrix, hoop, cells, mean, elastic, edge, lower_hoop, upper_hoop, cell, lower, upper, dt, columns):
    """Add the work of T12 of one row of cells on their corners. Reads as add_cell_work. Writes elastic (J), (n2,)."""
    for j in range(lanes(columns)):
        g = edge + j
        a = lower_hoop + j
        b = upper_hoop + j
        k = lower + j
        m = upper + j
        power = 0.0
        power += (hoop.x[a] + hoop.x[b]) * (mean.x[k] + mean.x[k + ONE] - mean.x[m] - mean.x[m + ONE])
        power += (hoop.y[a] + hoop.y[b]) * (mean.y[k] + mean.y[k + ONE] - mean.y[m] - mean.y[m + ONE])
        power += (hoop.z[a] + hoop.z[b]) * (mean.z[k] + mean.z[k + ONE] - mean.z[m] - mean.z[m + ONE])
        power += (generatrix.x[g] + generatrix.x[g + ONE]) * (mean.x[k] + mean.x[m] - mean.x[k + ONE] - mean.x[m + ONE])
        power += (generatrix.y[g] + generatrix.y[g + ONE]) * (mean.y[k] + mean.y[m] - mean.y[k + ONE] - mean.y[m + ONE])
        power += (generatrix.z[g] + generatrix.z[g + ONE]) * (mean.z[k] + mean.z[m] - mean.z[k + ONE] - mean.z[m + ONE])
        elastic[j] += dt * cells.shear[cell + j] * power


@kernel
def add_cargo_work(work, by_column, gas, weight, mass, between, after, dt):
    """Add the cargo's share, with its row of fabric: work of the gas and of the weight (N), kinetic energy.

    Reads between, after: its mean velocity in the step and that at n+1/2 (m/s); mass (kg); dt (s).
    Writes the first column of work.pressure, work.gravity, by_column.kinetic (J).
    """
    work.pressure[0] += dt * gas * between
    work.gravity[0] -= dt * weight * between
    by_column.kinetic[0] += 0.5 * mass * after * after


@kernel
def update_maximum(tension, top, row, columns):
    """Update the largest tension of the step by column, and the row where it stands, by the tension of a row."""
    largest, where = top.tension, top.row
    for j in range(lanes(columns)):
        larger = tension[FIRST + j] > largest[j]
        largest[j] = tension[FIRST + j] if larger else largest[j]
        where[j] = row if larger else where[j]


@kernel
def record_history(history, row, now):
    """Write now to a row of the history."""
    for column in range(now.size):
        history[row, column] = now[column]
