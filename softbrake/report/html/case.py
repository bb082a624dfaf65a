"""All values of the case."""

from __future__ import annotations

import math
from typing import Any

from softbrake.case.case import key_at
from softbrake.case.sections.contact import PARTS
from softbrake.case.sections.shell import shell_of
from softbrake.case.units import Dimension
from softbrake.report.html.frame import table


def case_table(case: dict[str, Any]) -> str:
    """All values of the resolved case with unit and meaning."""
    rows = []

    def add(path: str, value: Any) -> None:
        if isinstance(value, dict):
            for name, inner in value.items():
                add(f"{path}.{name}", inner)
            return
        key = key_at(path)
        unit = key.kind.unit if key is not None and isinstance(key.kind, Dimension) else ""
        values = value if isinstance(value, list) else [value]
        shown = ", ".join(f"{one:.6g}" if isinstance(one, float) else str(one) for one in values)
        rows.append([path, f"{shown} {unit}".strip(), key.meaning if key is not None else ""])
        if path == "fabric.viscosity" and (ratio := _damping_ratio(case)) is not None:
            rows.append(["fabric.damping_ratio", f"{100 * ratio:.3g} %", "that gives this viscosity"])

    for name, value in case.items():
        if name == "vents":
            for number, vent in enumerate(value):
                add(f"vents.{number}", vent)
        elif name == "belts":
            for number, belt in enumerate(value):
                add(f"belts.{number}", belt)
                if (layers := _layers(case, belt)) is not None:
                    rows.append([f"belts.{number}.layers", f"{layers:.6g}", "of fabric, with this stiffness and line density"])
        elif name == "contact":
            rows.append(["contact", ", ".join(value) or "none", f"what stops the fabric, of {', '.join(PARTS)}"])
        elif name != "title":
            add(name, value)
    return table(("", "", ""), rows)


def _layers(case: dict[str, Any], belt: dict[str, Any]) -> float | None:
    """Layers of fabric that make a belt; None where its stiffness and its mass are not those of one number of layers."""
    fabric = case.get("fabric", {})
    if not {"E22", "areal_density"} <= fabric.keys():
        return None
    layers: float = belt["stiffness"] / (fabric["E22"] * belt["width"])
    return layers if math.isclose(belt["line_density"], layers * fabric["areal_density"] * belt["width"], rel_tol=1e-9) else None


def _damping_ratio(case: dict[str, Any]) -> float | None:
    """Viscosity over that which damps the breathing hoop critically."""
    fabric = case["fabric"]
    if not {"E22", "areal_density", "nu12", "nu21", "viscosity"} <= fabric.keys() or "shell" not in case:
        return None
    stiffness = fabric["areal_density"] * fabric["E22"] / (1 - fabric["nu12"] * fabric["nu21"])
    return float(fabric["viscosity"] / (shell_of(case["shell"]).diameter * math.sqrt(stiffness)))
