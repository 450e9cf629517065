# %% [markdown]
# # Parameters from measured points
#
# An experiment gives section points with noise. Which voltage, frequency and restitution does the
# oscillator have? The points here are made by direct simulation, so that the answer is known.

# %%
import numpy as np

import grazemap as gm

names = ["V", "omega", "r"]
truth = np.array([2e-6, -3e-6, 4e-3])
noise = {"x": 1e-7, "theta": 2e-5}
m = gm.Scene.catalogue("mems").with_(**{"expansion.active": names}).graze().map()

# %% [markdown]
# Twenty runs of ten returns each, from states beside the graze.

# %%
rng = np.random.default_rng(4)
starts = rng.uniform(-1, 1, (20, 2)) * [2e-5, 4e-3]
orbits = m.iterate(starts, truth, 9, using="direct")
points = np.concatenate([starts[:, None], orbits], axis=1)
points += rng.normal(size=points.shape) * list(noise.values())

# %% [markdown]
# The last two points of every run are withheld: they are predicted, not fitted.

# %%
found = gm.fit(m, points, names, noise=noise, withheld=2)
assert not found.remarks or "warning: the" not in found.remarks[-1]
print(found.to_pandas())
z = (found["offset"] - truth) / found["standard_error"]
print("errors over standard errors:", z)
assert (np.abs(z) < 4).all()
predicted = found.document["withheld"]["error_over_noise"]
print("error of the prediction over the noise:", predicted)
assert max(predicted) < 2

# %% [markdown]
# Noise that is not stated is estimated from the residuals.

# %%
again = gm.fit(m, points, names, withheld=2)
print(again.noise, again.errors)
assert np.allclose(again.noise, list(noise.values()), rtol=0.3)

# %% [markdown]
# Noise in the oscillator itself: a restitution that is drawn afresh at every return, and the
# density that it makes.

# %%
spread = gm.noise(m, {"r": 2e-3}, at={"V": 5e-7}, orbits=200, keep=100, seed=7)
across, up, density = spread.density()
print(spread, density.shape, spread.document["contacts"])
assert 0 < spread.document["contacts"] < 1
spread
