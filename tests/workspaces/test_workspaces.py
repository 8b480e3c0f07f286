"""Workspaces: exactness of boundaries, closed forms, volumes and their errors, meshes, files, wrong calls."""

from __future__ import annotations

import hashlib
import itertools

import numpy as np
import pytest
import trimesh
from scipy import ndimage

import polypod as pp
from polypod.paper.section4 import PRINTED, section4
from polypod.workspaces.boundary import Cuts, coarsened, content, content_with_error, open_edges, surface
from polypod.workspaces.causes import EDGE_OF_GRID, NO_POSE, SINGULARITY
from support import DATA

NAME = "lu-3spu-2rpu-r"

EXACT = 1e-9
"""By how much, in its own unit, a limit may be missed at a vertex of the boundary."""

UPRIGHT = {"rx": 0.0, "ry": 0.0, "rz": 0.0}


@pytest.fixture(scope="module")
def lu():
    return pp.load(NAME)


@pytest.fixture(scope="module")
def hexapod():
    return pp.load(DATA / "stewart-gough.toml")


@pytest.fixture(scope="module")
def reachable(lu):
    return pp.workspace(lu, step=0.04)


@pytest.fixture(scope="module")
def aspect(lu):
    return pp.workspace(lu, step=0.05, keep_aspect=True)


@pytest.fixture(scope="module")
def upright(hexapod):
    return pp.workspace(hexapod, ["x", "y", "z"], UPRIGHT, step=0.02)


def digest(workspace) -> str:
    parts = (workspace.mask, workspace.vertices, workspace.faces, workspace.labels, workspace.poses)
    return hashlib.sha256(b"".join(part.tobytes() for part in parts)).hexdigest()


# --- meshes -------------------------------------------------------------------------------------------------


def ball(cells: int, dimensions: int) -> tuple[np.ndarray, Cuts, float]:
    """A ball of radius 1 about a point off the grid, with its exact cuts, and the width of a cell."""
    width = 2.3 / cells
    axis = -1.15 + width * (np.arange(cells) + 0.5)
    middle = np.array([0.013, -0.021, 0.017])[:dimensions]
    places = np.stack(np.meshgrid(*[axis] * dimensions, indexing="ij"), axis=-1) - middle
    mask = np.linalg.norm(places, axis=-1) < 1.0
    node, direction = open_edges(mask)
    from_middle = places.reshape(-1, dimensions)[node]
    along = from_middle[np.arange(len(node)), direction // 2] * (2 * (direction % 2) - 1)
    length = -along + np.sqrt(along**2 + 1.0 - np.sum(from_middle**2, axis=1))
    return mask, Cuts(node, direction, length / width), width


@pytest.mark.parametrize(("dimensions", "exact"), [(2, np.pi), (3, 4 / 3 * np.pi)])
def test_a_ball_has_its_volume_up_to_an_error_that_falls_with_the_square_of_the_step(dimensions, exact):
    off, estimate = [], []
    for cells in (16, 32, 64):
        mask, cuts, width = ball(cells, dimensions)
        found, error = content_with_error(mask, cuts, surface(mask, cuts))
        off.append(abs(width**dimensions * found - exact))
        estimate.append(width**dimensions * error)
    assert all(o <= e for o, e in zip(off, estimate, strict=True))
    for series in (off, estimate):
        assert 3.0 < series[0] / series[1] < 5.0
        assert 3.0 < series[1] / series[2] < 5.0


def test_a_coarsened_grid_is_the_coarse_grid():
    """The cuts of the coarse grid are those that it would find itself."""
    mask, cuts, _ = ball(33, 3)
    coarse, found = coarsened(mask, cuts)
    middle = np.array([0.013, -0.021, 0.017])
    width = 2.3 / 33
    place = np.stack(np.unravel_index(found.node, coarse.shape), axis=1).astype(float)
    place[np.arange(len(place)), found.direction // 2] += (2 * (found.direction % 2) - 1) * found.share
    points = -1.15 + width * (2 * place + 0.5) - middle
    assert np.abs(np.linalg.norm(points, axis=1) - 1.0).max() < 1e-12


@pytest.mark.parametrize("dimensions", [2, 3])
def test_any_mask_has_a_closed_boundary(dimensions):
    rng = np.random.default_rng(0)
    for _ in range(40):
        mask = rng.random((6, 7, 8)[:dimensions]) < rng.random()
        if not mask.any():
            continue
        node, direction = open_edges(mask)
        shape = surface(mask, Cuts(node, direction, rng.random(len(node))))
        assert sorted(shape.cut) == list(range(len(node)))  # every cut is one vertex
        assert content(shape) > 0.0
        if dimensions == 2:
            assert (np.bincount(shape.faces.ravel()) == 2).all()
        else:
            mesh = trimesh.Trimesh(shape.places, shape.faces, process=False)
            assert mesh.is_watertight
            assert mesh.is_winding_consistent


def test_a_mask_with_an_open_edge_without_cut_is_refused():
    mask, cuts, _ = ball(8, 3)
    with pytest.raises(ValueError, match="without a cut"):
        surface(mask, Cuts(*(part[1:] for part in cuts)))


# --- the boundary is exact ----------------------------------------------------------------------------------


def check_boundary(mech, workspace) -> None:
    """Every vertex keeps all limits and stands on the one that its label names."""
    poses = workspace.poses
    assert np.array_equal(poses[:, :3, 3], workspace.vertices) or np.allclose(
        poses[:, :3, 3], workspace.vertices, rtol=0, atol=1e-12
    )
    rotation = poses[:, :3, :3]
    assert np.abs(rotation @ rotation.transpose(0, 2, 1) - np.eye(3)).max() < 1e-12
    names = [workspace.label_names[i] for i in workspace.labels]
    # Where a leg lies along the axis of its joint, as it does when it reaches out, poses have no answer.
    limits = mech.limits(poses)
    known = limits.status != pp.Status.SINGULAR
    assert known.mean() > 0.5
    assert limits.margins[known].min() >= -EXACT
    for i, name in enumerate(limits.names):
        on = known & np.array([n == name for n in names])
        assert np.abs(limits.margins[on, i]).max(initial=0.0) < EXACT, name
    # All lengths again, straight from the points, each against its own bound.
    bounds = {}
    for i, leg in enumerate(mech.geometry["legs"]):
        tip = poses[:, :3, 3] + poses[:, :3, :3] @ np.array(leg["platform"]["point"])
        length = np.linalg.norm(tip - np.array(leg["base"]["point"]), axis=1)
        bounds[f"stroke min of leg {leg['name']}"] = length - mech.stroke[i, 0]
        bounds[f"stroke max of leg {leg['name']}"] = mech.stroke[i, 1] - length
    assert min(slack.min() for slack in bounds.values()) > -EXACT
    for name, slack in bounds.items():
        assert np.abs(slack[[n == name for n in names]]).max(initial=0.0) < EXACT, name


def test_every_vertex_of_the_reachable_workspace_lies_on_a_limit(lu, reachable):
    check_boundary(lu, reachable)
    assert reachable.shares.get(NO_POSE, 0.0) < 1e-3
    assert reachable.shares.get(SINGULARITY, 0.0) == 0.0
    assert reachable.poses.shape == (len(reachable.vertices), 4, 4)
    # Only the base plane cuts it off.
    at_edge = reachable.vertices[reachable.labels == reachable.label_names.index(EDGE_OF_GRID)]
    assert np.abs(at_edge[:, 2]).max() < 1e-12


def test_within_one_aspect_it_ends_at_limits_and_singularities(lu, aspect):
    check_boundary(lu, aspect)
    singular = aspect.labels == aspect.label_names.index(SINGULARITY)
    assert 0.0 < singular.mean() < 0.1
    sign = np.sign(lu.determinant(aspect.poses).determinant)
    start = np.sign(lu.determinant(aspect.inputs["start"]).determinant)
    assert (sign != -start).all()  # zero up to rounding at some singular ones
    # At a singularity it is a small part of what it is elsewhere.
    determinant = np.abs(lu.determinant(aspect.poses).determinant)
    assert np.median(determinant[singular]) < 0.02 * np.median(determinant[~singular])


def test_an_aspect_is_a_part(lu, aspect):
    whole = pp.workspace(lu, step=0.05, start=np.array(aspect.inputs["start"]))
    # Neighbours lead to other rotations when singularities stop none: some places are found by one way only.
    assert (aspect.mask & ~whole.mask).sum() <= 0.02 * aspect.mask.sum()
    assert aspect.volume < whole.volume


def coned(hexapod):
    """The hexapod with cones at its platform joints that bind."""
    data = hexapod.to_dict()
    for leg in data["legs"]:
        leg["platform"]["cone"] = {"angle": 25.0}
    return pp.Mechanism.from_dict(data)


@pytest.mark.parametrize(("kind", "step"), [("lu", 0.04), ("hexapod", 0.06), ("coned", 0.06)])
def test_both_ways_agree_within_the_coarser_step(lu, hexapod, aspect, kind, step):
    """Positions and leg lengths in one aspect: the same extents up to the step of positions or of lengths."""
    mech = {"lu": lu, "hexapod": hexapod}.get(kind) or coned(hexapod)
    flood = aspect if kind == "lu" else pp.workspace(mech, step=0.03, keep_aspect=True)
    lattice = pp.length_lattice(mech, step=step, start=np.array(flood.inputs["start"]))
    coarser = max(step, flood.inputs["step"]["x"])
    assert np.abs(lattice.extents - flood.extents).max() < coarser
    assert (lattice.at_limits > 0) == (kind != "hexapod")  # cones, or the base plane
    assert (lattice.singular > 0) == (kind != "coned")  # cones bind before
    assert lattice.profile[:, 0].min() == lattice.extents[0, 0]
    assert (lattice.layers[:, 0] <= lattice.layers[:, 1]).all()


def test_a_lattice_has_all_poses_of_its_aspect(lu):
    """Against all assembly modes at all nodes: those with the start's sign of det J, above the base plane."""
    lattice = pp.length_lattice(lu, step=0.1)
    sign = np.sign(lu.determinant(np.array(lattice.inputs["start"])).determinant)
    lengths = np.array(list(itertools.product([0.65, 0.75, 0.85], repeat=5)))
    poses = lu.assembly_modes(lengths).pose
    same = (np.sign(lu.determinant(poses).determinant) == sign) & (poses[..., 2, 3] >= 0.0)
    count, nodes = same.sum(), same.any(axis=1).sum()
    assert 1.3 * lattice.inside < lattice.poses <= count
    assert lattice.inside <= nodes


def test_a_lattice_keeps_to_its_bounds(lu):
    bounds = {"y": (-0.2, 0.3), "z": (0.6, 0.75)}
    lattice = pp.length_lattice(lu, step=0.05, bounds=bounds)
    for name, (low, high) in bounds.items():
        least, greatest = lattice.extents["xyz".index(name)]
        assert low <= least < low + 0.02
        assert high - 0.02 < greatest <= high
    with pytest.raises(pp.CoordinateError, match="bounds: 'alpha'"):
        pp.length_lattice(lu, bounds={"alpha": (0.0, 1.0)})


# --- closed form --------------------------------------------------------------------------------------------


def shells(mech, points: np.ndarray) -> np.ndarray:
    """Which positions of o keep all strokes upright: inside six shells about B_i - m_i."""
    inside = np.ones(len(points), dtype=bool)
    for leg, (least, greatest) in zip(mech.geometry["legs"], mech.stroke, strict=True):
        centre = np.array(leg["base"]["point"]) - np.array(leg["platform"]["point"])
        distance = np.linalg.norm(points - centre, axis=1)
        inside &= (distance >= least) & (distance <= greatest)
    return inside


def test_constant_orientation_is_the_meet_of_six_shells(hexapod, upright):
    places = np.stack(np.meshgrid(*upright.axes, indexing="ij"), axis=-1).reshape(-1, 3)
    parts, _ = ndimage.label(shells(hexapod, places).reshape(upright.mask.shape))
    largest = 1 + np.argmax(np.bincount(parts.ravel())[1:])  # two corners are cut off
    assert np.array_equal(parts == largest, upright.mask)
    check_boundary(hexapod, upright)
    rng = np.random.default_rng(1)
    low, high = upright.extents.T
    samples = 2_000_000
    share = shells(hexapod, rng.uniform(low, high, (samples, 3))).mean()
    box = float(np.prod(high - low))
    spread = box * np.sqrt(share * (1 - share) / samples)
    assert abs(upright.volume - share * box) < upright.volume_error + 4 * spread
    assert upright.volume_error < 0.05 * upright.volume


def test_orientation_changes_the_shells(hexapod):
    """Reach with a rotation: centres B_i - R m_i."""
    angle = 0.3
    found = pp.workspace(hexapod, ["x", "y", "z"], {"rx": 0.0, "ry": 0.0, "rz": angle}, step=0.05)
    c, s = np.cos(angle), np.sin(angle)
    turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    places = np.stack(np.meshgrid(*found.axes, indexing="ij"), axis=-1).reshape(-1, 3)
    inside = np.ones(len(places), dtype=bool)
    for leg, (least, greatest) in zip(hexapod.geometry["legs"], hexapod.stroke, strict=True):
        centre = np.array(leg["base"]["point"]) - turn @ np.array(leg["platform"]["point"])
        distance = np.linalg.norm(places - centre, axis=1)
        inside &= (distance >= least) & (distance <= greatest)
    assert np.array_equal(inside, found.mask.ravel())


@pytest.mark.parametrize("kind", ["reachable", "slice"])
def test_the_error_estimate_shrinks_and_covers_the_finer_volume(lu, hexapod, kind):
    steps = (0.08, 0.04, 0.02)
    if kind == "reachable":
        found = [pp.workspace(lu, step=step) for step in steps]
    else:
        found = [pp.workspace(hexapod, ["x", "y", "z"], UPRIGHT, step=step) for step in steps]
    for coarse, fine in itertools.pairwise(found):
        assert fine.volume_error < coarse.volume_error
        assert abs(fine.volume - coarse.volume) < coarse.volume_error


# --- slices -------------------------------------------------------------------------------------------------


def test_tilt_and_torsion_of_six_freedoms(hexapod):
    """R = Rz(azimuth) Ry(tilt) Rz(torsion - azimuth), Bonev and Gosselin 2002; a threefold symmetry."""
    at = {"x": 0.0, "y": 0.0, "z": 0.6}
    found = pp.workspace(hexapod, ["azimuth", "tilt", "torsion"], at, step=0.15)
    assert found.volume_unit == "rad^3"
    rng = np.random.default_rng(2)
    for i in rng.choice(len(found.vertices), 20, replace=False):
        azimuth, tilt, torsion = found.vertices[i]

        def z(a):
            return np.array([[np.cos(a), -np.sin(a), 0], [np.sin(a), np.cos(a), 0], [0, 0, 1]])

        y = np.array([[np.cos(tilt), 0, np.sin(tilt)], [0, 1, 0], [-np.sin(tilt), 0, np.cos(tilt)]])
        expected = z(azimuth) @ y @ z(torsion - azimuth)
        assert np.abs(found.poses[i, :3, :3] - expected).max() < 1e-12
        assert np.abs(found.poses[i, :3, 3] - [0, 0, 0.6]).max() < 1e-12
    limits = hexapod.limits(found.poses)
    on_limit = found.labels < len(limits.names)
    assert np.abs(limits.margins[on_limit].min(axis=1)).max() < EXACT
    # Turned by a third of a circle the machine is the same.
    a, b = (found.mask[k * 14 : (k + 1) * 14] for k in (0, 1))
    assert found.mask.shape[0] == 42
    assert np.array_equal(a, b)


def test_orientation_at_a_point_in_the_papers_angles(lu):
    at = {"x": 0.0, "y": 0.1, "z": 0.7}
    found = pp.workspace(lu, ["alpha", "beta"], at)
    limits = lu.limits(found.poses)
    assert limits.margins.min() >= -EXACT
    on_limit = found.labels < len(limits.names)
    assert np.abs(limits.margins[on_limit].min(axis=1)).max() < EXACT
    no_pose = found.labels == found.label_names.index(NO_POSE)
    assert no_pose.any()  # beyond |cos γ| = 1
    assert np.abs(np.sin(lu.coordinates(found.poses[no_pose], "paper")["gamma"])).max() < 1e-3
    assert EDGE_OF_GRID not in found.shares
    other = pp.workspace(lu, ["alpha", "beta"], at, branch=-1)
    assert not np.array_equal(found.extents, other.extents)


def test_a_slice_starts_where_it_is_told(lu):
    start = lu.pose({"x": 0.0, "y": 0.1, "z": 0.7, "alpha": -0.02, "beta": 0.7})
    assert lu.limits(start).within
    found = pp.workspace(
        lu,
        ["alpha", "beta"],
        {"x": 0.0, "y": 0.1, "z": 0.7},
        start=start,
        step=0.002,
        bounds={"alpha": (-0.05, 0.06), "beta": (-1.0, 1.0)},
    )
    place = [np.argmin(np.abs(axis - value)) for axis, value in zip(found.axes, (-0.02, 0.7), strict=True)]
    assert found.mask[tuple(place)]


def test_a_slice_keeps_one_sign_of_the_determinant(lu):
    fixed = {"x": 0.1, "y": 0.1, "z": 0.68}
    both = pp.workspace(lu, ["alpha", "beta"], fixed)
    one = pp.workspace(lu, ["alpha", "beta"], fixed, keep_aspect=True)
    assert len(np.unique(np.sign(lu.determinant(both.poses).determinant))) == 2
    assert len(np.unique(np.sign(lu.determinant(one.poses).determinant))) == 1
    singular = one.poses[one.labels == one.label_names.index(SINGULARITY)]
    assert len(singular)
    assert lu.singularity(singular).sigma_min.max() < 1e-6


def test_a_floor_of_conditioning_is_kept_and_binds(lu):
    free = pp.workspace(lu, step=0.08)
    found = pp.workspace(lu, step=0.08, sigma_min=0.02)
    assert found.volume < free.volume
    assert np.nanmin(lu.conditioning(found.poses).sigma_min) > 0.02 - EXACT
    binding = [i for i, name in enumerate(found.label_names) if "conditioning" in name]
    at_floor = found.poses[found.labels == binding[0]]
    assert len(at_floor)
    assert np.abs(lu.conditioning(at_floor).sigma_min - 0.02).max() < EXACT


# --- the same every time ------------------------------------------------------------------------------------


@pytest.mark.parametrize("keep_aspect", [False, True])
def test_threads_change_no_bit(lu, keep_aspect):
    one, two = (pp.workspace(lu, step=0.06, keep_aspect=keep_aspect, threads=n) for n in (1, 2))
    assert digest(one) == digest(two)
    assert one == two


def test_threads_change_no_bit_of_the_lattice(lu):
    one, two = (pp.length_lattice(lu, step=0.04, threads=n) for n in (1, 2))
    assert one.extents.tobytes() == two.extents.tobytes()
    assert one.profile.tobytes() == two.profile.tobytes()
    for count in ("inside", "poses", "at_limits", "singular"):
        assert getattr(one, count) == getattr(two, count)


@pytest.mark.slow
def test_a_million_nodes_are_the_same_with_one_thread(lu):
    bounds = {"x": (-0.75, 0.75), "y": (-0.75, 0.75), "z": (0.0, 1.0)}
    one, all = (pp.workspace(lu, step=0.0131, bounds=bounds, threads=n) for n in (1, 0))
    assert one.mask.size > 1_000_000
    assert digest(one) == digest(all)


# --- Section 4 ----------------------------------------------------------------------------------------------


def test_section4_cut_at_the_printed_height_is_as_wide_as_printed(lu):
    facts = section4(lu, step=0.04, lattice_step=0.05).facts()
    assert facts["printed"] == list(PRINTED)
    assert facts["highest"] == pytest.approx(0.8417, abs=0.0005)
    for off in facts["flood"]["off"]:
        assert abs(off) < 0.02
    assert facts["flood"]["full"][2] > 0.8  # far more than the print's height
    # A part is not wider than the whole, nor the lattice's nodes than the poses of their aspect.
    pairs = ("aspect", "flood", "full"), ("aspect", "flood", "cut"), ("lattice", "aspect", "full")
    for narrow, wide, part in pairs:
        assert (np.array(facts[narrow][part]) <= np.array(facts[wide][part]) + 1e-6).all()


@pytest.mark.slow
def test_section4_with_the_papers_own_step(lu):
    """10 mm: cut at the print's height, X and Y are its own within 2 %; in one aspect both ways agree."""
    facts = section4(lu, step=0.02, lattice_step=0.01).facts()
    assert facts["lattice"]["nodes"] == 21**5
    assert max(map(abs, facts["flood"]["off"])) < 0.02
    assert max(map(abs, facts["lattice"]["off"])) < 0.02
    for part in ("full", "cut"):
        sizes = np.array([facts[way][part] for way in ("lattice", "aspect")])
        assert np.abs(np.diff(sizes, axis=0)).max() < facts["aspect"]["step"]


# --- files --------------------------------------------------------------------------------------------------


def test_netcdf_loads_back_equal(upright, reachable, lu, tmp_path):
    flat = pp.workspace(lu, ["azimuth", "tilt"], {"x": 0.0, "y": 0.1, "z": 0.7}, step=0.1)
    for found in (upright, reachable, flat):
        found.save(tmp_path / "w.nc")
        back = pp.load_workspace(tmp_path / "w.nc")
        assert back == found
        assert digest(back) == digest(found)
        assert back.inputs == found.inputs
        assert back.mechanism == found.mechanism


def test_meshes_load_back(reachable, tmp_path):
    for name in ("w.ply", "w.stl"):
        reachable.save(tmp_path / name)
    ply = trimesh.load(tmp_path / "w.ply", process=False)
    assert np.array_equal(ply.vertices, reachable.vertices)
    assert np.array_equal(ply.faces, reachable.faces)
    raw = ply.metadata["_ply_raw"]["vertex"]["data"]
    assert np.array_equal(raw["label"].ravel(), reachable.labels)
    header = (tmp_path / "w.ply").read_bytes().split(b"end_header")[0].decode()
    for i, name in enumerate(reachable.label_names):
        assert f"comment label {i}: {name}\n" in header
    stl = trimesh.load(tmp_path / "w.stl", process=False)
    assert stl.triangles.shape == (len(reachable.faces), 3, 3)
    assert np.abs(stl.triangles - reachable.vertices[reachable.faces]).max() < 1e-7
    assert stl.volume == pytest.approx(reachable.volume, rel=1e-6)


def test_scenes_load_back(reachable, tmp_path):
    reachable.save(tmp_path / "w.glb")
    scene = trimesh.load(tmp_path / "w.glb", force="scene")
    (name,) = scene.geometry
    assert name.startswith(f"workspace of {reachable.mechanism.name}")
    placed, _ = scene.graph.get(f"workspace of {reachable.mechanism.name}")
    assert np.array_equal(placed[:3, :3] @ [1, 2, 3], [1, 3, -2])  # z is up in a workspace, y in a scene
    mesh = scene.geometry[name]
    assert np.abs(mesh.vertices[mesh.faces] - reachable.vertices[reachable.faces]).max() < 1e-6
    part = np.array([[int(c[i : i + 2], 16) for i in (1, 3, 5)] for c in reachable.colors]) / 255.0
    light = np.where(part <= 0.04045, part / 12.92, ((part + 0.055) / 1.055) ** 2.4)
    colors = mesh.visual.vertex_colors[mesh.faces][..., :3] / 255.0
    assert np.abs(colors - light[reachable.labels][reachable.faces]).max() <= 0.501 / 255.0
    assert mesh.is_watertight
    assert mesh.volume == pytest.approx(reachable.volume, rel=1e-6)


def test_scenes_are_for_positions(tmp_path):
    from polypod.workspaces.workspace import check_suffix

    check_suffix(tmp_path / "w.glb", ["x", "y", "z"])
    with pytest.raises(pp.WorkspaceError, match="not z, alpha, beta"):
        check_suffix(tmp_path / "w.glb", ["z", "alpha", "beta"])


def test_the_mesh_is_closed_and_has_the_volume(reachable, upright, aspect):
    for found in (reachable, upright, aspect):
        mesh = found.mesh()
        assert mesh.is_watertight
        assert mesh.is_winding_consistent
        assert mesh.volume == pytest.approx(found.volume, rel=1e-12)
        assert found.volume > 0
        assert sum(found.shares.values()) == pytest.approx(1.0)
        outside = mesh.bounds.T - found.extents
        assert outside[:, 0].min() > -1e-7  # the boundary lies within the ends
        assert outside[:, 1].max() < 1e-7


@pytest.mark.parametrize("name", ["w.obj", "w"])
def test_other_files_are_refused(reachable, tmp_path, name):
    with pytest.raises(pp.WorkspaceError, match=r"\.stl, \.ply, \.nc, \.glb"):
        reachable.save(tmp_path / name)


def test_damaged_files_are_refused(reachable, tmp_path):
    with pytest.raises(pp.WorkspaceError, match="does not exist"):
        pp.load_workspace(tmp_path / "none.nc")
    with pytest.raises(pp.WorkspaceError, match=r"ends in '.stl'"):
        pp.load_workspace(tmp_path / "w.stl")
    (tmp_path / "w.nc").write_bytes(b"CDF\x01 nothing")
    with pytest.raises(pp.WorkspaceError, match="no whole Polypod workspace"):
        pp.load_workspace(tmp_path / "w.nc")


# --- starts, bounds and wrong calls -------------------------------------------------------------------------


def test_a_start_is_found_where_home_is_outside_the_limits(lu):
    data = lu.to_dict()
    for leg in data["legs"]:
        leg["stroke"] = {"min": 650.0, "max": 700.0}
    short = pp.Mechanism.from_dict(data)
    assert not short.limits(short.home).within
    found = pp.workspace(short, step=0.04)
    assert short.limits(np.array(found.inputs["start"])).within
    assert found.mask.any()


def test_a_start_with_an_aspect_is_not_nearly_singular(lu, aspect):
    assert lu.conditioning(lu.home).sigma_min < 0.01
    assert lu.conditioning(np.array(aspect.inputs["start"])).sigma_min > 0.1


def test_no_start_is_found_where_no_pose_is(hexapod):
    with pytest.raises(pp.WorkspaceError, match="no pose of stewart-gough inside all limits"):
        pp.workspace(hexapod, step=0.02, bounds={"z": (1.1, 1.14)})


def test_bounds_hold_the_workspace(lu, hexapod, reachable):
    for name, (low, high) in reachable.inputs["bounds"].items():
        least, greatest = reachable.extents["xyz".index(name)]
        assert low <= least < greatest <= high
    small = pp.workspace(lu, step=0.04, bounds={"x": (-0.1, 0.1), "y": (-0.1, 0.1), "z": (0.6, 0.8)})
    assert np.allclose(small.extents[:2], [[-0.1, 0.1], [-0.1, 0.1]])
    assert 0.6 <= small.extents[2, 0] < small.extents[2, 1] <= 0.8
    assert small.shares[EDGE_OF_GRID] > 0.3


def test_progress_is_told(lu):
    told = []
    found = pp.workspace(lu, step=0.08, progress=lambda done, of: told.append((done, of)))
    for grid in {of for _, of in told}:  # a grid that cuts the workspace off is laid again
        each = [done for done, of in told if of == grid]
        assert each == sorted(each)
    assert told[-1] == (found.mask.sum(), found.mask.size)


FIX = {"rx": 0.0, "ry": 0.0, "rz": 0.0}


@pytest.mark.parametrize(
    ("arguments", "error", "message"),
    [
        ({"step": 0.0}, pp.WorkspaceError, "step of x is 0.0; must be above 0 m"),
        ({"step": np.nan}, pp.WorkspaceError, "step of x"),
        ({"step": 1e-5}, pp.WorkspaceError, "at most 1e\\+09"),
        ({"step": {"x": 0.1}}, pp.WorkspaceError, "cells of the reachable workspace are cubes"),
        ({"bounds": {"q": (0, 1)}}, pp.CoordinateError, "bounds: 'q' does not vary"),
        ({"bounds": {"z": (1, 0)}}, pp.WorkspaceError, "bounds.z is 1 to 0"),
        ({"bounds": {"z": 3}}, pp.WorkspaceError, "bounds.z is 3; needs two numbers"),
        ({"start": np.eye(3)}, pp.WorkspaceError, r"start has the shape \(3, 3\)"),
        ({"start": np.eye(4)}, pp.WorkspaceError, "start passes a limit: stroke"),
        ({"start": np.full((4, 4), np.nan)}, pp.WorkspaceError, "start INVALID_INPUT"),
        ({"threads": -1}, pp.WorkspaceError, "threads is -1"),
        ({"sigma_min": -1.0}, pp.WorkspaceError, "sigma_min is -1.0"),
        ({"fix": {"x": 0.0}}, pp.WorkspaceError, "fix.x: needs coordinates that vary"),
        ({"vary": ["x"]}, pp.WorkspaceError, "needs two or three different coordinates"),
        ({"vary": ["x", "x"]}, pp.WorkspaceError, "needs two or three different coordinates"),
        ({"vary": ["x", "y", "z"]}, pp.CoordinateError, "no coordinate set"),
        ({"vary": ["x", "y", "z"], "fix": FIX | {"x": 0.0}}, pp.WorkspaceError, "fix.x: varies"),
        ({"vary": ["x", "y", "z"], "fix": FIX | {"rx": np.inf}}, pp.WorkspaceError, "fix.rx is inf"),
        ({"vary": ["x", "rx"], "fix": {"y": 0, "z": 0.6, "ry": 0, "rz": 0}, "step": 0.1}, pp.WorkspaceError,
         "different units"),
        ({"vary": ["x", "y", "z"], "fix": FIX, "step": {"w": 1}}, pp.CoordinateError, "step: 'w'"),
        ({"vary": ["azimuth", "tilt"], "fix": {"x": 0}}, pp.CoordinateError, "need all of x, y, z, azimuth"),
        ({"vary": ["x", "y", "z"], "fix": FIX, "bounds": {"z": (2.0, 3.0)}}, pp.WorkspaceError, "no node"),
    ],
)  # fmt: skip
def test_wrong_calls_say_what_is_wrong(hexapod, arguments, error, message):
    with pytest.raises(error, match=message):
        pp.workspace(hexapod, **arguments)


def test_a_start_that_the_slice_does_not_hold(hexapod):
    start = hexapod.home
    with pytest.raises(pp.WorkspaceError, match=r"start: x = 0, y = 0, z = 0.6 is outside the bounds"):
        pp.workspace(hexapod, ["x", "y", "z"], UPRIGHT, start=start, step=0.05, bounds={"z": (0.65, 0.8)})
    with pytest.raises(pp.WorkspaceError, match=r"start: the node next to .* is not inside all limits"):
        pp.workspace(hexapod, ["x", "y", "z"], UPRIGHT | {"rz": 1.5}, start=start, step=0.05)
    with pytest.raises(pp.WorkspaceError, match=r"start: o is at .* outside the bounds"):
        pp.workspace(hexapod, start=start, step=0.05, bounds={"z": (0.65, 0.8)})


def test_the_lattice_needs_strokes(lu, hexapod):
    data = lu.to_dict()
    del data["legs"][1]["stroke"]
    with pytest.raises(pp.UnsupportedError, match=r"legs\.2\.stroke"):
        pp.length_lattice(pp.Mechanism.from_dict(data))
    with pytest.raises(pp.WorkspaceError, match="step is 0"):
        pp.length_lattice(lu, step=0)
    with pytest.raises(pp.WorkspaceError, match="at most 1e"):
        pp.length_lattice(lu, step=1e-4)


def test_a_mechanism_without_strokes_needs_bounds(hexapod):
    data = hexapod.to_dict()
    for leg in data["legs"]:
        del leg["stroke"]
    free = pp.Mechanism.from_dict(data)
    with pytest.raises(pp.WorkspaceError, match=r"bounds\.x: .* has no strokes"):
        pp.workspace(free, step=0.1)
    bounds = dict.fromkeys("xy", (-0.2, 0.2)) | {"z": (0.5, 0.7)}
    found = pp.workspace(free, step=0.1, bounds=bounds)
    assert found.mask.all()
    assert found.shares == {EDGE_OF_GRID: 1.0}
    assert found.volume < 0.4 * 0.4 * 0.2  # corners are cut


def test_where_o_does_not_move_freely_a_slice_is_named():
    with pytest.raises(pp.WorkspaceError, match="take a slice over z, rx, ry"):
        pp.workspace(pp.load(DATA / "3-rps.toml"))
    assert (
        pp.workspace(pp.load(DATA / "3-rps.toml"), ["z", "rx", "ry"], step={"rx": 0.1, "ry": 0.1}).volume
        > 0.1
    )
