"""The published 5-DoF manipulator: mobility, one pose, a whole motion, results in a file."""

import numpy as np

import polypod as pp

# 1. The mechanism of the paper comes with Polypod.
mech = pp.load("lu-3spu-2rpu-r")
print(mech)
for warning in mech.warnings:
    print("  note:", warning)

# 2. Degrees of freedom are counted from ranks. The paper's Eq. 1 has the same sum with another split.
mobility = mech.mobility()
print(f"{mobility.dof} degrees of freedom, {mobility.redundant} redundant and {mobility.passive} passive")
print("the paper says:", mobility.published)

# 3. A pose from the paper's coordinates: gamma follows from Eq. 5, `branch` is the sign of its sine.
alpha, beta = np.radians([-14, 29])
state = mech.state({"x": -0.36, "y": 0.221, "z": 0.6, "alpha": alpha, "beta": beta}, branch=1)
print("gamma:", np.degrees(state.coordinates["gamma"]).round(2), "deg")
print("leg lengths:", (1e3 * mech.inverse_kinematics(state.pose).lengths).round(1), "mm")

# 4. How near is it to a singularity? Pure numbers; the smallest should not be much below the largest.
print("singular values:", mech.conditioning(state.pose))

# 5. Forces at rest under the published load, and the couple-constrained pair.
still = np.zeros(6)
dynamics = mech.inverse_dynamics(state.pose, still, still)
print("active forces:", dynamics.forces.round(1), "N; f_c:", dynamics.constraint.round(1), "N")
print("coupled:", mech.coupled_forces(state.pose, dynamics.constraint))

# 6. Everything along the built-in motion, as one labelled dataset.
motion = pp.load_motion("lu-3spu-2rpu-r", mech)
solution = pp.solve(mech, motion)
data = solution.dataset
assert (data.status == pp.Status.OK).all()
print("largest active force of each leg:", abs(data.force).max("time").values.round(0), "N")

# 7. The power balance tests the whole computation: what is left is rounding.
power, rest = (float(abs(data[name]).max()) for name in ("actuator_power", "power_residual"))
print(f"largest power: {power:.0f} W; left over: {rest:.0e} W")

# 8. Results survive files to the last bit.
solution.save("published.nc")
assert pp.load_solution("published.nc") == solution
