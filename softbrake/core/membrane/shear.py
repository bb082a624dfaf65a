"""Shear of the cells of the fabric, and the tension it brings where it straightens wrinkles. T12 of Eq. (2.2)."""

from softbrake.core.arrays import Law
from softbrake.core.jit import kernel
from softbrake.core.lanes import FIRST, ONE, lanes
from softbrake.core.membrane.tension import field_tension


@kernel
def update_shear(fabric, generatrix, hoop, cells, edge, lower, upper, cell, columns):
    """Update T12 of one row of cells from column -1 on. T12 = T21 of (2.2) = G12 times r1 r2 of (2.6).

    r1 r2 is the sine of the shear angle for small elongations; with T12 √G22 e2 = T12 r2 in (2.2) it has the potential
    G12 (r1 r2)²/2 per unloaded area, of which a tension field keeps what wrinkles along the cell's diagonals leave; see
    diagonal_wrinkle. Under the laws of (2.9) it is linear, and not cut where the fabric is slack.
    Reads generatrix at offset edge, hoop at lower and upper. Writes cells.shear (N/m: corner force over the edge sums). Returns
    whether some cell has such wrinkles.
    """
    field, wrinkles = fabric.law == Law.TENSION_FIELD, 0
    quarter = 0.25 * fabric.g12
    for j in range(lanes(columns + 1)):
        g = edge + j - ONE
        a = lower + j - ONE
        b = upper + j - ONE
        E1, E2, sine = strains_of_cell(fabric, generatrix, hoop, g, a, b)
        free = diagonal_wrinkle(fabric, E1, E2, abs(sine)) if field else 0.0
        wrinkles |= int(free > 0.0)
        cells.shear[cell + j - ONE] = quarter * (sine - 2.0 * (free if sine > 0.0 else -free))
    return wrinkles > 0


@kernel
def strains_of_cell(fabric, generatrix, hoop, g, a, b):
    """Return Green's strains along generatrix and hoop of a cell, and r1 r2. Eq. (2.6) by the means of its edge vectors."""
    x1, x2 = generatrix.x[g] + generatrix.x[g + ONE], hoop.x[a] + hoop.x[b]
    y1, y2 = generatrix.y[g] + generatrix.y[g + ONE], hoop.y[a] + hoop.y[b]
    z1, z2 = generatrix.z[g] + generatrix.z[g + ONE], hoop.z[a] + hoop.z[b]
    E1 = (x1 * x1 + y1 * y1 + z1 * z1) * (0.125 / (fabric.h1 * fabric.h1)) - 0.5
    E2 = (x2 * x2 + y2 * y2 + z2 * z2) * (0.125 / (fabric.h2 * fabric.h2)) - 0.5
    return E1, E2, (x1 * x2 + y1 * y2 + z1 * z2) * (0.25 / (fabric.h1 * fabric.h2))


@kernel
def diagonal_wrinkle(fabric, E1, E2, sine):
    """Return the amplitude b of wrinkles along the diagonal that shear shortens, of a cell of Green's strains E1, E2.

    sine: r1 r2, not negative. They add b to both strains and take 2 b from the sine, and cost nothing: b is that of least energy
    W(E1 + b, E2 + b) + G12 (sine - 2 b)²/2, where T1 + T2 = 2 T12, or 0. T1 + T2 of the tension field is the largest of four
    linear functions of b: slack, wrinkled along either direction, taut.
    """
    four, push = 4.0 * fabric.g12, 2.0 * fabric.g12 * sine
    both_1, both_2 = fabric.c11 + fabric.c12, fabric.c22 + fabric.c12
    one = (push - fabric.e11 * E1) / (fabric.e11 + four)
    two = (push - fabric.e22 * E2) / (fabric.e22 + four)
    taut = (push - both_1 * E1 - both_2 * E2) / (both_1 + both_2 + four)
    return max(min(min(one, two), min(taut, 0.5 * sine)), 0.0)


# Kernels of a row have long parameter lists; softbrake/core/__init__.py says why.
@kernel
def add_diagonal_tension(fabric, generatrix, hoop, cells, tension_1, tension_2, edge, lower, upper, cell, columns, onto):
    """Add the tensions that shear brings where it straightens the wrinkles of a row of cells, those of update_shear.

    The potential of shear falls with either strain: T(E1 + b, E2 + b) - T(E1, E2) along generatrix and hoop.
    onto: whether cells already have tensions. Writes cells.force_1, force_2, elastic_1, elastic_2 as update_cell_tension; for the
    report, tension_1, tension_2 (N/m) of the cells with what shear brings, 0 without such wrinkles.
    """
    aspect = 0.25 * fabric.h2 / fabric.h1
    per_aspect = 0.0625 / aspect
    for j in range(lanes(columns + 1)):
        g = edge + j - ONE
        a = lower + j - ONE
        b = upper + j - ONE
        c = cell + j - ONE
        E1, E2, sine = strains_of_cell(fabric, generatrix, hoop, g, a, b)
        free = diagonal_wrinkle(fabric, E1, E2, abs(sine))
        F1, F2 = E1 + free, E2 + free
        pull_1 = field_tension(fabric.e11 * F1, fabric.c11 * F1, fabric.c12 * F2)
        pull_2 = field_tension(fabric.e22 * F2, fabric.c22 * F2, fabric.c12 * F1)
        tension_1[FIRST + j - ONE] = pull_1 if free > 0.0 else 0.0
        tension_2[FIRST + j - ONE] = pull_2 if free > 0.0 else 0.0
        added_1 = aspect * (pull_1 - field_tension(fabric.e11 * E1, fabric.c11 * E1, fabric.c12 * E2))
        added_2 = per_aspect * (pull_2 - field_tension(fabric.e22 * E2, fabric.c22 * E2, fabric.c12 * E1))
        cells.force_1[c] = added_1 + (cells.force_1[c] if onto else 0.0)
        cells.force_2[c] = added_2 + (cells.force_2[c] if onto else 0.0)
        cells.elastic_1[c] = added_1 + (cells.elastic_1[c] if onto else 0.0)
        cells.elastic_2[c] = added_2 + (cells.elastic_2[c] if onto else 0.0)


@kernel
def add_shear_forces(generatrix, hoop, cells, force, force_above, edge, lower, upper, cell, columns):
    """Add the corner forces of T12 = T21 of one row of cells. Eq. (2.2), second terms of both brackets.

    As add_cell_forces with the edges exchanged: shear (N/m) times the sum of the cell's hoop edges upwards on the lower corners,
    and times the sum of its generatrix edges to the right on the left corners. Writes force (N) of the row below, force_above.
    """
    for j in range(lanes(columns)):
        g = edge + j
        a = lower + j
        b = upper + j
        right = cells.shear[cell + j]
        left = cells.shear[cell + j - ONE]
        d = FIRST + j
        x1 = right * (hoop.x[a] + hoop.x[b]) + left * (hoop.x[a - ONE] + hoop.x[b - ONE])
        y1 = right * (hoop.y[a] + hoop.y[b]) + left * (hoop.y[a - ONE] + hoop.y[b - ONE])
        z1 = right * (hoop.z[a] + hoop.z[b]) + left * (hoop.z[a - ONE] + hoop.z[b - ONE])
        x2 = right * (generatrix.x[g] + generatrix.x[g + ONE]) - left * (generatrix.x[g - ONE] + generatrix.x[g])
        y2 = right * (generatrix.y[g] + generatrix.y[g + ONE]) - left * (generatrix.y[g - ONE] + generatrix.y[g])
        z2 = right * (generatrix.z[g] + generatrix.z[g + ONE]) - left * (generatrix.z[g - ONE] + generatrix.z[g])
        force.x[d] += x1 + x2
        force.y[d] += y1 + y2
        force.z[d] += z1 + z2
        force_above.x[d] += x2 - x1
        force_above.y[d] += y2 - y1
        force_above.z[d] += z2 - z1
