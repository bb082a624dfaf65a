"""A drop test that nobody made: the vented airdrop with other values than the case has, as a data logger would write it.

    python examples/drop_test.py FOLDER

writes FOLDER/drop-test.csv: an accelerometer on the cargo that at rest reads 1 g, and the gauge pressure in the bag, at 10 kHz,
from 50 ms before first contact on. docs/tutorial/test.md uses it.
"""

import sys
from pathlib import Path

import numpy as np

from softbrake import load_case
from softbrake.core.columns import History
from softbrake.studies.batch import run_one

CASE = Path(__file__).resolve().parents[1] / "configs" / "airdrop-vented.yaml"
HIDDEN = ["cargo.velocity=8.2m/s", "vents.0.discharge=0.66", "vents.0.opens.pressure=17kPa"]
BEFORE, RATE, G = 0.05, 10_000, 9.80665  # s, Hz, m/s^2


def main(folder: Path) -> None:
    drop = run_one(load_case(CASE, HIDDEN), histories=True)
    assert drop.history is not None
    time, acceleration, pressure = drop.history[:, [History.TIME, History.ACCELERATION, History.PRESSURE]].T
    at = np.arange(round((BEFORE + time[-1]) * RATE)) / RATE - BEFORE
    chance = np.random.default_rng(20)
    falling = at < 0.0
    reads = np.where(falling, 0.0, np.interp(at, time, acceleration) + G) / G + chance.normal(0.0, 0.8, len(at))
    gauge = np.where(falling, pressure[0], np.interp(at, time, pressure)) / 1e3 + chance.normal(0.0, 2.0, len(at))
    rows = np.column_stack(((at + BEFORE) * 1e3, reads, gauge))
    file = folder / "drop-test.csv"
    np.savetxt(file, rows, "%.4f", ",", header="time [ms],acc z [g],bag [kPa]", comments="")
    print(f"{file.name}: {len(at)} samples at {RATE} Hz")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "."))
