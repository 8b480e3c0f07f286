"""Computed torque: the published manipulator follows its motion, from a wrong start and with wrong masses."""

import matplotlib.pyplot as plt
import numpy as np

import polypod as pp
from polypod.bodies.palette import color_of
from polypod.plots import save_figure
from polypod.plots.style import dash_of, house_style

# 1. The mechanism and what it is to follow: the first second of the built-in motion.
mech = pp.load("lu-3spu-2rpu-r")
motion = pp.load_motion("lu-3spu-2rpu-r", mech)
UNTIL = 1.0

# 2. The controller knows it with all masses and inertias a fifth too large.
model = mech.to_dict()
bodies = [
    model["platform"],
    *model["rods"],
    *(leg[part] for leg in model["legs"] for part in ("cylinder", "piston")),
]
for body in bodies:
    body["mass"] *= 1.2
    body["inertia"] = (1.2 * np.array(body["inertia"])).tolist()
wrong = pp.Mechanism.from_dict(model)

# 3. It starts beside the motion: 10 mm off along the rod, and rotated about it by a degree.
first = mech.pose({name: values[0] for name, values in motion.coordinates.items()}, branch=motion.branch)
beside = mech.coordinates(first, "natural")
start = mech.pose({**beside, "p": beside["p"] + 0.01, "alpha": beside["alpha"] + np.radians(1)})

# 4. The same controller with either model; the mechanism that it drives has the true masses.
runs = {}
for label, known in {"true masses": mech, "masses 20 % too large": wrong}.items():
    law = pp.ComputedTorque(known, motion, frequency=20.0)
    run = pp.simulate(mech, start, forces=law, until=UNTIL, step=0.01, tolerance=1e-6)
    print(f"{label}: {run.end['reason']} at {run.end['time']:g} s")
    runs[label] = run.dataset

# 5. What is left of the error: the legs' lengths beside those that are wanted.
for label, data in runs.items():
    data["error"] = data.length - [law.desired(time).lengths for time in data.time.values]
    late = 1e3 * float(abs(data.error.where(data.time > 0.5)).max())
    print(f"{label}: after half a second at most {late:.4f} mm off")
    print("  most force:", abs(data.force).max("time").values.round(0), "N")

# 6. Errors and forces of all legs over time.
with house_style():
    figure, rows = plt.subplots(2, 2, figsize=(8.0, 5.0), sharex=True, sharey="row", layout="constrained")
    for column, (label, data) in zip(rows.T, runs.items(), strict=True):
        for i, leg in enumerate(mech.leg_names):
            style = {"color": color_of(i), "linestyle": dash_of(i), "label": f"leg {leg}"}
            column[0].plot(data.time, 1e3 * data.error[:, i], **style)
            column[1].plot(data.time, 1e-3 * data.force[:, i], **style)
        column[0].set_title(label)
        column[1].set_xlabel("time / s")
    rows[0, 0].set_ylabel("error of length / mm")
    rows[1, 0].set_ylabel("active force / kN")
    rows[0, 1].legend()
save_figure(figure, "computed_torque.png")
