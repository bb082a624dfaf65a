"""Tensions of fabric and belts, and the forces they put on the nodes, Eqs. (2.2), (2.8), (3.2).

The default law is a tension field: at each corner where a generatrix edge meets a hoop edge, tensions are the derivatives of the
least energy W0 of the orthotropic sheet over all wrinkles a >= 0, W(e1, e2) = min W0(e1 + a1, e2 + a2), which are

    T1 = max(0, E11 e1, c11 e1 + c12 e2),    T2 = max(0, E22 e2, c22 e2 + c12 e1)

per unloaded width: taut, wrinkled along one direction, or slack (Pipkin, IMA J. Appl. Math. 36, 1986). An edge pulls with the
mean over its corners, so that all forces have one potential. Viscosity adds to the tension at a corner before it is cut at zero;
what slackness takes from the sum counts as viscous work, which so is never positive.

The laws of (2.9) take the mean elongation of the edges across, and have no potential where they cut compression and nu12 > 0, or
where tensions are per deformed width: force per unloaded width is T (1 + e) with the elongation e across for true tensions.
"""

from numba import uint64

from softbrake.kernels.jit import kernel
from softbrake.kernels.rows import lanes
from softbrake.state import PAD, Law

ONE = uint64(1)
FIRST = uint64(PAD)
SMALLEST_STRETCH = 1e-12


@kernel
def update_field_tension(fabric, edges, others, tension, place, edge, lower, upper, count, modulus, stiffness, width):
    """Update the tension along a row of edges by the tension field at the four corners of each.

    modulus, stiffness (N/m): E and C of elongation along; width: unloaded, of an edge (m).
    Reads edges.e, force, elastic (1/m, 1/s) at offset edge; others.e before and at offsets lower, upper.
    Writes tension (N/m, from place on), edges.force and elastic (N/m: edge force over edge length).
    """
    c12, quarter = fabric.c12, 0.25 * width
    for j in range(lanes(count)):
        c = edge + j
        a = lower + j
        b = upper + j
        alone = modulus * edges.e[c]
        own = stiffness * edges.e[c]
        viscous = fabric.viscosity * edges.elastic[c]
        one, two, three, four = c12 * others.e[a - ONE], c12 * others.e[a], c12 * others.e[b - ONE], c12 * others.e[b]
        least = max(alone, 0.0)
        elastic = max(own + one, least) + max(own + two, least) + (max(own + three, least) + max(own + four, least))
        least = max(alone + viscous, 0.0)
        own += viscous
        whole = max(own + one, least) + max(own + two, least) + (max(own + three, least) + max(own + four, least))
        per_length = quarter * edges.force[c]
        tension[place + j] = 0.25 * whole
        edges.force[c] = whole * per_length
        edges.elastic[c] = elastic * per_length


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
        hooke = stiffness * edges.e[c] + fabric.c12 * across
        whole = max(hooke + fabric.viscosity * edges.elastic[c], fabric.floor)
        per_length = (width + widens * across) * edges.force[c]
        tension[place + j] = whole
        edges.force[c] = whole * per_length
        edges.elastic[c] = max(hooke, fabric.floor) * per_length


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
def update_belt_tension(belts, row, hoop, generatrix, belt, tension, edge, below, above, columns):
    """Update N22 of the belt on a row of hoop edges, from column -1 on. Eq. (2.3): slack in compression, as printed there.

    Reads hoop.e, force, elastic (1/m, 1/s: before update_hoop_tension) at offset edge; generatrix.e at offsets below, above.
    Writes tension (N/m, over the belt's width), belt.force and elastic (N/m: edge force over edge length).
    """
    stiffness = belts.stiffness[row]
    coupling = belts.coupling[row]
    viscosity = belts.viscosity[row]
    per_width = 1.0 / belts.width[row]
    for j in range(lanes(columns + 1)):
        c = edge + j - ONE
        a = below + j
        b = above + j
        d = FIRST + j - ONE
        across = 0.25 * (generatrix.e[a - ONE] + generatrix.e[a] + generatrix.e[b - ONE] + generatrix.e[b])
        hooke = stiffness * hoop.e[c] + coupling * across
        force = max(hooke + viscosity * hoop.elastic[c], 0.0)
        tension[d] = force * per_width
        belt.force[d] = force * hoop.force[c]
        belt.elastic[d] = max(hooke, 0.0) * hoop.force[c]


@kernel
def update_cell_tension(fabric, generatrix, hoop, cells, tension_1, tension_2, edge, lower, upper, cell, columns):
    """Update tensions at the centres of one row of cells from column -1 on. Eq. (3.2) as printed.

    Stretches and rates are means of the cell's two edges, directions the mean edge vector over the mean stretch.
    Reads generatrix.e, elastic (1/s) at offset edge, hoop at lower and upper. Writes cells.force_1, force_2, elastic_1, elastic_2
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
        hooke_1 = fabric.c11 * e1 + fabric.c12 * e2
        hooke_2 = fabric.c22 * e2 + fabric.c12 * e1
        if field:
            hooke_1 = max(hooke_1, fabric.e11 * e1)
            hooke_2 = max(hooke_2, fabric.e22 * e2)
        viscous_1 = 0.5 * fabric.viscosity * (generatrix.elastic[g] + generatrix.elastic[g + ONE])
        viscous_2 = 0.5 * fabric.viscosity * (hoop.elastic[a] + hoop.elastic[b])
        whole_1 = max(hooke_1 + viscous_1, fabric.floor)
        whole_2 = max(hooke_2 + viscous_2, fabric.floor)
        per_length_1 = 0.25 * fabric.h2 / fabric.h1 * (1.0 + fabric.true_tension * e2) / max(1.0 + e1, SMALLEST_STRETCH)
        per_length_2 = 0.25 * fabric.h1 / fabric.h2 * (1.0 + fabric.true_tension * e1) / max(1.0 + e2, SMALLEST_STRETCH)
        tension_1[FIRST + j - ONE] = whole_1
        tension_2[FIRST + j - ONE] = whole_2
        cells.force_1[c] = whole_1 * per_length_1
        cells.force_2[c] = whole_2 * per_length_2
        cells.elastic_1[c] = max(hooke_1, fabric.floor) * per_length_1
        cells.elastic_2[c] = max(hooke_2, fabric.floor) * per_length_2


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
        pull_1 = max(fabric.e11 * F1, fabric.c11 * F1 + fabric.c12 * F2, 0.0)
        pull_2 = max(fabric.e22 * F2, fabric.c22 * F2 + fabric.c12 * F1, 0.0)
        tension_1[FIRST + j - ONE] = pull_1 if free > 0.0 else 0.0
        tension_2[FIRST + j - ONE] = pull_2 if free > 0.0 else 0.0
        lift_1 = aspect * (pull_1 - max(fabric.e11 * E1, fabric.c11 * E1 + fabric.c12 * E2, 0.0))
        lift_2 = per_aspect * (pull_2 - max(fabric.e22 * E2, fabric.c22 * E2 + fabric.c12 * E1, 0.0))
        cells.force_1[c] = lift_1 + (cells.force_1[c] if onto else 0.0)
        cells.force_2[c] = lift_2 + (cells.force_2[c] if onto else 0.0)
        cells.elastic_1[c] = lift_1 + (cells.elastic_1[c] if onto else 0.0)
        cells.elastic_2[c] = lift_2 + (cells.elastic_2[c] if onto else 0.0)


@kernel
def update_edge_forces(generatrix, hoop, force, above, below, row, columns):
    """Update the pull of the edges on a row of nodes. First and second difference of (2.8).

    Reads x, y, z, force of generatrix at offsets above, below and of hoop at row. Writes force (N).
    """
    gx, gy, gz, gf = generatrix.x, generatrix.y, generatrix.z, generatrix.force
    hx, hy, hz, hf = hoop.x, hoop.y, hoop.z, hoop.force
    for j in range(lanes(columns)):
        a = above + j
        b = below + j
        c = row + j
        up, down, right, left = gf[a], gf[b], hf[c], hf[c - ONE]
        force.x[FIRST + j] = up * gx[a] - down * gx[b] + right * hx[c] - left * hx[c - ONE]
        force.y[FIRST + j] = up * gy[a] - down * gy[b] + right * hy[c] - left * hy[c - ONE]
        force.z[FIRST + j] = up * gz[a] - down * gz[b] + right * hz[c] - left * hz[c - ONE]


@kernel
def add_belt_forces(belt, hoop, force, edge, columns):
    """Add the pull of a belt to the forces on a row of nodes. dT/ds0 of (2.3).

    Reads belt.force; hoop.x, y, z at offset edge. Writes force (N).
    """
    for j in range(lanes(columns)):
        b = FIRST + j
        c = edge + j
        right = belt.force[b]
        left = belt.force[b - ONE]
        force.x[b] += right * hoop.x[c] - left * hoop.x[c - ONE]
        force.y[b] += right * hoop.y[c] - left * hoop.y[c - ONE]
        force.z[b] += right * hoop.z[c] - left * hoop.z[c - ONE]


@kernel
def add_cell_forces(generatrix, hoop, cells, force, force_above, edge, lower, upper, cell, columns):
    """Add the corner forces of one row of cells to the rows below and above. Sums over ± of (3.2).

    A corner force is force_1 (N/m) times the sum of the cell's generatrix edges, upwards on the lower corners and downwards on
    the upper ones, and force_2 times the sum of its hoop edges, to the right on the left corners and to the left on the right.
    Writes force (N) of the row below and force_above of the row above.
    """
    for j in range(lanes(columns)):
        g = edge + j
        a = lower + j
        b = upper + j
        right_1 = cells.force_1[cell + j]
        left_1 = cells.force_1[cell + j - ONE]
        right_2 = cells.force_2[cell + j]
        left_2 = cells.force_2[cell + j - ONE]
        d = FIRST + j
        x1 = right_1 * (generatrix.x[g] + generatrix.x[g + ONE]) + left_1 * (generatrix.x[g - ONE] + generatrix.x[g])
        y1 = right_1 * (generatrix.y[g] + generatrix.y[g + ONE]) + left_1 * (generatrix.y[g - ONE] + generatrix.y[g])
        z1 = right_1 * (generatrix.z[g] + generatrix.z[g + ONE]) + left_1 * (generatrix.z[g - ONE] + generatrix.z[g])
        x2 = right_2 * (hoop.x[a] + hoop.x[b]) - left_2 * (hoop.x[a - ONE] + hoop.x[b - ONE])
        y2 = right_2 * (hoop.y[a] + hoop.y[b]) - left_2 * (hoop.y[a - ONE] + hoop.y[b - ONE])
        z2 = right_2 * (hoop.z[a] + hoop.z[b]) - left_2 * (hoop.z[a - ONE] + hoop.z[b - ONE])
        force.x[d] += x1 + x2
        force.y[d] += y1 + y2
        force.z[d] += z1 + z2
        force_above.x[d] += x2 - x1
        force_above.y[d] += y2 - y1
        force_above.z[d] += z2 - z1


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
