# %% [markdown]
# # A first hour: from equations to a diagram
#
# A mass on a spring, driven by a force, hits a rigid stop. At one amplitude of the force its orbit
# just touches the stop: it grazes. Beyond that the dynamics change at once. This notebook goes from
# the equations to a bifurcation diagram, and says at every step how far the numbers can be trusted.

# %%
import numpy as np

import grazemap as gm

# %% [markdown]
# The oscillator is a text. States, free flight, a surface with its impact, which parameter is
# adjusted so that the orbit grazes.

# %%
text = """
[model]
name = "a mass that hits a stop"
states = ["x", "v"]
parameters = { zeta = 0.05, delta = 1.0, r = 0.8, alpha = 2.2, omega = 1.8 }

[model.phase]
name = "theta"
rate = "omega"
period = "2*pi"

[model.flow]
x = "v"
v = "alpha*cos(theta) - 2*zeta*v - x"

[[model.surface]]
name = "stop"
event = "delta - x"
impact = { v = "-r*v" }

[grazing]
surface = "stop"
solve_for = "alpha"

[section]
kind = "tangency"

[expansion]
active = ["alpha", "omega"]
smooth_order = 5
contact_weight = 6
"""
scene = gm.Scene.parse(text, "mine.toml")
scene

# %% [markdown]
# The grazing orbit. Of a linear oscillator the amplitude is known in closed form.

# %%
graze = scene.graze()
p = graze.parameters
amplitude = p["delta"] * np.hypot(1 - p["omega"] ** 2, 2 * p["zeta"] * p["omega"])
assert abs(p["alpha"] - amplitude) < 1e-12
print(graze.verdict)

# %% [markdown]
# The orbit by direct simulation, over a period: it touches the stop and has no impact.

# %%
series = graze.trajectory(samples=200)
assert np.min(series["h_stop"]) > -1e-9
series.plot()

# %% [markdown]
# The local map, its window, and what it errs there against direct simulation.

# %%
m = graze.map()
print(m.coordinates, m.parameters)
print(m.window)
print(m.error)

# %% [markdown]
# Images of a thousand points at once, and the same by direct simulation.

# %%
rng = np.random.default_rng(1)
widths = np.array([m.window[name] for name in m.coordinates])
states = rng.uniform(-widths, widths, (200, 2)) / 4
held = m.inside(states)
errors = np.abs(m(states[held]) - m.iterate(states[held], method="direct")[:, 0]).max(axis=0)
print(errors)
assert (errors <= 2 * np.array(list(m.error.values()))).all()

# %% [markdown]
# What happens as the force grows past the graze: every value of the parameter is iterated, by the
# map inside its window and by direct simulation outside.

# %%
diagram = m.diagram("alpha", (-2e-4, 4e-4), points=40, transient=200, keep=40)
before = diagram["offset"] < 0
assert (diagram["period"][before] == 1).all()
diagram.plot()

# %% [markdown]
# The orbit that the diagram jumps to hits the stop once a period. Direct simulation from a point of
# the grazing orbit shows how it grows.

# %%
after = m.trajectory(at={"alpha": 4e-4}, periods=12)
assert (after["event"] == "impact").any()
after.plot()

# %% [markdown]
# The branches of periodic orbits without impact and with one: the first ends at the graze, the
# second goes back from there and is unstable. Stable orbits are solid, unstable ones dashed. `x` is
# so small on the second that the speed of the impact says more.

# %%
branch = m.branch("alpha", (-1e-4, 1e-4), itineraries=["0", "1"], observe=["impact_speed"])
print(branch.stable_ranges)
print([(point["label"], point["parameters"]) for point in branch.special])
assert "GR" in set(branch["label"])
branch.plot()

# %%
branch.plot(y="impact_speed")

# %% [markdown]
# Two parameters: orbits without contact lie on one side of the grazing curve, those with an impact
# on the other.

# %%
plane = ((-1e-4, 1e-4), (-2e-4, 4e-4))
chart = m.chart(("omega", "alpha"), plane, points=(24, 16), transient=200, overlay="graze")
assert set(chart["period"]) == {1}
chart.plot()
