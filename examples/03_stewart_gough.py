"""A Stewart-Gough platform made from numbers: velocity, forward rates, conditioning over a grid of poses."""

import numpy as np

import polypod as pp

# 1. Six UPS legs, their joints in three pairs: a dictionary with the keys of a mechanism file.
base = [-10, 10, 110, 130, 230, 250]
platform = [-50, 50, 70, 170, 190, 290]
legs = [
    {
        "stroke": {"min": 550, "max": 850},
        "base": {"joint": "U", "point": {"radius": 500, "angle": low}, "axis": {"angle": low + 90}},
        "platform": {"joint": "S", "point": {"radius": 300, "angle": high}},
        "cylinder": {"mass": 2.4, "center": 200, "inertia": [0.035, 0.0015, 0.035]},
        "piston": {"mass": 1.1, "center": 180, "inertia": [0.014, 0.0002, 0.014]},
    }
    for low, high in zip(base, platform, strict=True)
]
mech = pp.Mechanism.from_dict(
    {
        "name": "my-stewart-gough",
        "units": {"length": "mm", "angle": "deg", "mass": "kg", "inertia": "kg m^2"},
        "home": {"position": [0, 0, 600]},
        "platform": {"mass": 12, "center": [0, 0, 20], "inertia": [0.35, 0.35, 0.68]},
        "legs": legs,
    }
)
print(mech, "with the coordinate sets", ", ".join(mech.coordinate_sets))

# 2. A moving pose: coordinates with rates and second rates give twist and acceleration.
state = mech.state(
    {"x": 0.05, "y": 0.0, "z": 0.62, "rx": 0.1, "ry": -0.05, "rz": 0.2},
    rates={"z": 0.3, "rz": 1.0},
    second_rates={"z": -2.0},
)
kinematics = mech.kinematics(state.pose, state.twist, state.acceleration)
print("leg rates:", kinematics.rates.round(4), "m/s")

# 3. And back: leg rates and accelerations give the platform's twist and acceleration.
twist = mech.platform_twist(state.pose, kinematics.rates).twist
acceleration = mech.platform_acceleration(state.pose, twist, kinematics.accelerations).acceleration
assert np.allclose(twist, state.twist)
assert np.allclose(acceleration, state.acceleration)

# 4. The forces that this motion needs, and the balance of powers.
print("active forces:", mech.inverse_dynamics(state.pose, twist, acceleration).forces.round(1), "N")
print("left of the power balance:", mech.power(state.pose, twist, acceleration).residual, "W")

# 5. A batch: conditioning over a grid of heights and rotations. Leading axes stay as they are.
heights, turns = np.meshgrid(np.linspace(0.5, 0.7, 5), np.radians([-60, -30, 0, 30, 60]), indexing="ij")
poses = mech.pose({"x": 0.0, "y": 0.0, "z": heights, "rx": 0.0, "ry": 0.0, "rz": turns})
quality = mech.conditioning(poses).sigma_min
assert quality.shape == (5, 5)
print(quality.round(3))
