"""Tension of the belts, and their pull on the nodes. Eq. (2.3)."""

from softbrake.core.jit import kernel
from softbrake.core.lanes import FIRST, ONE, lanes
from softbrake.core.membrane.tension import hooke, unilateral


# Kernels of a row have long parameter lists; softbrake/core/__init__.py says why.
@kernel
def update_belt_tension(belts, row, hoop, generatrix, belt, tension, edge, below, above, columns):
    """Update N22 of the belt on a row of hoop edges, from column -1 on. Eq. (2.3): slack in compression, as printed there.

    Reads hoop.e, inverse, rate at offset edge; generatrix.e at offsets below, above.
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
        force, elastic = unilateral(hooke(stiffness, hoop.e[c], coupling, across), viscosity * hoop.rate[c], 0.0)
        tension[d] = force * per_width
        belt.force[d] = force * hoop.inverse[c]
        belt.elastic[d] = elastic * hoop.inverse[c]


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
