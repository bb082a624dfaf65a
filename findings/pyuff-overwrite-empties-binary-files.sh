#!/usr/bin/env bash
# pyuff's mode "overwrite" leaves nothing of a binary dataset 58 but the line that ends it.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
"${PYTHON:-python3}" -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check pyuff==2.5.8
cat > "$folder/seen.py" <<'END'
import sys
from importlib.metadata import version
from pathlib import Path

import numpy as np
import pyuff

time = 1e-4 * np.arange(1000)
node = {"rsp_node": 1, "rsp_dir": 3, "ref_node": 0, "ref_dir": 0}
axes = {"abscissa_spacing": 1, "abscissa_spec_data_type": 17, "ordinate_spec_data_type": 12, "orddenom_spec_data_type": 0}
dataset = {"type": 58, "binary": 1, "func_type": 1, **node, **axes, "x": time, "data": np.sin(time)}
sizes = {}
for mode in ("add", "overwrite"):
    file = Path(sys.argv[1]) / f"{mode}.uff"
    pyuff.UFF(str(file)).write_sets(dict(dataset), mode)
    sizes[mode] = file.stat().st_size, pyuff.UFF(str(file)).get_n_sets()
print(f"pyuff {version('pyuff')}")
print("expected: the same file of both modes, as there was none before")
print(f"seen:     {sizes['add'][0]} bytes and {sizes['add'][1]} dataset added, {sizes['overwrite'][0]} bytes and {sizes['overwrite'][1]} written over, no error")
raise SystemExit(0 if sizes["add"][1] == 1 and sizes["overwrite"] == (7, 0) else 1)
END
"$folder/venv/bin/python" "$folder/seen.py" "$folder"
