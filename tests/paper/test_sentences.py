"""The paper's sentences: every measure against an independent one, and the numbers that the page quotes."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
import trimesh
from scipy.optimize import minimize
from scipy.stats import beta

import polypod as pp
from polypod.paper.sentences.forces import coupled_share, parallel_wrench, printed_share, redundant_forces
from polypod.paper.sentences.isotropy import (
    HEIGHTS,
    horizontal_rates,
    horizontal_velocities,
    isotropy,
    level_isotropy,
)
from polypod.paper.sentences.joints import base_joints, base_reactions, narrowest_cone
from polypod.paper.sentences.judgements import MIRRORED_AT, TURNED, Judged, isotropy_markdown, judge
from polypod.paper.sentences.poses import level_poses, quantile, upright_poses
from polypod.paper.sentences.reach import (
    circle,
    interrupted,
    largest_ball,
    level_reach,
    mirror_difference,
    reach,
    reach_inside,
    sphere,
    tilts_at_home,
)
from polypod.paper.sentences.sentence import Verdict, as_markdown
from polypod.paper.sentences.smoothness import across_singularity, ends_of, steps_along, steps_of
from support import ROOT
from support.oracle import coupled_forces_of_the_notes

PAGE = ROOT / "docs" / "paper.md"
NAMES = ("lu-3spu-2rpu-r", TURNED)
REST = np.zeros(6)


@pytest.fixture(scope="module")
def of():
    mech = pp.load(NAMES[0])
    return Judged(mech, pp.load(TURNED), pp.load_motion(NAMES[0], mech), pp.workspace(mech, step=0.02))


@pytest.fixture(scope="module")
def found(of):
    return judge(of)


@pytest.fixture(scope="module")
def others():
    """Upright poses by another sampling, of each mechanism: a larger box, own conditions, other seeds."""
    return {
        name: independent_poses(pp.load(name), 1000, seed) for name, seed in zip(NAMES, (31, 32), strict=True)
    }


def points(mech):
    """Base and platform points (5, 3) of the legs, m."""
    legs = mech.geometry["legs"]
    return tuple(np.array([leg[end]["point"] for leg in legs]) for end in ("base", "platform"))


def lengths_of(mech, pose):
    """Leg vectors (..., 5, 3) and lengths (..., 5) from the points alone."""
    base, platform = points(mech)
    r = np.einsum("...ij,kj->...ki", pose[..., :3, :3], platform) + pose[..., None, :3, 3] - base
    return r, np.linalg.norm(r, axis=-1)


def inside(mech, pose):
    """Whether the strokes allow a pose, from the points alone."""
    _, lengths = lengths_of(mech, pose)
    return np.all((lengths >= 0.65) & (lengths <= 0.85), axis=-1)


def independent_poses(mech, count, seed):
    """Uniform in natural coordinates over a box that holds more than it must; conditions from points."""
    rng, found = np.random.default_rng(seed), []
    while sum(map(len, found)) < count:
        low, high = [-np.pi / 2, -0.86, -0.1, -1.8, -np.pi], [np.pi / 2, 0.86, 0.9, 1.8, np.pi]
        q = rng.uniform(low, high, (400_000, 5))
        pose = mech.pose(dict(zip(("alpha", "p", "h", "beta", "gamma"), q.T, strict=True)))
        r, _ = lengths_of(mech, pose)
        upright = (r[..., 2] > 0) & (np.einsum("nki,ni->nk", r, pose[:, :3, 2]) > 0)
        turn = np.arccos(np.clip((np.trace(pose[:, :3, :3], axis1=1, axis2=2) - 1) / 2, -1, 1))
        found.append(pose[upright.all(axis=-1) & (turn < np.pi / 2) & inside(mech, pose)])
    return np.concatenate(found)


def agree(first, second, share):
    """Whether the quantiles of two samples agree within their own errors, added."""
    a, b = quantile(first, share), quantile(second, share)
    widths = np.hypot(a.high - a.low, b.high - b.low)
    return abs(a.value - b.value) < widths  # 4 standard errors of the difference


# --- poses --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", NAMES)
def test_upright_poses_are_inside_and_spread_as_those_of_another_sampling(name, others):
    mech = pp.load(name)
    poses = upright_poses(mech)
    assert poses.shape == (4000, 4, 4)
    assert inside(mech, poses).all()
    r, _ = lengths_of(mech, poses)
    assert (r[..., 2] > 0).all()
    assert (np.einsum("nki,ni->nk", r, poses[:, :3, 2]) > 0).all()
    assert (np.trace(poses[:, :3, :3], axis1=1, axis2=2) > 1).all()
    for row, column in ((0, 3), (1, 3), (2, 3), (0, 2), (1, 2), (2, 2), (0, 0), (1, 0)):
        for share in (0.05, 0.25, 0.5, 0.75, 0.95):
            assert agree(poses[:, row, column], others[name][:, row, column], share), (row, column, share)


def test_seeds_count_and_repeat():
    mech = pp.load(NAMES[0])
    np.testing.assert_array_equal(upright_poses(mech, 50), upright_poses(mech, 4000)[:50])
    assert not np.array_equal(upright_poses(mech, 50, seed=2), upright_poses(mech, 50))


@pytest.mark.parametrize("name", ["3-rps", "tsai-6-sps"])
def test_mechanisms_without_natural_coordinates_are_refused(name):
    with pytest.raises(pp.UnsupportedError, match="natural coordinates"):
        upright_poses(pp.load(name), 10)


@pytest.mark.parametrize("share", [0.05, 0.5, 0.95])
def test_the_interval_of_a_quantile_holds_it_as_often_as_it_says(share):
    rng = np.random.default_rng(5)
    held = [q.low <= share <= q.high for q in (quantile(rng.uniform(size=800), share) for _ in range(2000))]
    # Between two order statistics lies the quantile with a probability that the beta distribution knows.
    order = np.clip(
        np.round(800 * share + 1.96 * np.sqrt(800 * share * (1 - share)) * np.array([-1, 1])), 0, 799
    )
    exact = beta.sf(share, order[1] + 1, 800 - order[1]) - beta.sf(share, order[0] + 1, 800 - order[0])
    assert np.mean(held) == pytest.approx(exact, abs=4 * np.sqrt(exact * (1 - exact) / 2000))
    assert exact == pytest.approx(0.95, abs=0.015)


# --- isotropy -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", NAMES)
def test_horizontal_velocities_are_difference_quotients_of_forward_kinematics(name, of):
    """Each leg made longer and shorter: where o goes."""
    mech = pp.load(name)
    poses = upright_poses(mech, 300)
    poses = poses[mech.conditioning(poses).sigma_min > 0.02][:40]
    assert len(poses) == 40
    h = 2e-7
    moved = [
        mech.forward_kinematics(
            lengths_of(mech, poses)[1][:, None] + sign * h * np.eye(5), poses[:, None]
        ).pose
        for sign in (1, -1)
    ]
    quotients = np.swapaxes((moved[0] - moved[1])[..., :2, 3], -1, -2) / (2 * h)
    matrix = horizontal_velocities(mech, poses)
    np.testing.assert_allclose(matrix, quotients, atol=1e-6 * np.abs(quotients).max())
    # The ratio from the greatest and least speed over directions of the leg rates' ellipse, seen all round.
    angle = np.linspace(0, np.pi, 20_001)
    reached = np.linalg.norm(np.stack([np.cos(angle), np.sin(angle)], -1) @ quotients, axis=-1)
    np.testing.assert_allclose(isotropy(matrix), reached.min(-1) / reached.max(-1), rtol=1e-4)


@pytest.mark.parametrize("name", NAMES)
def test_horizontal_velocities_are_the_leg_forces_of_a_horizontal_force(name):
    mech = pp.load(name)
    poses = upright_poses(mech, 50)
    free = mech.inverse_dynamics(poses, REST, REST, wrench=REST).forces
    for axis in range(2):
        held = mech.inverse_dynamics(poses, REST, REST, wrench=np.eye(6)[axis]).forces
        expected = -horizontal_velocities(mech, poses)[:, axis]
        np.testing.assert_allclose(held - free, expected, atol=1e-6 * np.abs(free).max())


@pytest.mark.parametrize("name", NAMES)
def test_horizontal_rates_are_difference_quotients_of_distances(name):
    mech = pp.load(name)
    poses = level_poses(mech, 0.7, 0.1)
    quotients = []
    for axis in range(2):
        ends = []
        for sign in (1, -1):
            there = poses.copy()
            there[:, axis, 3] += sign * 1e-5
            ends.append(lengths_of(mech, there)[1])
        quotients.append((ends[0] - ends[1]) / 2e-5)
    np.testing.assert_allclose(horizontal_rates(mech, poses), np.stack(quotients, -1), atol=1e-9)


def test_isotropy_of_known_matrices():
    turn = np.array([[0.6, -0.8], [0.8, 0.6]])
    matrices = np.stack([turn @ np.diag([3.0, 1.5]), np.eye(2), np.full((2, 2), np.nan)])
    np.testing.assert_allclose(isotropy(matrices), [0.5, 1.0, np.nan], rtol=1e-14)


@pytest.mark.parametrize("name", NAMES)
def test_level_poses_fill_what_the_strokes_allow(name):
    mech = pp.load(name)
    line = 0.05 * np.arange(-30, 31)
    everywhere = np.broadcast_to(np.eye(4), (61, 61, 4, 4)).copy()
    everywhere[..., 0, 3], everywhere[..., 1, 3], everywhere[..., 2, 3] = *np.meshgrid(line, line), 0.65
    expected = {(round(x, 6), round(y, 6)) for x, y in everywhere[inside(mech, everywhere)][:, :2, 3]}
    assert {(round(x, 6), round(y, 6)) for x, y in level_poses(mech, 0.65, 0.05)[:, :2, 3]} == expected


def test_isotropy_where_the_page_says(of):
    """Near the axis and away from it; the slow direction; level poses are nearly singular."""
    text = PAGE.read_text(encoding="utf-8")
    slow, kept, away = [], [], []
    for mech in (of.mech, of.turned):
        levels = [level_isotropy(mech, height) for height in HEIGHTS]
        pose = np.concatenate([level.pose for level in levels])
        kept.append(np.concatenate([level.kept_level for level in levels]))
        away.append(np.linalg.norm(pose[:, :2, 3], axis=-1))
        slow.append(np.linalg.svd(horizontal_velocities(mech, pose), compute_uv=False)[:, 1])
    free = np.concatenate([level_isotropy(of.mech, height).free for height in HEIGHTS])
    best = np.argmax(kept[1])
    assert away[1][best] > 0.1
    for quoted in (
        f"at least {kept[0][away[0] < 0.06].min():.2f} within 60 mm of the Z axis",
        f"at most {kept[0][away[0] > 0.2].max():.2f} more than 200 mm away",
        f"its best, {kept[1].max():.2f}, off the axis",
        f"at most {free.max():.2f}, and the ratio hides",
        f"{slow[0].min():.0f} to {slow[0].max():.0f} in the slow direction",
        f"at {slow[1].min():.1f} to {slow[1].max():.1f}.",
    ):
        assert quoted in text, quoted


# --- workspace ----------------------------------------------------------------------------------------------


def test_reach_inside_a_cube_and_a_ball():
    directions = np.concatenate([sphere(), circle(), np.eye(3), -np.eye(3), [[0.6, 0.8, 0.0]]])
    cube = trimesh.creation.box((2.0, 2.0, 2.0))
    origin = np.array([0.2, -0.1, 0.3])
    with np.errstate(divide="ignore"):
        expected = np.min(
            np.where(directions == 0, np.inf, (np.sign(directions) - origin) / directions), axis=-1
        )
    np.testing.assert_allclose(
        reach_inside(cube.vertices, cube.faces, origin, directions), expected, rtol=1e-12
    )
    ball = trimesh.creation.icosphere(5, 0.7)
    found = reach_inside(
        ball.vertices, ball.faces, np.zeros(3), np.concatenate([directions, ball.vertices[:50] / 0.7])
    )
    np.testing.assert_allclose(found, 0.7, rtol=1e-3)
    np.testing.assert_allclose(found[-50:], 0.7, rtol=1e-12)  # through corners


def test_rays_from_outside_meet_a_cube_or_miss_it():
    cube = trimesh.creation.box((2.0, 2.0, 2.0))
    directions, origin = sphere(2000), np.array([0.3, 0.2, 3.0])
    down = directions[:, 2] < 0
    with np.errstate(divide="ignore", invalid="ignore"):
        slabs = (np.array([[-1.0], [1.0]])[..., None] - origin) / directions
    near, far = slabs.min(axis=0).max(axis=-1), slabs.max(axis=0).min(axis=-1)
    expected = np.where(down & (near < far), near, np.inf)
    assert 0.01 < np.mean(np.isfinite(expected)) < 0.2
    np.testing.assert_allclose(
        reach_inside(cube.vertices, cube.faces, origin, directions), expected, rtol=1e-12
    )


def test_directions_are_even():
    directions = sphere()
    np.testing.assert_allclose(np.linalg.norm(directions, axis=-1), 1.0, rtol=1e-14)
    np.testing.assert_allclose(directions.T @ directions / len(directions), np.eye(3) / 3, atol=1e-3)
    apart = np.sort(directions @ directions.T, axis=-1)[:, -2]
    assert np.ptp(np.degrees(np.arccos(apart))) < 2.5


def test_the_first_boundary_counts():
    """Of two balls, one in the other, the inner one."""
    inner, outer = trimesh.creation.icosphere(4, 0.3), trimesh.creation.icosphere(4, 0.9)
    both = trimesh.util.concatenate([outer, inner])
    np.testing.assert_allclose(
        reach_inside(both.vertices, both.faces, np.zeros(3), sphere(40)), 0.3, rtol=3e-3
    )


def test_largest_ball_and_interruptions_of_a_known_shape():
    axes = tuple(np.linspace(-1, 1, 101) for _ in range(3))
    x, y, z = np.meshgrid(*axes, indexing="ij")
    mask = ((x - 0.2) ** 2 + y**2 + z**2 < 0.5**2) | ((np.abs(x + 0.7) < 0.1) & (np.abs(y) < 0.1))
    centre, radius = largest_ball(SimpleNamespace(axes=axes, mask=mask))
    np.testing.assert_allclose(centre, [0.2, 0, 0], atol=0.02)
    assert radius == pytest.approx(0.5, abs=0.03)
    assert interrupted(SimpleNamespace(axes=axes, mask=mask)) == 0.0
    mask[20:30, 50, 40:45] = False  # some of the lines of the bar
    lines = mask.any(axis=-1).sum()
    broken = (mask[20:30, 50].any(axis=-1) & (np.abs(axes[0][20:30] + 0.7) < 0.1)).sum()
    workspace = SimpleNamespace(axes=axes, mask=mask)
    assert interrupted(workspace) == pytest.approx(broken / lines) != 0.0
    assert interrupted(workspace, 0.0) == 0.0


@pytest.mark.parametrize("name", NAMES)
def test_level_reach_ends_on_the_first_stroke(name):
    mech = pp.load(name)
    directions = np.concatenate([circle(12), sphere(30)])
    distance = level_reach(mech, directions)
    way = distance[:, None] * np.linspace(0.0, 1.0, 300)
    pose = np.broadcast_to(mech.home, (*way.shape, 4, 4)).copy()
    pose[..., :3, 3] += way[..., None] * directions[:, None]
    assert inside(mech, pose[:, :-1]).all()
    lengths = lengths_of(mech, pose[:, -1])[1]
    np.testing.assert_allclose(
        np.minimum(np.abs(lengths - 0.65), np.abs(lengths - 0.85)).min(axis=-1), 0, atol=1e-9
    )
    beyond = pose[:, -1].copy()
    beyond[:, :3, 3] += 1e-6 * directions
    assert not inside(mech, beyond).any()


def at_position(mech, position, step=1.0):
    """Poses (N, 4, 4) inside the strokes with o at a position, all over α and β in steps of degrees."""
    angles = np.radians(np.arange(-180.0, 180.0, step))
    alpha, by = np.meshgrid(angles, angles, indexing="ij")
    place = dict(zip("xyz", position, strict=True))
    poses = [mech.pose({**place, "alpha": alpha, "beta": by}, branch=branch) for branch in (1, -1)]
    poses = np.concatenate([pose.reshape(-1, 4, 4) for pose in poses])
    return poses[inside(mech, poses)]


def test_tilts_at_the_centre_pose_against_a_grid_of_orientations(of):
    """Upright ones over β and γ, with the α of Eq. 5; the azimuth is that of the horizontal part of z."""
    least, greatest = np.degrees(tilts_at_home(of.mech))
    o = of.mech.home[:3, 3]
    on_rod, e = 0.27 * np.sin(np.radians(18)), 0.15 * np.sin(np.radians(18))
    by, gamma = np.meshgrid(*[np.radians(np.arange(-85.0, 85.0, 0.2))] * 2, indexing="ij")
    across = o[1] - on_rod  # (y - E_1 s) cos α + z sin α = -e s cos γ
    alpha = np.arcsin(-e * np.cos(gamma) / np.hypot(across, o[2])) - np.arctan2(across, o[2])
    poses = np.broadcast_to(of.mech.home, (*by.shape, 4, 4)).copy()
    poses[..., :3, :3] = about(0, alpha) @ about(1, by) @ about(0, gamma)
    upright = np.trace(poses[..., :3, :3], axis1=-2, axis2=-1) > 1
    poses = poses[inside(of.mech, poses) & upright]
    tilt = np.degrees(np.arccos(poses[:, 2, 2]))
    azimuth = np.degrees(np.arctan2(poses[:, 1, 2], poses[:, 0, 2]))
    most = [tilt[np.abs((azimuth - at + 180) % 360 - 180) < 1.0].max() for at in range(-180, 180, 2)]
    assert max(most) == pytest.approx(greatest, abs=0.5)
    assert min(most) == pytest.approx(least, abs=0.5)


def about(axis, angle):
    """Rotations (..., 3, 3) about X (0) or Y (1)."""
    c, s, n, e = np.cos(angle), np.sin(angle), np.zeros_like(angle), np.ones_like(angle)
    rows = [[e, n, n], [n, c, -s], [n, s, c]] if axis == 0 else [[c, n, s], [n, e, n], [-s, n, c]]
    return np.moveaxis(np.array(rows), (0, 1), (-2, -1))


def test_w_is_the_mirror_image_in_oyz_alone(of):
    """A position that is reached, whose mirror image in OXZ no orientation reaches; in OYZ all are."""
    mirror = np.diag([-1.0, 1.0, 1.0])
    image = of.poses.copy()
    image[:, :3, :3] = mirror @ of.poses[:, :3, :3] @ mirror
    image[:, :3, 3] = of.poses[:, :3, 3] @ mirror
    lengths = of.mech.inverse_kinematics(image).lengths
    np.testing.assert_allclose(lengths, lengths_of(of.mech, of.poses)[1][:, [2, 1, 0, 4, 3]], atol=1e-12)
    in_oyz, in_oxz = mirror_difference(of.workspace, MIRRORED_AT)
    assert in_oyz < 0.002 < 0.01 < in_oxz
    axis = np.array([0.0, 0.0, MIRRORED_AT])
    far = reach(of.workspace, axis, circle())
    direction = int(np.argmax(far - far[-np.arange(len(far)) % len(far)]))
    place = axis + (far[direction] - 0.002) * circle()[direction]
    assert len(at_position(of.mech, place, 0.5))
    assert not len(at_position(of.mech, place * [1, -1, 1], 0.5))


# --- joints -------------------------------------------------------------------------------------------------


def test_narrowest_cone_of_known_vectors():
    axis = np.array([2.0, -1.0, 2.0]) / 3
    side = np.cross(axis, [0.0, 0.0, 1.0])
    side /= np.linalg.norm(side)
    angle = np.linspace(0, 2 * np.pi, 7)[:-1, None]
    ring = np.cos(angle) * side + np.sin(angle) * np.cross(axis, side)
    rng = np.random.default_rng(3)
    within = np.cos(0.9) * axis + np.sin(0.9) * ring
    found, half = narrowest_cone(np.concatenate([within, axis + 0.2 * rng.uniform(-0.5, 0.5, (50, 3))]))
    np.testing.assert_allclose(found, axis, atol=1e-12)
    assert half == pytest.approx(0.9, abs=1e-12)


def test_narrowest_cone_is_the_least_of_a_search():
    """The greatest t with a·δ ≥ t and |a| ≤ 1, found by a solver of constrained problems."""
    rng = np.random.default_rng(4)
    for _ in range(5):
        directions = rng.normal(size=(60, 3)) * [0.5, 0.8, 0.2] + [0.2, 0.1, 1.0]
        directions /= np.linalg.norm(directions, axis=-1, keepdims=True)
        axis, half = narrowest_cone(directions)
        assert np.arccos((directions @ axis).min()) == pytest.approx(half, abs=1e-12)
        search = minimize(
            lambda x: -x[3],
            [0.0, 0.0, 0.9, 0.0],
            constraints=[
                {"type": "ineq", "fun": lambda x, d=directions: d @ x[:3] - x[3]},
                {"type": "ineq", "fun": lambda x: 1 - x[:3] @ x[:3]},
            ],
            options={"ftol": 1e-14, "maxiter": 500},
        )
        assert half == pytest.approx(np.arccos(search.x[3]), abs=1e-6)


def test_base_joints_against_their_geometry(of):
    """Rotation of an R joint: of the leg in its plane with the rod, off the rod's normal, less home's."""
    found = base_joints(of.mech, of.poses)
    assert found.kinds == ("R", "S", "R", "S", "S")
    r, lengths = lengths_of(of.mech, np.concatenate([of.mech.home[None], of.poses]))
    inclined = np.arcsin(r[..., 0] / lengths)
    for leg in (0, 2):
        turned = inclined[1:, leg] - inclined[0, leg]
        got = found.rotation[leg]
        assert np.allclose(got, [turned.min(), turned.max()]) or np.allclose(
            got, [-turned.max(), -turned.min()]
        )
    assert np.isnan(found.rotation[[1, 3, 4]]).all()
    delta = r[1:] / lengths[1:, :, None]
    for leg in range(5):
        assert found.off_axis[:, leg].max() == pytest.approx(found.cone[leg], abs=1e-6)
        centre = delta[:, leg].mean(axis=0)
        assert found.cone[leg] < np.arccos((delta[:, leg] @ centre / np.linalg.norm(centre)).min())


def test_pull_is_the_active_force_less_the_weight_of_the_leg(of):
    """At rest, but for the 5 kg of a leg; an R joint bears a couple, an S joint none."""
    rest = np.zeros((len(of.poses), 6))
    pull, couple = base_reactions(of.mech, of.poses, rest, rest)
    forces = of.mech.inverse_dynamics(of.poses, REST, REST).forces
    np.testing.assert_allclose(pull, -forces, atol=50.0)
    assert np.all(couple[:, [1, 3, 4]] < 1e-6)
    assert np.all(couple[:, [0, 2]].max(axis=0) > 1e3)


# --- smoothness ---------------------------------------------------------------------------------------------


def test_steps_of_known_series():
    time = [np.linspace(0, 1, n + 1) for n in (800, 1600)]
    smooth, jump, corner = (
        [f(t) for t in time]
        for f in (lambda t: np.sin(7 * t), lambda t: t + (t > 0.3), lambda t: np.abs(t - 0.3))
    )
    assert steps_of(*smooth).ratio == pytest.approx(2.0, abs=1e-3)
    assert steps_of(*corner).ratio == pytest.approx(2.0, abs=1e-9)
    assert steps_of(*jump).ratio == pytest.approx(1.0, abs=1e-3)
    both = [np.stack(pair, axis=-1) for pair in zip(smooth, jump, strict=True)]
    assert steps_of(*both).ratio == pytest.approx(1.0, abs=1e-3)
    assert steps_of(*smooth).coarse == pytest.approx(7 / 800 / 2, rel=1e-3)


def test_steps_along_the_motion_and_where_the_motion_jumps(of):
    steps = steps_along(of.mech, of.motion)
    assert min(step.ratio for step in steps.values()) > 1.95
    samples = np.linspace(0.0, 8.0, 17)  # a motion of other pieces: its second rates jump
    broken = of.motion.sample(samples)
    curve = piecewise_cubic(samples, broken)
    jumping = pp.Motion.along(curve, of.motion.time, tuple(broken.coordinates), name="jumping", set="paper")
    steps = steps_along(of.mech, jumping)
    assert steps["length"].ratio > 1.95
    assert steps["rate"].ratio > 1.95
    assert steps["leg_acceleration"].ratio < 1.1


def piecewise_cubic(time, motion):
    from scipy.interpolate import CubicHermiteSpline

    values, rates = (np.stack([*of.values()], axis=-1) for of in (motion.coordinates, motion.rates))
    return CubicHermiteSpline(time, values, rates)


def test_ends_of_a_whole_motion_and_of_a_part(of):
    whole = ends_of(of.mech, of.motion)
    assert max(whole.rates, whole.accelerations, whole.forces) < 1e-12
    part = ends_of(of.mech, of.motion.sample(np.linspace(1.0, 3.0, 101)))
    assert min(part.rates, part.accelerations) > 0.1
    assert part.forces > 1e-3


def test_forces_have_a_pole_at_a_singularity(of):
    pole = across_singularity(of.mech, of.state.pose[0], of.poses)
    np.testing.assert_allclose(
        pole.forces[1:] / pole.forces[:-1], pole.before[:-1] / pole.before[1:], rtol=0.01
    )
    with pytest.raises(pp.UnsupportedError, match="crosses a singularity"):
        across_singularity(of.mech, of.state.pose[0], of.state.pose)


# --- forces -------------------------------------------------------------------------------------------------


def share_by_the_notes(mech, poses):
    """The same ratio with the forces of the rod's balance in the oracle."""
    answer = mech.inverse_dynamics(poses, REST, REST)
    r, _ = lengths_of(mech, poses)
    platform = points(mech)[1]
    l = poses[:, :3, :3] @ (platform[0] - platform[2])
    coupled = [
        coupled_forces_of_the_notes(r[k, 0], r[k, 2], l[k], answer.constraint[k, 0])[0]
        for k in range(len(poses))
    ]
    return np.abs(coupled).max(axis=-1) / np.abs(answer.forces).max(axis=-1)


@pytest.mark.parametrize("name", NAMES)
def test_coupled_share_by_another_sampling_and_the_oracle(name, others):
    mech = pp.load(name)
    share = coupled_share(mech, upright_poses(mech))
    other = share_by_the_notes(mech, others[name])
    np.testing.assert_allclose(coupled_share(mech, others[name]), other, rtol=1e-7)
    for part in (0.05, 0.5, 0.95):
        assert agree(share, other, part)
    assert max(share.max(), other.max()) > 1.0


def test_near_singular_shares_by_another_sampling(of, others):
    for name, (mech, poses) in zip(NAMES, of.both, strict=True):
        near = [np.mean(mech.conditioning(p).sigma_min < 0.01) for p in (poses, others[name])]
        error = np.sqrt(sum(s * (1 - s) / len(p) for s, p in zip(near, (poses, others[name]), strict=True)))
        assert abs(near[0] - near[1]) < 4 * error
    level = np.concatenate([level_poses(of.mech, height, 0.05) for height in HEIGHTS])
    assert of.mech.conditioning(level).sigma_min.max() < 0.01


def test_redundant_forces_are_open_in_legs_1_and_3_alone(of):
    found = redundant_forces(of.mech, *of.moving)
    assert found.redundant == 2
    assert found.active_determined
    assert {name[-1] for name in found.open_joints} == {"1", "3"}
    assert found.without_couples.max() > 3 * found.least.max() > 0


def test_what_other_verdicts_stand_on(of):
    ratio = printed_share(of.mech, *of.moving)
    assert 4 < ratio.min() < ratio.max() < 6
    force, torque = parallel_wrench(of.mech, level_poses(of.mech, 0.7, 0.1))
    assert max(force.max(), torque.max()) < 1e-12
    force, torque = parallel_wrench(of.mech, of.poses)
    assert (
        min(np.median(force), np.median(torque)) > 0.1
    )  # elsewhere it has a force, and is not perpendicular


# --- the table ----------------------------------------------------------------------------------------------


def test_the_page_quotes_the_computed_table(of, found):
    text = PAGE.read_text(encoding="utf-8")
    for line in (*as_markdown(found).split("\n"), *isotropy_markdown(of).split("\n")):
        assert line in text, line


def test_every_sentence_has_a_verdict_and_few_words(found):
    assert len(found) >= 12
    assert {sentence.verdict for sentence in found} == {*Verdict}
    for sentence in found:
        assert len(sentence.words.split()) <= 8
        assert sentence.reason
        assert all("nan" not in number and "inf" not in number for _, number in sentence.findings)
        assert sentence.findings or sentence.verdict is Verdict.OPEN


@pytest.mark.slow
def test_quantiles_of_ten_times_as_many_poses(of):
    many = upright_poses(of.mech, 40_000, seed=9)
    share, few = coupled_share(of.mech, many), coupled_share(of.mech, of.poses)
    for part in (0.05, 0.5, 0.95):
        assert agree(share, few, part)
    for of_pose in (
        lambda p: isotropy(horizontal_velocities(of.mech, p)),
        lambda p: of.mech.conditioning(p).sigma_min,
    ):
        for part in (0.05, 0.5, 0.95):
            assert agree(of_pose(many), of_pose(of.poses), part)
