"""How kernels are compiled: inlined by Numba's inside where that is known, else plainly, with the same digits."""

import subprocess
import sys
from pathlib import Path

import pytest

from softbrake.core import inlining
from softbrake.core.jit import kernel

CONFIGS = Path(__file__).resolve().parents[1] / "configs"
SMALL = ("grid={generatrix: 12, hoop: 24}", "time.end=20 ms", "contact=solid")


def test_driver_without_one_of_its_kernels_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    """At the link, by name: it would call address 0."""

    @kernel
    def innermost(x):  # type: ignore[no-untyped-def]
        return x + 1.0

    @kernel
    def inner(x):  # type: ignore[no-untyped-def]
        return innermost(x) * 2.0

    @kernel
    def outer(x):  # type: ignore[no-untyped-def]
        return inner(x)

    monkeypatch.setattr(inlining.Part, "add_linking_library", lambda self, library: None)
    with pytest.raises(inlining.Unlinked, match=r"was linked without .*innermost"):
        outer(1.0)


def run(code: str, environment: dict[str, str], **more: str) -> str:
    done = subprocess.run([sys.executable, "-c", code], env=environment | more, capture_output=True, text=True, timeout=600)
    assert done.returncode == 0, done.stderr
    return done.stdout + done.stderr


def test_other_release_of_numba_is_taken_plainly_and_named(environment: dict[str, str]) -> None:
    code = """
import numba
numba.__version__ = "0.99.0"
from softbrake.core import jit
assert jit.INLINING is None and str(jit.CACHE_FOLDER).endswith("-plain")
"""
    assert "Numba 0.99.0 was not tested: kernels are compiled plainly" in run(code, environment)


def test_changed_inside_of_numba_is_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    assert inlining.is_known("0.68.1")
    assert not inlining.is_known("0.69.0")
    monkeypatch.setattr(inlining, "JITCodeLibrary", type("Renamed", (), {}))
    assert not inlining.is_known("0.68.1")


@pytest.mark.parametrize("fidelity", ["axisymmetric", "full"])
def test_plain_kernels_give_the_same_digits(fidelity: str, environment: dict[str, str]) -> None:
    code = f"""
import softbrake
from softbrake.sim.simulation import Simulation
case = softbrake.load_case({str(CONFIGS / "paper-contact.yaml")!r}, {[*SMALL, f"model.fidelity={fidelity}"]!r})
one = Simulation(case)
one.advance(0.02)
print(one.state.now.tobytes().hex(), one.state.nodes.x.tobytes().hex())
"""
    plain, inlined = run(code, environment, SOFTBRAKE_SIMPLE_JIT="1"), run(code, environment)
    assert len(plain) > 500
    assert plain == inlined
