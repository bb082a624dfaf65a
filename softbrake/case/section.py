"""What a section of a case file is: keys, the dataclass they become, and cross-checks. Each has a file in `sections`."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, fields
from typing import Any, ClassVar

from softbrake.case.checker import Checker, Values
from softbrake.case.keys import Alternatives, Key, mapping_schema
from softbrake.case.yaml_nodes import Node, Place, join


class Draft(Checker):
    """A case file on its way to a case. A section reads, and later builds, those it depends on through it, each once."""

    def __init__(self, root: Node, stem: str, sections: Mapping[str, Section]) -> None:
        """root: a mapping; stem: name of the file without ending; sections: by name, that of the keys outside of all is ""."""
        super().__init__()
        assert isinstance(root.value, dict)
        self.root, self.members, self.stem, self.sections = root, root.value, stem, sections
        self._values: dict[str, Any] = {}
        self._built: dict[str, Any] = {}

    def values(self, section: str) -> Any:
        """SI values of a section, as its `read` gives them: without those that are faulty or missing."""
        if section not in self._values:
            self._values[section] = self.sections[section].read(self)
        return self._values[section]

    def built(self, section: str) -> Any:
        """The part of the case that a section becomes; for a draft without faults."""
        if section not in self._built:
            self._built[section] = self.sections[section].build(self)
        return self._built[section]

    def last_given(self, *paths: str) -> tuple[Place, str]:
        """Place and path of the last given of some keys of any section; of the file where none is given."""
        given = []
        for path in paths:
            node: Node | None = self.root
            for name in path.split("."):
                node = node.value.get(name) if node is not None and isinstance(node.value, dict) else None
            if node is not None:
                given.append((node.key, path))
        return max(given, key=lambda item: item[0].order, default=(self.root.place, ""))

    def written(self, section: str) -> Values:
        """What the file gives in a section, as it is written, not checked."""
        node = self.members.get(section)
        return {key: item.value for key, item in node.value.items()} if node and isinstance(node.value, dict) else {}


class Part:
    """A frozen dataclass of the case, whose fields keep within the bounds of the keys of their names however it is made."""

    where: ClassVar[str]  # name of its section, for messages
    keys: ClassVar[Mapping[str, Key]]

    def __post_init__(self) -> None:
        """Raise ValueError, with the path of the field and what is allowed."""
        for field in fields(self):  # type: ignore[arg-type]
            value, key = getattr(self, field.name), self.key(field.name)
            if key is None or (value is None and "None" in str(field.type)):
                continue
            try:
                key.check(value)
            except ValueError as error:
                raise ValueError(f"{join(self.where, field.name)}: {error}") from None

    def key(self, field: str) -> Key | None:
        """The key that bounds a field; None where nothing does."""
        return self.keys.get(field)


@dataclass(frozen=True, eq=False)
class Section:
    """A section that is checked key by key. One with cross-checks, other forms or computed defaults overrides methods."""

    name: str
    kind: Callable[..., Any]  # what it becomes, of the values of its keys
    keys: tuple[Key, ...]
    alternatives: Alternatives = ()  # of each exactly one group of keys must be given
    choices: Alternatives = ()  # of each at most one group may be
    each: tuple[Key, ...] = ()  # keys of each item of a list, which may stand instead
    optional: bool = False  # may be left out
    physical: bool = False  # describes the drop, not its computation
    begun: bool = True  # stands in the starter case; else only as comments

    def __post_init__(self) -> None:
        """Give the keys to what the section becomes."""
        if isinstance(self.kind, type) and issubclass(self.kind, Part):
            self.kind.where, self.kind.keys = self.name, {key.name: key for key in (*self.keys, *self.each)}

    def read(self, draft: Draft) -> Any:
        """Check the section, tell faults to the draft and return the SI values of its keys; none where it is missing."""
        node = self.node(draft)
        return {} if node is None else draft.mapping(node, self.name, self.keys, self.alternatives, self.choices)

    def build(self, draft: Draft) -> Any:
        """Return the part of the case; called when there are no faults."""
        return self.kind(**draft.values(self.name))

    def written(self, part: Any) -> Any:
        """Return the part of a case as a case file in SI numbers gives it."""
        return {name: value for name, value in asdict(part).items() if value is not None}

    def node(self, draft: Draft) -> Node | None:
        """The section in the file; an optional one left out is an empty one, another is a fault."""
        node = draft.members.get(self.name)
        if node is not None:
            return node
        if self.optional:
            return Node({}, draft.root.place, draft.root.place)
        if self.name not in draft.meant:
            example = ", ".join(f"{key.name}: {key.example}" for key in self.needed())
            draft.fault(draft.root.place, self.name, "missing", f"a section such as '{self.name}: {{{example}}}' is expected")
        return None

    def needed(self) -> list[Key]:
        """The keys of the shortest section: the required ones and the first of alternatives."""
        first = {name for groups in self.alternatives for name in groups[0]}
        return [key for key in self.keys if key.required or key.name in first]

    def give_way(self, members: dict[str, Node], name: str) -> None:
        """Drop from the section, an item or a part of it, the keys that one which is written over it stands for instead."""
        of_parts = (groups for key in (*self.keys, *self.each) for groups in key.part_groups)
        for groups in (*self.alternatives, *self.choices, *of_parts):
            if any(name in group for group in groups):
                for other in [key for group in groups if name not in group for key in group]:
                    members.pop(other, None)

    def schema(self) -> dict[str, Any]:
        """JSON Schema of the section."""
        return mapping_schema(self.keys, self.alternatives, self.choices)

    def starter(self) -> list[str]:
        """Lines of the starter case."""
        needed = [] if self.optional else self.needed()
        live = [key for key in self.keys if self.begun and (key in needed or key.default is not None or key.begun)]
        return [f"{'' if live else '# '}{self.name}:", *(key.starter("  ", key in live) for key in self.keys)]


class MayBeNone(Section):
    """A section that may be left out, and then is None in the case."""

    def read(self, draft: Draft) -> Values:
        """No values where it is left out."""
        return super().read(draft) if self.name in draft.members else {}

    def build(self, draft: Draft) -> Any:
        """None where it is left out."""
        return super().build(draft) if self.name in draft.members else None
