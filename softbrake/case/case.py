"""Case file -> frozen dataclasses in SI units; every message a user can get about input."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import Any, Literal

from softbrake.case.checker import Checker, Values, last_given, listed
from softbrake.case.keys import (
    ALTERNATIVES,
    AUTO_COURANT,
    BELTS,
    BETWEEN_BELTS,
    COARSE,
    CONTACT,
    CONTACT_SETS,
    FINE,
    HOOP,
    LAW,
    LISTED_BELT,
    PHYSICS,
    PRESSURE,
    SECTIONS,
    SHEAR,
    TOP,
    UNKNOWN_CONTACT,
    Key,
    schema,
    starter,
)
from softbrake.case.overrides import Override, apply_override
from softbrake.case.units import Dimension
from softbrake.case.yaml_nodes import Node, Place, YamlError, join, parse

__all__ = [
    "Belt",
    "Cargo",
    "Case",
    "CaseError",
    "Fabric",
    "FullStop",
    "Grid",
    "Model",
    "Output",
    "Pressure",
    "Shell",
    "Time",
    "case_to_dict",
    "full_stop",
    "level",
    "load_case",
    "parse_case",
    "quantities",
    "schema",
    "starter",
]
ONE_COLUMN = ("axisymmetric", "lumped")  # fidelities that compute the generatrix only
Fidelity = Literal["full", "axisymmetric", "lumped", "auto"]
AUTO_TOLERANCE = 0.02  # that fidelity: auto aims at
RECIPROCITY = 1e-3  # relative, to which both Poisson's ratios may be rounded


@dataclass(frozen=True)
class Shell:
    """Cut cylinder between the covers."""

    diameter: float  # m, of the unloaded shell and of the covers
    height: float  # m, cutting height l1


@dataclass(frozen=True)
class Fabric:
    """Cloth of the shell, Eq. (2.9)."""

    E11: float  # N/m, along the generatrix
    E22: float  # N/m, around the hoop
    nu12: float
    nu21: float
    G12: float  # N/m, shear
    areal_density: float  # kg/m^2, unloaded
    viscosity: float  # N s/m, resolved from damping_ratio where that was given
    law: Literal["tension_field", "nominal_tension", "true_tension"]
    slack: Literal["cut", "compression"]  # whether slack fabric carries nothing, or compression as it carries tension
    strength: float | None = None  # N/m, tension that it bears


@dataclass(frozen=True)
class Belt:
    """Ring belt sewn on the fabric, Eq. (2.3); acts besides the fabric below it."""

    height: float  # m, of the belt's middle above the lower cover, unloaded
    stiffness: float  # N, E2: force per unit elongation
    line_density: float  # kg/m, unloaded
    width: float  # m, reduced width
    strength: float | None = None  # N/m, tension N22 that it bears


@dataclass(frozen=True)
class Cargo:
    """Rigid body on the upper cover, Eq. (2.4)."""

    mass: float  # kg
    velocity: float  # m/s at first contact, downwards positive
    diameter: float  # m, of the upright cylinder that it is to the fabric
    height: float | None  # m; None: without a top


@dataclass(frozen=True)
class Pressure:
    """Excess pressure law: constant, Eq. (2.10) or a table; damped by Eq. (2.11)."""

    law: Literal["constant", "sine", "table"]
    value: float  # Pa: the constant, or P_max of (2.10); 0 for a table
    peak_time: float  # s, of P_max (sine), else 0
    end_time: float  # s, end of the pressure (sine), else 0
    times: tuple[float, ...]  # s, increasing (table), else empty
    values: tuple[float, ...]  # Pa, same length as times
    damping: float  # s/m, nu^n of (2.11)

    @property
    def start(self) -> float:
        """At t = 0, Pa."""
        return {"constant": self.value, "sine": 0.0, "table": self.values[0] if self.values else 0.0}[self.law]

    @property
    def largest(self) -> float:
        """Of the law, Pa."""
        return max(self.value, *self.values, 0.0)

    def steady(self, value: float) -> Pressure:
        """Return a constant pressure (Pa) in place of the law."""
        return replace(self, law="constant", value=value, peak_time=0.0, end_time=0.0, times=(), values=())


@dataclass(frozen=True)
class Grid:
    """Cells of the full shell."""

    generatrix: int
    hoop: int


@dataclass(frozen=True)
class Time:
    """Step and end of the run."""

    courant: float  # part of the longest stable step; above 1 nothing says that the run is stable
    end: float  # s


@dataclass(frozen=True)
class Model:
    """Numerical model."""

    scheme: Literal["edge", "cell"]  # cell is (3.2) as printed
    fidelity: Fidelity


@dataclass(frozen=True)
class Output:
    """What the result file keeps."""

    snapshot_interval: float  # s between pictures of the whole shell
    history_interval: int  # steps between rows of /history
    cfc: int  # channel frequency class of the filtered peaks


@dataclass(frozen=True)
class Case:
    """One drop, checked and in SI units."""

    title: str
    gravity: float  # m/s^2, downwards
    shell: Shell
    fabric: Fabric
    belts: tuple[Belt, ...]
    cargo: Cargo
    contact: tuple[str, ...]  # what stops the fabric, of keys.CONTACT
    initial: Literal["unloaded", "inflated"]  # shape at first contact
    friction: float  # Coulomb's coefficient on ground and cover
    tolerance: float | None  # relative, of the impact velocity: then fidelity, grid and Courant number are chosen
    pressure: Pressure
    grid: Grid
    time: Time
    model: Model
    output: Output
    insists: bool = False  # whether an answer that misses the tolerance is a failure: where the case names one

    @property
    def without_contact(self) -> list[str]:
        """Paths of inputs that do nothing, for the contact that they belong to is not asked for, or no fabric is there."""
        parts = () if self.model.fidelity == "lumped" else self.contact
        cargo, idle = self.cargo, []
        if self.friction > 0.0 and "ground" not in parts and "cover" not in parts:
            idle.append("friction")
        if "cargo" not in parts:
            idle += ["cargo.diameter"] if cargo.diameter != self.shell.diameter else []
            idle += ["cargo.height"] if cargo.height is not None else []
        return idle


class CaseError(Exception):
    """A case file or an override has faults; `faults` holds a message for each, in the order of the file."""

    def __init__(self, faults: Sequence[str]) -> None:
        super().__init__(faults)
        self.faults = list(faults)

    def __str__(self) -> str:
        return "\n".join(self.faults)


def load_case(path: str | Path, overrides: Sequence[str] = ()) -> Case:
    """Read a case file.

    overrides: texts such as `fabric.E=18.75kN/m`, applied in turn to the keys of the file.
    Raises CaseError with all faults of the file and the overrides.
    """
    return parse_case(read_text(path), str(path), overrides)


def read_text(path: str | Path) -> str:
    """Text of a case file. Raises CaseError."""
    try:
        content = Path(path).read_bytes()
    except OSError as error:
        raise CaseError([f"{path}: {error.strerror or error}; a case file is wanted"]) from None
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        before = content[: error.start]
        line, column = before.count(b"\n") + 1, error.start - before.rfind(b"\n")
        fault = f"{path}:{line}:{column}: byte 0x{content[error.start]:02x} is not UTF-8; a text file in UTF-8 is wanted"
        raise CaseError([fault]) from None


def parse_case(text: str, name: str, overrides: Sequence[str | Override] = ()) -> Case:
    """Read the text of a case file; `name` stands in messages and gives the default title. Raises CaseError."""
    check = _CaseChecker()
    case = check.case(_tree(text, name, overrides, check), Path(name).stem)
    if case is None:
        raise CaseError(check.messages())
    return case


def quantities(path: str | Path, overrides: Sequence[str] = ()) -> dict[str, float | tuple[float, ...]]:
    """What a case file and its overrides give to the physics as numbers other than 0, in SI units, by dotted path.

    Defaults are not among them, nor what is no input of the drop: grid, time, tolerance, strengths. Raises CaseError.
    """
    check = _CaseChecker()
    root = _tree(read_text(path), str(path), overrides, check)
    if check.case(root, Path(path).stem) is None:
        raise CaseError(check.messages())
    found: dict[str, float | tuple[float, ...]] = {}

    def gather(node: Node, where: str, keys: Sequence[Key]) -> None:
        assert isinstance(node.value, dict)
        for key in keys:
            if key.name not in node.value or not isinstance(key.kind, Dimension) or key.name in ("tolerance", "strength"):
                continue
            item = node.value[key.name].value
            values = tuple(float(key.convert(one.value)) for one in item) if isinstance(item, list) else float(key.convert(item))
            if values if isinstance(values, float) else any(values):
                found[join(where, key.name)] = values

    gather(root, "", TOP)
    assert isinstance(root.value, dict)
    for name in PHYSICS:
        node = root.value.get(name)
        if node is not None and isinstance(node.value, list):
            for number, item in enumerate(node.value):
                gather(item, join(name, number), LISTED_BELT)
        elif node is not None:
            gather(node, name, SECTIONS[name])
    return found


def _tree(text: str, name: str, overrides: Sequence[str | Override], check: Checker) -> Node:
    """The tree of a case file with its overrides written in; faults of theirs are told to `check`."""

    def place_of(line: int, column: int) -> Place:
        return Place((0, line, column), f"{name}:{line + 1}:{column + 1}")

    try:
        root = parse(text, place_of, check.fault)
    except YamlError as error:
        check.fault(error.place, "", str(error), "valid YAML is wanted")
        raise CaseError(check.messages()) from None
    if root is None or not isinstance(root.value, dict):
        place = root.place if root else place_of(0, 0)
        check.fault(place, "", "not a mapping" if root else "an empty file", "sections such as 'shell:' are wanted")
        raise CaseError(check.messages())
    for index, override in enumerate([overrides] if isinstance(overrides, str) else overrides):
        change = override if isinstance(override, Override) else Override(override, Place((1, index, 0), f"--set {override}"))
        apply_override(root, change.text, change.place, check.fault)
    return root


def case_to_dict(case: Case) -> dict[str, Any]:
    """The resolved case in SI numbers, in the sections of a case file: written as JSON, it is one that gives an equal Case."""
    sections = asdict(case)
    sections["belts"] = [_given(belt) for belt in sections["belts"]]
    sections["contact"] = list(sections["contact"])
    for name in ("fabric", "cargo", "model"):
        sections[name] = _given(sections[name])
    if not case.insists:
        del sections["tolerance"]
    del sections["insists"]
    keys = ("law", *(key.name for key in PRESSURE[case.pressure.law]))
    pressure = {name: sections["pressure"][name] for name in keys}
    sections["pressure"] = {name: list(value) if isinstance(value, tuple) else value for name, value in pressure.items()}
    return sections


def _given(section: Values) -> Values:
    return {key: value for key, value in section.items() if value is not None}


@dataclass(frozen=True)
class FullStop:
    """Pressure that absorbs the cargo's energy over the shell's height, section 2.2."""

    energy: float  # J, m g l1 + m V^2/2
    mean: float  # Pa, P~
    largest: float  # Pa, P_max of (2.10): pi/2 of the mean, wherever the peak stands
    end_time: float  # s, t_k


def full_stop(mass: float, velocity: float, gravity: float, height: float, diameter: float) -> FullStop:
    """Section 2.2 for a piston of the cover's area: P~ = E/(F l1), t_k = V/(P~ F/m - g), which is 2 l1/V with this P~."""
    energy = mass * (gravity * height + velocity**2 / 2)
    mean = energy / (math.pi * diameter**2 / 4 * height)
    return FullStop(energy, mean, math.pi / 2 * mean, 2 * height / velocity)


class _CaseChecker(Checker):
    def case(self, root: Node, stem: str) -> Case | None:
        """The checked case, None if there are faults."""
        top = self.section(root, "", TOP, others=("contact", "sweep", *SECTIONS))
        shell = self.named(root, "shell")
        fabric = self.fabric(root, shell)
        grid = self.grid(root, shell)
        belts = self.belts(root, shell, fabric, grid)
        cargo = self.cargo(root, shell)
        model = self.model(root)
        contact = self.contact(root, model)
        pressure = self.pressure(root, shell, cargo, top)
        self.initial(root, top, model, pressure)
        time = self.named(root, "time")
        output = self.named(root, "output")
        if self.faults:
            return None
        if time["courant"] == "auto":
            time["courant"] = auto_courant(Shell(**shell), Fabric(**fabric), Grid(**grid))
        return Case(
            title=top.get("title", stem),
            gravity=top["gravity"],
            shell=Shell(**shell),
            fabric=Fabric(**fabric),
            belts=belts,
            cargo=Cargo(**{"diameter": shell["diameter"], "height": None, **cargo}),
            contact=contact,
            initial=top["initial"],
            friction=top["friction"],
            tolerance=top.get("tolerance", AUTO_TOLERANCE if model["fidelity"] == "auto" else None),
            insists="tolerance" in top,
            pressure=pressure,
            grid=Grid(**grid),
            time=Time(**time),
            model=Model(**model),
            output=Output(**{"snapshot_interval": time["end"] / 150, **output}),
        )

    def fabric(self, root: Node, shell: Values) -> Values:
        node = self.member(root, "fabric")
        if node is None:
            return {}
        fabric = self.section(node, "fabric", SECTIONS["fabric"], ALTERNATIVES["fabric"])
        if fabric.get("law") == "tension_field" and fabric.get("slack") == "compression":
            place, where = last_given(node, "fabric", ["law", "slack"])
            self.fault(place, where, "a tension field carries no compression", "slack: cut, or law: nominal_tension is wanted")
        if "E" in fabric:
            fabric["E11"] = fabric["E22"] = fabric.pop("E")
        if not {"E11", "E22"} <= fabric.keys():
            return fabric
        fabric.setdefault("G12", SHEAR * min(fabric["E11"], fabric["E22"]))
        if not self.reciprocal(node, fabric):
            return fabric
        if {"damping_ratio", "areal_density"} <= fabric.keys() and "diameter" in shell:
            # of the critical damping of the hoop's breathing mode
            stiffness = fabric["areal_density"] * fabric["E22"] / (1 - fabric["nu12"] * fabric["nu21"])
            fabric["viscosity"] = fabric.pop("damping_ratio") * shell["diameter"] * math.sqrt(stiffness)
        return fabric

    def reciprocal(self, node: Node, fabric: Values) -> bool:
        """Whether Poisson's ratios are those of an elastic sheet; the one that is not given follows: nu12 E11 = nu21 E22."""
        E11, E22 = fabric["E11"], fabric["E22"]
        given = [name for name in ("nu12", "nu21") if name in fabric]
        nu12 = fabric["nu12"] if "nu12" in fabric else fabric.get("nu21", 0.0) * E22 / E11
        nu21 = nu12 * E11 / E22
        if "nu21" in fabric and not math.isclose(fabric["nu21"], nu21, rel_tol=RECIPROCITY):
            place, where = last_given(node, "fabric", ["nu12", "nu21", "E", "E11", "E22"])
            fault = (
                f"nu12*E11 = {nu12 * E11:.6g} N/m is not nu21*E22 = {fabric['nu21'] * E22:.6g} N/m, so there is no elastic energy"
            )
            self.fault(place, where, fault, f"nu21: {nu21:.6g}, or one of nu12 and nu21 alone is wanted")
            return False
        if nu12 * nu21 >= 1:
            place, where = last_given(node, "fabric", [*given, "E", "E11", "E22"])
            self.fault(place, where, f"nu12*nu21 = {nu12 * nu21:.6g}", "a product < 1 is wanted")
            return False
        fabric["nu12"], fabric["nu21"] = nu12, nu21
        return True

    def grid(self, root: Node, shell: Values) -> Values:
        """Cells as given, else of a size that the scene wants."""
        grid = self.named(root, "grid")
        asked = self.given(root, "model")
        grid.setdefault("hoop", HOOP)
        if {"diameter", "height"} <= shell.keys() and "generatrix" not in grid:
            gap = self.narrowest_gap(root, shell["height"])
            cells = wanted_cells(shell["height"], shell["diameter"], gap, asked.get("fidelity") in ONE_COLUMN)
            grid["generatrix"] = min(cells, 10_000)
        return grid

    def narrowest_gap(self, root: Node, height: float) -> float:
        """Smallest distance (m) of the middles of two belts, or of a belt and a cover; as far as belts can be read."""
        node = root.value.get("belts") if isinstance(root.value, dict) else None
        if node is None:
            return height
        quiet = _CaseChecker()
        if isinstance(node.value, list):
            items = (quiet.section(item, "", LISTED_BELT, complete=False) for item in node.value)
            places = sorted(item["height"] for item in items if "height" in item)
        else:
            count = quiet.section(node, "", BELTS, complete=False).get("count", 0)
            places = [height * k / (count + 1) for k in range(1, count + 1)] if count < 1000 else []
        gaps = [b - a for a, b in pairwise([0.0, *places, height])]
        return min((gap for gap in gaps if gap > 0.0), default=height)

    def cargo(self, root: Node, shell: Values) -> Values:
        node = self.member(root, "cargo")
        if node is None:
            return {}
        cargo = self.section(node, "cargo", SECTIONS["cargo"])
        if "diameter" in shell and cargo.get("diameter", 0.0) > shell["diameter"]:
            place, where = last_given(node, "cargo", ["diameter"])
            fault = f"{cargo['diameter']:g} m is wider than the cover"
            self.fault(place, where, fault, f"a diameter up to shell.diameter, {shell['diameter']:g} m, is wanted")
        return cargo

    def model(self, root: Node) -> Values:
        model, node = self.named(root, "model"), self.member(root, "model")
        if "fidelity" not in model:
            grid_given, time = self.given(root, "grid"), self.given(root, "time")
            numerics = grid_given or model.get("scheme") == "cell" or time.get("courant", "auto") != "auto"
            model["fidelity"] = "full" if numerics else "auto"
        fidelity = model.get("fidelity")
        if node is None or not isinstance(node.value, dict):
            return model
        if fidelity in ("axisymmetric", "lumped") and model.get("scheme") == "cell":
            place, where = last_given(node, "model", ["scheme", "fidelity"])
            fault = f"the {fidelity} shell does not know the cell scheme"
            self.fault(place, where, fault, "scheme: edge or fidelity: full is wanted")
        return model

    def given(self, root: Node, name: str) -> dict[str, Any]:
        """What the file gives in a section, as it is written."""
        node = root.value.get(name) if isinstance(root.value, dict) else None
        return {key: item.value for key, item in node.value.items()} if node and isinstance(node.value, dict) else {}

    def initial(self, root: Node, top: Values, model: Values, pressure: Pressure) -> None:
        """A shell is inflated by the pressure it starts with."""
        if top.get("initial") != "inflated" or self.faults:
            return
        place, where = last_given(root, "", ["initial"])
        if model["fidelity"] == "lumped":
            self.fault(
                place, where, "the lumped model has no shell to inflate", "initial: unloaded or another fidelity is wanted"
            )
        elif pressure.start == 0.0:
            fault = f"the {pressure.law} law starts without pressure"
            self.fault(place, where, fault, "initial: unloaded, or a pressure at t = 0 is wanted")

    def contact(self, root: Node, model: Values) -> tuple[str, ...]:
        """What stops the fabric."""
        assert isinstance(root.value, dict)
        node = root.value.get("contact")
        fidelity = model.get("fidelity", "axisymmetric")
        known = tuple(part for part in CONTACT if part not in UNKNOWN_CONTACT[fidelity])
        word = node.value if node is not None else "full"
        if isinstance(word, str) and word in CONTACT_SETS:
            return tuple(part for part in CONTACT_SETS[word] if part in known)
        assert node is not None
        items = node.value if isinstance(node.value, list) else [node]
        parts = f"{', '.join(known)}, or a list of them"
        wanted = f"{parts}, is wanted" if isinstance(node.value, list) else f"{', '.join(CONTACT_SETS)}, {parts}, is wanted"
        named: list[Any] = []
        for number, item in enumerate(items):
            path = join("contact", number) if isinstance(node.value, list) else "contact"
            if not isinstance(item.value, str):
                self.fault(item.place, path, "no value" if item.value is None else "not a word", wanted)
            elif item.value not in CONTACT:
                self.fault(item.place, path, f"unknown part '{item.value}'", wanted)
            elif item.value in named:
                self.fault(item.place, path, f"'{item.value}' is named twice", "once is wanted")
            elif item.value not in known:
                others = [
                    name
                    for name, unknown in UNKNOWN_CONTACT.items()
                    if item.value not in unknown and name not in ("lumped", "auto")
                ]
                fault = f"the {fidelity} shell does not know '{item.value}'"
                self.fault(item.place, path, fault, f"fidelity: {' or '.join(others)}, or no '{item.value}' is wanted")
            named.append(item.value)
        return tuple(part for part in CONTACT if part in named)

    def belts(self, root: Node, shell: Values, fabric: Values, grid: Values) -> tuple[Belt, ...]:
        assert isinstance(root.value, dict)
        node = root.value.get("belts")
        if node is None:
            return ()
        if isinstance(node.value, list):
            belts = []
            for number, item in enumerate(node.value):
                path = join("belts", number)
                values = self.section(item, path, LISTED_BELT, ALTERNATIVES["belts"])
                if {"height", "width"} <= values.keys():
                    self.fits(item, path, values, shell, grid)
                if not self.faults:
                    belts.append(_belt(values["height"], values, fabric))
            return tuple(belts)
        count = node.value.get("count") if isinstance(node.value, dict) else None
        no_belts = count is not None and count.value == 0
        values = self.section(node, "belts", BELTS, ALTERNATIVES["belts"], complete=not no_belts)
        if {"count", "width"} <= values.keys():
            self.stack_fits(node, values, shell, grid)
        if self.faults:
            return ()
        height = shell["height"]
        return tuple(_belt(height * k / (values["count"] + 1), values, fabric) for k in range(1, values["count"] + 1))

    def fits(self, node: Node, path: str, belt: Values, shell: Values, grid: Values) -> None:
        """The rows of nodes on the covers are rigid: a belt keeps half a cell off them."""
        if "height" not in shell or "generatrix" not in grid:
            return
        lowest = belt["width"] / 2 + shell["height"] / grid["generatrix"] / 2
        highest = shell["height"] - lowest
        place, where = last_given(node, path, ["height", "width"])
        if lowest > highest:
            widest = shell["height"] - shell["height"] / grid["generatrix"]
            self.fault(place, where, "the belt is wider than the room between the covers", f"a width < {widest:.6g} m is wanted")
        elif abs(belt["height"] - shell["height"] / 2) > (highest - lowest) / 2 + 1e-9 * shell["height"]:
            fault = "the belt comes closer than half a grid cell to a cover"
            self.fault(place, where, fault, f"a height from {lowest:.6g} m to {highest:.6g} m is wanted for this width")

    def stack_fits(self, node: Node, belts: Values, shell: Values, grid: Values) -> None:
        """As `fits`, for belts at uniform spacing."""
        if belts["count"] == 0 or "height" not in shell or "generatrix" not in grid:
            return
        widest = 2 * shell["height"] / (belts["count"] + 1) - shell["height"] / grid["generatrix"]
        if widest <= 0:
            place, where = last_given(node, "belts", ["count"])
            fault = "the outer belts come closer than half a grid cell to the covers"
            self.fault(place, where, fault, f"a count up to {2 * grid['generatrix'] - 2} is wanted on this grid")
        elif belts["width"] > widest * (1 + 1e-9):
            place, where = last_given(node, "belts", ["count", "width"])
            fault = "the outer belts come closer than half a grid cell to the covers"
            self.fault(place, where, fault, f"a width up to {widest:.6g} m is wanted for this count")

    def pressure(self, root: Node, shell: Values, cargo: Values, top: Values) -> Pressure:
        none = Pressure("constant", 0.0, 0.0, 0.0, (), (), 0.0)
        node = self.member(root, "pressure")
        if node is None:
            return none
        members = node.value if isinstance(node.value, dict) else {}
        law = members["law"].value if "law" in members else None
        if not isinstance(law, str) or law not in PRESSURE:
            self.section(node, "pressure", SECTIONS["pressure"], complete=False)
            if isinstance(node.value, dict) and "law" not in members:
                self.missing(node, "pressure", LAW)
            return none
        keys = (LAW, *PRESSURE[law])
        foreign = {key.name for key in SECTIONS["pressure"]} - {key.name for key in keys}
        for name in foreign & members.keys():
            self.fault(members[name].key, join("pressure", name), f"not a key of the {law} law", f"{listed(keys)} are wanted")
        values = self.section(node, "pressure", keys, others=foreign)
        if law == "table":
            self.table(node, values)
        elif law == "sine" and {"height", "diameter", "mass", "velocity", "gravity"} <= {*shell, *cargo, *top}:
            self.sine(node, values, shell, cargo, top["gravity"])
        if self.faults:
            return none
        return Pressure(**{**asdict(none), **values})

    def table(self, node: Node, values: Values) -> None:
        times = values.get("times")
        if times is None:
            return
        assert isinstance(node.value, dict)
        items = node.value["times"].value
        assert isinstance(items, list)
        for number in range(1, len(times)):
            if times[number] <= times[number - 1]:
                wanted = f"a time > {times[number - 1]:g} s is wanted"
                self.fault(items[number].place, f"pressure.times.{number}", "not later than the time before it", wanted)
        if "values" in values and len(values["values"]) != len(times):
            place, where = last_given(node, "pressure", ["values", "times"])
            self.fault(place, where, f"{len(values['values'])} values for {len(times)} times", "a value for each time is wanted")

    def sine(self, node: Node, values: Values, shell: Values, cargo: Values, gravity: float) -> None:
        """Defaults of the sine law, of a full stop by section 2.2."""
        stop = full_stop(cargo["mass"], cargo["velocity"], gravity, shell["height"], shell["diameter"])
        assert isinstance(node.value, dict)
        if "value" not in node.value:
            values["value"] = stop.largest
        if "end_time" not in node.value:
            values["end_time"] = stop.end_time
        if {"peak_time", "end_time"} <= values.keys() and values["end_time"] <= values["peak_time"]:
            place, where = last_given(node, "pressure", ["peak_time", "end_time"])
            fault = f"peak_time {values['peak_time']:.6g} s is not before end_time {values['end_time']:.6g} s"
            self.fault(place, where, fault, "peak_time < end_time is wanted")


def wanted_cells(height: float, diameter: float, gap: float, one_column: bool) -> int:
    """Cells along the generatrix of a default grid; gap (m): smallest distance of belts from one another and the covers."""
    least = math.ceil(height / (0.5 * diameter) * FINE * (2 if one_column else 1) - 1e-9)
    between = math.ceil(BETWEEN_BELTS * height / gap - 1e-9)
    return max(least, min(between, 4 * least), 8)


def coarseness(case: Case) -> str | None:
    """Say what is wanted where the grid of a case is coarser than its scene needs; None where it is not, or will be chosen."""
    if case.tolerance is not None or case.model.fidelity == "lumped":
        return None
    height, diameter, grid, faults = case.shell.height, case.shell.diameter, case.grid, []
    gap = min(b - a for a, b in pairwise([0.0, *sorted(belt.height for belt in case.belts), height]))
    wanted = wanted_cells(height, diameter, gap or height, False)
    if grid.generatrix * FINE < wanted * COARSE:
        faults.append(f"grid.generatrix {grid.generatrix}, where this scene wants {wanted}")
    if grid.hoop / (2.0 * math.pi) < COARSE and case.model.fidelity != "axisymmetric":
        faults.append(f"grid.hoop {grid.hoop}, where {HOOP} are wanted")
    return f"coarse grid: {' and '.join(faults)}; answers may be off by some per cent" if faults else None


class LongStep(UserWarning):
    """A run takes longer steps than the longest stable one."""


def long_steps(cases: Iterable[Case]) -> str | None:
    """Return what to say of cases whose steps are longer than the longest stable one; None without any."""
    stepping = (case for case in cases if case.tolerance is None and case.model.fidelity != "lumped")
    above = {case.time.courant for case in stepping if case.time.courant > 1.0}
    if not above:
        return None
    number = f"{'up to ' if len(above) > 1 else ''}{max(above):g}"
    return f"time.courant {number} is above 1, the longest stable step: a run diverges, or slack hides it and tensions are wrong"


def level(case: Case, fidelity: Fidelity, generatrix: int, hoop: int, courant: float | None = None) -> Case:
    """The case at another level and grid, with the contact that this level knows; courant: None for `auto`."""
    contact = case.contact
    if fidelity == "axisymmetric" and "folds" in contact and "axis" not in contact:
        contact = tuple(part for part in CONTACT_SETS["full"] if part in (*contact, "axis"))
    contact = tuple(part for part in contact if part not in UNKNOWN_CONTACT[fidelity])
    grid = replace(case.grid, generatrix=generatrix, hoop=hoop)
    if courant is None:
        courant = auto_courant(case.shell, case.fabric, grid)
    return replace(
        case,
        contact=contact,
        grid=grid,
        time=replace(case.time, courant=courant),
        model=replace(case.model, fidelity=fidelity),
        tolerance=None,
        insists=False,
    )


def auto_courant(shell: Shell, fabric: Fabric, grid: Grid) -> float:
    """Courant coefficient that is safe for the damping ratio of the grid's shortest waves."""
    ratio = damping_ratio(shell, fabric, grid)
    return next(courant for least, courant in AUTO_COURANT if ratio >= least)


def damping_ratio(shell: Shell, fabric: Fabric, grid: Grid) -> float:
    """Damping ratio of the grid's shortest waves, viscosity/(h sqrt(E density))."""
    density = fabric.areal_density / (1.0 - fabric.nu12 * fabric.nu21)
    along = shell.height / grid.generatrix * math.sqrt(fabric.E11 * density)
    around = shell.diameter * math.sin(math.pi / grid.hoop) * math.sqrt(fabric.E22 * density)
    return fabric.viscosity / max(along, around)


def _belt(height: float, belt: Values, fabric: Values) -> Belt:
    width = belt["width"]
    stiffness = belt["stiffness"] if "stiffness" in belt else belt["layers"] * fabric["E22"] * width
    line_density = belt["line_density"] if "line_density" in belt else belt["layers"] * fabric["areal_density"] * width
    strength = belt.get("strength")
    if strength is None and "layers" in belt and "strength" in fabric:
        strength = belt["layers"] * fabric["strength"]
    return Belt(height, stiffness, line_density, width, strength)
