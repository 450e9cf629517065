# %% [markdown]
# # Beside SciPy's `solve_ivp` with events
#
# The same impacts by an integrator for general purposes. The oscillator is that of the first
# notebook: a mass that hits a stop. What is compared are the times of the impacts and the state in
# the end; what is printed is how long both take for them.

# %%
import time

import numpy as np
from scipy.integrate import solve_ivp

import grazemap as gm

graze = gm.Scene.catalogue("linear").graze()
m = graze.map()
at, start, periods = {"alpha": 5e-3}, {"x": 0.0, "theta": 0.0}, 6

# %% [markdown]
# By direct simulation: exact steps between the impacts.

# %%
begun = time.perf_counter()
series = m.trajectory(at=at, start=start, periods=periods, samples=2)
own_seconds = time.perf_counter() - begun
struck = np.array(series["event"] == "impact")
impacts = series["t"][struck]
print(len(impacts), "impacts")
assert len(impacts) > 0
gm.trajectory(m, at=at, start=start, periods=periods).plot()

# %% [markdown]
# By `solve_ivp`: it is stopped at every impact, the velocity turned, and begun again.

# %%
p = graze.parameters | {"alpha": graze.parameters["alpha"] + at["alpha"]}


def flow(_time, state):
    x, v, theta = state
    return [v, p["alpha"] * np.cos(theta) - 2 * p["zeta"] * v - x, p["omega"]]


def gap(_time, state):
    return p["delta"] - state[0]


gap.terminal, gap.direction = True, -1
first = next(n for n in range(len(series["t"])) if series["t"][n] >= 0)
state = np.array([series[name][first] for name in ("x", "v", "theta")])
now, end, found = series["t"][first], series["t"][-1], []
begun = time.perf_counter()
while now < end:
    leg = solve_ivp(flow, (now, end), state, events=gap, rtol=1e-11, atol=1e-13)
    now, state = leg.t[-1], leg.y[:, -1].copy()
    if leg.status == 1:
        found.append(now)
        state[1] *= -p["r"]
scipy_seconds = time.perf_counter() - begun

# %% [markdown]
# Both agree. A single call of `m.trajectory` lays out a document and draws figures too; a return
# by itself is what `m.iterate(..., method="direct")` takes.

# %%
impacts = impacts[impacts >= series["t"][first]]
assert len(found) == len(impacts)
print("largest difference of an impact's time:", np.abs(np.array(found) - impacts).max())
assert np.abs(np.array(found) - impacts).max() < 1e-6
assert abs(state[0] - series["x"][-1]) < 1e-6

begun = time.perf_counter()
m.iterate([[0.0, 0.0]] * 100, [at["alpha"], 0.0], periods, method="direct")
return_seconds = (time.perf_counter() - begun) / (100 * periods)
print(f"solve_ivp: {1e3 * scipy_seconds / periods:.3f} ms a period")
print(f"direct simulation: {1e3 * return_seconds:.3f} ms a period")
print(f"m.trajectory with document and figures: {1e3 * own_seconds / periods:.3f} ms a period")
