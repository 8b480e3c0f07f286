"""A page that plays a motion by itself: one file, which opens without a server and without a network."""

from __future__ import annotations

import contextlib
import io
from html import escape
from os import PathLike
from pathlib import Path

import numpy as np

from polypod.answers.singularity import NEAR_SINGULAR
from polypod.mechanism import Mechanism
from polypod.motion.motion import Motion
from polypod.viewer.model import Model
from polypod.viewer.player import Player, Track, track_of
from polypod.viewer.server import largest_force
from polypod.viewer.viser_access import ViewerError, require_viser

FRAMES_PER_SECOND = 30.0
MOST_FRAMES = 600
"""Pictures of a motion that a file keeps."""

_SUFFIX = ".html"

_CAPTION = """
<div style="position:fixed;left:14px;top:10px;z-index:5;font:12px/1.4 system-ui,sans-serif;color:#262626;
pointer-events:none;max-width:27em"><b style="font-size:15px">{name}</b><br>{words}<br>
<span style="color:#7A7A7A">{legend}</span></div>
"""
_LEGEND = (
    "Struts turn yellow near a limit and red beyond one, the platform magenta near singular poses "
    f"(σ_min below {NEAR_SINGULAR:g}).{{forces}} Polypod."
)


def check_static_path(path: Path) -> None:
    """Before any work: raises ViewerError for a file that cannot be written or does not end in .html."""
    if path.suffix != _SUFFIX:
        raise ViewerError(f"{path} ends in {path.suffix!r}; the file of a page ends in {_SUFFIX}")
    if not path.parent.is_dir():
        raise ViewerError(f"{path.parent} is no directory; make it first")


def write_static(mech: Mechanism, motion: Motion | None, path: str | PathLike[str]) -> None:
    """Writes a page that plays a motion, or shows the centre pose where there is none.

    Of a motion the page keeps thirty poses a second, at most `MOST_FRAMES`, evenly chosen, and says so.

    Raises:
        ViewerError: viser is not installed, or the file does not end in .html.
    """
    path = Path(path)
    check_static_path(path)
    viser = require_viser()
    track = None if motion is None else track_of(mech, motion, _frames(motion))
    model = Model(mech, track)
    # The recorder belongs to a server, which here nobody visits.
    with contextlib.redirect_stdout(io.StringIO()):
        server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
        try:
            page = _record(server, model, mech)
        finally:
            server.stop()
    path.write_text(_captioned(page, mech, track, motion), encoding="utf-8")


def _frames(motion: Motion) -> int:
    duration = float(motion.time[-1] - motion.time[0])
    return int(np.clip(round(FRAMES_PER_SECOND * duration) + 1, 2, MOST_FRAMES))


def _record(server: object, model: Model, mech: Mechanism) -> str:
    """The page of a scene that goes through the rows of the track."""
    import viser

    from polypod.viewer.scene import Arrows, Machine, add_labels, add_triads, furnish

    assert isinstance(server, viser.ViserServer)
    track = model.track
    view = model.view()
    furnish(server, model, view.frames)
    machine, arrows = Machine(server.scene, model.links), Arrows(server.scene, mech)
    add_triads(server.scene, mech)
    add_labels(server.scene, mech)
    machine.show(view)
    if track is None:
        arrows.show(view)
        return server.scene.as_html()
    arrows.force_scale = largest_force(mech, track)
    lost = server.scene.add_label("/lost", "no pose", position=_above(track, mech), visible=False)
    recorder = server.get_scene_serializer()
    player = Player.of(track)
    for row, time in enumerate(track.time):
        if row:
            recorder.insert_sleep(float(time - track.time[row - 1]))
        player.seek(float(time))
        known = model.set_time(player.time)
        with server.atomic():
            if known:
                view = model.view()
                machine.show(view)
                arrows.show(view)
            lost.visible = not known
    return recorder.as_html()


def _above(track: Track, mech: Mechanism) -> tuple[float, float, float]:
    """A place over the highest pose."""
    x, y, z = (float(part) for part in track.positions.mean(axis=0))
    return x, y, z + 1.5 * mech.characteristic_length


def _captioned(page: str, mech: Mechanism, track: Track | None, motion: Motion | None) -> str:
    """The page with its title and a caption."""
    words = "Centre pose." if track is None else track.words
    forces = " Black arrows: active forces"
    forces += "." if track is None else f", the longest {largest_force(mech, track):.0f} N."
    legend = _LEGEND.format(forces=forces)
    caption = _CAPTION.format(name=escape(mech.name), words=escape(words), legend=escape(legend))
    title = escape(f"Polypod: {mech.name}" + ("" if motion is None else f" along {motion.name}"))
    start, end = page.index("<title>"), page.index("</title>")
    page = f"{page[:start]}<title>{title}{page[end:]}"
    body = page.index("<body")
    body = page.index(">", body) + 1
    return page[:body] + caption + page[body:]
