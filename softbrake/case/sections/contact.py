"""Key `contact`: what stops the fabric, a word or a list of parts."""

from __future__ import annotations

from typing import Any

from softbrake.case.section import Draft, Section
from softbrake.case.sections.numerics import Fidelity
from softbrake.case.yaml_nodes import Node, join

PARTS = ("ground", "belts", "cover", "cargo", "axis", "folds")
SETS = {
    "full": ("ground", "cover", "cargo", "axis", "folds"),
    "solid": ("ground", "cover", "cargo"),
    "paper": ("ground", "belts"),
}
UNKNOWN: dict[Fidelity, tuple[str, ...]] = {"full": ("axis",), "axisymmetric": (), "lumped": (), "auto": ()}  # parts, by fidelity
_MEANING = "what stops the fabric: full, solid, paper, or parts"


class _ContactSection(Section):
    def read(self, draft: Draft) -> tuple[str, ...]:
        """Parts in the order of PARTS; of a word those that the fidelity knows."""
        fidelity: Fidelity = draft.values("model").get("fidelity", "axisymmetric")
        node = draft.members.get(self.name)
        word = node.value if node is not None else "full"
        if isinstance(word, str) and word in SETS:
            return tuple(part for part in SETS[word] if part in known_parts(fidelity))
        assert node is not None
        named = _named(draft, node, fidelity)
        return tuple(part for part in PARTS if part in named)

    def build(self, draft: Draft) -> tuple[str, ...]:
        """The parts."""
        parts: tuple[str, ...] = draft.values(self.name)
        return parts

    def written(self, part: tuple[str, ...]) -> list[str]:
        """A list."""
        return list(part)

    def schema(self) -> dict[str, Any]:
        """A word, a part or a list of parts."""
        some: dict[str, Any] = {"type": "array", "items": {"enum": list(PARTS)}, "uniqueItems": True}
        return {"description": _MEANING, "oneOf": [{"enum": [*SETS, *PARTS]}, some]}

    def starter(self) -> list[str]:
        """One line."""
        return ["contact: full".ljust(34) + f"# {_MEANING}"]


CONTACT = _ContactSection("contact", tuple, (), optional=True)


def known_parts(fidelity: Fidelity) -> tuple[str, ...]:
    """Parts of contact that a fidelity knows."""
    return tuple(part for part in PARTS if part not in UNKNOWN[fidelity])


def _named(draft: Draft, node: Node, fidelity: Fidelity) -> list[Any]:
    """What a list, or a single word, names."""
    known = known_parts(fidelity)
    many = isinstance(node.value, list)
    items = node.value if isinstance(node.value, list) else [node]
    parts = f"{', '.join(known)}, or a list of them"
    expected = f"{parts}, is expected" if many else f"{', '.join(SETS)}, {parts}, is expected"
    named: list[Any] = []
    for number, item in enumerate(items):
        path = join("contact", number) if many else "contact"
        if not isinstance(item.value, str):
            draft.fault(item.place, path, "no value" if item.value is None else "not a word", expected)
        elif item.value not in PARTS:
            draft.fault(item.place, path, f"unknown part '{item.value}'", expected)
        elif item.value in named:
            draft.fault(item.place, path, f"'{item.value}' is named twice", "once is expected")
        elif item.value not in known:
            others = [name for name in UNKNOWN if item.value in known_parts(name) and name not in ("lumped", "auto")]
            fault = f"the {fidelity} shell does not know '{item.value}'"
            draft.fault(item.place, path, fault, f"fidelity: {' or '.join(others)}, or no '{item.value}' is expected")
        named.append(item.value)
    return named
