"""All values of the case."""

from __future__ import annotations

from typing import Any

from softbrake.case.case import key_at
from softbrake.case.sections.contact import PARTS
from softbrake.case.units import Dimension
from softbrake.report.html.frame import table


def case_table(case: dict[str, Any]) -> str:
    """All values of the resolved case with unit and meaning."""
    rows = []

    def add(path: str, value: Any) -> None:
        key = key_at(path)
        unit = key.kind.unit if key is not None and isinstance(key.kind, Dimension) else ""
        values = value if isinstance(value, list) else [value]
        shown = ", ".join(f"{one:.6g}" if isinstance(one, float) else str(one) for one in values)
        rows.append([path, f"{shown} {unit}".strip(), key.meaning if key is not None else ""])

    for name, value in case.items():
        if isinstance(value, dict):
            for key, inner in value.items():
                add(f"{name}.{key}", inner)
        elif name == "belts":
            for number, belt in enumerate(value):
                for key, inner in belt.items():
                    add(f"belts.{number}.{key}", inner)
        elif name == "contact":
            rows.append(["contact", ", ".join(value) or "none", f"what stops the fabric, of {', '.join(PARTS)}"])
        elif name != "title":
            add(name, value)
    return table(("", "", ""), rows)
