# %% [markdown]
# # Parameters from measured points
#
# An experiment gives section points with noise. Which voltage, frequency and restitution does the
# oscillator have? The points here are made by direct simulation, so that the answer is known.

# %%
import numpy as np

import grazemap as gm

names = ["V", "omega", "r"]
truth = np.array([-1e-5, -1e-5, 4e-3])
noise = {"x": 3e-7, "theta": 1e-5}
keys = {
    "expansion.active": names,
    "expansion.smooth_order": 7,
    "expansion.contact_weight": 10,
    "window.depth": 6e-3,
    "window.state": {"x": 6e-3, "theta": 0.1},
    "window.parameter": {"V": 3e-4, "omega": 3e-4, "r": 1e-2},
}
m = gm.Scene.catalogue("mems").replace(**keys).graze().map()
print(m.error)

# %% [markdown]
# Sixty runs of three returns each, from states whose contacts are deeper than the noise. The window
# was widened so that it holds where a shallow contact leads; what the map errs there is printed.

# %%
rng = np.random.default_rng(4)
starts = np.array([8e-6, 0]) + rng.uniform(-1, 1, (60, 2)) * [4e-6, 1e-3]
orbits = m.iterate(starts, truth, 3, method="direct")
points = np.concatenate([starts[:, None], orbits], axis=1)
points += rng.normal(size=points.shape) * list(noise.values())

# %% [markdown]
# The last point of every run is withheld: it is predicted, not fitted.

# %%
found = m.fit(points, names, noise=noise, withheld=1)
assert found.document["end"] == "converged"
print(found.to_pandas())
z = (found["offset"] - truth) / found["standard_error"]
print("errors over standard errors:", z)
assert (np.abs(z) < 4).all()
predicted = found.document["withheld"]["error_over_noise"]
print("error of the prediction over the noise:", predicted)
assert max(predicted) < 6

# %% [markdown]
# How the errors of voltage and frequency hang together; the cross is the truth.

# %%
ax = found.plot(x="V", y="omega")
(cross,) = ax.plot(truth[0], truth[1], "x", color="black")

# %% [markdown]
# Noise that is not stated is estimated from the residuals.

# %%
again = m.fit(points, names, withheld=1)
print(again.noise, again.errors)
assert np.allclose(again.noise, list(noise.values()), rtol=0.3)

# %% [markdown]
# Noise in the oscillator itself: a forcing that is drawn afresh at every return. A little of it
# spreads the orbit below its graze; more makes it touch the stop, and it leaves for another orbit,
# far away, with a contact in every period.

# %%
linear = gm.Scene.catalogue("linear").graze().map()
below = {"alpha": -1e-4}
near = {"x": (-5.2e-5, -3.7e-5), "theta": (-3e-6, 3e-6)}
counts = {"orbits": 100, "keep": 20, "seed": 7}
spread = linear.noise({"alpha": 1e-6}, at=below, range=near, cells=40, **counts)
across, up, density = spread.density()
print(spread, density.shape)
gone = linear.noise({"alpha": 1e-4}, at=below, **counts)
print("share of returns with contact:", spread.document["contacts"], gone.document["contacts"])
spread.plot()
assert spread.document["contacts"] == 0
assert gone.document["contacts"] == 1
