"""Workspaces: where the platform can go, how far it can rotate there, and what stops it."""

import numpy as np

import polypod as pp

# 1. The reachable workspace of the published manipulator: all positions of o, whatever the orientation.
mech = pp.load("lu-3spu-2rpu-r")
reachable = pp.workspace(mech, step=0.05)
for name, (low, high) in zip("XYZ", 1e3 * reachable.extents, strict=True):
    print(f"{name}: {low:.0f} to {high:.0f} mm")
print(f"volume: {reachable.volume:.3f} ± {reachable.volume_error:.3f} {reachable.volume_unit}")

# 2. What ends it, as a share of the boundary; each vertex has its label and a pose on that very limit.
for what, share in list(reachable.shares.items())[:3]:
    print(f"{100 * share:.0f} %: {what}")
first = reachable.labels[0]
margin = mech.limits(reachable.poses[0]).margins[first]
print(f"{reachable.label_names[first]}: {abs(margin) < 1e-9}")

# 3. Without crossing a singularity, and with a floor for the smallest singular value, less remains.
within = pp.workspace(mech, step=0.05, keep_aspect=True)
dexterous = pp.workspace(mech, step=0.05, keep_aspect=True, sigma_min=0.05)
print(f"in one aspect: {within.volume:.3f} m^3, with sigma_min >= 0.05: {dexterous.volume:.3f} m^3")

# 4. How far the platform can tilt at a point, in every direction.
at = {"x": 0.0, "y": 0.1, "z": 0.7}
tilts = pp.workspace(mech, ["azimuth", "tilt"], at, step=np.radians(2))
print(f"tilt at the point: up to {np.degrees(tilts.extents[1, 1]):.1f} deg")

# 5. A mesh for other programs, and everything for later.
reachable.save("workspace.stl")
reachable.save("workspace.nc")
assert pp.load_workspace("workspace.nc") == reachable
print("watertight:", reachable.mesh().is_watertight)
