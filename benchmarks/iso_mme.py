"""Tests of ISO-MME read and written by pyisomme 1.1.0, which cannot be installed beside softbrake: it pins numpy 1.26.

`python -m benchmarks.iso_mme [PYTHON]` makes an environment for it, or takes that of an interpreter that has it. Exits with 1
where values differ, times by 1e-15 s, or the test in tests/iso_mme from what it writes.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
import venv
from pathlib import Path

import numpy as np

from softbrake.report.test_files import CODES
from softbrake.signals import Channel, iso_mme, read_channels

FIXTURE = Path(__file__).parents[1] / "tests" / "iso_mme"
READ = """
import json, sys
from pyisomme import Isomme
test = Isomme().read(sys.argv[1])
rows = [(str(c.code), c.get_info("Name of the channel"), c.data.index.tolist(), c.get_data().tolist()) for c in test.channels]
print(json.dumps(rows))
"""
WRITE = """
import sys
import numpy as np, pandas as pd
from pyisomme import Channel, Isomme
times = np.arange(6) * 1e-4 - 1e-4
def channel(code, unit, values, name, **info):
    info = {"Name of the channel": name, "Reference channel": "implicit", **info}
    return Channel(code, pd.DataFrame(values, index=times), unit=unit, info=list(info.items()))
explicit = {"Reference channel": "explicit", "Reference channel name": "T0TIRS000000TI00"}
channels = [
    channel("T0PLAF000000AC3A", "m/s^2", np.array([0.0, 1.5, -2.25, 3, 4, 5]), "acc z"),
    channel("T0AIRB000000PR0C", "kPa", np.array([0.5, 1.5, 2.5, 3, 4, 5]), "p"),
    channel("T0TIRS000000TI00", "ms", np.array([0.0, 0.1, 0.3, 0.4, 0.5, 0.7]), "clock"),
    channel("T0PLAF000000VE30", "km/h", np.array([-21.6, -18, -14.4, -10.8, -7.2, -3.6]), "v", **explicit),
]
Isomme(test_number="drop7", test_info=[("Title", "made by pyisomme 1.1.0")], channels=channels).write(sys.argv[1] + "/drop7.mme")
"""


def texts_of(folder: Path) -> dict[str, str]:
    """Texts of all files of a folder by their names in it."""
    return {each.relative_to(folder).as_posix(): each.read_text() for each in folder.rglob("*") if each.is_file()}


def main(folder: Path, python: str | None) -> bool:
    """Print what was compared; whether all is as said."""
    if python is None:
        venv.create(folder / "venv", with_pip=True)
        python = str(folder / "venv" / ("Scripts" if sys.platform == "win32" else "bin") / "python")
        subprocess.run([python, "-m", "pip", "install", "--quiet", "pyisomme==1.1.0"], check=True)

    random = np.random.default_rng(20)
    times = 5e-5 + 1e-4 * np.arange(1000)
    sizes = 10.0 ** random.integers(-9, 9, len(CODES))
    made = [
        Channel(column.name.lower(), times, random.normal(size=len(times)) * size, column.unit, code)
        for (column, code), size in zip(CODES.items(), sizes, strict=True)
    ]
    (folder / "ours" / "Channel").mkdir(parents=True)
    for name, text in iso_mme.files("drop", "made", made, 1e-4).items():
        (folder / "ours" / name).write_text(text, encoding="utf-8")
    told = subprocess.run([python, "-c", READ, str(folder / "ours")], check=True, capture_output=True, text=True).stdout
    read = json.loads(told.splitlines()[-1])
    named = [(code, name) for code, name, _, _ in read] == [(each.code, each.name) for each in made]
    values = [np.array_equal(each.values, row[3]) for each, row in zip(made, read, strict=True)]
    apart = max(float(np.abs(each.time - row[2]).max()) for each, row in zip(made, read, strict=True))
    print(f"it reads ours: {sum(values)} of {len(made)} channels to the last digit, times within {apart:.1g} s,")
    print(f"               names and codes {'equal' if named else 'differ'}")
    good = named and all(values) and apart < 1e-15

    (folder / "theirs").mkdir()
    subprocess.run([python, "-c", WRITE, str(folder / "theirs")], check=True, capture_output=True)
    stored, written = texts_of(FIXTURE), texts_of(folder / "theirs")
    print(f"it writes:     {len(written)} files, {'those' if written == stored else 'not those'} of tests/iso_mme")
    acceleration = read_channels(folder / "theirs")[0]
    exact = np.array_equal(acceleration.values, [0.0, 1.5, -2.25, 3.0, 4.0, 5.0])
    print(f"we read it:    {'to the last digit' if exact else 'with differences'}; tests/test_signals.py asserts the rest")
    return bool(good and exact and written == stored)


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as scratch:
        sys.exit(not main(Path(scratch), *(sys.argv[1:2] or [None])))
