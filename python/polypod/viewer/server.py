"""The live page: a viser server, its scene and panel, and the worker between them."""

from __future__ import annotations

import contextlib
import io
import logging
import socket
from statistics import median
from typing import Any

import numpy as np

from polypod.errors import PolypodError
from polypod.mechanism import Mechanism
from polypod.motion.motion import Motion
from polypod.viewer.message_filter import is_own_page, is_update
from polypod.viewer.model import Model
from polypod.viewer.player import Player, track_of
from polypod.viewer.viser_access import ViewerError, inner_parts, require_viser
from polypod.viewer.worker import Worker

LOCAL = ("127.0.0.1", "localhost", "::1")


class Viewer:
    """A page about a mechanism at `url`, the same one for all who open it: what one moves, all see.

    It listens on this machine only unless told otherwise, reads values of its own controls from pages and
    nothing else, and takes no file names and no code from them.
    """

    def __init__(
        self, mech: Mechanism, motion: Motion | None = None, *, host: str = "127.0.0.1", port: int = 8080
    ) -> None:
        """Starts serving.

        Args:
            mech: the mechanism.
            motion: a motion to play.
            host: the address to listen on.
            port: the port; 0 for any that is free.

        Raises:
            ViewerError: viser is not installed, or the address or port cannot be had.
        """
        viser = require_viser()
        from polypod.viewer.overlays import Overlays
        from polypod.viewer.panel import Panel
        from polypod.viewer.scene import Arrows, Machine, furnish

        track = None if motion is None else track_of(mech, motion)
        self.model = Model(mech, track)
        self.player = None if track is None else Player.of(track)
        port = _free_port(host, port)
        with contextlib.redirect_stdout(io.StringIO()):  # it greets in its own name
            self._server = viser.ViserServer(
                host=host, port=port, label=f"Polypod: {mech.name}", verbose=False
            )
        try:
            _restrict(self._server, local=host in LOCAL)
        except ViewerError:
            self._server.stop()
            raise
        self.url = f"http://{f'[{host}]' if ':' in host else host}:{self._server.get_port()}"
        self._worker = Worker(self._answer, tick=self._tick, settled=self._settle)
        gui, scene = self._server.gui, self._server.scene
        gui.configure_theme(show_logo=False, show_share_button=False, control_width="large")
        gui.main_panel.dock_right()
        view = self.model.view()
        furnish(self._server, self.model, view.frames)
        self._machine = Machine(scene, self.model.links)
        self._arrows = Arrows(scene, mech)
        self._arrows.force_scale = 0.0 if track is None else largest_force(mech, track)
        self._panel = Panel(gui, self.model, self.player, self._worker)
        with self._panel.tabs.add_tab("Show"):
            Overlays(self._server, self.model, self._arrows, self._worker)
        self._worker.start()
        self._worker.submit("start", lambda: None)

    @property
    def durations(self) -> tuple[float, ...]:
        """Time that each of the last answers took, from the change to the messages for the pages, s."""
        return tuple(self._worker.durations)

    def stop(self) -> None:
        """Ends the page."""
        self._worker.stop()
        with contextlib.redirect_stdout(io.StringIO()):
            self._server.stop()

    def _answer(self) -> None:
        view = self.model.view()
        with self._server.atomic():
            self._machine.show(view)
            self._arrows.show(view)
            self._panel.show(view, self._arrows.largest(view), self._usual_time())
        self._server.flush()

    def _tick(self, elapsed: float) -> bool:
        if self.player is None or not self.player.advance(elapsed):
            return False
        self.model.set_time(self.player.time)
        return True

    def _settle(self) -> None:
        with contextlib.suppress(PolypodError):
            self._panel.show_ranges(self.model.singular_values(), self._usual_time())

    def _usual_time(self) -> float | None:
        """Median time of the last answers, s."""
        return median(self.durations[-30:]) if self._worker.durations else None


def largest_force(mech: Mechanism, track: Any) -> float:
    """The largest active force of a motion's rows, N; 0 where none is known."""
    load = () if track.wrench is None else (track.wrench, track.wrench_axes)
    forces = mech.inverse_dynamics(track.pose, track.twist, track.acceleration, *load).forces
    return float(np.max(np.abs(forces), initial=0.0, where=np.isfinite(forces)))


def _free_port(host: str, port: int) -> int:
    """The port itself if it can be had; viser alone would take another one without a word."""
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    with socket.socket(family, socket.SOCK_STREAM) as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind((host, port))
        except (OSError, OverflowError) as error:
            raise ViewerError(
                f"cannot listen on port {port} of {host}: {error}; choose another one with --port, or any "
                "free one with --port 0"
            ) from None
        return int(probe.getsockname()[1])


def _restrict(server: Any, *, local: bool) -> None:
    """Lets pages change values of controls, and nothing else.

    viser itself would also take files and open a way to the machine from outside when a page asks for it.
    """
    parts = inner_parts(server)
    handle = parts.sockets._handle_incoming_message

    async def handle_values(client_id: Any, message: Any) -> None:
        if isinstance(message, parts.update):
            control = parts.controls.get(message.uuid)
            if control is not None and is_update(message.updates, control.value):
                await handle(client_id, message)

    async def check_origin(connection: Any) -> None:
        web = parts.connections.get(connection.client_id)
        if web is not None and not is_own_page(web.request.headers, local=local):
            await web.close(1008, "not a page of this server")

    parts.sockets._handle_incoming_message = handle_values
    parts.sockets.on_client_connect(check_origin)
    # Garbage ends the connection that it came on; no need for its traceback on the terminal.
    logging.getLogger("websockets.server").setLevel(logging.CRITICAL + 1)
