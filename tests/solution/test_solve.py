"""Solutions along motions: the built-in one, loads, other mechanisms, and motions that go too far."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from numpy.typing import NDArray

import polypod as pp
from polypod import Motion, Status
from polypod.solution import solve
from support import DATA

Array = NDArray[np.float64]

BUILT_IN = "lu-3spu-2rpu-r"
LU = pp.load(BUILT_IN)
MOTION = pp.load_motion(BUILT_IN, LU)
GOUGH = pp.load(DATA / "stewart-gough.toml")
RPS = pp.load(DATA / "3-rps.toml")

BALANCE = 1e-10  # relative to the largest power of the motion: as the issue asks
SIMPSON = 1e-4  # J, of Simpson's rule with 10 ms steps; found are 1e-5 of several hundred
ROUNDING = 1e-12  # relative to the largest number, of forces by two roads
POWERS = ("actuator_power", "load_power", "damping_power", "friction_power")
TIME = np.linspace(0, 2, 201)


@pytest.fixture(scope="module")
def built_in() -> xr.Dataset:
    return pp.solve(LU, MOTION).dataset


def assert_balanced(data: xr.Dataset) -> None:
    largest = max(float(np.abs(data[name]).max()) for name in POWERS)
    assert largest > 1
    assert float(np.abs(data["power_residual"]).max()) <= BALANCE * largest


def energy_gained(data: xr.Dataset) -> Array:
    energy = (data["kinetic_energy"] + data["potential_energy"]).values
    return energy - energy[0]


# --- the built-in motion ------------------------------------------------------------------------------------


def test_built_in_motion_is_what_its_file_says(built_in: xr.Dataset) -> None:
    assert np.all(built_in["status"] == Status.OK)
    assert built_in.sizes["time"] == 801
    assert built_in["time"].values[[0, -1]].tolist() == [0.0, 8.0]
    # The file's words: reached by motion and solution to the last digit that it gives.
    for values, low, high, digit in (
        (built_in["length"] * 1e3, 654.5, 848.2, 0.1),
        (np.degrees(built_in["coordinate_alpha"]), -20.7, 7.4, 0.1),
        (np.degrees(built_in["coordinate_beta"]), 11.9, 38.4, 0.1),
        (np.degrees(built_in["coordinate_gamma"]), 19.4, 36.9, 0.1),
        (built_in["coordinate_z"] * 1e3, 600, 694, 1),
    ):
        assert values.min() == pytest.approx(low, abs=0.6 * digit)
        assert values.max() == pytest.approx(high, abs=0.6 * digit)
    assert 0.0297 <= built_in["sigma_min"].min() < 0.0298
    assert built_in["length"].min() > 0.65
    assert built_in["length"].max() < 0.85
    first, last = (built_in.isel(time=i) for i in (0, -1))
    assert last["pose"].values == pytest.approx(first["pose"].values, abs=1e-14)  # a closed loop
    for end in (first, last):  # at rest
        assert np.abs(end["twist"]).max() < 1e-12
        assert np.abs(end["acceleration"]).max() < 1e-12


def test_built_in_motion_is_solved_as_each_of_its_states(built_in: xr.Dataset) -> None:
    state = LU.state(MOTION.coordinates, MOTION.rates, MOTION.second_rates, continued=True)
    kinematics = LU.kinematics(state.pose, state.twist, state.acceleration)
    dynamics = LU.inverse_dynamics(state.pose, state.twist, state.acceleration)
    coupled = LU.coupled_forces(state.pose, dynamics.constraint)
    printed = LU.coupled_forces(state.pose, dynamics.constraint, as_printed=True)
    for name, expected in {
        "pose": state.pose,
        "coordinate_rate_gamma": state.coordinate_rates["gamma"],
        "rate": kinematics.rates,
        "leg_spin": kinematics.leg_spin,
        "rod_eps": kinematics.rod_eps,
        "force": dynamics.forces,
        "constraint": dynamics.constraint,
        "coupled_force": coupled.forces,
        "coupled_torque": coupled.torque,
        "coupled_force_as_printed": printed.forces,
        "condition": LU.conditioning(state.pose).condition,
    }.items():
        assert np.array_equal(built_in[name], expected), name
    assert np.abs(built_in["coupled_force"] - built_in["coupled_force_as_printed"]).max() > 1


def test_every_variable_has_unit_and_name_and_is_finite(built_in: xr.Dataset) -> None:
    for name, variable in built_in.data_vars.items():
        assert variable.dims[0] == "time"
        assert variable.attrs["long_name"]
        assert name == "status" or variable.attrs["units"]
        if name in ("base_joint_angle", "base_joint_rate"):  # S joints have none
            assert np.isfinite(variable).all("joint_axis").all("time").values.tolist() == [1, 0, 1, 0, 0]
        else:
            assert np.isfinite(variable).all(), name
    assert built_in["leg"].values.tolist() == list("12345")
    assert pp.Mechanism.from_toml(built_in.attrs["mechanism_file"]) == LU


def test_power_balances(built_in: xr.Dataset) -> None:
    assert_balanced(built_in)
    rates = (built_in["force"] * built_in["rate"]).sum("leg")
    assert np.abs(rates - built_in["actuator_power"]).max() <= BALANCE * np.abs(rates).max()


def test_power_balances_with_friction_and_damping() -> None:
    dynamics = {"efficiency": 0.7, "linear_damping": 40.0, "angular_damping": 3.0}
    data = pp.solve(pp.Mechanism.from_dict(LU.to_dict() | {"dynamics": dynamics}), MOTION).dataset
    assert_balanced(data)
    twist = data["twist"].values
    squares = (twist[:, :3] ** 2).sum(axis=1), (twist[:, 3:] ** 2).sum(axis=1)
    assert data["damping_power"].values == pytest.approx(-40 * squares[0] - 3 * squares[1], rel=1e-12)
    assert np.abs(data["friction_power"]).max() > 1


@pytest.mark.parametrize("force", [(0.0, 0.0, 0.0), (100.0, -50.0, 300.0)])
def test_actuators_do_the_work_that_energy_and_load_ask_for(force: tuple[float, ...]) -> None:
    """A constant force at o does the work force · way."""
    wrench = np.broadcast_to([*force, 0.0, 0.0, 0.0], (len(MOTION.time), 6))
    data = pp.solve(LU, replace(MOTION, wrench=wrench)).dataset
    way = data["pose"].values[:, :3, 3] - data["pose"].values[0, :3, 3]
    needed = energy_gained(data) - way @ np.array(force)
    assert np.abs(needed).max() > 10
    assert np.abs(data["actuator_work"].values - needed).max() < SIMPSON
    assert data["actuator_work"].values[-1] == pytest.approx(0, abs=SIMPSON)  # a closed loop


# --- load ---------------------------------------------------------------------------------------------------


def test_load_along_the_motion_in_either_axes(built_in: xr.Dataset) -> None:
    t = MOTION.time
    wrench = np.stack([50 * np.sin(k + t) for k in range(6)], axis=1)
    turned = replace(MOTION, wrench=wrench, wrench_axes="platform")
    R = built_in["pose"].values[:, :3, :3]
    in_base = np.concatenate([(R @ w[..., None])[..., 0] for w in (wrench[:, :3], wrench[:, 3:])], axis=1)
    platform, base = (pp.solve(LU, m).dataset for m in (turned, replace(MOTION, wrench=in_base)))
    scale = float(np.abs(base["force"]).max())
    assert np.abs(platform["force"] - base["force"]).max() < ROUNDING * scale
    assert np.abs(platform["load_power"] - base["load_power"]).max() < ROUNDING * scale
    assert np.array_equal(platform["wrench"], wrench)
    assert (platform.attrs["wrench_axes"], base.attrs["wrench_axes"]) == ("platform", "base")
    wrongly = pp.solve(LU, replace(MOTION, wrench=wrench)).dataset
    assert np.abs(wrongly["force"] - platform["force"]).max() > 1
    twist = base["twist"].values
    assert base["load_power"].values == pytest.approx((in_base * twist).sum(axis=1), abs=1e-12 * scale)
    assert_balanced(platform)


def test_own_load_is_that_of_the_mechanism_file(built_in: xr.Dataset) -> None:
    own = [10.0, 10.0, 500.0, 0.0, 0.0, 1000.0]
    assert np.array_equal(built_in["wrench"], np.broadcast_to(own, (801, 6)))
    given = pp.solve(LU, replace(MOTION, wrench=np.broadcast_to(own, (801, 6)))).dataset
    assert given["force"].equals(built_in["force"])


# --- pieces -------------------------------------------------------------------------------------------------


def reaching(amplitude: float, middle: float = 0.0) -> Motion:
    """The paper's coordinates with cos γ = middle + amplitude sin(3 t), α = 0."""
    cosine = middle + amplitude * np.sin(3 * TIME)
    still = np.ones_like(TIME)
    sine18 = math.sin(math.pi / 10)
    q = {"x": -0.2 * still, "y": (0.27 - 0.15 * cosine) * sine18, "z": 0.68 * still, "alpha": 0 * still}
    return Motion.through(TIME, q | {"beta": 0.6 * still}, set="paper")


@pytest.mark.parametrize("chunk", [1, 7, 200, 201, 1000])
@pytest.mark.parametrize("which", ["tool", "paper with a gap"])
def test_pieces_make_the_same_whole(chunk: int, which: str, monkeypatch: pytest.MonkeyPatch) -> None:
    motion = reaching(1.2)
    if which == "tool":
        poses = LU.pose(reaching(0.5).coordinates)
        tool = LU.coordinates(poses, "tool")
        del tool["turn"]
        motion = Motion.through(TIME, tool, set="tool")
    whole = pp.solve(LU, motion)
    seen: list[tuple[int, int]] = []
    monkeypatch.setattr(solve, "CHUNK", chunk)
    assert pp.solve(LU, motion, progress=lambda *count: seen.append(count)) == whole
    assert seen == [(min(end, 201), 201) for end in range(chunk, 201 + chunk, chunk)]


# --- other mechanisms ---------------------------------------------------------------------------------------


def test_stewart_gough() -> None:
    wave = {"x": 0.05, "y": -0.04, "z": 0.06, "rx": 0.2, "ry": -0.15, "rz": 0.3}
    q = {name: a * np.sin(2 * TIME + k) for k, (name, a) in enumerate(wave.items())}
    data = pp.solve(GOUGH, Motion.through(TIME, q | {"z": 0.6 + q["z"]}, set="pose")).dataset
    assert np.all(data["status"] == Status.OK)
    assert_balanced(data)
    assert data["force"].shape == (201, 6)
    assert not {"constraint", "rod_omega", "coupled_force"} & {*data.data_vars}
    way = data["pose"].values[:, :3, 3] - data["pose"].values[0, :3, 3]
    needed = energy_gained(data) - way @ [0.0, 0.0, -200.0]
    assert np.abs(data["actuator_work"].values - needed).max() < SIMPSON


RPS_WAVE = {"z": 0.52 + 0.03 * np.sin(2 * TIME), "rx": 0.2 * np.sin(TIME), "ry": 0.15 * np.cos(3 * TIME)}


def assert_3_rps(data: xr.Dataset) -> None:
    assert np.all(data["status"] == Status.OK)
    assert_balanced(data)
    assert data["constraint"].shape == (201, 3)
    assert np.abs(data["coordinate_x"]).max() > 1e-4  # the parasitic motion
    assert np.abs(data["actuator_work"].values - energy_gained(data)).max() < SIMPSON
    for name, values in RPS_WAVE.items():
        assert data[f"coordinate_{name}"].values == pytest.approx(values, abs=1e-12)


def test_3_rps() -> None:
    assert_3_rps(pp.solve(RPS, Motion.through(TIME, RPS_WAVE, set="pose")).dataset)


def test_3_rps_from_a_table(tmp_path: Path) -> None:
    """Of the set pose as many coordinates as there are degrees of freedom, in a file too."""
    rows = np.column_stack([TIME, *RPS_WAVE.values()])
    path = tmp_path / "wave.csv"
    header = "time [s], z [m], rx [rad], ry [rad]"
    np.savetxt(path, rows, fmt="%.17g", delimiter=",", header=header, comments="")
    assert_3_rps(pp.solve(RPS, pp.load_motion(path, RPS)).dataset)


def test_3_rps_from_keyframes(tmp_path: Path) -> None:
    path = tmp_path / "rise.toml"
    path.write_text(
        '[motion]\ncoordinates = "pose"\n[units]\ntime = "s"\nlength = "mm"\nangle = "deg"\n'
        "[[keyframes]]\ntime = 0\nz = 500\nrx = 0\nry = 0\n"
        "[[keyframes]]\ntime = 1\nz = 520\nrx = 10\nry = 5\n",
        encoding="utf-8",
    )
    data = pp.solve(RPS, pp.load_motion(path, RPS)).dataset
    assert np.all(data["status"] == Status.OK)
    assert data["coordinate_z"].values[-1] == pytest.approx(0.52)


# --- motions that cannot be ---------------------------------------------------------------------------------


def test_out_of_stroke_keeps_its_numbers(built_in: xr.Dataset) -> None:
    """From a pose of the built-in motion up and down by 15 cm."""
    start = LU.coordinates(built_in["pose"].values[0], "natural")
    q = {name: np.full_like(TIME, value) for name, value in start.items()}
    q["h"] = q["h"] + 0.15 * np.sin(2 * TIME)
    data = pp.solve(LU, Motion.through(TIME, q, set="natural")).dataset
    lengths = data["length"].values
    outside = ((lengths < 0.65) | (lengths > 0.85)).any(axis=1)
    assert 20 < outside.sum() < 180
    assert np.array_equal(data["status"], np.where(outside, Status.OUT_OF_STROKE, Status.OK))
    for name in ("pose", "force", "constraint", "power_residual", "actuator_work", "sigma_min"):
        assert np.isfinite(data[name]).all(), name
    assert_balanced(data)


def test_impossible_poses_are_gaps_and_nothing_else() -> None:
    motion = reaching(1.2)
    data = pp.solve(LU, motion).dataset
    impossible = np.abs(1.2 * np.sin(3 * TIME)) > 1
    assert 50 < impossible.sum() < 150
    assert np.array_equal(data["status"] == Status.NO_BRANCH, impossible)
    assert np.isin(data["status"][~impossible], (Status.OK, Status.OUT_OF_STROKE)).all()
    given = {f"{kind}_{name}" for name in motion.coordinates for kind in ("coordinate", "coordinate_rate")}
    given |= {f"coordinate_second_rate_{name}" for name in motion.coordinates} | {"status", "wrench"}
    for name in given:
        assert np.isfinite(data[name]).all(), name
    assert np.array_equal(data["binding_limit"] == -1, impossible)
    for name in {*data.data_vars} - given - {"actuator_work", "binding_limit"}:
        known = np.isfinite(data[name].values.reshape(201, -1)).any(axis=1)
        assert np.array_equal(known, ~impossible), name
    # Work is known up to the first gap: what comes after it depends on what happened there.
    assert np.array_equal(np.isfinite(data["actuator_work"]), np.cumsum(impossible) == 0)


def test_no_state_at_all() -> None:
    data = pp.solve(LU, reaching(0.1, middle=3.0)).dataset
    assert np.all(data["status"] == Status.NO_BRANCH)
    assert np.isnan(data["force"]).all()
    assert np.isnan(data["actuator_work"]).all()
