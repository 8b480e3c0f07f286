"""Every built-in mechanism: mobility, round trips, the twin in Pinocchio, and published numbers."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from functools import cache
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image
from scipy.spatial.transform import Rotation

import polypod as pp
from polypod import SingularityKind, Status
from polypod.errors import UnsupportedError
from polypod.summary.mechanism_facts import catalogue
from support.pages import DOCS, read
from support.pose_search import search

Array = NDArray[np.float64]

SEED = 20001
ROW = r"^\| \[`([\w-]+)`\]\(#[\w-]+\) \| (\S+) \| (\d) \|"
"""Of the table of the page: name, legs, degrees of freedom."""
POSES = 6
REACH = 0.15
"""How far random coordinates go from home: radians, and parts of the characteristic length."""
NEAR_SINGULAR = 0.02
"""Least singular value of random poses: rounding in forces grows with its inverse."""
POSE = 1e-9
"""1 and m by characteristic length: of forward kinematics where the singular value is above the floor."""
IDENTITY = 1e-12
"""Of J V and J A + VᵀHV, relative: rounding alone."""


class Known(NamedTuple):
    """Published properties of a mechanism."""

    dof: int
    """Degrees of freedom of the platform."""
    source: str
    """Where the degrees of freedom stand, or why they are plain."""
    complex_modes: int | None = None
    """Solutions of forward kinematics, complex ones too, for generic leg lengths."""


GENERAL = "six legs without constraints"
ROD = "of six, five legs on a rod leave its spin: Borràs, Thomas, Torras 2010; 8 solutions: three quadrics"
LEAST = "one constraint of the leg that is not SPS, UPS or PSS"
KNOWN = {
    "2rpu-spr": Known(3, "2R1T: Rotational axes analysis of the 2-RPU/SPR 2R1T parallel mechanism"),
    "2upr-rpu": Known(3, "RPR-equivalent: Li, Hervé, IEEE Trans. Robot. 30, 2014"),
    "3-rpr": Known(3, "two translations and a rotation in the plane"),
    "3-rps": Known(3, "Hunt 1983; 16 solutions: Nanua, Waldron, Murthy 1990", 16),
    "3-spr": Known(3, "kinematic inversion of 3-rps, so with its solutions", 16),
    "3-prs": Known(3, "as 3-rps, whose legs these are with the carriages at rest", 16),
    "3-puu": Known(3, "three translations: Tsai 1996, Li, Xu 2006"),
    "3-upu": Known(3, "three translations: Tsai 1996"),
    "3-upu-snu": Known(3, "three translations but at singular poses; 78: Walter, Husty, Pfurner 2009", 78),
    "4-rpr": Known(3, "as 3-rpr"),
    "4pss-upu": Known(5, LEAST),
    "4sps-spr": Known(5, LEAST),
    "4sps-upu": Known(5, LEAST),
    "4ups-up": Known(3, "as tricept"),
    "4ups-upu": Known(5, LEAST),
    "dietmaier-6-sps": Known(6, GENERAL, 40),
    "exechon": Known(3, "two tilts and a translation: Neumann's patent"),
    "griffis-duffy": Known(6, "six, of which the legs control five: Husty, Karger 2000"),
    "hexaglide": Known(6, GENERAL, 40),
    "linapod": Known(6, GENERAL, 40),
    "linuxcnc-6-3": Known(6, GENERAL, 16),
    "linuxcnc-pentakins": Known(6, ROD, 8),
    "lu-3spu-2rpu-r": Known(5, "Lu, Liu, Zhang, Ye, Wang: Eq. 1"),
    "lu-3spu-2rpu-r-turned": Known(5, "as lu-3spu-2rpu-r: the same joints"),
    "octahedral-3-3": Known(6, GENERAL, 16),
    "pentapod-5-spu": Known(6, ROD, 8),
    "pentapod-5-ups": Known(6, ROD, 8),
    "tricept": Known(3, "two tilts and a sliding: Neumann's patent"),
    "tsai-6-sps": Known(6, GENERAL),
    "ups-hexapod": Known(6, GENERAL),
}

OVERCONSTRAINED = {
    "2rpu-spr": 2,
    "2upr-rpu": 3,
    "3-rpr": 6,
    "4-rpr": 9,
    "exechon": 2,
    "lu-3spu-2rpu-r": 2,
    "lu-3spu-2rpu-r-turned": 2,
}
"""Redundant constraints by the formula of Grübler and Kutzbach with these degrees of freedom; others have
none."""

SINGULAR = ("griffis-duffy",)
"""Singular at every pose."""
IDLE = ("linuxcnc-pentakins", "pentapod-5-spu", "pentapod-5-ups")
"""With a degree of freedom that no leg feels."""
REDUNDANT = ("4-rpr", "4ups-up")
"""With one actuator more than it takes."""
STARTS = {
    "3-upu-snu": {"x": 0.06, "y": 0.06, "z": 0.45},
    "lu-3spu-2rpu-r": {"alpha": 0.1, "p": -0.3, "h": 0.6, "beta": 0.8, "gamma": 0.6},
}
"""Coordinates of regular poses of those that are singular, or nearly so, at their centre pose; m and rad."""
REGULAR = tuple(name for name in KNOWN if name not in SINGULAR)


@cache
def load(name: str) -> pp.Mechanism:
    """By name; never changed."""
    return pp.load(name)


@cache
def sampled(name: str) -> tuple[Array, Array, Array]:
    """Random poses near `start` inside all limits, not nearly singular; with twists and accelerations."""
    mech, rng = load(name), np.random.default_rng([SEED, *name.encode()])
    names = mech.equations_of_motion(start(mech), np.zeros(6), "pose").coordinates
    home = mech.coordinates(start(mech), "pose")
    width = {n: REACH * (mech.characteristic_length if n in "xyz" else 1.0) for n in names}
    size = 200 * POSES

    def draw(middle: dict[str, float]) -> dict[str, Array]:
        return {n: middle.get(n, 0.0) + width[n] * rng.uniform(-1, 1, size) for n in names}

    state = mech.state(draw(home), draw({}), draw({}), guess=start(mech))
    usable = (state.status == Status.OK) & mech.limits(state.pose).within
    if name not in SINGULAR:
        usable &= mech.conditioning(state.pose).sigma_min > NEAR_SINGULAR
    chosen = np.flatnonzero(usable)[:POSES]
    assert len(chosen) == POSES
    return state.pose[chosen], state.twist[chosen], state.acceleration[chosen]


def start(mech: pp.Mechanism) -> Array:
    """Home, or a pose well away from a singular one."""
    return mech.pose(STARTS[mech.name]) if mech.name in STARTS else mech.home


# --- mobility -----------------------------------------------------------------------------------------------


def test_all_built_in_mechanisms_are_here() -> None:
    assert tuple(sorted(KNOWN)) == pp.list_mechanisms()


@pytest.mark.parametrize("name", KNOWN)
def test_mobility_is_that_of_the_literature(name: str) -> None:
    mech = load(name)
    mobility = mech.mobility()
    assert mech.name == name
    assert (mech.dof, mobility.redundant) == (KNOWN[name].dof, OVERCONSTRAINED.get(name, 0))
    assert mobility.uncontrolled == (name in SINGULAR)
    assert len(mobility.idle) == (name in IDLE)
    assert mech.actuated.sum() == mech.dof - (name in IDLE) + (name in REDUNDANT)
    assert mech.n_rows == 6 + (name in REDUNDANT)
    assert mobility.passive == sum(letters in ("SPS", "PSS") for letters in mech.leg_letters)
    assert mobility.passive == sum(letters in ("SPS", "PSS") for letters in mech.leg_letters)
    # Kutzbach: 6 (n - k - 1) + ΣM_i + ς - M_0
    terms = 6 * (mobility.links - mobility.joints - 1) + mobility.joint_freedoms
    assert terms + mobility.redundant - mobility.passive == mech.dof


# --- kinematics ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", REGULAR)
def test_forward_kinematics_returns_to_the_pose(name: str) -> None:
    mech = load(name)
    pose, *_ = sampled(name)
    lengths = mech.inverse_kinematics(pose).lengths
    # From a pose that is no solution: half way to the next one, by its coordinates.
    found = mech.forward_kinematics(lengths, beside(mech, pose))
    assert set(found.status.tolist()) == {Status.OK}
    assert apart(mech, found.pose, pose).max() < POSE
    if name in REDUNDANT:
        lengths[:, np.flatnonzero(mech.actuated)[0]] += 0.01 * mech.characteristic_length
        assert set(mech.forward_kinematics(lengths, pose).status.tolist()) == {Status.INCONSISTENT}


@pytest.mark.parametrize("name", REGULAR)
def test_the_pose_is_among_the_assembly_modes(name: str) -> None:
    mech = load(name)
    pose = sampled(name)[0][0]
    modes = mech.assembly_modes(mech.inverse_kinematics(pose).lengths)
    assert Status(int(modes.status)) is Status.OK
    distance = apart(mech, modes.pose, pose)
    assert np.sum(distance < POSE) == 1
    # Where a strut leans to the other side, the carriage that is asked for is the other of two; a leg that
    # would have to point backwards has no length.
    meant = modes.pose[~np.isin(modes.mode_status, [Status.OTHER_BRANCH, Status.BACKWARDS])]
    lengths = mech.inverse_kinematics(meant).lengths[:, mech.actuated]
    wanted = mech.inverse_kinematics(pose).lengths[mech.actuated]
    assert abs(lengths - wanted).max() < 1e-11 * max(abs(wanted).max(), mech.characteristic_length)


@pytest.mark.parametrize("name", [name for name, known in KNOWN.items() if known.complex_modes])
def test_number_of_solutions_is_that_of_the_literature(name: str) -> None:
    assert load(name)._core.complex_modes() == KNOWN[name].complex_modes


@pytest.mark.parametrize("name", KNOWN)
def test_jacobian_and_hessian_give_rates_and_accelerations(name: str) -> None:
    """Those of `kinematics`, which the twin is held against below."""
    mech = load(name)
    pose, twist, acceleration = sampled(name)
    motion = mech.kinematics(pose, twist, acceleration)
    J, H = mech.jacobian(pose), mech.hessian(pose)
    rates = np.einsum("nij,nj->ni", J, twist)
    accelerations = np.einsum("nij,nj->ni", J, acceleration) + np.einsum("nijk,nj,nk->ni", H, twist, twist)
    k, idle = int(mech.actuated.sum()), int(name in IDLE)
    for found, given in ((rates, motion.rates), (accelerations, motion.accelerations)):
        scale = abs(given).max()
        assert abs(found[:, :k] - given[:, mech.actuated]).max() < IDENTITY * scale
        assert abs(found[:, k + idle :]).max(initial=0.0) < IDENTITY * max(scale, 1.0)


def beside(mech: pp.Mechanism, pose: Array) -> Array:
    """Poses near the given ones that keep the constraints."""
    names = mech.equations_of_motion(start(mech), np.zeros(6), "pose").coordinates
    there = mech.coordinates(pose, "pose")
    aside = {n: there[n] + 0.03 * (mech.characteristic_length if n in "xyz" else 1.0) for n in names}
    return mech.pose(aside, guess=pose)


def apart(mech: pp.Mechanism, a: Array, b: Array) -> Array:
    """(...): largest difference of entries, positions by the characteristic length; of an idle line."""
    for idle in mech.mobility().idle:
        a, b = (np.concatenate([p @ [*idle.point, 1.0], p @ [*idle.axis, 0.0]], axis=-1) for p in (a, b))
        return abs(a - b).max(axis=-1) / min(1.0, mech.characteristic_length)
    scale = np.ones((4, 4))
    scale[:3, 3] = mech.characteristic_length
    return abs((a - b) / scale).max(axis=(-1, -2))


@pytest.mark.parametrize("name", ["3-upu-snu", "3-rpr"])
def test_modes_in_the_base_plane_are_their_own_images(name: str) -> None:
    """Where a platform lies in the base plane: once among the modes, as regular as the pose is."""
    mech, pose = load(name), np.eye(4)
    pose[:2, :2] = [[np.cos(0.7), -np.sin(0.7)], [np.sin(0.7), np.cos(0.7)]]
    pose[:2, 3] = 0.03, -0.05
    modes = mech.assembly_modes(mech.inverse_kinematics(pose).lengths)
    [here] = np.flatnonzero(apart(mech, modes.pose, pose) < POSE)
    assert mech.conditioning(pose).sigma_min > 0.1
    assert int(modes.multiplicity[here]) == 1
    assert abs(modes.determinant_sign[here]) == 1.0
    assert Status(int(modes.status)) is Status.OK


def test_modes_that_turn_about_the_centre() -> None:
    """Of a 3-UPU with radial axes: all of them meet there, and the platform may rotate as it likes."""
    mech, pose = load("3-upu-snu"), np.eye(4)
    pose[:3, :3] = Rotation.from_rotvec([0.4, -0.7, 0.3]).as_matrix()
    modes = mech.assembly_modes(mech.inverse_kinematics(pose).lengths)
    assert mech.conditioning(pose).sigma_min > 0.01
    assert np.sum(apart(mech, modes.pose, pose) < POSE) == 1


# --- dynamics against Pinocchio -----------------------------------------------------------------------------


@pytest.mark.parametrize("name", REGULAR)
def test_the_twin_agrees(name: str) -> None:
    """Lengths, rates, accelerations, forces and constraint wrenches, to a part in 10⁹ at every state."""
    pytest.importorskip("pinocchio")
    from polypod.verify import TOLERANCE, verify_states

    mech = load(name)
    found = verify_states(mech, *sampled(name), np.array([300.0, -200.0, -500.0, 20.0, 40.0, -30.0]))
    comparison = found.comparisons[0]
    assert TOLERANCE == 1e-9
    assert (comparison.compared, comparison.without_answer) == (POSES, {})
    assert found.agrees, {row.quantity: row.relative_max for row in comparison.rows}
    assert {"lengths", "rates", "accelerations", "forces"} <= {row.quantity for row in comparison.rows}


# --- singular ones say so -----------------------------------------------------------------------------------


def test_griffis_duffy_is_singular_everywhere() -> None:
    mech = load("griffis-duffy")
    pose, twist, acceleration = sampled("griffis-duffy")
    found = mech.singularity(pose)
    assert set(found.kind.tolist()) == {SingularityKind.ACTUATION}
    assert set(found.uncontrolled.tolist()) == {1}
    # The legs do not feel the twist that is left.
    rates = mech.kinematics(pose, found.twist, np.zeros(6)).rates
    assert abs(rates).max() < 1e-12
    dynamics = mech.inverse_dynamics(pose, twist, acceleration)
    assert set(dynamics.status.tolist()) == {Status.SINGULAR}
    assert np.isnan(dynamics.forces).all()
    assert mech.platform_twist(pose, np.zeros(6)).status.tolist() == [Status.SINGULAR] * POSES
    lengths = mech.inverse_kinematics(pose).lengths
    assert set(mech.forward_kinematics(lengths, pose).status.tolist()) == {Status.SINGULAR}
    # Only accelerations under given forces are determined: the masses see to that.
    assert set(mech.forward_dynamics(pose, twist, np.zeros(6)).status.tolist()) == {Status.OK}
    with pytest.raises(UnsupportedError, match="singular everywhere"):
        mech.assembly_modes(lengths)
    with pytest.raises(UnsupportedError, match="singular everywhere"):
        mech.base_parameters()


def test_forward_kinematics_of_griffis_duffy_names_the_singularity() -> None:
    """From a guess beside the pose: the lengths leave a curve of poses, whichever of them is found."""
    mech = load("griffis-duffy")
    pose, *_ = sampled("griffis-duffy")
    found = mech.forward_kinematics(mech.inverse_kinematics(pose).lengths, beside(mech, pose))
    assert set(found.status.tolist()) == {Status.SINGULAR}
    lengths = mech.inverse_kinematics(pose).lengths
    assert abs(mech.inverse_kinematics(found.pose).lengths - lengths).max() < 1e-12
    # Only five lengths are free.
    lengths[:, 0] += 0.01
    assert set(mech.forward_kinematics(lengths, pose).status.tolist()) == {Status.INCONSISTENT}


def test_snu_is_loose_at_its_centre() -> None:
    mech = load("3-upu-snu")
    found = mech.singularity(mech.home)
    assert SingularityKind(int(found.kind)) is SingularityKind.CONSTRAINT
    assert int(found.uncontrolled) == 2
    dynamics = mech.inverse_dynamics(mech.home, np.zeros(6), np.zeros(6))
    assert Status(int(dynamics.status)) is Status.SINGULAR
    # Off the centre it is a translational manipulator as that of Tsai.
    assert SingularityKind(int(mech.singularity(start(mech)).kind)) is SingularityKind.NONE
    assert abs(sampled("3-upu-snu")[1][:, 3:]).max() < 1e-12


@pytest.mark.parametrize(
    ("name", "text"), [("griffis-duffy", "singular by design"), ("3-upu-snu", "constraint singularity")]
)
def test_info_warns_of_singular_ones(run, name: str, text: str) -> None:
    status, out, _ = run("info", name)
    assert status == 0
    assert text in " ".join(out.split())


# --- published numbers --------------------------------------------------------------------------------------


def test_dietmaier_has_40_real_modes() -> None:
    """P. Dietmaier 1998; coordinates and lengths to six decimals."""
    mech, lengths = load("dietmaier-6-sps"), [1.0, 0.645275, 1.086284, 1.503439, 1.281933, 0.771071]
    modes = mech.assembly_modes(lengths)
    assert int(modes.number) == 40
    assert abs(mech.inverse_kinematics(modes.pose).lengths - lengths).max() < 1e-12
    apart = [abs(modes.pose[i] - modes.pose[j]).max() for i in range(40) for j in range(i)]
    assert min(apart) > 1e-3
    # Modes in pairs: as many with one sign of det J as with the other.
    assert int(modes.determinant_sign.sum()) == 0


def test_3_rpr_has_six_modes() -> None:
    """Lengths 14.98, 15.38, 12; upright modes alone, as in the plane."""
    mech = load("3-rpr")
    modes = mech.assembly_modes([0.1498, 0.1538, 0.12])
    upright = modes.pose[modes.pose[:, 2, 2] > 0.0]
    assert len(upright) == 6


def test_octahedral_example() -> None:
    """D. Rusin 1999: an eliminant of degree 16 in even powers, and a first corner with x = -2/5."""
    mech, lengths = load("octahedral-3-3"), [6.0, 12.0, 7.0, 11.0, 9.0, 13.0]
    modes = mech.assembly_modes(lengths)
    assert mech._core.complex_modes() == 16
    assert abs(modes.pose[:, 0, 3] + 2 / 5).max() < 1e-12
    heights = np.sort(modes.pose[:, 2, 3])
    assert heights == pytest.approx(-heights[::-1], abs=1e-12), "the base is a mirror"


def test_octahedral_eliminant() -> None:
    """Its printed coefficients, by a search for all complex poses with equations of its own."""
    printed = {  # power of the third corner's height: coefficient
        14: (233520143876274504789, 242177763763360000),
        12: (7255016240942576514134370463827, 34830199726657445888000000),
        10: (-6135855545804589799118335658802661631, 445826556501215307366400000000),
        8: (-815801522057339831032333444255677424613211, 365221115085795579794554880000000),
        6: (2893043016821964206280419999396021687312902961, 584353784137272927671287808000000000),
    }
    mech, lengths = load("octahedral-3-3"), np.array([6.0, 12.0, 7.0, 11.0, 9.0, 13.0])
    poses = search(mech, lengths, 600, np.random.default_rng(SEED), over=complex)
    assert len(poses) == 16
    corner = np.array(mech.geometry["legs"][4]["platform"]["point"])
    coefficients = np.poly(poses[:, 2, :3] @ corner + poses[:, 2, 3])
    for power, (numerator, denominator) in printed.items():
        assert coefficients[16 - power] == pytest.approx(numerator / denominator, rel=1e-8)


def test_griffis_duffy_lengths() -> None:
    """Six printed lengths meet in a pose, though only five are free, to the printed digits."""
    from scipy.optimize import least_squares

    mech = load("griffis-duffy")
    printed = np.array([1.519640, 1.922131, 1.812880, 1.380117, 1.715536, 1.714524])
    names = mech.coordinate_sets["pose"]

    def left(values: Array) -> Array:
        pose = mech.pose(dict(zip(names, values, strict=True)))
        return mech.inverse_kinematics(pose).lengths - printed

    rng = np.random.default_rng(SEED)
    home = np.array([mech.coordinates(mech.home, "pose")[n] for n in names])
    fits = [least_squares(left, home + 0.5 * rng.normal(size=6), xtol=1e-15, gtol=1e-15) for _ in range(20)]
    best = min(fits, key=lambda fit: fit.cost)
    assert abs(best.fun).max() < 0.5e-6
    pose = mech.pose(dict(zip(names, best.x, strict=True)))
    assert int(mech.singularity(pose).uncontrolled) == 1


def test_tsai_legs_are_equally_long_at_home() -> None:
    """Threefold symmetry, to half a millimetre of the digits in the file."""
    mech = load("tsai-6-sps")
    assert np.ptp(mech.inverse_kinematics(mech.home).lengths) < 0.5e-3


def test_smith_wendlandt_lengths() -> None:
    """The strokes of the file are three quarters and five quarters of the published leg at home, 3.1538 m."""
    mech = load("ups-hexapod")
    assert mech.inverse_kinematics(mech.home).lengths == pytest.approx(mech.stroke.mean(axis=1), abs=1e-4)


# --- what the files say -------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", KNOWN)
def test_files_are_complete(name: str) -> None:
    mech = load(name)
    facts = mech.to_dict()
    assert facts["description"]
    assert facts["source"]
    assert facts["platform"]["mass"] > 0.0
    links = {True: {"carriage", "strut"}, False: {"cylinder", "piston"}}
    assert all(links["slider" in leg] <= leg.keys() for leg in facts["legs"])
    assert bool(mech.limits(mech.home).within)
    assert "published" not in facts or name == "lu-3spu-2rpu-r"


@pytest.mark.parametrize("name", KNOWN)
def test_info_of_all(run, name: str) -> None:
    status, out, err = run("info", name, "--json")
    assert (status, err) == (0, "")
    facts = json.loads(out, parse_constant=pytest.fail)
    assert facts["mobility"]["dof"] == KNOWN[name].dof


# --- the page -----------------------------------------------------------------------------------------------


def test_the_page_has_every_mechanism_and_its_drawing() -> None:
    page = read(DOCS / "catalogue.md")
    shown = set(re.findall(r"\(images/catalogue/([\w-]+)\.png\)", page))
    kept = {path.stem for path in (DOCS / "images" / "catalogue").iterdir()}
    rows = {name: (legs, int(dof)) for name, legs, dof in re.findall(ROW, page, flags=re.MULTILINE)}
    facts = {row["name"]: (row["legs"], row["dof"]) for row in catalogue()}
    assert rows == facts
    assert kept == set(KNOWN)
    assert shown == kept - {"4sps-upu"}, "that one looks as 4ups-upu does"
    assert f"\n{len(KNOWN)}\n" in page


@pytest.mark.slow
@pytest.mark.parametrize("name", KNOWN)
def test_drawings_are_kept_up(name: str, tmp_path: Path) -> None:
    made, kept = tmp_path / f"{name}.png", DOCS / "images" / "catalogue" / f"{name}.png"
    subprocess.run([sys.executable, DOCS / "catalogue.py", name, "-o", tmp_path], check=True, timeout=120)
    grey = [np.asarray(Image.open(p).convert("L").resize((64, 64)), dtype=float) / 255 for p in (made, kept)]
    assert abs(grey[0] - grey[1]).max() < 0.15, "make gallery has not been run"


def test_the_mathworks_stage_has_the_solids_of_its_set_up_file() -> None:
    """Steel of 76 kN/m^3; tubes of 50 and 30 mm radius, rods of 30 mm, three quarters of a leg long each."""
    mech = pp.load("ups-hexapod")
    density, length = 76e3 / 9.81, 0.75 * mech.inverse_kinematics(mech.home).lengths[0]
    section = {"cylinder": (0.05**2 - 0.03**2, 0.05**2 + 0.03**2), "piston": (0.03**2, 0.03**2)}
    for leg in mech.to_dict()["legs"]:
        for link, (difference, total) in section.items():
            mass = density * length * np.pi * difference
            across = mass * (total / 4 + length**2 / 12)
            assert leg[link]["mass"] == pytest.approx(mass, rel=1e-12)
            assert leg[link]["inertia"] == pytest.approx([across, mass * total / 2, across], rel=1e-12)
