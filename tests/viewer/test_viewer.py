"""The viewer without a browser: what is shown, how it moves, what pages may send."""

from __future__ import annotations

import socket
import subprocess
import sys
import threading
import time
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import polypod as pp
from polypod.bodies.palette import rgb
from polypod.errors import UnknownNameError
from polypod.viewer import html
from polypod.viewer.message_filter import is_own_page, is_update, is_value
from polypod.viewer.model import NEAR_LIMIT, Level, Model
from polypod.viewer.player import Player, track_of
from polypod.viewer.scene import SINGULAR, platform_color
from polypod.viewer.static import check_static_path, write_static
from polypod.viewer.viser_access import ViewerError, inner_parts, require_viser
from polypod.viewer.worker import SETTLED, Worker
from support import DATA

NAME = "lu-3spu-2rpu-r"
FILES = [NAME, *sorted(str(path) for path in DATA.glob("*.toml"))]
GOOD = {"alpha": 0.1, "p": -0.2, "h": 0.66, "beta": 0.6, "gamma": 0.5}


@pytest.fixture(scope="module")
def mech():
    return pp.load(NAME)


@pytest.fixture(scope="module")
def motion(mech):
    return pp.load_motion(NAME, mech)


@pytest.fixture
def model(mech):
    model = Model(mech)
    model.go(mech.pose(GOOD))
    return model


# --- moving -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("file", FILES, ids=lambda file: Path(file).stem)
def test_any_mechanism_moves_by_coordinates_and_by_lengths(file):
    mech = pp.load(file)
    model = Model(mech)
    assert model.set == ("natural" if "natural" in mech.coordinate_sets else "pose")
    assert len(model.names) == mech.dof
    for name in model.names:
        low, high = model.range(name)
        now = float(mech.coordinates(model.pose, model.set)[name])
        assert low <= now <= high
        assert model.set_coordinate(name, now + 0.02), model.refusal
        assert float(mech.coordinates(model.pose, model.set)[name]) == pytest.approx(now + 0.02, abs=1e-9)
    lengths = mech.inverse_kinematics(model.pose).lengths
    assert model.set_length(0, float(lengths[0]) + 1e-4), model.refusal
    lengths[0] += 1e-4
    found = mech.inverse_kinematics(model.pose).lengths
    np.testing.assert_allclose(found[mech.actuated], lengths[mech.actuated], atol=1e-10)
    view = model.view()
    assert np.isfinite(view.frames).all()
    np.testing.assert_array_equal(view.lengths, found)
    np.testing.assert_allclose(view.joints[0], view.frames[1 + len(mech.rod_names) + 1, :3, 3])


@pytest.mark.parametrize("name", ["4-rpr", "4ups-up"])
def test_with_redundant_actuators_legs_follow_the_coordinates(name):
    mech = pp.load(name)
    model = Model(mech)
    before = mech.inverse_kinematics(model.pose).lengths
    pose = model.pose.copy()
    assert not any(model.moves_alone(leg) for leg in range(mech.n_legs))
    assert not model.set_length(0, float(before[0]) + 1e-3)
    assert "more actuators than degrees of freedom" in model.refusal
    np.testing.assert_array_equal(model.pose, pose)
    for coordinate in model.names:
        now = float(mech.coordinates(model.pose, model.set)[coordinate])
        assert model.set_coordinate(coordinate, now + 0.01), model.refusal
    view = model.view()
    assert np.isfinite(view.frames).all()
    assert np.abs(view.lengths - before).max() > 1e-3


def test_a_coordinate_alone_moves(model, mech):
    before = model.view().coordinates
    assert model.set_coordinate("h", 0.62)
    after = model.view().coordinates
    np.testing.assert_array_equal(
        model.pose, mech.pose({**{n: before[n] for n in model.names}, "h": 0.62}, guess=model.pose)
    )
    assert after["h"] == pytest.approx(0.62, abs=1e-12)
    for name in set(model.names) - {"h"}:
        assert after[name] == pytest.approx(before[name], abs=1e-12)


def test_a_branch_that_is_nearest_stays(mech):
    """The paper's coordinates leave two poses; the page stays where it is, not on the branch +1."""
    model = Model(mech)
    start = mech.pose({"x": 0.0, "y": 0.05, "z": 0.7, "alpha": 0.1, "beta": 0.4}, branch=-1)
    model.go(start)
    model.choose_set("paper")
    gamma = model.view().coordinates["gamma"]
    assert model.set_coordinate("z", 0.701)
    assert model.view().coordinates["gamma"] == pytest.approx(gamma, abs=0.05)
    assert gamma < 0.0


def test_what_is_impossible_is_refused_in_words_and_changes_nothing(model, mech):
    pose = model.pose.copy()
    model.choose_set("paper")
    y = float(mech.coordinates(pose, "paper")["y"])
    for change, said in (
        (lambda: model.set_coordinate("y", y + 2.0), "No pose with y = "),
        (lambda: model.set_coordinate("y", float("nan")), "no number"),
        (lambda: model.set_length(0, 3.0), "The length of leg 1 cannot be 3000.0 mm"),
        (lambda: model.set_length(0, float("nan")), "The length of leg 1 cannot be nan m"),
        (lambda: model.set_length(0, -1.0), "The length of leg 1 cannot be -1.0 m"),
        (lambda: model.go(np.full((4, 4), np.nan)), "cannot stand there"),
        (lambda: model.set_time(1.0), "no motion"),
    ):
        assert not change()
        assert said in model.refusal
        np.testing.assert_array_equal(model.pose, pose)
        view = model.view()
        assert view.level is Level.BEYOND
        assert view.notes[-1].text == model.refusal
        assert view.notes[-1].text.endswith("The last good pose stays.")
    assert model.set_coordinate("y", y)
    assert not model.refusal
    with pytest.raises(UnknownNameError):
        model.choose_set("nonsense")
    with pytest.raises(UnknownNameError):
        model.set_coordinate("h", 0.1)


def test_lengths_of_another_mode_are_refused(mech):
    """Where the mode ends on the way, the answer lies in another one: the page does not jump there."""
    model = Model(mech)
    model.go(mech.pose(GOOD))
    sign = np.sign(model.view().determinant)
    moved = refused = 0
    for length in np.linspace(0.5, 1.2, 41):
        for leg in range(mech.n_legs):
            if model.set_length(leg, float(length)):
                moved += 1
                assert np.sign(model.view().determinant) == sign
            else:
                refused += 1
    assert moved > 10
    assert refused > 0


def test_a_pose_of_another_mode_is_no_answer(model, monkeypatch):
    """The core may have a pose and say that it lies in another mode: the page does not go there."""
    solve = pp.Mechanism.forward_kinematics

    def jump(self, lengths, guess=None):
        return replace(solve(self, lengths, guess), status=np.array(pp.Status.MODE_JUMP, np.uint8))

    pose = model.pose.copy()
    monkeypatch.setattr(pp.Mechanism, "forward_kinematics", jump)
    assert not model.set_length(0, 0.672)
    assert "another mode" in model.refusal
    np.testing.assert_array_equal(model.pose, pose)


def test_a_passive_leg_follows(tricept):
    mech = tricept("<b>post</b>")
    model = Model(mech)
    assert model.set_coordinate(model.names[0], 0.05 if model.names[0] != "z" else 0.61)
    assert not model.set_length(3, 0.7)
    assert "passive" in model.refusal
    view = model.view()
    assert view.slack.tolist() == [np.inf] * 4
    text = html.numbers(view, mech, {"z": (-np.inf, 0.5)}, 12.0, 0.004)
    assert "<b>post" not in text
    assert "&lt;b&gt;post" in text
    assert "passive" in text
    assert "500.0" in text
    assert "Answered in 4 ms" in text


# --- what is told -------------------------------------------------------------------------------------------


def test_limits_are_told_and_coloured(mech, motion):
    model = Model(mech, track_of(mech, motion))
    assert model.view().notes == ()
    assert model.view().leg_levels == (Level.FINE,) * 5
    start = {name: float(mech.coordinates(model.pose, "natural")[name]) for name in GOOD}
    longest = float(mech.stroke[1, 1])
    span = float(np.ptp(mech.stroke[1]))
    for beyond, level in ((-0.5 * NEAR_LIMIT * span, Level.NEAR), (0.003, Level.BEYOND)):
        low = 0.0
        high = 0.5
        for _ in range(60):  # to the height at which leg 2 is that long
            middle = (low + high) / 2
            pose = mech.pose({**start, "h": start["h"] + middle})
            longer = mech.inverse_kinematics(pose).lengths[1] > longest + beyond
            low, high = (low, middle) if longer else (middle, high)
        model.go(pose)
        view = model.view()
        assert view.leg_levels[1] is level
        worst = Level(max(view.leg_levels))
        assert view.level is worst
        assert any(note.level is worst for note in view.notes)
        limits = mech.limits(pose)
        first = limits.names[limits.binding]
        assert first in view.notes[0].text
        assert f'data-level="{view.level.name}"' in html.status(view.notes, view.level)


def test_singular_poses_are_told_and_coloured(mech):
    view = Model(mech).view()
    assert view.level is Level.NEAR
    assert view.notes[0].text.startswith("Near a direct singularity")
    near = mech.singularity(mech.home)
    assert view.screw is not None
    np.testing.assert_array_equal(view.screw.axis, near.axis)
    np.testing.assert_array_equal(view.screw.velocity, near.twist[:3])
    assert platform_color(view.sigma_min) == rgb(SINGULAR)
    assert platform_color(1.0) != rgb(SINGULAR)
    assert platform_color(float("nan")) == rgb(SINGULAR)


def test_forces_are_those_of_the_library(mech, motion):
    model = Model(mech)
    pose = mech.pose(GOOD)
    model.go(pose)
    np.testing.assert_array_equal(
        model.view().forces, mech.inverse_dynamics(pose, np.zeros(6), np.zeros(6)).forces
    )
    solution = pp.solve(mech, motion).dataset
    moved = Model(mech, track_of(mech, motion))
    assert moved.set == motion.set
    for row in (0, 400, 777):
        assert moved.set_time(float(motion.time[row]))
        view = moved.view()
        np.testing.assert_allclose(view.forces, solution["force"][row], rtol=1e-9)
        assert view.time == motion.time[row]
    moved.set_coordinate("z", view.coordinates["z"])  # at rest again
    assert moved.view().time is None


def test_singular_values_of_any_set(mech, model):
    found = mech.singularity_distance(model.pose)
    assert model.singular_values()["beta"] == tuple(found.singular[found.coordinates.index("beta")])
    for set in model.sets:
        model.choose_set(set)
        assert len(model.singular_values()) == mech.dof


# --- motions ------------------------------------------------------------------------------------------------


def test_huge_motions_are_thinned_and_say_so(mech, motion):
    dense = motion.sample(np.linspace(0.0, 8.0, 50_001))
    track = track_of(mech, dense, most=401)
    assert len(track.time) == 401
    assert track.total == 50_001
    assert track.words == f"{NAME}: 0 s to 8 s; of its 50001 rows the page shows 401, evenly chosen."
    assert track.time[[0, -1]].tolist() == [0.0, 8.0]
    whole = mech.state(
        dense.coordinates, dense.rates, dense.second_rates, branch=dense.branch, continued=True
    )
    rows = np.searchsorted(dense.time, track.time)
    np.testing.assert_allclose(track.pose, whole.pose[rows], atol=1e-12)
    np.testing.assert_allclose(track.twist, whole.twist[rows], atol=1e-9)
    assert len(track_of(mech, dense).time) == 30_000
    few = track_of(mech, motion)
    assert few.words == f"{NAME}: 0 s to 8 s, 801 rows."
    assert few.total == len(few.time) == 801


def test_poses_are_followed_from_one_part_of_a_motion_to_the_next(mech, motion, monkeypatch):
    guesses, state = [], pp.Mechanism.state

    def heard(self, *args, guess=None, **more):
        guesses.append(guess)
        return state(self, *args, guess=guess, **more)

    monkeypatch.setattr("polypod.viewer.player._CHUNK", 300)
    monkeypatch.setattr(pp.Mechanism, "state", heard)
    track = track_of(mech, motion)
    assert guesses[0] is None
    np.testing.assert_array_equal(guesses[1:], track.pose[[299, 599]])
    assert len(track.time) == 801


def test_rows_without_a_pose_are_refused(mech):
    time = np.linspace(0.0, 1.0, 11)
    given = {"x": 0 * time, "y": 0.04 + 0.5 * time**9, "z": 0.7 + 0 * time}
    given |= {"alpha": 0 * time, "beta": 0.3 + 0 * time}
    model = Model(mech, track_of(mech, pp.Motion.through(time, given, set="paper", name="lost")))
    good = model.pose.copy()
    assert not model.set_time(1.0)
    assert "No pose at 1.000 s" in model.refusal
    np.testing.assert_array_equal(model.pose, good)
    assert not model.set_time(float("nan"))


def test_the_nearest_row_is_shown(mech, motion):
    track = track_of(mech, motion)
    for moment in (-1.0, 0.0, 0.0049, 0.0051, 3.333, 8.0, 99.0):
        assert track.row_at(moment) == np.argmin(np.abs(motion.time - moment))
    short = replace(track, time=track.time[:1])
    assert short.row_at(5.0) == 0


def test_the_player_runs_seeks_and_starts_again():
    player = Player(2.0, 6.0, 2.0)
    assert not player.advance(1.0)
    player.play()
    player.speed = 2.0
    assert player.advance(0.5)
    assert player.time == 3.0
    assert player.advance(2.0)
    assert player.time == pytest.approx(3.0)  # once round
    player.loop = False
    assert player.advance(100.0)
    assert (player.time, player.playing) == (6.0, False)
    player.play()
    assert player.time == 2.0
    player.seek(99.0)
    assert player.time == 6.0
    player.seek(float("nan"))
    assert player.time == 6.0


# --- the worker ---------------------------------------------------------------------------------------------


def wait_for(condition, seconds=20.0):
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "waited in vain"
        time.sleep(0.005)


def test_the_newest_of_each_kind_is_answered_and_failures_end_nothing(capsys):
    started, go, done, settled = threading.Event(), threading.Event(), [], []

    def hold():
        started.set()
        go.wait(20.0)

    def fail():
        raise ZeroDivisionError("on purpose")

    worker = Worker(lambda: done.append("answer"), settled=lambda: settled.append(time.perf_counter()))
    worker.start()
    worker.submit("first", hold)
    assert started.wait(20.0)
    for i in range(100):
        worker.submit("slider", lambda i=i: done.append(i))
    worker.submit("bad", fail)
    worker.submit("other", lambda: done.append("other"))
    assert worker.awaits("slider")
    go.set()
    wait_for(lambda: settled)
    assert done == ["answer", 99, "other", "answer"]
    assert len(worker.durations) == 2
    assert "on purpose" in capsys.readouterr().err
    worker.submit("slider", lambda: done.append("again"))
    wait_for(lambda: len(settled) == 2)
    assert done[-2:] == ["again", "answer"]
    assert settled[1] - settled[0] > SETTLED
    worker.stop()


def test_ticks_are_answered():
    answers, left = [], [3]

    def tick(elapsed):
        assert elapsed >= 0.0
        left[0] -= 1
        return left[0] >= 0

    worker = Worker(lambda: answers.append(1), tick=tick)
    worker.start()
    wait_for(lambda: left[0] < -1)
    worker.stop()
    assert len(answers) == 3


# --- what pages may send ------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("value", "current", "fine"),
    [
        *((1.5, 0.0, True), (2, 0.0, True), (True, False, True), ("pose", "natural", True)),
        *((float("nan"), 0.0, False), (float("inf"), 0.0, False), (1e300, 0.0, False)),
        *(("1", 0.0, False), (None, 0.0, False), ([1.0], 0.0, False), (True, 0.0, False)),
        *((1, False, False), ("x" * 201, "", False), (b"x", "", False), ((1,), (1,), False)),
    ],
)
def test_values_of_controls(value, current, fine):
    assert is_value(value, current) is fine
    assert is_update({"value": value}, current) is fine


def test_messages_change_values_only():
    assert not is_update({"value": 1.0, "max": 9.0}, 0.0)
    assert not is_update({"update_cb": []}, 0.0)
    assert not is_update({}, 0.0)
    assert not is_update([("value", 1.0)], 0.0)


def test_pages_of_other_sites_are_not_served():
    here = {"Host": "127.0.0.1:8080", "Origin": "http://127.0.0.1:8080"}
    assert is_own_page(here, local=True)
    assert is_own_page({"Host": "[::1]:8080"}, local=True)
    assert not is_own_page({**here, "Origin": "http://evil.example"}, local=True)
    assert not is_own_page({**here, "Origin": "null"}, local=True)
    rebound = {"Host": "evil.example:8080", "Origin": "http://evil.example:8080"}
    assert not is_own_page(rebound, local=True)
    lab = {"Host": "robot.lab:8080", "Origin": "http://robot.lab:8080"}
    assert is_own_page(lab, local=False)


def test_viser_has_the_inner_parts_that_the_filter_needs():
    """If this fails, viser has moved them: mend `viewer/viser_access.py` before pages are served."""
    viser = pytest.importorskip("viser")
    server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    try:
        parts = inner_parts(server)
        slider = server.gui.add_slider("a", 0.0, 1.0, 0.1, 0.5)
        assert [*parts.controls.values()] == [slider]
        assert parts.connections == {}
    finally:
        server.stop()


@pytest.mark.parametrize(
    ("gone", "told"),
    [
        ("_websock_server", "ViserServer._websock_server"),
        ("_handle_incoming_message", "WebsockServer._handle_incoming_message"),
        ("_live_connections", "WebsockServer._live_connections"),
        ("_gui_input_handle_from_uuid", "GuiApi._gui_input_handle_from_uuid"),
    ],
)
def test_inner_parts_that_have_moved_are_named(gone, told):
    viser = pytest.importorskip("viser")

    async def handle(client_id, message):
        raise AssertionError

    def having(**parts):
        return SimpleNamespace(**{name: part for name, part in parts.items() if name != gone})

    server = having(
        _websock_server=having(_handle_incoming_message=handle, _live_connections={}),
        gui=having(_gui_input_handle_from_uuid={}),
    )
    with pytest.raises(ViewerError, match=f"viser {viser.__version__} has no {told}, by which"):
        inner_parts(server)


# --- without viser, and wrong calls -------------------------------------------------------------------------


def test_importing_polypod_does_not_import_viser():
    code = (
        "import sys, polypod, polypod.plots, polypod.cli, polypod.viewer.model, polypod.viewer.html, "
        "polypod.viewer.server, polypod.viewer.static; sys.exit('viser' in sys.modules)"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_without_viser_the_error_says_what_to_install(monkeypatch, run, tmp_path):
    monkeypatch.setitem(sys.modules, "viser", None)
    with pytest.raises(ViewerError, match=r"pip install polypod\[viewer\]"):
        require_viser()
    for more in ((), ("--static", tmp_path / "scene.html")):
        status, out, err = run("view", NAME, *more)
        assert (status, out) == (2, "")
        assert "pip install polypod[viewer]" in err


def test_a_port_that_is_taken_is_told(run):
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        port = other.getsockname()[1]
        status, _, err = run("view", NAME, "--port", port)
    assert status == 2
    assert f"cannot listen on port {port} of 127.0.0.1" in err
    assert "--port 0" in err


def test_wrong_calls_of_the_command(run, tmp_path):
    assert run("view", "nonsense")[0] == 2
    status, _, err = run("view", NAME, "--static", tmp_path / "scene.txt")
    assert status == 2
    assert ".html" in err
    status, _, err = run("view", NAME, "--static", tmp_path / "none" / "scene.html")
    assert status == 2
    assert "no directory" in err
    check_static_path(tmp_path / "scene.html")
    with pytest.raises(ViewerError):
        write_static(pp.load(NAME), None, tmp_path / "scene.htm")
