"""Kernels over a whole shell, where a step keeps a few rows."""

from typing import NamedTuple

import numpy as np

from softbrake.core.arrays import PAD, Cells, Edges, Floats, Model, Nodes, Vectors
from softbrake.core.membrane.area import update_area_vectors
from softbrake.core.membrane.edges import update_edges


class Whole(NamedTuple):
    """Edges and cells of the whole shell; generatrix edges and cells above row i of nodes are row i."""

    generatrix: Edges
    hoop: Edges
    cells: Cells


def at(model: Model, row: int, column: int = 0) -> np.uint64:
    """Offset of a node, edge or cell in flat arrays, of the type the step passes, so that nothing is compiled for it."""
    return np.uint64(row * model.stride + PAD + column)


def on_row(row: Vectors, model: Model) -> Floats:
    """A row of vectors, (n2, 3)."""
    return np.stack([part[PAD : PAD + model.n2] for part in row], axis=-1)


def whole_grid(model: Model, nodes: Nodes) -> Whole:
    """Edges by update_edges, all else nought."""
    size = (model.n1 + 1) * model.stride
    whole = Whole(*(kind(*(np.zeros(size) for _ in kind._fields)) for kind in (Edges, Edges, Cells)))
    one, stride = np.uint64(1), np.uint64(model.stride)
    for i in range(model.n1 + 1):
        a = at(model, i, -1)
        update_edges(nodes, whole.hoop, a, one, a, model.n2 + 1, model.fabric.h2)
        if i < model.n1:
            update_edges(nodes, whole.generatrix, a, stride, a, model.n2 + 2, model.fabric.h1)
    return whole


def area_vectors(model: Model, nodes: Nodes) -> Floats:
    """Area vectors of all nodes (m²), (n1+1, n2, 3)."""
    whole, n1, areas = whole_grid(model, nodes), model.n1, []
    # One more row, of no edges, stands for those beyond both covers.
    g, h = (Edges(*(np.append(part, np.zeros(model.stride)) for part in edges)) for edges in (whole.generatrix, whole.hoop))
    for i in range(n1 + 1):
        row = Vectors(*(np.zeros(model.stride) for _ in Vectors._fields))
        here, below, above = (at(model, k if 0 <= k <= n1 else n1 + 1) for k in (i, i - 1, i + 1))
        update_area_vectors(g, h, row, here, below, here, above, below, model.n2)
        areas.append(on_row(row, model))
    return np.array(areas)
