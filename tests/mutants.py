"""Do the quick tests see a wrong line? Mutants of the kernels, each in a copy of the project with a kernel cache of its own.

`python tests/mutants.py` applies one after the other and runs the tests that should fail; `python tests/mutants.py NAME ...` only
those named. Not collected by pytest, for each mutant compiles its kernels anew. Ends with 1 where one survives, with 2 where one
cannot be applied or its tests do not run.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from time import perf_counter
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[1]
WANTED = ("softbrake", "tests", "benchmarks", "configs", "pyproject.toml")
FAILED, PASSED = 1, 0  # pytest's exit codes


class Mutant(NamedTuple):
    """A change of one line, by a fragment that stands in the file exactly once."""

    name: str
    file: str  # in softbrake/
    old: str
    new: str
    tests: tuple[str, ...]  # in tests/


KERNELS, FIDELITY, FOLDS, GAS = "test_kernels.py", "test_fidelity.py", "test_self_contact.py", "test_gas.py"
MUTANTS = (
    Mutant(
        "pressed zones stay where they are pressed",
        "core/contact/impact_zones.py",
        "cover, rising = pressed or held == sheet.rows,",
        "cover, rising = held == sheet.rows,",
        (f"{FOLDS}::test_zone_moves_as_what_bears_it",),
    ),
    Mutant(
        "friction of the meridian on the ground halved",
        "core/loop/meridian.py",
        "obstacles.friction * meridian.ground_impulse[i]",
        "0.5 * obstacles.friction * meridian.ground_impulse[i]",
        (f"{FIDELITY}::test_friction_on_the_meridian_is_coulomb_s",),
    ),
    Mutant(
        "friction of the meridian on the cover halved",
        "core/loop/meridian.py",
        "obstacles.friction * abs(jump_w)",
        "0.5 * obstacles.friction * abs(jump_w)",
        (f"{FIDELITY}::test_friction_on_the_meridian_is_coulomb_s",),
    ),
    Mutant(
        "lying area doubled",
        "core/contact/obstacles.py",
        "return area * min(force",
        "return 2.0 * area * min(force",
        (f"{KERNELS}::test_lying_area_is_the_load_that_the_ground_bears",),
    ),
    Mutant(
        "damping by the gas left out of the bound",
        "core/pressure.py",
        "2.0 * model.pressure.damping * push",
        "0.0 * model.pressure.damping * push",
        ("test_stability_map.py::test_bound_with_damping_by_the_gas_is_safe",),
    ),
    Mutant(
        "sign of c12 in the tension field",
        "core/membrane/tension.py",
        "    c12 = fabric.c12\n",
        "    c12 = -fabric.c12\n",
        (f"{KERNELS}::test_tension_field",),
    ),
    Mutant(
        "work of shear doubled",
        "core/loop/ledger.py",
        "elastic[j] += dt * cells.shear[cell + j] * power",
        "elastic[j] += 2.0 * dt * cells.shear[cell + j] * power",
        (f"{KERNELS}::test_shear_work_is_that_of_the_shear_forces",),
    ),
    Mutant(
        "time constant of the low-pass doubled",
        "core/loop/time_loop.py",
        "FILTER_TIME = 1.6e-4",
        "FILTER_TIME = 3.2e-4",
        ("test_filters.py::test_low_pass_of_the_peak_deceleration_is_one_of_1_khz",),
    ),
    Mutant(
        "viscosity of the belts dropped",
        "core/membrane/belts.py",
        "across), viscosity * hoop.rate[c], 0.0)",
        "across), 0.0, 0.0)",
        (f"{KERNELS}::test_belt_tensions_and_forces",),
    ),
    Mutant(
        "weights of rows without the mass of the row below",
        "sim/build.py",
        "weight[:-2] / weight[1:-1] * per_mass[:-2]",
        "weight[:-2] / weight[1:-1] * per_mass[1:-1]",
        (f"{KERNELS}::test_weights_of_rows_bound_a_chain_from_above",),
    ),
    Mutant(
        "discriminant of the impact",
        "core/loop/time_loop.py",
        "velocity * velocity - 2.0 * acceleration * height",
        "velocity * velocity - acceleration * height",
        (f"{KERNELS}::test_impact_in_a_step",),
    ),
    Mutant(
        "way of late contact booked once",
        "core/loop/contact_work.py",
        "workspace, 0.0, 0.5 * take_shift",
        "workspace, 0.0, 0.0 * take_shift",
        (f"{FOLDS}::test_works_over_the_way_of_late_contact",),
    ),
    Mutant(
        "work of contact by the velocity after the jump",
        "core/contact/records.py",
        "gain = mass * (u * (nodes.u[a] + 0.5 * u)",
        "gain = mass * (u * (nodes.u[a] + 1.0 * u)",
        (f"{FOLDS}::test_layers_that_do_not_match_never_pass",),
    ),
    Mutant(
        "gaps between the triangles of a face",
        "core/contact/constants.py",
        "RIM = 1e-8",
        "RIM = 0.0",
        (f"{FOLDS}::test_no_way_leads_between_the_triangles_of_a_face",),
    ),
    Mutant(
        "work of the gas by the pressure before",
        "core/gas.py",
        "work = before * old * log(new / old) if isothermal else (before * old - after * new) / excess",
        "work = before * (new - old)",
        (f"{GAS}::test_closed_gas_keeps_its_polytrope",),
    ),
    Mutant(
        "enthalpy of what leaves with cv",
        "core/gas.py",
        "(gas.gamma - 1.0) + limp\n",
        "gas.gamma / (gas.gamma - 1.0) + limp\n",
        (f"{GAS}::test_gas_that_stays_keeps_its_entropy",),
    ),
    Mutant(
        "outflow of Euler",
        "core/gas.py",
        "half = mass - 0.5 * length * outflow",
        "half = mass - 0.0 * length * outflow",
        (f"{GAS}::test_order_of_convergence",),
    ),
    Mutant(
        "a burst at the end of the step",
        "core/gas.py",
        "vents[k, VentState.OPEN], vents[k, VentState.SHARE] = 1.0, 1.0 - at",
        "vents[k, VentState.OPEN], vents[k, VentState.SHARE] = 1.0, 0.0",
        (f"{GAS}::test_order_of_convergence",),
    ),
    Mutant(
        "gas drawn in fills all of a limp shell",
        "core/gas.py",
        "    if limp < taken:\n",
        "    if True:\n",
        (f"{GAS}::test_course_of_the_twin",),
    ),
    Mutant(
        "a relief valve that opens once",
        "core/gas.py",
        "vents[k, VentState.SHUT] = 0.0 if again else 1.0",
        "vents[k, VentState.SHUT] = 1.0",
        (f"{GAS}::test_relief_valve_opens_again_and_again",),
    ),
    Mutant(
        "choking left out",
        "core/gas.py",
        "    if ratio < gas.choking:\n",
        "    if ratio < 0.0:\n",
        (f"{GAS}::test_choking",),
    ),
    Mutant(
        "a step that goes past what the last of the gas does",
        "core/gas.py",
        "    return PART_OF_VOLUME * last_step * left / fallen\n",
        "    return inf\n",
        (f"{GAS}::test_leaking_bag_pressed_flat",),
    ),
    Mutant(
        "a wall that leaks where it lies",
        "core/contact/obstacles.py",
        "        if not (on_ground(obstacles, z) or on_cover_or_cargo(obstacles, step, x, y, z)):\n",
        "        if True:\n",
        ("test_gas_shell.py::test_wall_leaks_where_it_lies_on_nothing",),
    ),
    Mutant(
        "half cells at the covers that do not leak",
        "core/loop/meridian.py",
        "        halves = 0.5 * (meridian.free[0]",
        "        halves = 0.0 * (meridian.free[0]",
        ("test_gas_shell.py::test_wall_leaks_where_it_lies_on_nothing",),
    ),
)


def mutated(mutant: Mutant) -> str:
    """The file's text with the mutant in it. Raises ValueError where its fragment is not there exactly once."""
    text = (ROOT / "softbrake" / mutant.file).read_text(encoding="utf-8")
    if (count := text.count(mutant.old)) != 1:
        raise ValueError(f"{mutant.file}: {mutant.old!r} is there {count} times; a fragment of one place is expected")
    return text.replace(mutant.old, mutant.new)


def run(mutant: Mutant) -> tuple[int, str]:
    """Exit code and output of its tests on a copy of the project."""
    text = mutated(mutant)
    with tempfile.TemporaryDirectory(prefix="mutant-") as name:
        folder = Path(name)
        for part in WANTED:
            source = ROOT / part
            copy = shutil.copytree if source.is_dir() else shutil.copy2
            copy(source, folder / part)
        (folder / "softbrake" / mutant.file).write_text(text, encoding="utf-8")
        environment = os.environ | {"PYTHONPATH": name, "NUMBA_CACHE_DIR": str(folder / "cache")}
        tests = [str(folder / "tests" / test) for test in mutant.tests]
        words = [sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:cacheprovider", "-m", "not slow", *tests]
        done = subprocess.run(words, cwd=folder, env=environment, capture_output=True, text=True)
        return done.returncode, done.stdout + done.stderr


def outcomes(mutants: list[Mutant]) -> Iterator[int]:
    for mutant in mutants:
        started = perf_counter()
        try:
            code, output = run(mutant)
        except ValueError as error:
            print(f"NOT APPLIED  {mutant.name}: {error}", flush=True)
            yield 2
            continue
        seconds = f"{perf_counter() - started:.0f} s"
        if code == FAILED:
            killer = re.search(r"^FAILED \S*?(test_\w+\.py::\S+)", output, re.MULTILINE)
            print(f"died      {mutant.name}, by {killer[1] if killer else '?'}, {seconds}", flush=True)
            yield 0
        elif code == PASSED:
            print(f"SURVIVED  {mutant.name}, {seconds}", flush=True)
            yield 1
        else:
            print(f"NOT RUN   {mutant.name}\n{output}", flush=True)
            yield 2


def main(names: list[str]) -> int:
    unknown = set(names) - {mutant.name for mutant in MUTANTS}
    if unknown:
        print(f"no mutant {', '.join(sorted(unknown))}; there are:", *(mutant.name for mutant in MUTANTS), sep="\n  ")
        return 2
    return max(outcomes([mutant for mutant in MUTANTS if not names or mutant.name in names]))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
