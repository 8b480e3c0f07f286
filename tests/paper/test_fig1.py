"""Fig. 1 of the paper: two positions far from Z and a large orientation, drawn with the paper's letters."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib.figure import Figure

import polypod as pp
from polypod.errors import ShapeError
from polypod.paper.fig1 import SIGMA_MIN, fig1_poses
from polypod.plots import plot_fig1


@pytest.fixture(scope="module")
def mech():
    return pp.load("lu-3spu-2rpu-r")


@pytest.fixture(scope="module")
def poses(mech):
    return fig1_poses(mech)


def tilt(pose):
    """Between z and Z, degrees."""
    return np.degrees(np.arccos(pose[..., 2, 2]))


def test_two_positions_are_far_from_z_on_opposite_sides(mech, poses):
    first, second, _ = poses.values()
    for pose in (first, second):
        assert np.hypot(*pose[:2, 3]) > 0.5
        assert mech.limits(pose).within
        assert mech.conditioning(pose).sigma_min >= SIGMA_MIN
    assert first[:2, 3] @ second[:2, 3] < 0.0
    # Farther than all along the built-in motion.
    motion = pp.solve(mech, pp.load_motion("lu-3spu-2rpu-r", mech)).dataset["pose"].to_numpy()
    assert np.hypot(*motion[:, :2, 3].T).max() < np.hypot(*second[:2, 3])


def test_the_orientation_is_the_large_one(mech, poses):
    """That of Table I's first row: φ_zZ = 62.86° in print, 61.35° with Table II's dimensions."""
    first, second, large = poses.values()
    motion = pp.solve(mech, pp.load_motion("lu-3spu-2rpu-r", mech)).dataset["pose"].to_numpy()
    assert tilt(large) == pytest.approx(61.35, abs=0.01)
    assert tilt(large) > max(tilt(first), tilt(second), tilt(motion).max())
    np.testing.assert_allclose(
        mech.inverse_kinematics(large).lengths, [0.70814, 0.65, 0.71546, 0.85, 0.85], atol=1e-12
    )


def test_captions_tell_the_poses(poses):
    for caption, pose in [*poses.items()][:2]:
        o = 1e3 * pose[:3, 3]
        assert caption.startswith(f"{np.hypot(*o[:2]):.0f} mm from")
        assert ", ".join(f"{x:.0f}" for x in o) in caption.replace("−", "-")
    assert "61°" in [*poses][2]


def test_panels_have_the_letters_of_the_paper(mech, poses):
    figure = plot_fig1(mech, poses, Figure(figsize=(10.0, 8.2)))
    captions = sorted(text.get_text() for text in figure.texts)
    assert [caption[:3] for caption in captions] == ["(a)", "(b)", "(c)", "(d)", "(e)"]
    assert [caption[5:] for caption in captions[2:]] == [*poses]
    spaces = [ax for ax in figure.axes if hasattr(ax, "get_zlim")]
    assert len(spaces) == 4
    for ax in spaces:  # every drawing names its joints and axes
        names = {text.get_text() for text in ax.texts}
        assert {*(f"${letter}_{{{i}}}$" for letter in "bB" for i in range(1, 6)), "$o$", "$O$", "$L$"} < names
    assert len({tuple(np.round(ax._box_aspect, 9)) for ax in spaces}) == 1  # one scale


@pytest.mark.parametrize("count", [0, 25])
def test_as_many_poses_as_there_are_letters(mech, count):
    with pytest.raises(ShapeError, match="1 to 24"):
        plot_fig1(mech, {str(i): mech.home for i in range(count)}, Figure())


def test_one_pose_of_any_mechanism_is_drawn():
    mech = pp.load("tricept")
    figure = plot_fig1(mech, {"home": mech.home}, Figure(figsize=(10.0, 8.2)))
    assert [text.get_text()[:3] for text in figure.texts] == ["(a)", "(c)", "(b)"]
