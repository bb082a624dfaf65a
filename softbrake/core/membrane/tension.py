"""Tensions of the fabric. Eqs. (2.9), (3.2).

The default law is a tension field: at each corner where a generatrix edge meets a hoop edge, tensions are the derivatives of the
least energy W0 of the orthotropic sheet over all wrinkles a >= 0, W(e1, e2) = min W0(e1 + a1, e2 + a2), which are

    T1 = max(0, E11 e1, c11 e1 + c12 e2),    T2 = max(0, E22 e2, c22 e2 + c12 e1)

per unloaded width: taut, wrinkled along one direction, or slack (Pipkin, IMA J. Appl. Math. 36, 1986). An edge pulls with the
mean over its corners, so that all forces have one potential. Viscosity adds to the tension at a corner before it is cut at zero;
what slackness takes from the sum counts as viscous work, which so is never positive.

The laws of (2.9) take the mean elongation of the edges across, and have no potential where they cut compression and nu12 > 0, or
where tensions are per deformed width: force per unloaded width is T (1 + e) with the elongation e across for true tensions.
"""

from softbrake.core.arrays import Law
from softbrake.core.jit import kernel
from softbrake.core.lanes import FIRST, ONE, lanes

SMALLEST_STRETCH = 1e-12


@kernel
def hooke(stiffness, along, coupling, across):
    """Return the tension (N/m) of elongations along and across. Eq. (2.9) without viscosity."""
    return stiffness * along + coupling * across


@kernel
def unilateral(elastic, viscous, least):
    """Return the whole tension (N/m) and its elastic part: neither is below the least. Eq. (2.9)."""
    return max(elastic + viscous, least), max(elastic, least)


@kernel
def field_tension(alone, own, across):
    """Return the tension (N/m) of the tension field: of E e and C e along and C12 times the elongation across."""
    return max(own + across, max(alone, 0.0))


@kernel
def mean_of_corners(alone, own, one, two, viscous):
    """Return the tension (N/m) along an edge and its elastic part: means of the tension field at two corners.

    alone, own: E e and C e along the edge; one, two: C12 times the elongation across, of either corner.
    """
    elastic = field_tension(alone, own, one) + field_tension(alone, own, two)
    whole = field_tension(alone + viscous, own + viscous, one) + field_tension(alone + viscous, own + viscous, two)
    return 0.5 * whole, 0.5 * elastic


# Kernels of a row have long parameter lists; softbrake/core/__init__.py says why.
@kernel
def update_field_tension(fabric, edges, others, tension, place, edge, lower, upper, count, modulus, stiffness, width):
    """Update the tension along a row of edges by the tension field, for (2.9), at the four corners of each.

    modulus, stiffness (N/m): E and C of elongation along; width: unloaded, of an edge (m).
    Reads edges.e, inverse, rate at offset edge; others.e before and at offsets lower, upper.
    Writes tension (N/m, from place on), edges.force and elastic (N/m: edge force over edge length).
    """
    c12 = fabric.c12
    for j in range(lanes(count)):
        c = edge + j
        a = lower + j
        b = upper + j
        alone, own, viscous = modulus * edges.e[c], stiffness * edges.e[c], fabric.viscosity * edges.rate[c]
        whole_1, elastic_1 = mean_of_corners(alone, own, c12 * others.e[a - ONE], c12 * others.e[a], viscous)
        whole_2, elastic_2 = mean_of_corners(alone, own, c12 * others.e[b - ONE], c12 * others.e[b], viscous)
        whole, per_length = 0.5 * (whole_1 + whole_2), width * edges.inverse[c]
        tension[place + j] = whole
        edges.force[c] = whole * per_length
        edges.elastic[c] = 0.5 * (elastic_1 + elastic_2) * per_length


@kernel
def update_tension(fabric, edges, others, tension, place, edge, lower, upper, count, stiffness, width):
    """Update the tension along a row of edges. Eq. (2.9), the elongation across the mean of the four other edges around.

    stiffness (N/m): C of elongation along; else as update_field_tension.
    """
    widens = width * fabric.true_tension
    for j in range(lanes(count)):
        c = edge + j
        a = lower + j
        b = upper + j
        across = 0.25 * (others.e[a - ONE] + others.e[a] + others.e[b - ONE] + others.e[b])
        viscous = fabric.viscosity * edges.rate[c]
        whole, elastic = unilateral(hooke(stiffness, edges.e[c], fabric.c12, across), viscous, fabric.floor)
        per_length = (width + widens * across) * edges.inverse[c]
        tension[place + j] = whole
        edges.force[c] = whole * per_length
        edges.elastic[c] = elastic * per_length


@kernel
def update_generatrix_tension(fabric, generatrix, hoop, tension, edge, lower, upper, columns):
    """Update T11 of one row of generatrix edges, Eq. (2.9) or the tension field, hoop edges of rows lower and upper around.

    upper  ──e22──┬──e22──
                 T11 e11
    lower  ──e22──┴──e22──
    """
    c11, h2 = fabric.c11, fabric.h2
    if fabric.law == Law.TENSION_FIELD:
        update_field_tension(fabric, generatrix, hoop, tension, FIRST, edge, lower, upper, columns, fabric.e11, c11, h2)
    else:
        update_tension(fabric, generatrix, hoop, tension, FIRST, edge, lower, upper, columns, c11, h2)  # (2.9)


@kernel
def update_hoop_tension(fabric, hoop, generatrix, tension, edge, below, above, columns):
    """Update T22 of the hoop edges from column -1 on, Eq. (2.9) or the tension field, generatrix edges of rows i-1/2, i+1/2."""
    first, place, count, c22, h1 = edge - ONE, FIRST - ONE, columns + 1, fabric.c22, fabric.h1
    if fabric.law == Law.TENSION_FIELD:
        update_field_tension(fabric, hoop, generatrix, tension, place, first, below, above, count, fabric.e22, c22, h1)
    else:
        update_tension(fabric, hoop, generatrix, tension, place, first, below, above, count, c22, h1)  # (2.9)


@kernel
def update_cell_tension(fabric, generatrix, hoop, cells, tension_1, tension_2, edge, lower, upper, cell, columns):
    """Update tensions at the centres of one row of cells from column -1 on. Eq. (3.2) as printed.

    Stretches and rates are means of the cell's two edges, directions the mean edge vector over the mean stretch.
    Reads generatrix.e, rate at offset edge, hoop at lower and upper. Writes cells.force_1, force_2, elastic_1, elastic_2
    (N/m: corner force over the sum of the two edge vectors), and, for the report, tension_1, tension_2 (N/m) from PAD on.
    """
    field = fabric.law == Law.TENSION_FIELD
    for j in range(lanes(columns + 1)):
        g = edge + j - ONE
        a = lower + j - ONE
        b = upper + j - ONE
        c = cell + j - ONE
        e1 = 0.5 * (generatrix.e[g] + generatrix.e[g + ONE])
        e2 = 0.5 * (hoop.e[a] + hoop.e[b])
        hooke_1, hooke_2 = hooke(fabric.c11, e1, fabric.c12, e2), hooke(fabric.c22, e2, fabric.c12, e1)
        if field:
            hooke_1 = max(hooke_1, fabric.e11 * e1)
            hooke_2 = max(hooke_2, fabric.e22 * e2)
        viscous_1 = 0.5 * fabric.viscosity * (generatrix.rate[g] + generatrix.rate[g + ONE])
        viscous_2 = 0.5 * fabric.viscosity * (hoop.rate[a] + hoop.rate[b])
        whole_1, elastic_1 = unilateral(hooke_1, viscous_1, fabric.floor)
        whole_2, elastic_2 = unilateral(hooke_2, viscous_2, fabric.floor)
        per_length_1 = 0.25 * fabric.h2 / fabric.h1 * (1.0 + fabric.true_tension * e2) / max(1.0 + e1, SMALLEST_STRETCH)
        per_length_2 = 0.25 * fabric.h1 / fabric.h2 * (1.0 + fabric.true_tension * e1) / max(1.0 + e2, SMALLEST_STRETCH)
        tension_1[FIRST + j - ONE] = whole_1
        tension_2[FIRST + j - ONE] = whole_2
        cells.force_1[c] = whole_1 * per_length_1
        cells.force_2[c] = whole_2 * per_length_2
        cells.elastic_1[c] = elastic_1 * per_length_1
        cells.elastic_2[c] = elastic_2 * per_length_2
