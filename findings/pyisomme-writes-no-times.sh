#!/usr/bin/env bash
# pyisomme writes the times of a channel only where its info says "Reference channel"; else they are read back as 0, 1, 2 ... s.
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

time = -0.01 + 1e-4 * np.arange(1000)
pulse = pd.DataFrame(np.sin(time), index=time)
channel = Channel("T0PLAF000000AC30", pulse, unit="m/s^2")
Isomme(test_number="drop", channels=[channel]).write(f"{sys.argv[1]}/test")
read = Isomme().read(f"{sys.argv[1]}/test").channels[0].data.index.to_numpy()
print(f"pyisomme {version('pyisomme')}")
print(f"expected: times from {time[0]:g} to {time[-1]:g} s, or an error")
print(f"seen:     times from {read[0]:g} to {read[-1]:g}, the numbers of the samples")
raise SystemExit(0 if np.array_equal(read, np.arange(1000)) else 1)
END
"$folder/venv/bin/python" "$folder/seen.py" "$folder" 2> "$folder/said" || { cat "$folder/said" >&2; exit 1; }
