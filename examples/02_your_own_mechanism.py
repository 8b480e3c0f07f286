"""Your own mechanism: a 3-RPS head from a text, its faults, its dependent coordinates, its forces."""

import numpy as np

import polypod as pp

# 1. A mechanism is a TOML text, usually a file. Each R joint's axis is perpendicular to its leg: tangential.
LEG = """
[[legs]]
stroke = {{ min = 420, max = 640 }}
base = {{ joint = "R", point = {{ radius = 250, angle = {0} }}, axis = {{ angle = {1} }} }}
platform = {{ joint = "S", point = {{ radius = 150, angle = {0} }} }}
piston = {{ mass = 0.9, center = 140, inertia = [0.007, 0.0002, 0.007] }}
"""
TEXT = """
name = "my-3-rps"
[units]
length = "mm"
angle = "deg"
mass = "kg"
inertia = "kg m^2"
[home]
position = [0, 0, 500]
[platform]
mass = 6
center = [0, 0, 15]
inertia = [0.045, 0.045, 0.085]
""" + "".join(LEG.format(angle, angle + 90) for angle in (0, 120, 240))

mech = pp.Mechanism.from_toml(TEXT)
print(mech, mech.mobility().constraint_rows)

# 2. All faults of a text come at once, each with its place.
try:
    pp.Mechanism.from_toml(TEXT.replace("mass = 6", "mass = -6").replace("max = 640", "max = 240", 1))
except pp.MechanismError as error:
    print(error)

# 3. Three degrees of freedom: give any three numbers of the pose, the others follow. Arrays are a batch.
tilt = np.radians([0.0, 5.0, 10.0])
state = mech.state({"z": 0.5, "rx": tilt, "ry": 0.0})
print("o moves aside with the tilt:", (1e3 * state.coordinates["x"]).round(2), "mm")

# 4. Numerical outcomes never raise; each state has a status.
lengths = mech.inverse_kinematics(mech.pose({"z": [0.5, 0.7], "rx": 0.0, "ry": 0.0}))
for length, code in zip(lengths.lengths, lengths.status, strict=True):
    print((1e3 * length).round(1), pp.Status(code).name)

# 5. Forces with a load of your own, fixed in the platform: 200 N along its -z.
load = [0, 0, -200, 0, 0, 0]
forces = mech.inverse_dynamics(state.pose, state.twist, state.acceleration, load, "platform").forces
print("active forces:", forces.round(1).tolist(), "N")

# 6. Change a number and compare.
content = mech.to_dict()
content["platform"]["mass"] = 12
heavier = pp.Mechanism.from_dict(content)
more = heavier.inverse_dynamics(state.pose, state.twist, state.acceleration, load, "platform").forces - forces
print("6 kg more need", more.round(1).tolist(), "N")

# 7. Save it as a file of its own.
mech.save("my-3-rps.toml")
assert pp.load("my-3-rps.toml") == mech
