"""The documents say what is there: the equations against the code and its tests, commands against the command line."""

import ast
import math
import re
import shlex
import subprocess
import sys
from functools import cache
from pathlib import Path
from typing import NamedTuple

import pytest
from conftest import Command

from softbrake.case.case_file import parse_case
from softbrake.cli.app import app
from softbrake.sim.simulation import simulate

ROOT = Path(__file__).resolve().parents[1]
DOCUMENTS = sorted([*ROOT.glob("*.md"), *ROOT.glob("docs/**/*.md")])
EQUATIONS = ROOT / "docs" / "explanation" / "equations.md"
NUMBERS = [f"({chapter}.{k})" for chapter, count in ((2, 11), (3, 4)) for k in range(1, count + 1)]
KERNELS = sorted(path.relative_to(ROOT).as_posix() for path in (ROOT / "softbrake" / "core").rglob("*.py"))
NOWHERE = "–"  # opens the cell of an equation without a home or a test


class Row(NamedTuple):
    """An equation: cells of the table as they are written."""

    number: str
    meaning: str
    symbols: str
    home: str
    test: str


def equations() -> list[Row]:
    """The rows of the table of equations."""
    text = EQUATIONS.read_text(encoding="utf-8")
    table = text.split("| number | meaning |", 1)[1].split("\n\n", 1)[0].splitlines()[2:]
    return [Row(*(cell.strip() for cell in line.strip().strip("|").split("|"))) for line in table]


def functions_named(cell: str) -> list[tuple[str, str]]:
    """(file, function) for each name in backquotes of a cell; a name belongs to the file in backquotes before it."""
    found, path = [], ""
    for word in re.findall(r"`([^`]+)`", cell):
        if word.endswith(".py"):
            path = word
        else:
            found.append((path, word))
    return found


@cache
def tree(path: str) -> ast.Module:
    """A parsed source file of the project; fails the test where there is none."""
    assert (ROOT / path).is_file(), f"{EQUATIONS.name}: no file {path!r}"
    return ast.parse((ROOT / path).read_text(encoding="utf-8"))


def functions(path: str) -> dict[str, str]:
    """Functions and methods of a file with their docstrings."""
    nodes = [node for node in ast.walk(tree(path)) if isinstance(node, ast.FunctionDef)]
    return {node.name: ast.get_docstring(node) or "" for node in nodes}


def fields() -> set[str]:
    """Class.field of all that arrays, columns and case declare."""
    found = set()
    sections = sorted(path.relative_to(ROOT).as_posix() for path in ROOT.glob("softbrake/case/sections/*.py"))
    for path in ("softbrake/core/arrays.py", "softbrake/core/columns.py", "softbrake/case/case.py", *sections):
        for kind in (node for node in ast.walk(tree(path)) if isinstance(node, ast.ClassDef)):
            for line in kind.body:
                targets = [line.target] if isinstance(line, ast.AnnAssign) else getattr(line, "targets", [])
                found |= {f"{kind.name}.{target.id}" for target in targets if isinstance(target, ast.Name)}
    return found


def cited(docstring: str) -> list[str]:
    """Numbers after "Eq." and "Eqs."."""
    lists = re.findall(r"Eqs?\.\s((?:\(\d\.\d+\)(?:,?\s(?:and\s)?)?)+)", docstring)
    return [number for some in lists for number in re.findall(r"\(\d\.\d+\)", some)]


def test_every_equation_has_one_row() -> None:
    numbered = [row.number for row in equations() if row.number.startswith("(")]
    assert sorted(numbered) == sorted(NUMBERS)


@pytest.mark.parametrize("row", equations(), ids=lambda row: row.number)
def test_row_names_what_exists(row: Row) -> None:
    homes = functions_named(row.home)
    for path, name in homes:
        assert path.startswith("softbrake/"), f"{name!r} stands in no file of the package"
        assert name in functions(path), f"no function {name!r} in {path}"
        if path in KERNELS and row.number in NUMBERS:
            assert row.number in functions(path)[name], f"the docstring of {name} in {path} does not name {row.number}"
    proofs = functions_named(row.test)
    for path, name in proofs:
        assert path.startswith("tests/") and name.startswith("test_"), f"{name!r} in {path!r} is no test"
        assert name in functions(path), f"no test {name!r} in {path}"
    known = fields() | {name for _, name in homes}
    assert not [name for _, name in functions_named(row.symbols) if name not in known]
    if homes:
        assert proofs, "code without a test"
    else:
        assert row.home.startswith(f"{NOWHERE} "), "an equation has a home, or a reason to have none"


def test_tests_in_the_text_exist() -> None:
    text = EQUATIONS.read_text(encoding="utf-8")
    there = {name for path in ROOT.glob("tests/test_*.py") for name in functions(path.relative_to(ROOT).as_posix())}
    named = set(re.findall(r"`(test_\w+)`", text))
    assert named
    assert not named - there


@pytest.mark.parametrize("path", KERNELS)
def test_equations_that_a_kernel_cites_have_it_as_home(path: str) -> None:
    here = {row.number for row in equations() if f"`{path}`" in row.home}
    for docstring in [ast.get_docstring(tree(path)) or "", *functions(path).values()]:
        assert set(cited(docstring)) <= here, docstring


def test_citations_are_found() -> None:
    assert cited("Tensions, Eqs. (2.9), (2.3), and forces, Eqs. (2.2) and\n(2.8). Unlike (3.2). Eq. (2.10).") == [
        "(2.9)",
        "(2.3)",
        "(2.2)",
        "(2.8)",
        "(2.10)",
    ]
    assert {number for path in KERNELS for text in functions(path).values() for number in cited(text)}


def commands(document: Path) -> list[str]:
    """Commands of softbrake in the code blocks of a document, and their paths relative to the project."""
    blocks = re.findall(r"^ *```[^\n]*\n(.*?)^ *```", document.read_text(encoding="utf-8"), re.DOTALL | re.MULTILINE)
    lines = [line.split("#")[0].strip() for block in blocks for line in re.split(r"\n|&&|;", block)]
    return [line for line in lines if re.match(r"[^'\"(]*\bsoftbrake [a-z-]", line) and not line.startswith("from ")]


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_commands_exist(document: Path) -> None:
    known = {command.name or command.callback.__name__ for command in app.registered_commands if command.callback}
    for line in commands(document):
        name = re.split(r"\bsoftbrake ", line, maxsplit=1)[1].split()[0]
        assert name in known or name in ("--help", "--version"), f"no command {name!r}: {line}"
        for path in re.findall(r"\bconfigs/\S+\.yaml", line):
            assert (ROOT / path).is_file(), f"no file {path}: {line}"


TUTORIAL = ROOT / "docs" / "tutorial" / "index.md"
VENTED = TUTORIAL.with_name("vented.md")
CHANGING = re.compile(
    r"^(lumped|full|axisymmetric) |^level|^ {40}|^standard error|^scatter"
)  # hold seconds, or depend on round-off


def quoted(*tutorials: Path) -> dict[str, list[str]]:
    """Commands of tutorials with the lines they quote of their answers, spaces made single."""
    text = "".join(tutorial.read_text(encoding="utf-8") for tutorial in tutorials)
    blocks = re.findall(r"^```\n(\$ .*?)^```", text, re.DOTALL | re.MULTILINE)
    answers: dict[str, list[str]] = {}
    for line in "".join(blocks).splitlines():
        if line.startswith("$ softbrake "):
            lines = answers.setdefault(line.removeprefix("$ softbrake "), [])
        elif line not in ("...", "") and not CHANGING.search(line):
            lines.append(" ".join(line.split()))
    return answers


@pytest.mark.slow
@pytest.mark.parametrize("arguments", [command for command, lines in quoted(TUTORIAL, VENTED).items() if lines])
def test_tutorial_quotes_what_the_commands_print(arguments: str, softbrake: Command, tmp_path: Path) -> None:
    for name in ("airdrop.yaml", "airdrop-vented.yaml"):
        (tmp_path / name).write_bytes((ROOT / "configs" / name).read_bytes())
    done = softbrake(*shlex.split(arguments), "-q")
    assert done.returncode == 0, done.stderr
    printed = [" ".join(line.split()) for line in done.stdout.splitlines()]
    missing = [line for line in quoted(TUTORIAL, VENTED)[arguments] if not any(alike(line, other) for other in printed)]
    assert not missing


@pytest.mark.slow
def test_tutorial_of_a_drop_test_quotes_what_the_commands_print(softbrake: Command, tmp_path: Path) -> None:
    """One after the other; numbers to a hundredth, as a fit of noise ends a little elsewhere on another processor."""
    (tmp_path / "airdrop-vented.yaml").write_bytes((ROOT / "configs" / "airdrop-vented.yaml").read_bytes())
    subprocess.run([sys.executable, ROOT / "examples" / "drop_test.py", tmp_path], check=True)
    for arguments, lines in quoted(VENTED.with_name("test.md")).items():
        done = softbrake(*shlex.split(arguments))
        assert done.returncode == 0, done.stderr
        printed = [" ".join(line.split()) for line in done.stdout.splitlines()]
        assert not [line for line in lines if not any(alike(line, other, 0.01) for other in printed)], printed


def alike(line: str, other: str, within: float = 1e-6) -> bool:
    """Whether two lines have the same words, and numbers that differ by round-off at most, as from one processor to another."""
    words, others = line.split(), other.split()
    return len(words) == len(others) and all(one == two or near(one, two, within) for one, two in zip(words, others, strict=True))


def near(word: str, other: str, within: float) -> bool:
    try:
        return math.isclose(
            float(word.strip("()")), float(other.strip("()")), rel_tol=within, abs_tol=within if within > 1e-3 else 0
        )
    except ValueError:
        return False


BAG = """\
shell: {diameter: 0.5 m, height: 0.6 m}
fabric: {E: 20 kN/m, areal_density: 0.05 kg/m^2, viscosity: 0.2 N*s/m}
cargo: {mass: 100 kg, velocity: 6 m/s}
model: {fidelity: lumped}
"""
PIECES = [
    (document, piece)
    for document in (ROOT / "docs" / "how-to" / "gas.md", ROOT / "README.md")
    for piece in re.findall(r"^```yaml\n(gas:.*?)^```", document.read_text(encoding="utf-8"), re.DOTALL | re.MULTILINE)
]


@pytest.mark.parametrize(
    ("document", "piece"), PIECES, ids=lambda part: part.name if isinstance(part, Path) else part.split("\n")[1]
)
def test_pieces_of_a_gas_are_cases_that_run(document: Path, piece: str) -> None:
    """With the rest of a case, by the piston; its gas lets out what it is said to."""
    case = parse_case(BAG + piece, document.name)
    answer = simulate(case)
    assert case.gas is not None and answer.peak_pressure is not None
    assert answer.outcome in ("impact", "rebound") or answer.rest_time is not None
    assert answer.peak_pressure > case.gas.pressure
    assert (answer.vented_mass == 0.0) == ("vents" not in piece and "leakage" not in piece and "permeability" not in piece)
    assert None not in (answer.vent_opening_times or ())
    assert abs(answer.energy_error) < 1e-10


def test_tables_are_included_and_say_how_they_are_made() -> None:
    tables = sorted((ROOT / "docs" / "validation" / "tables").glob("*.md"))
    texts = [document.read_text(encoding="utf-8") for document in DOCUMENTS]
    included = {name for text in texts for name in re.findall(r'^--8<-- "(\S+)"$', text, re.MULTILINE)}
    assert included == {table.name for table in tables}
    for table in tables:
        assert re.match(r"Made by|Asserted by|Measured|Read from", table.read_text(encoding="utf-8").splitlines()[-1]), table.name


def test_tutorial_shows_the_shipped_case() -> None:
    for tutorial, name in ((TUTORIAL, "airdrop.yaml"), (VENTED, "airdrop-vented.yaml")):
        text, case = tutorial.read_text(encoding="utf-8"), (ROOT / "configs" / name).read_text(encoding="utf-8")
        block = text.split("```yaml\n")[1].split("```")[0]
        assert block in case
