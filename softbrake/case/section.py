"""What a section of a case file is: keys, the dataclass they become, and cross-checks. Each has a file in `sections`."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, fields
from functools import cache
from typing import Any, ClassVar

from softbrake.case.checker import Checker, Values
from softbrake.case.keys import Alternatives, Key, mapping_schema
from softbrake.case.yaml_nodes import Node, Place, join


class _Members(Mapping[str, Node]):
    """The members of a file, which notes what is looked up."""

    def __init__(self, members: dict[str, Node], note: Callable[[str], None]) -> None:
        self._members, self._note = members, note

    def __getitem__(self, name: str) -> Node:
        self._note(name)
        return self._members[name]

    def get(self, name: str, default: Any = None) -> Any:
        self._note(name)
        return self._members.get(name, default)

    def __contains__(self, name: object) -> bool:
        self._note(str(name))
        return name in self._members

    def __iter__(self) -> Iterator[str]:
        self._note(_ALL)
        return iter(self._members)

    def __len__(self) -> int:
        self._note(_ALL)
        return len(self._members)


_ALL, _NAMES = "", " "  # noted of a section that looks at the whole file, or at the names in it


class Draft(Checker):
    """A case file on its way to a case. A section reads, and later builds, those it depends on through it, each once.

    What a section looks up is noted: of a draft that differs from a sound one in other members, the section is taken from that.
    """

    def __init__(self, root: Node, stem: str, sections: Mapping[str, Section], sound: Draft | None = None) -> None:
        """root: a mapping; stem: name of the file without ending; sections: by name, that of the keys outside of all is "".

        sound: a draft without faults, of the same stem and sections.
        """
        super().__init__()
        assert isinstance(root.value, dict)
        self._root, self.place, self.stem, self.sections = root, root.place, stem, sections
        self._noted: list[set[str]] = []
        self.members = _Members(root.value, self._note)
        self._found: dict[tuple[str, bool], tuple[Any, set[str]]] = {}  # what was read or built, and of what
        self._sound = sound
        self._changed = set() if sound is None else _changes(root.value, sound._root.value)

    @property
    def root(self) -> Node:
        """The whole file."""
        self._note(_ALL)
        return self._root

    def outline(self, keys: Iterable[Key]) -> Node:
        """The whole file, of which only these keys and the names of the others are looked at."""
        for key in keys:
            self._note(key.name)
        self._note(_NAMES)
        return self._root

    def values(self, section: str) -> Any:
        """SI values of a section, as its `read` gives them: without those that are faulty or missing."""
        return self._once(section, False)

    def built(self, section: str) -> Any:
        """The part of the case that a section becomes; for a draft without faults."""
        return self._once(section, True)

    def _once(self, section: str, built: bool) -> Any:
        key = (section, built)
        if key not in self._found:
            same = None if self._sound is None else self._sound._found.get(key)
            if same is not None and same[1].isdisjoint(self._changed):
                self._found[key] = same
            else:
                self._noted.append(set())
                one = self.sections[section]
                value = one.build(self) if built else one.read(self)
                self._found[key] = value, self._noted.pop()
        value, noted = self._found[key]
        if self._noted:
            self._noted[-1] |= noted
        return value

    def _note(self, name: str) -> None:
        if self._noted:
            self._noted[-1].add(name)

    def settle(self) -> None:
        """Forget the draft that this one began with."""
        self._sound = None

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


def _changes(members: dict[str, Node], others: Any) -> set[str]:
    """What to note of members that are not those of another file."""
    changed = {name for name in {**members, **others} if members.get(name) is not others.get(name)}
    return changed | ({_ALL} if changed else set()) | ({_NAMES} if members.keys() != others.keys() else set())


class Part:
    """A frozen dataclass of the case, whose fields keep within the bounds of the keys of their names however it is made."""

    where: ClassVar[str]  # name of its section, for messages
    keys: ClassVar[Mapping[str, Key]]

    def __post_init__(self) -> None:
        """Raise ValueError, with the path of the field and what is allowed."""
        for name, may_be_none in _fields_of(type(self)):  # type: ignore[arg-type]  # mypy takes no class for hashable
            value, key = getattr(self, name), self.key(name)
            if key is None or (value is None and may_be_none):
                continue
            try:
                key.check(value)
            except ValueError as error:
                raise ValueError(f"{join(self.where, name)}: {error}") from None

    def key(self, field: str) -> Key | None:
        """The key that bounds a field; None where nothing does."""
        return self.keys.get(field)


@cache
def _fields_of(kind: Any) -> tuple[tuple[str, bool], ...]:
    """Names of the fields of a part, and whether each may be None."""
    return tuple((field.name, "None" in str(field.type)) for field in fields(kind))


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
        return {name: value for name, value in vars(part).items() if value is not None}

    def node(self, draft: Draft) -> Node | None:
        """The section in the file; an optional one left out is an empty one, another is a fault."""
        if self.name in draft.members:
            return draft.members[self.name]
        if self.optional:
            return Node({}, draft.place, draft.place)
        if self.name not in draft.meant:
            example = ", ".join(f"{key.name}: {key.example}" for key in self.needed())
            draft.fault(draft.place, self.name, "missing", f"a section such as '{self.name}: {{{example}}}' is expected")
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
