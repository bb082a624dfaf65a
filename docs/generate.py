"""A hook of MkDocs: makes the reference pages of keys, commands, answer, history and Python API from the code they describe.

`mkdocs build` calls `on_files`; nothing is written into docs/. Contents come from the table of keys, the command line
and the comments beside fields of `Summary` and members of `History`.
"""

from __future__ import annotations

import ast
import dataclasses
import inspect
import io
import tokenize
from collections.abc import Iterable
from typing import Any

import typer
from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files

import softbrake
from softbrake.case.case import MAPPINGS, key_at
from softbrake.case.keys import Key
from softbrake.case.plausible import RANGES
from softbrake.case.section import Section
from softbrake.case.sections import contact, pressure
from softbrake.case.sections.sweep import SWEEP
from softbrake.case.sections.top import TOP
from softbrake.case.units import CELSIUS, UNITS
from softbrake.cli.app import app
from softbrake.core import columns
from softbrake.sim import summary

ANSWER = ("Summary", "PeakValue", "FilteredPeaks", "Work", "ModelUsed", "Trial", "Ensemble")
ANSWER += ("Sensitivities", "Sensitivity", "Inflation")
API_NOTE = (
    "The package exports these names. Importing it loads no kernel; the first use of a name loads its module. "
    "The fields of `Summary` stand on the page [Answer and history](answer.md).\n"
)


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the generated pages to the site."""
    pages = {"keys": keys_page, "commands": commands_page, "answer": answer_page, "python": python_page}
    for name, page in pages.items():
        files.append(File.generated(config, f"reference/{name}.md", content=page()))
    return files


def table(header: Iterable[str], rows: Iterable[Iterable[object]]) -> str:
    """A table in Markdown."""
    head = list(header)
    lines = [head, ["---"] * len(head), *([escaped(str(cell)) for cell in row] for row in rows)]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines) + "\n"


def escaped(cell: str) -> str:
    """A cell with its bars escaped, but for those in code."""
    parts = cell.replace("\n", " ").split("`")
    return "`".join(part if k % 2 else part.replace("|", "\\|") for k, part in enumerate(parts))


def code(text: object) -> str:
    """Text as code, nothing for no text."""
    return f"`{text}`" if text not in (None, "") else ""


# Keys of the case file


def allowed(key: Key) -> str:
    """Unit and bounds of a key, or its words."""
    if isinstance(key.kind, tuple):
        return ", ".join(code(word) for word in key.kind)
    kind = {int: "integer", str: "text"}[key.kind] if isinstance(key.kind, type) else code(key.kind.unit) or "ratio"
    limits = [(">", key.above), ("≥", key.least), ("≤", key.most)]
    bounds = [f"{sign} {bound:g}" for sign, bound in limits if bound is not None]
    return ", ".join(["list of " * key.many + kind, *bounds, *(["or `auto`"] if key.auto else [])])


def default(key: Key) -> str:
    """What holds where the key is left out."""
    if key.required:
        return "required"
    if key.default is not None:
        return code(f"{key.default:.7g}" if isinstance(key.default, float) else key.default)
    return key.computed or "none"


def keys_table(some: Iterable[Key]) -> str:
    """A row for each key, and for those of a mapping that may stand instead of its value."""
    named = [(name, one) for key in some for name, one in ((key.name, key), *((f"{key.name}.{p.name}", p) for p in key.parts))]
    rows = [(code(name), key.purpose, allowed(key), default(key), code(key.example)) for name, key in named]
    return table(("key", "meaning", "unit or values", "default", "example"), rows)


def alternatives(section: Section) -> str:
    """In words, which keys of a section, or which sections, exclude one another."""
    said = []
    for many, wanted in (("Exactly one is required", section.alternatives), ("At most one is allowed", section.choices)):
        for groups in wanted:
            names = [" and ".join(code(name) for name in group) for group in groups]
            said.append(f"{many}: {', or '.join(names)}.")
    return "\n".join(said) + "\n" if said else ""


def keys_page() -> str:
    """Every section and key of a case file."""
    parts = [
        "# Keys of a case file\n",
        "A case file is YAML. A value is a number with a unit, such as `20 kN/m`; a bare number is in the SI unit of the table. "
        "Units: " + ", ".join(code(unit) for unit in UNITS) + ". They are joined by `*`, `/`, `^` or a space. "
        f"A temperature may be in `{CELSIUS}`.\n",
        "`softbrake init` writes a file with every key. `softbrake check CASE` lists all faults by line and column. "
        "`--set SECTION.KEY=VALUE` replaces one value.\n",
        "## Top level\n",
        alternatives(TOP),
        keys_table(TOP.keys),
        "## contact\n",
        "What stops the fabric: one of these words, one part, or a list of parts. The default is `full`.\n",
        table(("word", "parts"), [(code(word), ", ".join(map(code, parts))) for word, parts in contact.SETS.items()]),
        "Parts: " + ", ".join(code(part) for part in contact.PARTS) + ".\n",
    ]
    for section in MAPPINGS:
        name, optional = section.name, " This section may be left out." if section.optional else ""
        if name == "pressure":
            parts.append(f"## {name}\n\n{keys_table([pressure.LAW])}\nThe other keys depend on the law.\n")
            parts += [f"### law: {law}\n\n{keys_table(own)}" for law, own in pressure.LAWS.items()]
        elif name == "vents":
            parts.append(
                f"## vents\n\nA list of openings of the bag.{optional} A mapping of one key, such as "
                f"`{{pressure: 60 kPa}}`, stands instead of a word.\n\n{keys_table(section.each)}"
            )
        elif name == "belts":
            parts.append(f"## belts\n\nBelts at uniform spacing, or a list of belts.{optional} {alternatives(section)}")
            parts += ["### at uniform spacing\n", keys_table(section.keys), "### each belt of a list\n", keys_table(section.each)]
        else:
            said = f"{optional.strip()} {alternatives(section)}".strip()
            parts.append("\n\n".join(part for part in (f"## {name}", said, keys_table(section.keys)) if part))
    parts += [
        "## Usual ranges\n",
        "Values and figures beyond these are allowed; `check`, `run`, `sweep` and `design` say so on stderr. SI units.\n",
        table(("key or figure", "from", "to", "reason"), usual_ranges()),
        "## sweep\n",
        "`softbrake sweep` reads this section: `vary`, a mapping of keys to values, and\n",
        keys_table(SWEEP.keys),
    ]
    return "\n".join(parts)


def usual_ranges() -> Iterable[tuple[str, str, str, str]]:
    """A row for each range."""
    for name, usual in RANGES.items():
        yield code(name) if key_at(name) else name, f"{usual.low:g}", f"{usual.high:g}", usual.reason


# Commands


def commands_page() -> str:
    """Every command with its arguments and options."""
    parts = [
        "# Commands\n",
        "Exit codes: 0 done; 1 the computation failed, missed its tolerance, or has a doubtful answer; 2 bad input or usage; "
        "130 interrupted.\n",
        "`softbrake --version` prints the version, `softbrake COMMAND --help` the options of a command.\n",
    ]
    group: Any = typer.main.get_command(app)
    for name, command in group.commands.items():
        arguments = [option for option in command.params if not option.opts[0].startswith("-")]
        options = [option for option in command.params if option.opts[0].startswith("-")]
        usage = " ".join(["softbrake", name, *(f"[{a.metavar}]" if not a.required else str(a.metavar) for a in arguments)])
        parts.append(f"## {name}\n\n{command.help}\n\n    {usage}{' [OPTIONS]' if options else ''}\n")
        rows = [(code(a.metavar), a.help or "", shown(a.default)) for a in arguments]
        rows += [(code(" ".join([", ".join(o.opts), o.metavar or ""]).strip()), o.help or "", shown(o.default)) for o in options]
        if rows:
            parts.append(table(("argument or option", "meaning", "default"), rows))
    return "\n".join(parts)


def shown(value: object) -> str:
    """A default as the user would type it."""
    return "" if value is None or isinstance(value, bool) else code(value)


# Answer and history


def comments(kind: type) -> dict[str, tuple[str, str]]:
    """Type and comment of each field of a class, as its source has them."""
    source = inspect.getsource(kind)
    tokens = tokenize.generate_tokens(io.StringIO(source).readline)
    beside = {token.start[0]: token.string.lstrip("# ") for token in tokens if token.type == tokenize.COMMENT}
    found: dict[str, tuple[str, str]] = {}
    (declared,) = ast.parse(source).body
    assert isinstance(declared, ast.ClassDef)
    for line in declared.body:
        target = line.target if isinstance(line, ast.AnnAssign) else line.targets[0] if isinstance(line, ast.Assign) else None
        if isinstance(target, ast.Name):
            kind_of = ast.unparse(line.annotation) if isinstance(line, ast.AnnAssign) else ""
            found[target.id] = (kind_of, beside.get(line.end_lineno or 0, ""))
    return found


def fields(name: str) -> str:
    """A section for one dataclass of the answer."""
    kind = getattr(summary, name)
    told = {field.name: ", ".join(filter(None, field.metadata.values())) for field in dataclasses.fields(kind)}
    rows = [(code(field), code(type_), told[field] or comment) for field, (type_, comment) in comments(kind).items()]
    return f"### {name}\n\n{summed_up(kind)}\n\n{table(('field', 'type', 'unit and meaning'), rows)}"


def summed_up(kind: type) -> str:
    """Docstring of a class as its source has it, without the fields that one may list for help()."""
    (declared,) = ast.parse(inspect.getsource(kind)).body
    assert isinstance(declared, ast.ClassDef)
    return ast.get_docstring(declared) or ""


def answer_page() -> str:
    """Fields of the answer, columns of the history."""
    history = columns.History
    rows = []
    for column in history:
        rows.append((code(column.name.lower()), code(column.unit), column.meaning))
    return "\n".join(
        [
            "# Answer and history\n",
            "## Columns of the history\n",
            f"{inspect.getdoc(history)} The result file holds them as `/history`.\n",
            table(("column", "unit", "meaning"), rows),
            "## Fields of the answer\n",
            "`softbrake run CASE --json` prints them, `softbrake.run` returns them, the result file keeps them as `summary`.\n",
            *(fields(name) for name in ANSWER),
        ]
    )


# Python


def python_page() -> str:
    """What the package exports, for mkdocstrings to fill in."""
    names = [name for name in softbrake.__all__ if not name.startswith("__")]
    names.sort(key=lambda name: (name[0].isupper(), name))  # functions before classes
    return "\n".join(
        [
            "# Python\n",
            API_NOTE,
            "```python\nimport softbrake\n",
            'case = softbrake.load_case("configs/paper.yaml", ["fabric.E=18.75kN/m"])',
            "summary = softbrake.run(case)\nprint(summary.impact_velocity, summary.peak_tension_hoop)\n```\n",
            *(f"::: softbrake.{name}\n" for name in names),
        ]
    )


if __name__ == "__main__":  # to look at the pages without the site
    for make in (keys_page, commands_page, answer_page, python_page):
        print(make())
