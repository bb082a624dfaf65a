# %% [markdown]
# # From Python: run a case, read its result file, sweep one parameter
#
# `docs/tutorial/index.md` does the same from the command line. Each cell runs on its own in an editor that knows `# %%`;
# `python examples/airdrop.py [FOLDER]` runs all and writes to the folder, or to the current one.

# %%
import sys
from pathlib import Path

import softbrake
from softbrake.studies.batch import run_batch

CASE = Path(__file__).resolve().parents[1] / "configs" / "airdrop.yaml"
folder = Path(sys.argv[1]) if len(sys.argv) == 2 and Path(sys.argv[1]).is_dir() else Path()

# %% [markdown]
# ## Run the case

# %%
case = softbrake.load_case(CASE)
result = folder / "airdrop.vtkhdf"
answer = softbrake.run(case, result)
assert answer.impact_velocity is not None
print(f"{answer.title}: {answer.outcome} at {answer.impact_velocity:.4f} m/s after {answer.impact_time:.4f} s")
print(f"peak hoop tension {answer.peak_tension_hoop:.0f} N/m, {answer.peaks['peak_tension_hoop'].phase}")
print(f"energy balance {answer.energy_error:.1e}")

# %% [markdown]
# ## Read the result file
#
# The history has a row per recorded step, the snapshots have the whole shell.

# %%
kept = softbrake.read_result(result)
history, shell = kept.history, kept.snapshots("tension_hoop")
for name in ("height", "velocity", "pressure"):
    print(f"{name}: {history[name][0]:g} to {history[name][-1]:g} {kept.units[name]}, {len(history)} rows")
print(f"{len(shell.times)} snapshots of {' x '.join(map(str, shell.xyz.shape[1:3]))} nodes")

# %% [markdown]
# ## Sweep the pressure
#
# Overrides read as on the command line. A batch runs a drop a core and yields answers in order. Above 29 kPa the cargo stops
# before it reaches the ground.

# %%
pressures = [20.0 + 2.0 * k for k in range(8)]  # kPa
cases = [softbrake.load_case(CASE, [f"pressure.value={pressure} kPa"]) for pressure in pressures]
velocities = []
for pressure, drop in zip(pressures, run_batch(cases), strict=True):
    assert drop.summary is not None, drop.fault
    velocities.append(drop.summary.impact_velocity or 0.0)
    print(f"{pressure:4.0f} kPa  {drop.summary.outcome:8}  {velocities[-1]:.4f} m/s")

# %% [markdown]
# ## Draw both

# %%
try:
    from matplotlib.figure import Figure
except ImportError:
    print("no picture: pip install 'softbrake[plot]'")
else:
    figure = Figure(figsize=(9.0, 3.5), layout="constrained")
    left, right = figure.subplots(1, 2)
    left.plot(1e3 * history["time"], -history["velocity"])
    left.set(xlabel="time, ms", ylabel="velocity downwards, m/s")
    right.plot(pressures, velocities, "o-")
    right.set(xlabel="pressure, kPa", ylabel="impact velocity, m/s")
    figure.savefig(folder / "airdrop.png", dpi=150)
