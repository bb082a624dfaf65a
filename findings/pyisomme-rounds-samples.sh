#!/usr/bin/env bash
# pyisomme writes samples as pandas prints them, with six decimals: a distance in metres to 1 um, whose second slope is lost.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
"${PYTHON:-python3}" -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check pyisomme==1.1.0
cat > "$folder/seen.py" <<'END'
import sys
from importlib.metadata import version

import numpy as np
import pandas as pd
from pyisomme import Channel, Isomme

time = 1e-4 * np.arange(1001)
height = 0.6 - 6.0 * time + 10.0 * time**2  # m, of a uniform deceleration of 20 m/s^2
info = [("Reference channel", "implicit")]
channel = Channel("T0PLAF000000DS30", pd.DataFrame(height, index=time), unit="m", info=info)
Isomme(test_number="drop", channels=[channel]).write(f"{sys.argv[1]}/test")
read = Isomme().read(f"{sys.argv[1]}/test").channels[0]
before, after = (each.differentiate().differentiate().get_data()[2:-2] for each in (channel, read))
print(f"pyisomme {version('pyisomme')}")
print(f"expected: the deceleration of the height that was written, {before.min():.4f} to {before.max():.4f} m/s^2")
print(f"seen:     heights off by up to {np.abs(read.get_data() - height).max():.1g} m, {after.min():.1f} to {after.max():.1f} m/s^2 after")
raise SystemExit(0 if np.ptp(before) < 1e-3 and np.ptp(after) > 10.0 else 1)
END
"$folder/venv/bin/python" "$folder/seen.py" "$folder" 2> "$folder/said" || { cat "$folder/said" >&2; exit 1; }
