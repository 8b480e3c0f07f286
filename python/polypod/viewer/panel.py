"""The controls of the page and its numbers. Every change goes to the worker; every answer comes back here."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from polypod.answers import leg_words
from polypod.viewer import html
from polypod.viewer.model import Model, View
from polypod.viewer.player import SPEEDS, Player

if TYPE_CHECKING:
    import viser

_STEP = 0.1
"""Of sliders in mm and deg."""


class Inbox(Protocol):
    """Where changes go; see `Worker`."""

    def submit(self, key: Hashable, action: Callable[[], object]) -> None:
        """Has an action done soon."""

    def awaits(self, key: Hashable) -> bool:
        """Whether an action with this key still waits."""


def listen(control: Any, inbox: Inbox, key: Hashable, act: Callable[[Any], object]) -> None:
    """Has `act` called with a control's value whenever somebody at a page changes it.

    Calls come in order, the newest value only where several wait.
    """

    # On the event loop, so that they are submitted in order.
    async def heard(event: viser.GuiEvent[Any]) -> None:
        if event.client is not None:  # else the page is only told the present value
            value = event.target.value
            inbox.submit(key, lambda: act(value))

    (control.on_click if hasattr(control, "on_click") else control.on_update)(heard)


@dataclass(frozen=True)
class _Slider:
    """A slider and what it stands for, `factor` times a value in SI."""

    handle: Any
    key: Hashable
    factor: float
    step: float

    def show(self, value: float, inbox: Inbox) -> None:
        """Puts the slider where the value is, or as near as it goes; not while somebody moves it on."""
        if np.isnan(value) or inbox.awaits(self.key):
            return
        shown = min(max(self.factor * value, self.handle.min), self.handle.max)
        shown = round(round(shown / self.step) * self.step, 6)
        if abs(shown - self.handle.value) > 1e-9:
            self.handle.value = shown


class Panel:
    """Status, sliders, player and numbers."""

    def __init__(self, gui: viser.GuiApi, model: Model, player: Player | None, inbox: Inbox) -> None:
        self._gui, self._model, self._player, self._inbox = gui, model, player, inbox
        self._view: View | None = None
        self._largest = 0.0
        self._sliders: dict[str, dict[str, _Slider]] = {}
        self._folders: dict[str, Any] = {}
        self._status = gui.add_html("")
        self.tabs = gui.add_tab_group()
        with self.tabs.add_tab("Coordinates"):
            self._add_coordinates()
        with self.tabs.add_tab(leg_words.words(model.mech.drives).capitalize()):
            self._lengths = [self._length_slider(i) for i in range(model.mech.n_legs)]
        if player is not None:
            with self.tabs.add_tab("Motion"):
                self._add_player(player)
        self._numbers = gui.add_html("")

    # --- making --------------------------------------------------------------------------------------------

    def _add_coordinates(self) -> None:
        """A choice of the set, and a folder of sliders for each; only the chosen one is to be seen."""
        model, gui = self._model, self._gui
        chosen = model.set
        choice = gui.add_dropdown("Coordinate set", model.sets, initial_value=chosen)
        for name in model.sets:
            model.choose_set(name)
            self._folders[name] = gui.add_folder(f"Set {name}", visible=name == chosen)
            with self._folders[name]:
                self._sliders[name] = {each: self._slider(name, each) for each in model.names}
        model.choose_set(chosen)
        home = gui.add_button("Centre pose", color="gray")

        def go_home(_: object) -> None:
            self._stop()
            model.go(model.mech.home)

        listen(home, self._inbox, "home", go_home)
        listen(choice, self._inbox, "set", self._choose)

    def _choose(self, name: str) -> None:
        self._model.choose_set(name)
        for each, folder in self._folders.items():
            folder.visible = each == name

    def _slider(self, set: str, name: str) -> _Slider:
        model = self._model
        factor, unit, _ = html.scaled(name)
        step = _STEP if unit else 0.01
        low, high = (round(factor * end, 1) for end in model.range(name))
        now = float(model.mech.coordinates(model.pose, set)[name])
        start = min(max(round(factor * now, 1), low), high)
        handle = self._gui.add_slider(html.label(name), low, high, step, start)
        slider = _Slider(handle, ("coordinate", set, name), factor, step)

        def move(value: float) -> None:
            self._stop()
            if model.set == set:
                model.set_coordinate(name, value / factor)

        listen(handle, self._inbox, slider.key, move)
        return slider

    def _length_slider(self, leg: int) -> _Slider:
        model = self._model
        drive = model.mech.drives[leg]
        factor = leg_words.factor(drive)
        low, high = (round(factor * end, 1) for end in model.length_range(leg))
        now = factor * float(model.mech.inverse_kinematics(model.pose).lengths[leg])
        start = min(max(round(now, 1), low), high)
        active = model.moves_alone(leg)
        label = f"{model.mech.leg_names[leg]} / {leg_words.unit([drive])}"
        hint = None
        if not model.mech.actuated[leg]:
            hint = f"A passive leg: its {drive.coordinate} follows from the others."
        elif not active:
            hint = "More actuators than degrees of freedom: no leg moves alone, all follow the coordinates."
        handle = self._gui.add_slider(label, low, high, _STEP, start, disabled=not active, hint=hint)
        slider = _Slider(handle, ("length", leg), factor, _STEP)

        def move(value: float) -> None:
            self._stop()
            model.set_length(leg, value / factor)

        listen(handle, self._inbox, slider.key, move)
        return slider

    def _add_player(self, player: Player) -> None:
        gui, inbox = self._gui, self._inbox
        assert self._model.track is not None
        gui.add_markdown(_plain(self._model.track.words))
        self._play = gui.add_button("Play")
        step = max((player.end - player.start) / 1000.0, 1e-4)
        handle = gui.add_slider("t / s", player.start, player.end, step, player.start)
        self._time = _Slider(handle, "time", 1.0, step)
        speeds = [f"{speed:g} ×" for speed in SPEEDS]
        speed = gui.add_dropdown("Speed", speeds, initial_value="1 ×")
        loop = gui.add_checkbox("Again from the start", player.loop)

        def toggle(_: object) -> None:
            if player.playing:
                player.playing = False
            else:
                player.play()
                self._model.set_time(player.time)

        def seek(time: float) -> None:
            player.seek(time)
            self._model.set_time(player.time)

        def set_speed(text: str) -> None:
            if text in speeds:
                player.speed = SPEEDS[speeds.index(text)]

        def set_loop(wanted: bool) -> None:
            player.loop = wanted

        for control, key, act in ((self._play, "play", toggle), (handle, "time", seek)):
            listen(control, inbox, key, act)
        listen(speed, inbox, "speed", set_speed)
        listen(loop, inbox, "loop", set_loop)

    def _stop(self) -> None:
        if self._player is not None:
            self._player.playing = False

    # --- showing -------------------------------------------------------------------------------------------

    def show(self, view: View, largest: float, answered: float | None) -> None:
        """The numbers of a view, and the sliders where it is; `largest` and `answered` as for `numbers`."""
        self._view, self._largest = view, largest
        self._status.content = html.status(view.notes, view.level)
        for name, slider in self._sliders[self._model.set].items():
            slider.show(view.coordinates[name], self._inbox)
        for leg, slider in enumerate(self._lengths):
            slider.show(float(view.lengths[leg]), self._inbox)
        if self._player is not None:
            self._time.show(self._player.time, self._inbox)
            label = "Pause" if self._player.playing else "Play"
            if self._play.label != label:
                self._play.label = label
        self._numbers.content = html.numbers(view, self._model.mech, {}, largest, answered)

    def show_ranges(self, ranges: dict[str, tuple[float, float]], answered: float | None) -> None:
        """Adds the nearest singular values to the numbers."""
        if self._view is not None:
            text = html.numbers(self._view, self._model.mech, ranges, self._largest, answered)
            self._numbers.content = text


def _plain(text: str) -> str:
    """A text inside Markdown as it is."""
    return "".join(f"\\{c}" if c in "\\`*_{}[]()<>#+-!|~$" else c for c in text)
