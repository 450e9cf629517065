# %% [markdown]
# # The electrostatic oscillator where a graze changes its kind
#
# Thota, Zhao and Dankowicz (2006) follow the grazing orbits of an electrostatically driven
# oscillator in voltage and frequency. Where `xi_1` vanishes the graze is of codimension two: on one
# side of it a stable orbit with impacts goes on from the graze, on the other it jumps away.

# %%
import numpy as np

import grazemap as gm

scene = gm.Scene.catalogue("mems_codim2")

# %% [markdown]
# The grazing curve near the point, with `xi_1` along it. Its zero is solved for.

# %%
curve = scene.curve("omega", (0.4876, 0.488), xi=1)
assert curve.ended is None
(point,) = curve.document["codim2"]
print(point["n"], point["parameters"])
assert abs(point["parameters"]["omega"] - 0.4878087004) < 1e-9
assert abs(point["parameters"]["V"] - 0.1710666890) < 1e-9
curve.plot()

# %% [markdown]
# `xi_1` changes its sign there, and only there.

# %%
omega, xi = curve["omega"], curve["xi_1"]
signs = np.sign(xi)
assert (np.diff(signs) != 0).sum() == 1
print(omega[0], xi[0], omega[-1], xi[-1])
curve.plot(y="xi_1")

# %% [markdown]
# What theory says on both sides.

# %%
for shift in (-1e-4, 1e-4):
    beside = scene.replace(omega=point["parameters"]["omega"] + shift)
    print(shift, beside.graze().verdict, sep="\n")

# %% [markdown]
# Loci that end at the point: where orbits with one impact fold and flip, over the two parameters.
# They leave the grazing curve with the square of the distance, so that the voltage is drawn from
# that curve.

# %%
m = scene.graze().map()
loci = m.loci(("omega", "V"), (-2e-6, 2e-6), itineraries=["1"])
print(sorted(set(loci["kind"])), [word for word in loci["label"] if word])
assert "graze" in set(loci["kind"])
loci.plot()

# %% [markdown]
# Branches in the voltage on either side of the point: on one the orbit with an impact folds, on the
# other it flips.

# %%
for shift, voltages, label in (
    (1.5e-6, (3.36e-7, 3.4e-7), "SN"),
    (-1.5e-6, (-3.328e-7, -3.3e-7), "PD"),
):
    beside = gm.branch(m, "V", voltages, at={"omega": shift}, itineraries=["1"])
    assert label in set(beside["label"])
    beside.plot()
