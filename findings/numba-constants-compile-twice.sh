#!/usr/bin/env bash
# A constant argument in a call between jitted functions makes a specialisation of its own, beside that of a variable of its type.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
"${PYTHON:-python3}" -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check numba==0.68.1
cat > "$folder/seen.py" <<'END'
import numba


@numba.njit
def inner(x):
    return x + 1


@numba.njit
def outer(n):
    return inner(0) + inner(n)


outer(3)
seen = [str(types) for types in inner.signatures]
print(f"numba {numba.__version__}")
print("expected: inner compiled once, for int64, as no literally() asks for the constant")
print(f"seen:     {len(seen)} compilations, {', '.join(seen)}")
raise SystemExit(0 if seen == ["(Literal[int](0),)", "(int64,)"] else 1)
END
"$folder/venv/bin/python" "$folder/seen.py"
