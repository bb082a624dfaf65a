"""Careless case files, by the hundred: every one is a case or a list of faults, each at its place."""

import random
import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from conftest import ROOT, Command

from softbrake.case.case import ALL, Case
from softbrake.case.case_file import CaseError, load_case, parse_case
from softbrake.case.keys import Key
from softbrake.case.schema import starter
from softbrake.case.sections.contact import PARTS, SETS
from softbrake.case.units import UNITS

COUNT = 500
MESSAGE = re.compile(r"f\.yaml:(\d+):(\d+): (\S.*; \S.*)")
SHIPPED = [  # without the section that a drop does not read
    path.read_text(encoding="utf-8").partition("\nsweep:")[0] + "\n" for path in sorted(ROOT.glob("configs/*.yaml"))
]
KEYS = [key for section in ALL.values() for one in (*section.keys, *section.each) for key in (one, *one.parts)]
BAG = """\
shell: {diameter: 0.5 m, height: 0.6 m}
fabric: {E: 20 kN/m, areal_density: 0.05 kg/m^2, viscosity: 0.2 N*s/m}
cargo: {mass: 100 kg, velocity: 6 m/s}
gas:
  pressure: 15.7 kPa
  name: helium
  temperature: 20 degC
  process: adiabatic
ambient:
  altitude: 3000 m
vents:
  - area: 300 cm^2
    discharge: 0.6
    opens: always
    closes:
      pressure: 20 kPa
    inflow: allowed
  - area: 0.001
    discharge:
      pressure_ratio: [0.5, 1]
      coefficient: [0.75, 0.6]
    opens:
      height: 30 cm
permeability:
  viscous: 5e4 Pa*s/m
  inertial: 1e3
inflator:
  times: [0 s, 5 ms]
  mass_flow: [2.4, 0]
  temperature: 600 K
time:
  after: rebound
"""


def outcome(text: str) -> Case | list[tuple[int, int, str]]:
    """The case, or line, column and message of each fault. Anything else that is raised fails the test."""
    try:
        return parse_case(text, "f.yaml")
    except CaseError as error:
        found = [MESSAGE.fullmatch(message) for message in error.faults]
        assert found and all(found), error.faults
        return [(int(match[1]), int(match[2]), match[3]) for match in found if match]


def check_places(text: str, faults: list[tuple[int, int, str]]) -> None:
    """Every place lies in the file, and the faults are in its order."""
    lines = re.split("\r\n|[\n\r\x85\u2028\u2029]", text)
    for line, column, message in faults:
        assert 1 <= line <= len(lines) and 1 <= column <= len(lines[line - 1]) + 1, (line, column, message)
    assert [fault[:2] for fault in faults] == sorted(fault[:2] for fault in faults)


# Malformed files, of a grammar that knows sections, keys and values, and holds to nothing


def scalar(chance: random.Random) -> str:
    """A value that is right for some key, or for none."""
    number = chance.choice(
        ["0", "-3", "1e3", "0.5", ".5", "1e400", "-1e-320", "0x1F", "0o7", ".nan", "-.inf", "1_000", "9" * 500]
    )
    unit = chance.choice([*UNITS, "kN/m", "N*s/m", "kg/m^2", "m^9", "furlong", "m/", "^2", "²"])
    odd = [
        "",
        "~",
        "null",
        "true",
        "no",
        "auto",
        "'",
        '"',
        "''",
        "&a",
        "*a",
        "!!int 3",
        "|",
        ">-",
        "@",
        "`",
        "%",
        "#",
        "\t",
        "\0",
    ]
    odd += [
        "0,5 m",
        "1 2 3",
        "[",
        "]",
        "{",
        "}",
        "[[]]",
        "{}",
        "? a",
        "- 1",
        ": ",
        "<<",
        "Größe",
        "\ud800",
        "\u2028",
        "---",
        "...",
    ]
    key = chance.choice(KEYS)
    words = list(map(str, key.kind)) if isinstance(key.kind, tuple) else [key.example]
    return chance.choice([number, f"{number} {unit}", chance.choice(odd), chance.choice(words), chance.choice([*PARTS, *SETS])])


def name_of_a_key(chance: random.Random) -> str:
    names = [*ALL, *(key.name for key in KEYS)]
    return chance.choice([chance.choice(names), chance.choice(names), chance.choice(names)[:-1], scalar(chance), "0"])


def node(chance: random.Random, depth: int) -> str:
    """A value in flow style."""
    kind = chance.random()
    if depth == 0 or kind < 0.5:
        return scalar(chance)
    items = [node(chance, depth - 1) for _ in range(chance.randrange(4))]
    if kind < 0.7:
        return f"[{', '.join(items)}]"
    return "{" + ", ".join(f"{name_of_a_key(chance)}: {item}" for item in items) + "}"


def malformed(chance: random.Random) -> str:
    """A file of sections in any order and number, in block or flow style, with any line ends."""
    lines = [chance.choice(["", "", "# a comment", "---", "%YAML 1.1", "\ufeff", "..."])]
    for _ in range(chance.randrange(9)):
        section = chance.choice([*ALL.values()])
        name = section.name or chance.choice([key.name for key in section.keys])
        if chance.random() < 0.4 or not section.keys:
            lines.append(f"{name}: {node(chance, 3)}")
            continue
        indent = " " * chance.randrange(5) if chance.random() < 0.9 else "\t"
        some: list[Key] = chance.sample(section.keys, chance.randrange(len(section.keys) + 1))
        lines += [f"{name}:", *(f"{indent}{key.name}: {chance.choice([key.example, node(chance, 2)])}" for key in some)]
    return chance.choice(["\n", "\n", "\n", "\r\n", "\r"]).join(lines)


def some_malformed() -> Iterator[str]:
    chance = random.Random(16)
    return (malformed(chance) for _ in range(COUNT))


def test_malformed_files_are_cases_or_lists_of_faults() -> None:
    faulty, messages = 0, set()
    for text in some_malformed():
        found = outcome(text)
        if not isinstance(found, Case):
            check_places(text, found)
            faulty += 1
            messages |= {re.sub(r"'[^']*'|[0-9.]+", "", message.split("; ")[0].split(": ")[-1]) for _, _, message in found}
    assert faulty > 0.95 * COUNT
    assert len(messages) > 40  # kinds of faults


@pytest.mark.parametrize("depth", [100, 3000])
@pytest.mark.parametrize("pair", ["[]", "{}"])
def test_nesting_without_end_is_a_fault(depth: int, pair: str) -> None:
    opening = "[" if pair == "[]" else "{a: "
    assert isinstance(outcome("shell: " + opening * depth + pair[1] * depth), list)


def test_bytes_of_any_kind_are_a_list_of_faults(tmp_path: Path) -> None:
    chance, path = random.Random(16), tmp_path / "case.yaml"
    for _ in range(100):
        path.write_bytes(chance.randbytes(chance.randrange(200)))
        with pytest.raises(CaseError, match="case.yaml"):
            load_case(path)


# Mutated files: one value or key of a case that is right


PAIR = re.compile(r"^(?P<front>\s*(?:- )?(?P<key>\w+):\s+)(?P<value>[^#\s{\[|>][^#{\[]*?)(?=\s*(?:#|$))")


def places(text: str) -> list[tuple[int, re.Match[str]]]:
    """Lines, from 0, that have a key and a value."""
    return [(number, match) for number, line in enumerate(text.splitlines()) if (match := PAIR.match(line))]


def mutated(chance: random.Random) -> tuple[str, int, int, int]:
    """A case with one line changed; the line, and the columns of its key and of its value, all from 1."""
    text = chance.choice([*SHIPPED, starter(), BAG, BAG])
    number, match = chance.choice(places(text))
    lines, front, key, value = text.splitlines(), match["front"], match["key"], match["value"]
    number_in_it = re.match(r"[-+.0-9e]+", value)
    digits = number_in_it[0] if number_in_it and number_in_it[0] != "0" else "7"
    changes = [
        (front, f"-{digits}e40"),
        (front, f"{digits} furlong"),
        (front, f"{digits} s^7"),
        (front, digits.replace(".", ",") if "." in digits else f"{digits},5"),
        (front, "[]"),
        (front, "{}"),
        (front, "''"),
        (front, ".nan"),
        (front, "yes please"),
        (front, f"&a {value}"),
        (front, f"!!str {value}"),
        (front.replace(key, f"{key}x"), value),
        (front.replace(key, key.swapcase()), value),
        (front.replace(key, f"{key} {key}"), value),
    ]
    new_front, new_value = chance.choice(changes)
    lines[number] = new_front + new_value
    return "\n".join(lines) + "\n", number + 1, match.start("key") + 1, len(new_front) + 1


def some_mutated() -> Iterator[tuple[str, int, int, int]]:
    chance = random.Random(16)
    return (mutated(chance) for _ in range(COUNT))


def test_a_mutated_line_is_told_at_its_place() -> None:
    """By its key or by its value; a text may be anything."""
    faulty = 0
    for text, line, of_key, of_value in some_mutated():
        found = outcome(text)
        if isinstance(found, Case):
            assert re.match("title: |contact: \\[]$", text.splitlines()[line - 1]), text.splitlines()[line - 1]
            continue
        faulty += 1
        check_places(text, found)
        assert any((one, column) in ((line, of_key), (line, of_value)) for one, column, _ in found), (
            text.splitlines()[line - 1],
            found,
        )
    assert faulty > 0.9 * COUNT


@pytest.mark.parametrize("cut", range(16))
def test_a_file_cut_anywhere_is_a_case_or_a_list_of_faults(cut: int) -> None:
    chance = random.Random(cut)
    for text in (*SHIPPED, BAG):
        part = text[: chance.randrange(len(text))]
        found = outcome(part)
        if not isinstance(found, Case):
            check_places(part, found)


@pytest.mark.slow
def test_the_command_line_answers_a_sample_of_them(softbrake: Command, tmp_path: Path) -> None:
    texts = [*some_malformed()][::100] + [text for text, *_ in some_mutated()][::100]
    for number, text in enumerate(texts):
        path = tmp_path / f"{number}.yaml"
        path.write_bytes(text.encode("utf-8", "surrogatepass"))
        for command in ("check", "run"):
            done = softbrake(command, path.name)
            faults: list[str] = []
            try:
                load_case(path)
            except CaseError as error:
                faults = error.faults
            if faults:
                told = "\n".join(faults).replace(str(path), path.name)
                assert (done.returncode, done.stdout, done.stderr) == (2, "", told + "\n")
            assert "Traceback" not in done.stderr
    assert all(path.suffix == ".yaml" for path in tmp_path.iterdir())


@pytest.mark.parametrize(
    ("content", "place"),
    [
        (b"shell:\n  diameter: 0.5 m\n  heigh\n", "3:3"),  # told where the key stands, not behind it
        (b"title: 'never closed\nshell: {}\n", "1:8"),
        (b"shell: {diameter: 0.5 m\n", "1:8"),
        (b"---\n", "1:1"),
        (b"%YAML 1.1\n", "1:10"),
        (b"title: a\rcargo: \0\r", "2:8"),
        (b"\xef\xbb\xbftitle: \xc3\xb6\r\nshell: \xff\n", "2:8"),
        ("title: ö \xff".encode() + b"\xff", "1:11"),
    ],
)
def test_places_at_and_behind_the_end_of_a_line(content: bytes, place: str, tmp_path: Path) -> None:
    path = tmp_path / "f.yaml"
    path.write_bytes(content)
    with pytest.raises(CaseError) as caught:
        load_case(path)
    assert caught.value.faults[0].startswith(f"{path}:{place}: ")


def test_an_override_that_is_no_text_is_a_fault() -> None:
    """As a command line has it whose bytes are not UTF-8."""
    with pytest.raises(CaseError, match="title: a character that is none; a YAML value is expected"):
        parse_case(SHIPPED[0], "f.yaml", ["title=\udcff"])
