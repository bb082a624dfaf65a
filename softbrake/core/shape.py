"""The unloaded shell row by row: the cloth of its edges and cells with the lengths that they have there."""

from softbrake.core.arrays import Membrane
from softbrake.core.jit import kernel


@kernel
def cloth_above(model, i):
    """Return the Membrane of the generatrix edges and of the cells above row i: as wide as the hoops on both sides on average."""
    shape = model.shape
    return with_lengths(model.fabric, shape.h1[i], 0.5 * (shape.h2[i] + shape.h2[i + 1]))


@kernel
def cloth_around(model, i):
    """Return the Membrane of the hoop edges of row i, between the covers: as wide as half of both edges along the generatrix."""
    shape = model.shape
    return with_lengths(model.fabric, 0.5 * (shape.h1[i - 1] + shape.h1[i]), shape.h2[i])


@kernel
def with_lengths(fabric, h1, h2):
    """Return a Membrane on cells of these edges (m)."""
    return Membrane(
        fabric.law,
        h1,
        h2,
        fabric.e11,
        fabric.e22,
        fabric.c11,
        fabric.c22,
        fabric.c12,
        fabric.g12,
        fabric.viscosity,
        fabric.floor,
        fabric.true_tension,
    )
