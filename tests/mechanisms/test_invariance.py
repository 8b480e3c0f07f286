"""Invariance when a mechanism is described otherwise: moved, rotated, mirrored, scaled, renumbered.

Each mechanism gets bodies of no symmetry, damping, a load and limits of all kinds; then all results up to
power and the relative slack of all limits are compared.
"""

import copy
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

import polypod as pp
from polypod import Status
from polypod.files.units import from_si
from support import DATA
from support.mechanism_files import SI_UNITS

Array = NDArray[np.float64]
Tables = dict[str, Any]

NAMES = ("lu-3spu-2rpu-r", "stewart-gough", "3-rps")

INVARIANT = (
    1e-10  # relative to the largest number of its kind: rounding, times the condition number of J, up to 1e3
)
BALANCE = 1e-10  # W, relative to the largest power of the state: as the issue asks
STENCIL = 1e-7  # relative, of differences freed of their h² part, step 1e-3: h⁴ and 1e-16 / h
SEED = 20240302


# --- mechanisms and their states ----------------------------------------------------------------------------


def body(rng: np.random.Generator) -> Tables:
    """A body made of points with mass, of no symmetry."""
    points, masses = rng.normal(size=(6, 3)) * 0.1, rng.uniform(0.2, 1, 6)
    inertia = sum(m * (p @ p * np.eye(3) - np.outer(p, p)) for m, p in zip(masses, points, strict=True))
    return {"mass": masses.sum(), "center": rng.uniform(-0.1, 0.1, 3), "inertia": inertia}


def tables_of(name: str) -> Tables:
    """The mechanism in SI, with vectors as arrays, and bodies, damping, load and limits that hide no term."""
    rng = np.random.default_rng(SEED)
    spec = pp.load(name if name == NAMES[0] else DATA / f"{name}.toml").geometry
    rods = [rod | {"body": None, "range": [-1.5, 1.5]} | body(rng) for rod in spec["rods"]]
    for leg in spec["legs"]:
        leg |= {"cylinder": body(rng), "piston": body(rng), "radius": 0.02, "force": [-2e3, 4e3]}
        if leg["base"]["joint"] == "R":
            leg["base"]["range"] = [-1.2, 1.7]
        if leg["base"]["rod"] is not None:
            leg["base"]["rod"] = rods[leg["base"]["rod"]]["name"]
    tables = {key: spec[key] for key in ("name", "home", "tool", "legs")} | {
        "units": SI_UNITS,
        "dynamics": {"efficiency": 0.8, "linear_damping": 30.0, "angular_damping": 2.0}
        | {"gravity": [1.0, -2.0, -9.0]},
        "load": {"force": [30.0, -20.0, 100.0], "torque": [5.0, 10.0, -15.0], "axes": "platform"},
        "platform": body(rng),
        "limits": {"sigma_min": 0.01, "clearance": 0.004},
        "rods": rods,
    }
    result: Tables = arrays(tables)
    return result


def arrays(value: Any) -> Any:
    """Lists of numbers as arrays, without the keys that stand for nothing."""
    if isinstance(value, dict):
        return {k: arrays(v) for k, v in value.items() if v is not None}
    if isinstance(value, list) and value and not isinstance(value[0], dict):
        return np.array(value)
    return [arrays(v) for v in value] if isinstance(value, list) else value


def plain(value: Any) -> Any:
    """Arrays as lists, as a file has them, pairs of limits as tables."""
    if isinstance(value, dict):
        return {
            k: ends(v) if isinstance(v, np.ndarray) and len(v) == 2 else plain(v) for k, v in value.items()
        }
    if isinstance(value, list):
        return [plain(v) for v in value]
    return value.tolist() if isinstance(value, np.ndarray | np.generic) else value


def ends(limits: Array) -> Tables:
    return dict(zip(("min", "max"), limits.tolist(), strict=True))


def mechanism(tables: Tables) -> pp.Mechanism:
    return pp.Mechanism.from_dict(plain(tables))


@dataclass
class States:
    pose: Array
    twist: Array
    acceleration: Array


def states_of(mech: pp.Mechanism) -> States:
    """The centre, near it, and uniform; inside the stroke or not."""
    rng = np.random.default_rng(SEED)
    set = "natural" if "natural" in mech.coordinate_sets else "pose"
    names = mech.coordinate_sets[set] if mech.dof > 3 else ("z", "rx", "ry")
    home = {"h": 0.74} if set == "natural" else mech.coordinates(mech.home, set)
    spread = {"x": 0.1, "y": 0.1, "z": 0.05, "p": 0.1, "h": 0.05}
    near = np.concatenate([[0.0, 1e-9, 1e-3], np.ones(12)])
    q = {n: home.get(n, 0.0) + near * rng.uniform(-1, 1, 15) * spread.get(n, 0.5) for n in names}
    rates, second = ({n: rng.normal(size=15) * 2 * spread.get(n, 0.5) for n in names} for _ in range(2))
    state = mech.state(q, rates, second)
    assert np.all(state.status == Status.OK)
    return States(state.pose, state.twist, state.acceleration)


def chain(mech: pp.Mechanism, states: States) -> dict[str, Array]:
    """All results, by name; the power balances."""
    motion = (states.pose, states.twist, states.acceleration)
    results: dict[str, Array] = {}
    for part in (mech.kinematics(*motion), mech.inverse_dynamics(*motion), mech.power(*motion)):
        assert np.isin(part.status, (Status.OK, Status.OUT_OF_STROKE)).all()
        results |= part.arrays
    results |= mech.conditioning(states.pose).arrays | {"status": results["status"]}
    limits = mech.limits(states.pose, twist=states.twist, acceleration=states.acceleration)
    results["relative slack"] = limits.relative
    powers = [
        results[k] for k in ("actuators", "load", "damping", "friction", "kinetic_rate", "potential_rate")
    ]
    assert np.all(np.abs(results.pop("residual")) <= BALANCE * np.abs(powers).max(axis=0))
    results["constraint"] = np.abs(results["constraint"])
    del results["condition"]  # as good as sigma_min, which is nothing but rounding where it is small
    return results


def same(actual: dict[str, Array], expected: dict[str, Array], tolerance: float = INVARIANT) -> None:
    assert actual.keys() == expected.keys()
    for name, values in expected.items():
        scale = np.nanmax(np.abs(values), initial=0.0)
        assert actual[name] == pytest.approx(values, rel=0, abs=tolerance * scale, nan_ok=True), name


# --- other descriptions -------------------------------------------------------------------------------------


@dataclass
class Change:
    """Base axes rotated by `base` and shifted, platform axes by `platform`; both are mirrored or none."""

    base: Array
    platform: Array
    shift: Array
    length: float = 1.0
    mass: float = 1.0
    time: float = 1.0

    @property
    def sign(self) -> float:
        """-1 for a mirror, under which axes of turning and torques are pseudo-vectors."""
        return float(np.sign(np.linalg.det(self.base)))

    def scale(self, length: int, mass: int, time: int) -> float:
        return self.length**length * self.mass**mass * self.time**time

    def tables(self, old: Tables) -> Tables:
        new = copy.deepcopy(old)
        Q, P, sign, s = self.base, self.platform, self.sign, self.length
        force, torque = self.scale(1, 1, -2), self.scale(2, 1, -2)

        def bodily(b: Tables, D: Array) -> None:
            b["mass"] *= self.mass
            b["center"] = s * D @ b["center"]
            b["inertia"] = self.scale(2, 1, 0) * D @ b["inertia"] @ D.T

        home = new["home"]
        R = Q @ Rotation.from_rotvec(home["rotation_vector"]).as_matrix() @ P.T
        home["rotation_vector"] = Rotation.from_matrix(R).as_rotvec()
        home["position"] = s * (Q @ home["position"] + self.shift)
        new["tool"] = {"point": s * P @ old["tool"]["point"], "axis": P @ old["tool"]["axis"]}
        new["dynamics"]["gravity"] = self.scale(1, 0, -2) * Q @ old["dynamics"]["gravity"]
        new["dynamics"]["linear_damping"] *= self.scale(0, 1, -1)
        new["dynamics"]["angular_damping"] *= self.scale(2, 1, -1)
        A = P if old["load"]["axes"] == "platform" else Q
        new["load"]["force"] = force * A @ old["load"]["force"]
        new["load"]["torque"] = torque * sign * A @ old["load"]["torque"]
        bodily(new["platform"], P)
        new["limits"]["clearance"] *= s
        for rod in new["rods"]:
            rod["point"], rod["axis"] = s * (Q @ rod["point"] + self.shift), Q @ rod["axis"]
            bodily(rod, np.diag([1, sign, 1]))  # in the rod's axes (L, n, L × n)
        for leg in new["legs"]:
            leg["stroke"] = s * leg["stroke"]
            leg["radius"] *= s
            leg["force"] = force * leg["force"]
            bodily(leg["cylinder"], np.diag([sign, 1, 1]))  # in the leg's axes (n, δ, n × δ)
            bodily(leg["piston"], np.diag([sign, 1, 1]))
            for joint, A, shift in ((leg["base"], Q, self.shift), (leg["platform"], P, np.zeros(3))):
                joint["point"] = s * (A @ joint["point"] + shift)
                if "axis" in joint:
                    joint["axis"] = (sign if joint["joint"] == "R" else 1) * A @ joint["axis"]
        return new

    def states(self, old: States) -> States:
        pose = old.pose.copy()
        pose[:, :3, :3] = self.base @ old.pose[:, :3, :3] @ self.platform.T
        pose[:, :3, 3] = self.length * (old.pose[:, :3, 3] @ self.base.T + self.shift)
        twist, acceleration = (
            np.hstack(
                [self.length * six[:, :3] @ self.base.T, self.sign * six[:, 3:] @ self.base.T]
            ) / self.time**k
            for k, six in ((1, old.twist), (2, old.acceleration))
        )  # fmt: skip
        return States(pose, twist, acceleration)

    def results(self, mech: pp.Mechanism, old: dict[str, Array]) -> dict[str, Array]:
        """Expected results."""
        new = dict(old)
        for names, length, mass, time in (
            (("lengths",), 1, 0, 0),
            (("rates", "piston_velocity", "cylinder_velocity"), 1, 0, -1),
            (("accelerations", "piston_acceleration", "cylinder_acceleration"), 1, 0, -2),
            (("leg_omega", "leg_spin", "rod_omega", "base_joint_rates", "platform_joint_rates"), 0, 0, -1),
            (("leg_eps", "leg_spin_rate", "rod_eps"), 0, 0, -2),
            (("forces", "constraint"), 1, 1, -2),
            (("kinetic", "potential"), 2, 1, -2),
            (("kinetic_rate", "potential_rate", "actuators", "load", "damping", "friction"), 2, 1, -3),
        ):
            for name in names:
                new[name] = new[name] * self.scale(length, mass, time)
        for link in ("piston", "cylinder"):
            for rate in ("velocity", "acceleration"):
                new[f"{link}_{rate}"] = new[f"{link}_{rate}"] @ self.base.T
        new["directions"] = new["directions"] @ self.base.T
        for name in ("leg_omega", "leg_eps", "rod_omega", "rod_eps"):
            new[name] = self.sign * new[name] @ self.base.T
        for name in ("leg_spin", "leg_spin_rate", "rod_angle"):
            new[name] = self.sign * new[name]
        # About an axis that is mirrored as a line a rotation changes sign; about n and R axes it does not.
        for k, side in enumerate(("base", "platform")):
            legs = zip(mech.leg_letters, mech.geometry["legs"], strict=True)
            lines = [letters[2 * k] == "U" or leg[side]["rod"] is not None for letters, leg in legs]
            signs = np.where(lines, self.sign, 1.0)
            for name in (f"{side}_joint_angles", f"{side}_joint_rates"):
                new[name] = new[name] * np.column_stack([signs, np.ones(mech.n_legs)])
        # The height of the origin is a matter of description.
        g = self.base @ mech.geometry["gravity"]
        new["potential"] = new["potential"] - self.scale(2, 1, -2) * mass_of(mech) * g @ self.shift
        return new


def mass_of(mech: pp.Mechanism) -> float:
    spec = mech.geometry
    bodies = [spec["platform"], *(rod["body"] for rod in spec["rods"])]
    bodies += [leg[link] for leg in spec["legs"] for link in ("cylinder", "piston")]
    return float(sum(b["mass"] for b in bodies))


TURN = Rotation.from_rotvec([0.3, -1.2, 2.0]).as_matrix()
OTHER = Rotation.from_rotvec([-0.7, 0.4, 0.2]).as_matrix()
SHIFT = np.array([0.3, -2.0, 1.1])
SAME = Change(np.eye(3), np.eye(3), np.zeros(3))
MIRROR = np.diag([-1.0, 1.0, 1.0])
CHANGES = {
    "base shifted": replace(SAME, shift=SHIFT),
    "base rotated and shifted": replace(SAME, base=TURN, shift=SHIFT),
    "platform axes rotated": replace(SAME, platform=OTHER),
    "mirrored": replace(SAME, base=MIRROR, platform=MIRROR),
    "mirrored askew": replace(SAME, base=MIRROR @ TURN, platform=OTHER @ MIRROR, shift=SHIFT),
    "three times as long": replace(SAME, length=3.0),
    "four times as long, half as fast, equal weight": replace(SAME, length=4.0, time=2.0),
    "twice as heavy": replace(SAME, mass=2.0),
    "all at once": Change(MIRROR @ TURN, OTHER @ MIRROR, SHIFT, 0.3, 5.0, 0.7),
}


@pytest.fixture(params=NAMES)
def tables(request: pytest.FixtureRequest) -> Tables:
    return tables_of(request.param)


@pytest.mark.parametrize("axes", ["base", "platform"])
@pytest.mark.parametrize("change", CHANGES.values(), ids=CHANGES.keys())
def test_other_axes_and_other_measures(tables: Tables, change: Change, axes: str) -> None:
    tables["load"]["axes"] = axes
    mech = mechanism(tables)
    states = states_of(mech)
    other = mechanism(change.tables(tables))
    expected = change.results(mech, chain(mech, states))
    same(chain(other, change.states(states)), expected)
    assert other.mobility() == mech.mobility()
    assert other.characteristic_length == pytest.approx(mech.characteristic_length * change.length, rel=1e-14)


def test_gravity_alone_does_not_see_the_size(tables: Tables) -> None:
    """At rest and unloaded, the forces are shares of the weight, whatever the size."""
    tables["load"] |= {"force": np.zeros(3), "torque": np.zeros(3)}
    large = replace(SAME, length=7.0).tables(tables)
    large["dynamics"]["gravity"] = tables["dynamics"]["gravity"]
    mech, other = mechanism(tables), mechanism(large)
    states = states_of(mech)
    rest = np.zeros(6)
    forces = mech.inverse_dynamics(states.pose, rest, rest).forces
    pose = replace(SAME, length=7.0).states(states).pose
    again = other.inverse_dynamics(pose, rest, rest).forces
    assert np.abs(forces).max() > 10
    assert again == pytest.approx(forces, rel=0, abs=INVARIANT * np.abs(forces).max())


ORDERS = {
    "lu-3spu-2rpu-r": [1, 0, 4, 2, 3],  # leg 1 still before leg 3: the rod follows the first
    "stewart-gough": [5, 2, 0, 1, 4, 3],
    "3-rps": [2, 0, 1],
}


def test_order_of_the_legs(tables: Tables) -> None:
    order = ORDERS[tables["name"]]
    mech = mechanism(tables)
    states = states_of(mech)
    expected = chain(mech, states)
    kinematics = mech.kinematics(states.pose, states.twist, states.acceleration)
    for name in (*list(kinematics.arrays)[:18], "forces"):
        expected[name] = expected[name][:, order]
    if tables["name"] == "3-rps":
        expected["constraint"] = expected["constraint"][:, order]
    tables["legs"] = [tables["legs"][i] for i in order]
    other = mechanism(tables)
    assert other.leg_names == tuple(mech.leg_names[i] for i in order)
    found = chain(other, states)
    for results in (expected, found):  # limits stand in the order of the legs
        results["relative slack"] = np.sort(results["relative slack"], axis=-1)
    same(found, expected)


def test_leg_that_the_rod_follows_changes_no_force() -> None:
    """Leg 3 before leg 1: the multiplier carries another share of the legs' inertia, the actuators do not."""
    tables = tables_of("lu-3spu-2rpu-r")
    mech = mechanism(tables)
    states = states_of(mech)
    tables["legs"] = tables["legs"][::-1]
    here, there = (chain(m, states) for m in (mech, mechanism(tables)))
    assert there["forces"][:, ::-1] == pytest.approx(
        here["forces"], rel=0, abs=INVARIANT * np.abs(here["forces"]).max()
    )
    assert there["rod_omega"] == pytest.approx(here["rod_omega"], abs=INVARIANT)
    assert np.abs(there["constraint"] - here["constraint"]).max() > 1e-3 * here["constraint"].max()


KINDS = {
    **dict.fromkeys(("point", "position", "center", "radius", "stroke", "clearance"), "length"),
    **dict.fromkeys(("angle", "rotation_vector", "range"), "angle"),
    **{kind: kind for kind in ("mass", "inertia", "force", "torque")},
    "gravity": "acceleration",
}
ODD = {"length": "in", "angle": "deg", "mass": "lb", "inertia": "g mm^2", "force": "kN", "torque": "N mm"}
ODD |= {"acceleration": "mm/s^2"}


def in_units(value: Any, units: dict[str, str], kind: str = "") -> Any:
    if isinstance(value, dict):
        return {k: in_units(v, units, KINDS.get(k, "")) for k, v in value.items() if k != "units"}
    if isinstance(value, list):
        return [in_units(v, units) for v in value]
    return from_si(value, kind, units[kind]) if kind else value


def test_units_of_the_file(tables: Tables) -> None:
    mech, other = mechanism(tables), mechanism(in_units(tables, ODD) | {"units": ODD})
    assert other.to_dict()["home"] != mech.to_dict()["home"]
    states = states_of(mech)
    same(chain(other, states), chain(mech, states))


# --- virtual power ------------------------------------------------------------------------------------------


def conservative(name: str) -> Tables:
    """The mechanism without load, damping and friction."""
    tables = tables_of(name)
    tables["load"] |= {"force": np.zeros(3), "torque": np.zeros(3)}
    tables["dynamics"] |= {"efficiency": 1.0, "linear_damping": 0.0, "angular_damping": 0.0}
    return tables


@pytest.mark.parametrize("name", NAMES)
def test_virtual_power_at_rest(name: str) -> None:
    """Starting from rest, forces · leg rates = A·M·V + P'(V) for any feasible V; M is the energies'."""
    mech = mechanism(conservative(name))
    states = states_of(mech)
    pose, V, rest = states.pose, states.twist, np.zeros(6)
    A = feasible(mech, pose, np.random.default_rng(SEED).normal(size=V.shape))

    def kinetic(twist: Array) -> Array:
        K: Array = mech.power(pose, twist, quadratic_part(mech, pose, twist)).kinetic
        return K

    forces = mech.inverse_dynamics(pose, rest, A).forces
    rates = mech.kinematics(pose, V, quadratic_part(mech, pose, V)).rates
    virtual = (kinetic(A + V) - kinetic(A) - kinetic(V)
               + mech.power(pose, V, quadratic_part(mech, pose, V)).potential_rate)  # fmt: skip
    assert np.abs(virtual).max() > 1
    scale = np.abs(forces * rates).sum(axis=-1)
    assert np.all(np.abs((forces * rates).sum(axis=-1) - virtual) < INVARIANT * scale)


def feasible(mech: pp.Mechanism, pose: Array, twist: Array) -> Array:
    """The twist without what breaks the constraints."""
    G = mech.jacobian(pose)[:, mech.dof :]
    return twist - (np.linalg.pinv(G) @ G @ twist[..., None])[..., 0]


def quadratic_part(mech: pp.Mechanism, pose: Array, twist: Array) -> Array:
    """The least acceleration that goes with a twist: J A + VᵀHV = 0 in the constraints' rows."""
    G, H = mech.jacobian(pose)[:, mech.dof :], mech.hessian(pose)[:, mech.dof :]
    return -(np.linalg.pinv(G) @ np.einsum("ni,nkij,nj->nk", twist, H, twist)[..., None])[..., 0]


@pytest.mark.parametrize("name", NAMES)
def test_lagrange(name: str) -> None:
    """Forces · ∂ℓ/∂q = d/dt ∂K/∂q' - ∂K/∂q + ∂P/∂q in independent coordinates, by differences of K and P."""
    mech = mechanism(conservative(name))
    rng = np.random.default_rng(SEED)
    natural = "natural" in mech.coordinate_sets
    names = mech.coordinate_sets["natural" if natural else "pose"] if mech.dof > 3 else ("z", "rx", "ry")
    home = {"h": 0.74, "beta": 0.4} if natural else mech.coordinates(mech.home, "pose")
    q0 = np.array([home.get(n, 0.0) for n in names]) + rng.uniform(-0.05, 0.05, len(names))
    u, w = rng.normal(size=(2, len(names)))

    def at(q: Array, rates: Array, second: Array) -> Any:
        return mech.state(*(dict(zip(names, x, strict=True)) for x in (q, rates, second)))

    def energies(q: Array, rates: Array) -> tuple[float, float]:
        state = at(q, rates, 0 * q)
        power = mech.power(state.pose, state.twist, state.acceleration)
        return float(power.kinetic), float(power.potential)

    def momentum(t: float, e: Array) -> float:
        """∂K/∂q_i' along the motion; K is quadratic in the rates."""
        q, rates = q0 + u * t + w * t**2 / 2, u + w * t
        return (energies(q, rates + e)[0] - energies(q, rates - e)[0]) / 2

    state = at(q0, u, w)
    forces = mech.inverse_dynamics(state.pose, state.twist, state.acceleration).forces
    for e in np.eye(len(names)):
        still = np.zeros_like(e)
        lengths = [mech.inverse_kinematics(at(q0 + h * e, still, still).pose).lengths for h in STEPS]
        lagrangian = [np.subtract(*energies(q0 + h * e, u)) for h in STEPS]
        momenta = [momentum(h, e) for h in STEPS]
        generalised = forces @ derivative(lengths)
        lagrange = derivative(momenta) - derivative(lagrangian)
        assert generalised == pytest.approx(lagrange, rel=STENCIL, abs=STENCIL * np.abs(forces).max())


STEPS = (-1e-3, -5e-4, 5e-4, 1e-3)


def derivative(values: list[Any]) -> Any:
    """The derivative at 0 from values at STEPS, by central differences freed of their h² part."""
    coarse, fine = (values[3] - values[0]) / 2e-3, (values[2] - values[1]) / 1e-3
    return (4 * fine - coarse) / 3


def test_jacobian_is_the_derivative_of_the_lengths(tables: Tables) -> None:
    """Of lengths along any twist, on the constraints or not, from points alone; the error falls with h²."""
    mech = mechanism(tables)
    pose = states_of(mech).pose
    V = np.random.default_rng(SEED).normal(size=(len(pose), 6))
    B = np.array([leg["base"]["point"] for leg in tables["legs"]])
    m = np.array([leg["platform"]["point"] for leg in tables["legs"]])

    def lengths(t: float) -> Array:
        R = Rotation.from_rotvec(t * V[:, 3:]).as_matrix() @ pose[:, :3, :3]
        b = (pose[:, :3, 3] + t * V[:, :3])[:, None] + m @ np.swapaxes(R, -1, -2)
        return np.linalg.norm(b - B, axis=-1)

    assert lengths(0) == pytest.approx(mech.inverse_kinematics(pose).lengths, rel=1e-14)
    rates = (mech.jacobian(pose) @ V[..., None])[:, : mech.n_legs, 0]
    coarse, fine = ((lengths(h) - lengths(-h)) / (2 * h) for h in (2e-3, 1e-3))
    assert np.linalg.norm(fine - rates) / np.linalg.norm(coarse - rates) == pytest.approx(0.25, rel=0.01)
    assert (4 * fine - coarse) / 3 == pytest.approx(rates, abs=1e-9)


def test_forces_of_massless_legs_balance_the_load(tables: Tables) -> None:
    """Jᵀ (forces, multipliers) = - load: the transposed Jacobian is what forces are found by."""
    del tables["platform"]
    for leg in tables["legs"]:
        del leg["cylinder"], leg["piston"]
    for rod in tables["rods"]:
        del rod["mass"], rod["center"], rod["inertia"]
    tables["dynamics"]["efficiency"] = 1.0
    mech = mechanism(tables)
    pose, rest = states_of(mech).pose, np.zeros(6)
    wrench = np.random.default_rng(SEED).normal(size=(len(pose), 6))
    d = mech.inverse_dynamics(pose, rest, rest, wrench)
    both = np.hstack([d.forces, d.constraint])
    sums = np.swapaxes(mech.jacobian(pose), -1, -2) @ both[..., None]
    assert sums[..., 0] == pytest.approx(-wrench, abs=INVARIANT * np.abs(both).max())
