"""The list of mutants fits the code: each fragment is there once, each test exists."""

import pytest
from conftest import ROOT
from mutants import MUTANTS, Mutant, mutated


@pytest.mark.parametrize("mutant", MUTANTS, ids=lambda mutant: mutant.name)
def test_mutant_can_be_applied(mutant: Mutant) -> None:
    assert mutated(mutant) != (ROOT / "softbrake" / mutant.file).read_text(encoding="utf-8")
    for test in mutant.tests:
        file, name = test.split("::")
        assert f"def {name}(" in (ROOT / "tests" / file).read_text(encoding="utf-8"), test


def test_names_are_unique() -> None:
    assert len({mutant.name for mutant in MUTANTS}) == len(MUTANTS)


def test_fragment_that_is_not_there_once_is_refused() -> None:
    for old in ("no such line", "def "):
        with pytest.raises(ValueError, match="a fragment of one place is expected"):
            mutated(Mutant("", "core/cargo.py", old, "", ()))
