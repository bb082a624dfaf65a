"""What a case file may contain, as JSON Schema for editors and as a starter case for people."""

from __future__ import annotations

from typing import Any

from softbrake.case.case import MAPPINGS
from softbrake.case.keys import mapping_schema
from softbrake.case.sections.contact import CONTACT
from softbrake.case.sections.sweep import SWEEP
from softbrake.case.sections.top import TOP
from softbrake.case.units import Dimension, pattern


def schema() -> dict[str, Any]:
    """JSON Schema (draft 2020-12) of a case file."""
    top = mapping_schema(TOP.keys, TOP.alternatives, TOP.choices)
    alone = {name for groups in TOP.alternatives for group in groups for name in group}
    keys = [key for section in (TOP, *MAPPINGS) for one in (*section.keys, *section.each) for key in (one, *one.parts)]
    signed = {key.kind for key in keys if key.signed}
    patterns = {one.name.lower(): pattern(one) for one in Dimension}
    patterns |= {f"signed_{one.name.lower()}": pattern(one, signed=True) for one in Dimension if one in signed}
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "softbrake case file",
        "type": "object",
        "properties": top["properties"] | {section.name: section.schema() for section in (*MAPPINGS, CONTACT, SWEEP)},
        "required": [section.name for section in MAPPINGS if not section.optional and section.name not in alone],
        "additionalProperties": False,
        "allOf": top["allOf"],
        "$defs": {name: {"type": "string", "pattern": text} for name, text in patterns.items()},
    }


def starter() -> str:
    """Text of a case file to begin with, one comment a key: meaning, SI unit, default."""
    lines = [
        "# yaml-language-server: $schema=case.schema.json",
        "# The schema for your editor: softbrake schema > case.schema.json. A bare number is in the unit in brackets.",
    ]
    for section in (TOP, CONTACT, *MAPPINGS):
        lines += section.starter()
    return "\n".join(lines) + "\n"
