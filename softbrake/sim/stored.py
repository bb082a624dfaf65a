"""Elastic energy of fabric and belts as they are: what their works can give back at most."""

from __future__ import annotations

import numpy as np

from softbrake.core.arrays import Floats, Law, Model, Nodes
from softbrake.sim.build import grid_view, meridian_view


def stored_energy(model: Model, nodes: Nodes) -> tuple[float, float]:
    """Return the elastic energy (J) of fabric and belts of the whole shell.

    That of the tension field is exact on its grid: the relaxed energy of each corner of a cell, of one edge of either direction.
    Other laws have none of their own: theirs is that of Hooke's law with no compression, and no less than what they hold.
    """
    e1, e2, sine = _strains(model, nodes)
    h1, h2 = model.shape.h1[:-1, None], model.shape.h2[:, None]
    cell = 0.5 * h1 * (h2[:-1] + h2[1:])
    fabric = 0.0
    for lower, upper in ((e2[:-1], e2[1:]), (np.roll(e2, 1, axis=1)[:-1], np.roll(e2, 1, axis=1)[1:])):
        for across in (lower, upper):
            fabric += float((0.25 * cell * _density(model, e1, across)).sum())
    fabric += 0.5 * model.fabric.g12 * float((cell * sine**2).sum())
    stretched = np.maximum(e2, 0.0)
    belts = 0.5 * float((h2 * model.belts.stiffness[:, None] * stretched**2).sum())
    return model.hoop.whole * fabric, model.hoop.whole * belts


def _strains(model: Model, nodes: Nodes) -> tuple[Floats, Floats, Floats]:
    """Elongations of the edges along the generatrix (n1, columns) and around the hoop (n1+1, columns), and sines of shear."""
    h1, h2 = model.shape.h1[:-1, None], model.shape.h2[:, None]
    if model.stride == 1:
        column = meridian_view(nodes, model)
        e1 = np.hypot(np.diff(column.x), np.diff(column.z))[:, None] / h1 - 1.0
        return e1, np.abs(column.x)[:, None] / model.shape.radius[:, None] - 1.0, np.zeros_like(e1)
    places = np.stack([grid_view(part, model) for part in nodes[:3]], axis=-1)
    up, along = np.diff(places, axis=0), np.roll(places, -1, axis=1) - places
    e1, e2 = np.linalg.norm(up, axis=-1) / h1 - 1.0, np.linalg.norm(along, axis=-1) / h2 - 1.0
    area = 2.0 * h1 * (h2[:-1] + h2[1:])
    return e1, e2, np.sum((up + np.roll(up, -1, axis=1)) * (along[1:] + along[:-1]), axis=-1) / area


def _density(model: Model, e1: Floats, e2: Floats) -> Floats:
    """Energy per unloaded area (N/m) of fabric under two elongations."""
    cloth = model.fabric
    one, other = np.maximum(e1, 0.0), np.maximum(e2, 0.0)
    if cloth.law != Law.TENSION_FIELD:
        return 0.5 * (cloth.c11 * one**2 + 2.0 * cloth.c12 * one * other + cloth.c22 * other**2) * (1.0 + np.maximum(one, other))
    both = 0.5 * (cloth.c11 * e1**2 + 2.0 * cloth.c12 * e1 * e2 + cloth.c22 * e2**2)
    taut_1, taut_2 = cloth.c11 * e1 + cloth.c12 * e2 > 0.0, cloth.c22 * e2 + cloth.c12 * e1 > 0.0
    single = np.maximum(0.5 * cloth.e11 * one**2, 0.5 * cloth.e22 * other**2)
    return np.where(taut_1 & taut_2, both, single)
