#!/usr/bin/env bash
# All sets of compiler flags have one hash: it is taken over the names of the options, not over their values.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
"${PYTHON:-python3}" -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check numba==0.68.1
cat > "$folder/seen.py" <<'END'
import numba
from numba.core.compiler import Flags

kinds = []
for name in ("nrt", "noalias", "forceinline", "release_gil", "boundscheck"):
    flags = Flags()
    setattr(flags, name, True)
    kinds.append(flags)
equal = sum(one == other for one in kinds for other in kinds) - len(kinds)
hashes = len({hash(flags) for flags in kinds})
print(f"numba {numba.__version__}")
print(f"expected: {len(kinds)} sets of flags, no two equal ({equal} pairs are), with hashes that differ")
print(f"seen:     {hashes} hash; caches of templates keyed by flags compare all values of all flags at each lookup")
raise SystemExit(0 if equal == 0 and hashes == 1 else 1)
END
"$folder/venv/bin/python" "$folder/seen.py"
