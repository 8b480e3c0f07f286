"""The viewer's pages: what a real browser shows, and what a bad one may send.

Pages are slow where there is no graphics card: small windows, and waits for what is to be seen.
"""

from __future__ import annotations

import contextlib
import re
import time

import numpy as np
import pytest

import polypod as pp

pytest.importorskip("viser")

import msgspec
import websockets.exceptions
from websockets.sync.client import connect

from polypod.viewer.server import Viewer
from polypod.viewer.static import write_static
from support import ROOT

NAME = "lu-3spu-2rpu-r"
PATIENCE = 180_000
"""For a page on a busy machine without a graphics card, ms."""


@pytest.fixture(scope="module")
def mech():
    return pp.load(NAME)


@pytest.fixture(scope="module")
def viewer(mech):
    viewer = Viewer(mech, pp.load_motion(NAME, mech), port=0)
    yield viewer
    viewer.stop()


def wait_for(condition, seconds=30.0):
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "waited in vain"
        time.sleep(0.01)


# --- what a page may send -----------------------------------------------------------------------------------


class Client:
    """A page as the server sees one: a web socket that speaks its messages."""

    def __init__(self, viewer, **more):
        import viser

        address = viewer.url.replace("http", "ws")
        protocols = [f"viser-v{viser.__version__}"]
        self.socket = connect(address, subprotocols=protocols, max_size=None, compression=None, **more)
        camera = {"type": "ViewerCameraMessage", "wxyz": (1, 0, 0, 0), "position": (0, 0, 1), "fov": 0.7}
        camera |= {"near": 0.1, "far": 9.0, "image_height": 9, "image_width": 9}
        self.send({**camera, "look_at": (0, 0, 0), "up_direction": (0, 0, 1)})
        wait_for(lambda: viewer._server.get_clients())

    def send(self, content):
        self.socket.send(content if isinstance(content, bytes | str) else msgspec.msgpack.encode(content))

    def update(self, uuid, **values):
        self.send({"type": "GuiUpdateMessage", "uuid": uuid, "updates": values})


def wait_for_end(socket):
    """Reads until the server closes the connection; TimeoutError where it does not."""
    with contextlib.suppress(websockets.exceptions.ConnectionClosed):
        while True:
            socket.recv(timeout=30)


def control(viewer, set, name):
    """The slider of a coordinate."""
    return viewer._panel._sliders[set][name].handle


def put_back(viewer):
    viewer._worker.submit("put back", lambda: viewer.model.choose_set("paper") or viewer.model.set_time(0.0))
    wait_for(lambda: viewer.model.view().time == 0.0)


def test_garbage_and_wrong_values_change_nothing_for_others(viewer, mech):
    """All that must not be done, then one good change, which is answered as ever."""
    put_back(viewer)
    pose = viewer.model.pose.copy()
    slider = control(viewer, "paper", "x")
    uuid, top = slider._impl.uuid, slider.max
    good, bad = Client(viewer), Client(viewer)
    for value in (float("nan"), float("inf"), -1e300, "200", None, [1.0], {"a": 1}, b"\0" * 100, True):
        bad.update(uuid, value=value)
    bad.update(uuid, value=-300.0, max=1e9)
    bad.update(uuid, max=1e9)
    bad.update(uuid, update_cb=[])
    bad.update("no such control", value=1.0)
    bad.update(viewer._panel._play._impl.uuid, value="yes")
    bad.send({"type": "ShareUrlRequest"})
    bad.send({"type": "FileTransferStartUpload", "source_component_uuid": uuid})
    for garbage in (b"", b"\xff\x00garbage", "text", {"type": "Nonsense"}, {"no": "type"}, [1, 2], None):
        client = Client(viewer)
        client.send(garbage)
        wait_for_end(client.socket)
    good.update(uuid, value=-320.0)
    wait_for(lambda: viewer.model.view().coordinates["x"] == pytest.approx(-0.32))
    assert slider.max == top
    assert viewer._server._share_tunnel is None
    moved = viewer.model.pose.copy()
    moved[0, 3] = pose[0, 3]
    view = viewer.model.view()
    expected = {**{n: mech.coordinates(pose, "paper")[n] for n in ("y", "z", "alpha", "beta")}, "x": -0.32}
    np.testing.assert_allclose(view.pose, mech.pose(expected, guess=pose), atol=1e-12)
    good.socket.close()
    bad.socket.close()


def test_a_message_that_is_too_long_ends_its_own_connection(viewer):
    client = Client(viewer)
    with contextlib.suppress(websockets.exceptions.ConnectionClosed):
        client.send(b"\0" * (51 * 2**20))
    wait_for_end(client.socket)
    Client(viewer).socket.close()


def test_pages_of_other_sites_get_nothing(viewer):
    import viser

    with connect(
        viewer.url.replace("http", "ws"),
        subprotocols=[f"viser-v{viser.__version__}"],
        origin="http://elsewhere.example",
    ) as socket:
        wait_for_end(socket)
        assert socket.close_code == 1008


def test_it_listens_on_this_machine_only(viewer):
    assert re.fullmatch(r"http://127\.0\.0\.1:\d+", viewer.url)
    host = viewer._server.get_host()
    assert host == "127.0.0.1"


def test_a_change_is_answered_within_one_frame(viewer):
    """Thirty pictures a second: by the time of the processor, whatever else the machine does."""
    put_back(viewer)
    wait_for(lambda: not viewer._worker._waiting)
    times = []
    for i in range(40):
        start = time.thread_time()
        assert viewer.model.set_coordinate("x", -0.326 + 1e-4 * i)
        viewer._answer()
        times.append(time.thread_time() - start)
    assert np.median(times) < 1.0 / 30.0


@pytest.mark.parametrize(("path", "degrees"), [("planar", 50.0), ("hexapod", 19.0)])
def test_a_flat_machine_is_seen_from_above(path, degrees):
    viewer = Viewer(pp.load(ROOT / "docs" / "mechanisms" / f"{path}.toml"), port=0)
    try:
        camera = viewer._server.initial_camera
        way = np.array(camera.position) - np.array(camera.look_at)
        assert np.degrees(np.arcsin(way[2] / np.linalg.norm(way))) == pytest.approx(degrees)
    finally:
        viewer.stop()


def test_names_from_a_file_are_texts(mech):
    """Names of legs are not part of the scene's names, nor HTML."""
    data = mech.to_dict()
    for leg, name in zip(data["legs"], ("a/b", "<i>c</i>", "**d**", "e f", "ß"), strict=True):
        leg["name"] = name
    viewer = Viewer(pp.Mechanism.from_dict(data), port=0)
    try:
        wait_for(lambda: viewer.durations)
        content = viewer._panel._numbers.content
        assert "<i>c" not in content
        assert "&lt;i&gt;c" in content
    finally:
        viewer.stop()


# --- in a browser -------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def page(browser, viewer):
    page = browser.new_page(viewport={"width": 1000, "height": 640})
    page.set_default_timeout(PATIENCE)
    yield page
    page.close()


def number(page, name):
    """A number that the page shows."""
    return float(page.locator(f"[data-polypod='{name}']").inner_text())


def type_into(page, label, value):
    """Types a number into the field beside a slider."""
    place = f"xpath=//label[normalize-space()='{label}']/ancestor::div[2]/..//input[@type='text']"
    field = page.locator(place).filter(visible=True)
    field.fill(str(value))
    field.press("Enter")
    return field


def wait_for_number(page, name, value, tolerance=0.051):
    page.wait_for_function(
        "([name, value, tolerance]) => Math.abs("
        'Number(document.querySelector(`[data-polypod="${name}"]`).innerText) - value) < tolerance',
        arg=[name, value, tolerance],
    )


def picture(page, screenshots, name):
    """A screenshot, without the notice that there is no graphics card."""
    notice = page.get_by_text("Software WebGL rendering detected")
    if notice.count():
        page.locator(".mantine-Notification-closeButton").first.click()
        notice.wait_for(state="detached")
    page.screenshot(path=screenshots / f"{name}.png")


def test_a_slider_moves_the_platform(page, viewer, mech, watch, screenshots):
    put_back(viewer)
    seen = watch(page)
    page.goto(viewer.url)
    page.locator("[data-polypod='x']").wait_for()
    page.locator("canvas").last.wait_for()
    picture(page, screenshots, "viewer")
    start = viewer.model.pose.copy()
    type_into(page, "x / mm", -200)
    wait_for_number(page, "x", -200.0)
    given = {name: mech.coordinates(start, "paper")[name] for name in ("y", "z", "alpha", "beta")}
    pose = mech.pose({**given, "x": -0.2}, guess=start)
    lengths = 1e3 * mech.inverse_kinematics(pose).lengths
    for leg, length in enumerate(lengths, start=1):
        assert number(page, f"length {leg}") == pytest.approx(length, abs=0.051)
    assert number(page, "sigma_min") == pytest.approx(float(mech.conditioning(pose).sigma_min), abs=5.1e-5)
    picture(page, screenshots, "viewer-limits")
    assert seen.errors == []
    assert seen.failed == []
    assert all(address.split("://")[1].startswith(viewer.url[7:]) for address in seen.requests)


def test_play_lets_time_go_on(page, viewer):
    page.get_by_role("tab", name="Motion").click()
    before = viewer.player.time
    page.get_by_role("button", name="Play").click()
    page.get_by_role("button", name="Pause").wait_for()
    page.wait_for_function(
        "before => Number(document.querySelector('[data-polypod=time]')?.innerText) > before + 0.2",
        arg=before,
    )
    page.get_by_role("button", name="Pause").click()
    page.get_by_role("button", name="Play").wait_for()
    assert not viewer.player.playing
    wait_for_number(page, "time", viewer.player.time, 0.006)
    solution = pp.solve(viewer.model.mech, pp.load_motion(NAME, viewer.model.mech)).dataset
    row = int(np.argmin(np.abs(solution["time"].to_numpy() - viewer.player.time)))
    assert number(page, "x") == pytest.approx(1e3 * float(solution["pose"][row, 0, 3]), abs=0.051)


def test_a_length_without_a_pose_is_refused_in_words(page, viewer, screenshots):
    put_back(viewer)
    page.get_by_role("tab", name="Leg lengths").click()
    wait_for_number(page, "x", -326.0)
    lengths = viewer.model.view().lengths
    field = type_into(page, "4 / mm", 852)
    status = page.locator("[data-polypod='status']")
    page.get_by_text("The length of leg 4 cannot be 852.0 mm").wait_for()
    assert "The last good pose stays." in status.inner_text()
    assert status.get_attribute("data-level") == "BEYOND"
    wait_for(lambda: float(field.input_value()) == pytest.approx(1e3 * lengths[3], abs=0.051))
    assert number(page, "length 4") == pytest.approx(1e3 * lengths[3], abs=0.051)
    np.testing.assert_array_equal(viewer.model.view().lengths, lengths)
    picture(page, screenshots, "viewer-refused")
    type_into(page, "4 / mm", 757)
    wait_for_number(page, "length 4", 757.0)
    page.get_by_text("The length of leg 4 cannot be").wait_for(state="detached")


def test_workspace_and_modes_are_shown(page, viewer, mech, screenshots):
    put_back(viewer)
    page.get_by_role("tab", name="Show").click()
    type_into(page, "step / mm", 60)
    page.get_by_role("button", name="Find where o can go").click()
    page.get_by_text("Reachable workspace of o").wait_for()
    picture(page, screenshots, "viewer-workspace")
    page.get_by_label("Show it").uncheck()
    page.get_by_role("button", name="All poses with these lengths").click()
    modes = mech.assembly_modes(mech.inverse_kinematics(viewer.model.pose).lengths)
    page.get_by_text(f"{int(modes.number)} poses have these leg lengths").wait_for()
    picture(page, screenshots, "viewer-modes")
    page.get_by_role("button", name="Put them away").click()
    page.get_by_text("poses have these leg lengths").wait_for(state="detached")


def test_a_page_without_a_server_plays(browser, mech, watch, tmp_path, screenshots):
    path = tmp_path / "scene.html"
    write_static(mech, pp.load_motion(NAME, mech), path)
    page = browser.new_page(viewport={"width": 640, "height": 420})
    page.set_default_timeout(PATIENCE)
    seen = watch(page)
    page.goto(path.as_uri())
    page.get_by_text("of its 801 rows the page shows 241").wait_for()
    page.locator("canvas").last.wait_for()
    clock = page.locator(".mantine-NumberInput-input").first
    before = float(clock.input_value())
    wait_for(lambda: abs(float(clock.input_value()) - before) > 0.3)
    page.keyboard.press("Space")
    picture(page, screenshots, "viewer-static")
    assert page.title() == f"Polypod: {NAME} along {NAME}"
    assert seen.errors == []
    assert seen.requests == []
    assert seen.failed == []
    page.close()
