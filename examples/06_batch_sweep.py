"""Sweeps: a hundred thousand poses at once and what becomes of each; then a dimension that is varied."""

import matplotlib.pyplot as plt
import numpy as np

import polypod as pp
from polypod.answers.status import count
from polypod.bodies.palette import color_of
from polypod.plots import save_figure
from polypod.plots.style import house_style

mech = pp.load("lu-3spu-2rpu-r")
still = np.zeros(6)

# 1. A grid of 100 000 poses in natural coordinates: arrays broadcast, and their axes stay.
p, h, beta = np.linspace(-0.45, 0.45, 50), np.linspace(0.4, 0.9, 50), np.radians(np.linspace(-40, 40, 40))
grid = {"alpha": 0.0, "p": p[:, None, None], "h": h[:, None], "beta": beta, "gamma": 0.6}
poses = mech.pose(grid)
print("poses:", poses.shape)

# 2. The forces that hold the load there. Nothing is raised: every state has a status, and no answer is NaN.
held = mech.inverse_dynamics(poses, still, still)
print(held)
for status, states, _ in count(held.status):
    print(f"{states} states are {status.name}: {status.message}")

# 3. The same as a labelled dataset: names for the grid's axes, legs by name, units as attributes.
data = held.to_xarray("p", "h", "beta").assign_coords(p=p, h=h, beta=beta)
usable = data.where(data.status == pp.Status.OK)
most = abs(usable.forces).max(["h", "beta"]).isel(p=slice(0, None, 7)) / 1e3
print("most force along the rod / kN:", most.round(1).to_pandas(), sep="\n")

# 4. A design sweep: the radius on which the legs 2, 4 and 5 stand. A design is the file with another number.
radii = np.linspace(0.20, 0.60, 17)
sample = poses[:, :, ::5]
within, largest = [], []
for radius in radii:
    content = mech.to_dict()
    for leg in content["legs"]:
        if leg["name"] in ("2", "4", "5"):
            leg["base"]["point"]["radius"] = 1e3 * radius
    design = pp.Mechanism.from_dict(content)
    inside = design.limits(sample).within
    forces = abs(design.inverse_dynamics(sample[inside], still, still).forces).max(axis=-1)
    within.append(100 * inside.mean())
    largest.append(np.median(forces) / 1e3)
best = int(np.argmax(within))
print(f"most poses at {1e3 * radii[best]:.0f} mm: {within[best]:.1f} %, with {largest[best]:.1f} kN")
print(f"the file's 265 mm: {np.interp(0.265, radii, largest):.1f} kN")

# 5. Wider legs bear the load with less force, but reach fewer of the poses.
with house_style():
    figure, (above, below) = plt.subplots(2, 1, figsize=(4.6, 4.4), sharex=True, layout="constrained")
    above.plot(1e3 * radii, within, color=color_of(0), marker="o", markersize=2.5)
    above.set_ylabel("poses within all limits / %")
    below.plot(1e3 * radii, largest, color=color_of(3), marker="o", markersize=2.5)
    below.set_ylabel("median of the largest force / kN")
    below.set_xlabel("radius of the base joints 2, 4, 5 / mm")
save_figure(figure, "sweep.png")
