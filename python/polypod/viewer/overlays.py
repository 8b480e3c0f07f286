"""Overlays of the page beside the machine: arrows, its workspace, its other assembly modes."""

from __future__ import annotations

import threading
import time
import traceback
from collections.abc import Callable, Iterable
from functools import partial
from html import escape
from typing import TYPE_CHECKING, Any

import numpy as np
import trimesh
from numpy.typing import NDArray

from polypod.answers import leg_words
from polypod.answers.kinematics import AssemblyModes
from polypod.answers.status import Status
from polypod.bodies.links import LinkPlaces
from polypod.errors import PolypodError
from polypod.mechanism import spans
from polypod.viewer.model import LATERAL, Model
from polypod.viewer.panel import Inbox, listen
from polypod.viewer.scene import Arrows, add_labels, add_triads, add_workspace
from polypod.workspaces.search import workspace
from polypod.workspaces.workspace import Workspace

if TYPE_CHECKING:
    import viser

Array = NDArray[np.float64]

MOST_MODES = 12
"""Assembly modes that are drawn."""

_STEPS = (2.0, 200.0)
"""Least and greatest width of a workspace's cells, mm."""


class Overlays:
    """The controls of the overlays, and what they draw."""

    def __init__(self, server: viser.ViserServer, model: Model, arrows: Arrows, inbox: Inbox) -> None:
        self._server, self._model, self._arrows, self._inbox = server, model, arrows, inbox
        self._places = LinkPlaces(model.mech)
        self._of = leg_words.words(model.mech.drives)
        self._busy = threading.Lock()
        self._workspace: Any = None
        self._modes: list[Any] = []
        self._poses: list[Array] = []
        self._add_arrows()
        self._add_workspace()
        self._add_modes()

    # --- arrows, axes, names -------------------------------------------------------------------------------

    def _add_arrows(self) -> None:
        gui, scene, mech = self._server.gui, self._server.scene, self._model.mech
        texts = {
            "forces": ("Active forces", "Black: of the legs on the platform, or on carriages."),
            "wrench": ("Constraint wrench", "At o: force violet, torque ochre."),
            "loose": ("Uncontrolled motion", "Magenta, near singular poses: what the locked legs let go."),
        }
        for key, (text, hint) in texts.items():
            box = gui.add_checkbox(text, self._arrows.wanted[key], hint=hint)
            listen(box, self._inbox, key, partial(self._want, key))
        triads, labels = add_triads(scene, mech), add_labels(scene, mech)
        for text, nodes in (("Axes", triads), ("Names of legs", labels)):
            box = gui.add_checkbox(text, True)
            listen(box, self._inbox, text, partial(_set_visible, nodes))

    def _want(self, arrows: str, wanted: bool) -> None:
        self._arrows.wanted[arrows] = wanted

    # --- workspace -----------------------------------------------------------------------------------------

    def _add_workspace(self) -> None:
        gui, mech = self._server.gui, self._model.mech
        reach = 2e3 * LATERAL * float(spans(mech).mean())
        step = round(min(max(reach / 30.0, _STEPS[0]), _STEPS[1]))
        with gui.add_folder("Workspace", expand_by_default=True):
            self._step = gui.add_slider("step / mm", _STEPS[0], _STEPS[1], 1.0, float(step))
            self._find = gui.add_button("Find where o can go")
            self._shown = gui.add_checkbox("Show it", True, visible=False)
            self._found = gui.add_html("")
        listen(self._find, self._inbox, "workspace", lambda _: self._start(self._find_workspace))
        listen(self._shown, self._inbox, "show workspace", self._show_workspace)

    def _find_workspace(self) -> None:
        step, last = self._step.value / 1e3, [0.0]
        self._say(self._found, "Looking …")

        def progress(done: float, total: float) -> None:
            if time.perf_counter() - last[0] > 0.2 and total > 0:
                last[0] = time.perf_counter()
                self._say(self._found, f"Looking … {100.0 * done / total:.0f} %")

        try:
            found = workspace(self._model.mech, step=step, threads=1, progress=progress)
        except PolypodError as error:
            self._say(self._found, str(error))
            return
        self._inbox.submit("workspace found", lambda: self._draw_workspace(found))

    def _draw_workspace(self, found: Workspace) -> None:
        if self._workspace is not None:
            self._workspace.remove()
        self._workspace = add_workspace(self._server.scene, found)
        self._workspace.visible = self._shown.value
        self._shown.visible = True
        size = f"{found.volume:.4g} ± {found.volume_error:.1g} m³"
        self._say(self._found, f"Reachable workspace of o: {size}, cells of {self._step.value:g} mm.")

    def _show_workspace(self, wanted: bool) -> None:
        if self._workspace is not None:
            self._workspace.visible = wanted

    # --- assembly modes ------------------------------------------------------------------------------------

    def _add_modes(self) -> None:
        gui = self._server.gui
        with gui.add_folder("Assembly modes", expand_by_default=True):
            self._all = gui.add_button(f"All poses with these {self._of.removeprefix('leg ')}")
            self._go = gui.add_dropdown("Go to", ("–",), visible=False)
            self._away = gui.add_button("Put them away", color="gray", visible=False)
            self._told = gui.add_html("")
        listen(self._all, self._inbox, "modes", lambda _: self._start(self._find_modes))
        listen(self._go, self._inbox, "go", self._go_to)
        listen(self._away, self._inbox, "away", lambda _: self._put_away())

    def _find_modes(self) -> None:
        mech, pose = self._model.mech, self._model.pose
        self._say(self._told, "Looking …")
        try:
            modes = mech.assembly_modes(mech.inverse_kinematics(pose).lengths)
        except PolypodError as error:
            self._say(self._told, str(error))
            return
        self._inbox.submit("modes found", lambda: self._draw_modes(modes, pose))

    def _draw_modes(self, modes: AssemblyModes, present: Array) -> None:
        """The mechanism once more for each mode, in a row behind the machine."""
        self._put_away()
        mech = self._model.mech
        total = int(modes.number)
        count = min(total, MOST_MODES)
        self._poses = [modes.pose[k] for k in range(count)]
        texts = []
        meshes = [self._mesh(pose) for pose in self._poses]
        gap = 1.5 * mech.characteristic_length
        widths = [float(np.ptp(mesh.bounds[:, 0])) + gap for mesh in meshes]
        depth = 1.3 * max((float(np.ptp(mesh.bounds[:, 1])) for mesh in meshes), default=1.0)
        left = -sum(widths) / 2
        for k, (pose, mesh, width) in enumerate(zip(self._poses, meshes, widths, strict=True)):
            shift = (left + gap / 2 - float(mesh.bounds[0, 0]), depth, 0.0)
            left += width
            self._modes.append(self._server.scene.add_mesh_trimesh(f"/modes/{k}", mesh, position=shift))
            text = _mode_words(modes, k, bool(np.linalg.norm(pose - present) < 1e-6))
            texts.append(text)
            x, y, _ = np.add(shift, mesh.bounds.mean(axis=0))
            above = (float(x), float(y), float(mesh.bounds[1, 2]) + 0.2 * mech.characteristic_length)
            self._modes.append(
                self._server.scene.add_label(f"/modes/name {k}", f"mode {k + 1}", position=above)
            )
        self._step_back(1.3 * sum(widths), depth)
        self._go.options = ("–", *texts)
        self._go.visible = self._away.visible = count > 0
        status = Status(int(modes.status))
        more = f" {count} of them are drawn." if count < total else ""
        doubt = "" if status is Status.OK else f" {status.message}."
        self._say(self._told, f"{total} poses have these {self._of}.{more}{doubt}")

    def _step_back(self, width: float, depth: float) -> None:
        """Moves the cameras of all pages back until they see a row of this width."""
        height = self._model.mech.characteristic_length
        for client in self._server.get_clients().values():
            client.camera.position = (0.0, -width, 0.4 * width)
            client.camera.look_at = (0.0, depth, height)

    def _mesh(self, pose: Array) -> trimesh.Trimesh:
        """The whole mechanism at a pose, smooth where it is round."""
        parts = []
        for link, frame in zip(self._model.links, self._places.at(pose).frames, strict=True):
            if np.isfinite(frame).all():
                mesh = link.mesh()
                mesh.apply_transform(frame)
                parts.append(mesh)
        joined: trimesh.Trimesh = trimesh.util.concatenate(parts)  # type: ignore[assignment]
        return joined

    def _go_to(self, text: str) -> None:
        options = [*self._go.options]
        if text in options[1:]:
            self._model.go(self._poses[options.index(text) - 1])

    def _put_away(self) -> None:
        for node in self._modes:
            node.remove()
        self._modes, self._poses = [], []
        self._go.visible = self._away.visible = False
        self._say(self._told, "")

    # --- what takes long -----------------------------------------------------------------------------------

    def _start(self, work: Callable[[], None]) -> None:
        """Has work done in a thread of its own, one at a time, while the page goes on answering."""

        def run() -> None:
            try:
                work()
            except Exception:
                traceback.print_exc()
            finally:
                self._busy.release()

        if self._busy.acquire(blocking=False):
            threading.Thread(target=run, name="polypod overlay", daemon=True).start()

    def _say(self, where: Any, text: str) -> None:
        style = "padding:0 12px 4px;font-size:12px;color:#262626"
        where.content = f"<div style='{style}'>{escape(text)}</div>" if text else ""


def _mode_words(modes: AssemblyModes, k: int, present: bool) -> str:
    sign = {1: "det J > 0", -1: "det J < 0"}.get(int(np.nan_to_num(modes.determinant_sign[k])), "det J = 0")
    side = "above" if modes.above[k] == 1.0 else "below"
    status = Status(int(modes.mode_status[k]))
    state = "" if status is Status.OK else f", {status.name.lower().replace('_', ' ')}"
    return f"mode {k + 1}{' (present)' if present else ''}: {side}, {sign}{state}"


def _set_visible(nodes: Iterable[Any], wanted: bool) -> None:
    for node in nodes:
        node.visible = wanted
