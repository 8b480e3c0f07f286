"""Machines with redundant actuators beside the same ones with just enough: time of a state of each operation.

A redundant machine and its square twin, in which so many legs are passive that the others are just enough,
take turns at the same states. Prints a line of JSON; run by `python -m benchmarks`.
"""

import json
import sys

import numpy as np

import polypod as pp
from benchmarks import timing

COUNT = 20_000
FEW = 1_000
"""States of the operations that take microseconds each, and of those that take many."""
SPREAD = 0.05
"""How far off home states are, in characteristic lengths and radians."""
SLOW = ("joint_reactions", "inverse_dynamics_derivatives", "regressor", "forward_kinematics")


def square(mech):
    """The machine with its surplus actuators passive: as many legs, as many actuated ones as it takes."""
    data = mech.to_dict()
    surplus = mech.n_rows - 6
    for leg in range(mech.n_legs):
        if surplus and mech.actuated[leg]:
            data["legs"][leg]["actuated"] = False
            surplus -= 1
    return pp.Mechanism.from_dict(data)


def states(mech, count):
    """Poses about home that the machine can have, at rest."""
    draw = np.random.default_rng(0)
    names = mech.singularity_distance(mech.home).coordinates
    home, size = mech.coordinates(mech.home), SPREAD * mech.characteristic_length
    near = {name: home[name] + size * draw.uniform(-1, 1, count) for name in names}
    state = mech.state(near)
    if np.any(state.status != pp.Status.OK):
        raise RuntimeError(f"{mech.name}: a state about home has no answer")
    return state


def main():
    timing.pin(1)
    rows = []
    for name in pp.list_mechanisms():
        mech = pp.load(name)
        if not mech.redundantly_actuated:
            continue
        rows += pairs(name, {"redundant": mech, "square": square(mech)})
    print(json.dumps(rows))


def pairs(name, machines):
    """Times of both machines at each operation, in turns."""
    mech = machines["redundant"]
    found = []
    for operation in OPERATIONS:
        count = FEW if operation in SLOW else COUNT
        state = states(mech, count)
        calls = {kind: OPERATIONS[operation](of, state) for kind, of in machines.items()}
        times = timing.rounds(calls, dict.fromkeys(calls, count))
        row = {kind: timing.summary(of) for kind, of in times.items()}
        ratio = np.median(np.divide(times["redundant"], times["square"]))
        legs = {"legs": mech.n_legs, "rows": mech.n_rows}
        found.append({"mechanism": name, **legs, "operation": operation, **row, "ratio": float(ratio)})
    return found


def _of_motion(method):
    return lambda mech, s: lambda: getattr(mech, method)(s.pose, s.twist, s.acceleration)


def _of_pose(method):
    return lambda mech, s: lambda: getattr(mech, method)(s.pose)


def _forward_dynamics(mech, s):
    forces = np.zeros((len(s.pose), mech.n_legs))
    return lambda: mech.forward_dynamics(s.pose, s.twist, forces)


def _platform_twist(mech, s):
    rates = np.zeros((len(s.pose), mech.n_legs))
    return lambda: mech.platform_twist(s.pose, rates)


def _forward_kinematics(mech, s):
    lengths = mech.inverse_kinematics(s.pose).lengths
    guess = np.roll(s.pose, 1, axis=0)
    return lambda: mech.forward_kinematics(lengths, guess)


OPERATIONS = {
    "jacobian": _of_pose("jacobian"),
    "hessian": _of_pose("hessian"),
    "platform_twist": _platform_twist,
    "inverse_dynamics": _of_motion("inverse_dynamics"),
    "power": _of_motion("power"),
    "limits": _of_pose("limits"),
    "forward_dynamics": _forward_dynamics,
    "joint_reactions": _of_motion("joint_reactions"),
    "inverse_dynamics_derivatives": _of_motion("inverse_dynamics_derivatives"),
    "regressor": _of_motion("regressor"),
    "forward_kinematics": _forward_kinematics,
}

if __name__ == "__main__":
    main(*sys.argv[1:])
