"""The generatrix of the unloaded shell: lines and arcs in the half plane of height z and radius r, from cover to cover."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

Place = tuple[float, float]  # z, height above the lower cover, and r, distance from the axis, m


class Line(NamedTuple):
    """A straight piece."""

    start: Place
    stop: Place

    @property
    def length(self) -> float:
        """In m."""
        (z, r), (top, end) = self
        return top - z if end == r else math.hypot(top - z, end - r)

    def at(self, along: float) -> Place:
        """The place so far (m) from its start."""
        (z, r), (top, end) = self
        if end == r:  # to the last bit
            return z + along, r
        share = along / self.length
        return z + share * (top - z), r + share * (end - r)

    def along(self, z: float) -> float | None:
        """How far (m) from its start it first has a height; None where it has not."""
        low, high = self.start[0], self.stop[0]
        if not low <= z <= high:
            return None
        return z - low if self.start[1] == self.stop[1] else self.length * (z - low) / (high - low)

    @property
    def volume(self) -> float:
        """Within it, turned about the axis, m^3."""
        (z, r), (top, end) = self
        return math.pi * (top - z) * (r * r + r * end + end * end) / 3.0

    @property
    def area(self) -> float:
        """Of the wall that it makes, m^2."""
        return math.pi * (self.start[1] + self.stop[1]) * self.length


class Arc(NamedTuple):
    """A piece of a circle, that bulges outwards; its heights rise all along."""

    centre: Place
    radius: float  # m
    first: float  # rad, of its start: from the horizontal outwards, up positive
    last: float

    @property
    def length(self) -> float:
        """In m."""
        return self.radius * (self.last - self.first)

    def at(self, along: float) -> Place:
        """The place so far (m) from its start."""
        angle = self.first + along / self.radius
        return self.centre[0] + self.radius * math.sin(angle), self.centre[1] + self.radius * math.cos(angle)

    def along(self, z: float) -> float | None:
        """How far (m) from its start it has a height; None where it has not."""
        sine = (z - self.centre[0]) / self.radius
        if not math.sin(self.first) - 1e-12 <= sine <= math.sin(self.last) + 1e-12:
            return None
        return self.radius * (math.asin(max(-1.0, min(sine, 1.0))) - self.first)

    @property
    def volume(self) -> float:
        """Within it, turned about the axis, m^3."""
        c, a = self.centre[1], self.radius

        def until(angle: float) -> float:
            sine = math.sin(angle)
            return c * c * sine + c * a * (angle + sine * math.cos(angle)) + a * a * sine * (1.0 - sine * sine / 3.0)

        return math.pi * a * (until(self.last) - until(self.first))

    @property
    def area(self) -> float:
        """Of the wall that it makes, m^2."""
        swept = self.centre[1] * (self.last - self.first)
        return 2.0 * math.pi * self.radius * (swept + self.radius * (math.sin(self.last) - math.sin(self.first)))


class Generatrix(NamedTuple):
    """Pieces that follow one another."""

    pieces: tuple[Line | Arc, ...]

    @property
    def length(self) -> float:
        """In m."""
        return sum(piece.length for piece in self.pieces)

    @property
    def height(self) -> float:
        """Of its end, m."""
        return self.at(self.length)[0]

    @property
    def volume(self) -> float:
        """Of the shell, m^3."""
        return sum(piece.volume for piece in self.pieces)

    @property
    def area(self) -> float:
        """Of the wall, m^2."""
        return sum(piece.area for piece in self.pieces)

    @property
    def mean_diameter(self) -> float:
        """Of the cylinder of its height and volume, m."""
        return 2.0 * math.sqrt(self.volume / (math.pi * self.height))

    @property
    def widest(self) -> float:
        """Largest radius, m."""
        bulges = (piece for piece in self.pieces if isinstance(piece, Arc) and piece.first < 0.0 < piece.last)
        return max(*self.ends, *(arc.centre[1] + arc.radius for arc in bulges))

    @property
    def ends(self) -> list[float]:
        """Radius at the start of each piece, and at the end of the last, m."""
        return [*(piece.at(0.0)[1] for piece in self.pieces), self.pieces[-1].at(self.pieces[-1].length)[1]]

    @property
    def narrowest(self) -> float:
        """Least radius, m: at the end of a piece, as arcs bulge outwards."""
        return min(self.ends)

    def at(self, along: float) -> Place:
        """The place so far (m) from the lower cover."""
        for piece in self.pieces[:-1]:
            if along <= piece.length:
                return piece.at(along)
            along -= piece.length
        return self.pieces[-1].at(min(along, self.pieces[-1].length))

    def along(self, z: float) -> float:
        """How far (m) from the lower cover it first has a height, 0 to that of the upper cover."""
        before = 0.0
        for piece in self.pieces:
            if (found := piece.along(z)) is not None:
                return before + found
            before += piece.length
        return before


def straight(height: float, lower: float, upper: float) -> Generatrix:
    """Return that of a cylinder or a cone (m), of radii at both covers."""
    return Generatrix((Line((0.0, lower), (height, upper)),))


def bulging(height: float, lower: float, upper: float, bulge: float) -> Generatrix:
    """Return an arc of a radius (m) from rim to rim. Raises ValueError where there is none that rises all along."""
    chord = math.hypot(height, upper - lower)
    if 2.0 * bulge < chord:
        raise ValueError(f"an arc of {bulge:.6g} m does not reach from rim to rim; a radius of {0.5 * chord:.6g} m or more")
    inwards = math.sqrt(max(bulge * bulge - 0.25 * chord * chord, 0.0)) / chord
    z, r = 0.5 * height + inwards * (upper - lower), 0.5 * (lower + upper) - inwards * height
    first, last = math.atan2(-z, lower - r), math.atan2(height - z, upper - r)
    if not -0.5 * math.pi - 1e-12 <= first < last <= 0.5 * math.pi + 1e-12:
        raise ValueError(f"an arc of {bulge:.6g} m is cut by a cover; a larger radius")
    return Generatrix((Arc((z, r), bulge, first, last),))


def zone(diameter: float, lower: float, upper: float) -> Generatrix:
    """Return that of a ball (m) between covers of two radii, below and above its middle. Raises ValueError."""
    radius = 0.5 * diameter
    if max(lower, upper) >= radius:
        raise ValueError(f"a cover as wide as the ball or wider; diameters < {diameter:.6g} m")
    first, last = -math.acos(lower / radius), math.acos(upper / radius)
    return Generatrix((Arc((-radius * math.sin(first), 0.0), radius, first, last),))


def through(points: Sequence[Place]) -> Generatrix:
    """Return straight pieces through points that follow one another."""
    return Generatrix(tuple(Line(one, other) for one, other in pairwise(points)))


def hung(height: float, lengths: Sequence[float], diameters: Sequence[float]) -> Generatrix:
    """Return where cloth hangs between covers of a distance (m), rows at evenly spaced heights, no edge longer than its cloth.

    Lengths along the cloth and diameters of its hoops, m. As near to its own radii as its lengths allow; hoops are slack there.
    Raises ValueError where the cloth is too short, or its hoops grow faster than it is long.
    """
    total, radii = lengths[-1], [0.5 * diameter for diameter in diameters]
    straight_line = math.hypot(height, radii[-1] - radii[0])
    if straight_line > total * (1.0 + 1e-12):
        raise ValueError(f"{total:.6g} m of cloth do not reach from cover to cover; {straight_line:.6g} m or more")
    part = 1.0  # of the way from the straight line to the radii of the cloth
    for row, ((start, stop), (one, other)) in enumerate(zip(pairwise(lengths), pairwise(radii), strict=True), 1):
        if abs(other - one) > (stop - start) * (1.0 + 1e-12):
            raise ValueError(
                f"row {row}: the radius changes by {abs(other - one):.6g} m; {stop - start:.6g} m, its cloth, or less"
            )
        even = (radii[-1] - radii[0]) * (stop - start) / total
        most = math.sqrt(max((stop - start) ** 2 - (height * (stop - start) / total) ** 2, 0.0))
        bend = other - one - even
        if bend:
            part = min(part, max((math.copysign(most, bend) - even) / bend, 0.0))
    places = []
    for length, radius in zip(lengths, radii, strict=True):
        line = radii[0] + (radii[-1] - radii[0]) * length / total
        places.append((height * length / total, line + part * (radius - line)))
        if places[-1][1] > radius * (1.0 + 1e-9):
            fault = f"row {len(places)}: a hoop of {2 * radius:.6g} m would hang at a diameter of {2 * places[-1][1]:.6g} m"
            raise ValueError(f"{fault}; cloth without a waist, or longer,")
    return through(places)
