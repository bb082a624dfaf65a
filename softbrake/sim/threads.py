"""Sides of a shell that stand through its faces: what passed through folded fabric, whatever contact found of it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from softbrake.core.arrays import PAD, Floats, Ints, Model, Nodes
from softbrake.core.contact.threads import find_threads, meridian_threads


class Threads(NamedTuple):
    """What was found. See core.contact.threads."""

    threads: int  # sides that pass an odd number of a face's triangles and share no corner with it
    hinges: int  # those that share one
    pairs: Ints  # (k, 3), of both, as many as were asked for: nodes of State at the ends of the side, and at the face's corner 0


class ThreadSearch:
    """A search for threads of a full shell, and its scratch."""

    def __init__(self, model: Model) -> None:
        row, column = np.divmod(_along_curve(model.n1, model.n2), model.n2)
        left, right = row * model.stride + PAD + column, row * model.stride + PAD + (column + 1) % model.n2
        self.faces: Ints = np.stack((left, right, right + model.stride, left + model.stride), axis=-1)
        self.cover = model.n1 * model.stride
        self.boxes: Floats = np.empty((2 << (len(self.faces) - 1).bit_length(), 6))

    def find(self, nodes: Nodes, most: int = 0) -> Threads:
        """Find all threads of finite places, and return up to so many pairs."""
        pairs = np.empty((most, 3), np.int64)
        threads, hinges = find_threads(nodes, self.faces, self.cover, self.boxes, pairs)
        return Threads(threads, hinges, pairs[: threads + hinges])


def crossings_of_meridian(model: Model, nodes: Nodes) -> int:
    """Return how many pairs of segments of an axisymmetric shell's meridian cross each other."""
    return int(meridian_threads(nodes.x, nodes.z, model.n1))


def _along_curve(rows: int, columns: int) -> Ints:
    """Return the faces, numbered by rows, in Morton's order: neighbours on the shell near one another."""
    row, column = np.divmod(np.arange(rows * columns), columns)
    code = np.zeros_like(row)
    for bit in range(max(rows, columns).bit_length()):
        code |= (row >> bit & 1) << 2 * bit + 1 | (column >> bit & 1) << 2 * bit
    return np.argsort(code)
