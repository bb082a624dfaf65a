#!/usr/bin/env bash
# A NUMBA_CACHE_DIR that cannot be made is passed over in silence: machine code goes beside the source.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
"${PYTHON:-python3}" -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check numba==0.68.1
mkdir "$folder/source"
cat > "$folder/source/cached.py" <<'END'
import numba


@numba.njit(cache=True)
def double(x):
    return 2 * x


double(1)
print(f"numba {numba.__version__}")
END
touch "$folder/no-folder"
(cd "$folder/source" && NUMBA_CACHE_DIR="$folder/no-folder/cache" "$folder/venv/bin/python" -W always cached.py 2> "$folder/said")
written=$(find "$folder/source/__pycache__" -name '*.nbc' | wc -l)
echo "expected: an error or a warning that the folder named cannot be used, and no cache elsewhere"
echo "seen:     $(wc -l < "$folder/said") lines of warning, $written file of machine code in __pycache__ beside the source"
[ ! -s "$folder/said" ] && [ "$written" -eq 1 ]
