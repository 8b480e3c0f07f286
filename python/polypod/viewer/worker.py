"""One thread that answers all changes, the newest of each kind only, so that no page waits for old ones."""

from __future__ import annotations

import sys
import threading
import time
import traceback
from collections import deque
from collections.abc import Callable, Hashable
from functools import partial

FRAME = 1.0 / 30.0
"""Time between two pictures of a running motion, s."""

SETTLED = 0.25
"""Quiet time after a change, s, before what takes longer is worked out."""

Action = Callable[[], object]


class Worker:
    """Runs actions in one thread, in the order of their keys; of two with one key the newer one only."""

    def __init__(
        self,
        answer: Action,
        *,
        tick: Callable[[float], bool] = lambda elapsed: False,
        settled: Action = lambda: None,
    ) -> None:
        """Makes the thread.

        Args:
            answer: called once after all actions that were waiting, and after a tick that changed something.
            tick: called about every `FRAME` with the time since the last call, s; whether anything changed.
            settled: called once when nothing has changed for `SETTLED`.
        """
        self._answer, self._tick, self._settled = answer, tick, settled
        self._waiting: dict[Hashable, Action] = {}
        self._wake = threading.Condition()
        self._stopped = False
        self._thread = threading.Thread(target=self._run, name="polypod viewer", daemon=True)
        self.durations: deque[float] = deque(maxlen=1000)
        """Time that each of the last answers took, actions included, s."""

    def start(self) -> None:
        """Starts the thread."""
        self._thread.start()

    def stop(self) -> None:
        """Lets the thread end, and waits for it."""
        with self._wake:
            self._stopped = True
            self._wake.notify()
        if self._thread is not threading.current_thread():
            self._thread.join(timeout=5.0)

    def submit(self, key: Hashable, action: Action) -> None:
        """Has an action done soon, in place of one with the same key that still waits."""
        with self._wake:
            self._waiting[key] = action
            self._wake.notify()

    def awaits(self, key: Hashable) -> bool:
        """Whether an action with this key still waits."""
        with self._wake:
            return key in self._waiting

    def _run(self) -> None:
        last = changed = time.perf_counter()
        unsettled = False
        while True:
            with self._wake:
                if not self._waiting and not self._stopped:
                    self._wake.wait(FRAME)
                if self._stopped:
                    return
                actions, self._waiting = list(self._waiting.values()), {}
            now = time.perf_counter()
            done = [_guarded(action) for action in actions]
            moved = _guarded(partial(self._tick, now - last)) is True
            last = now
            if done or moved:
                _guarded(self._answer)
                changed, unsettled = time.perf_counter(), True
                self.durations.append(changed - now)
            elif unsettled and now - changed > SETTLED:
                unsettled = False
                _guarded(self._settled)
            if moved:  # no faster than the pictures
                time.sleep(max(0.0, FRAME - (time.perf_counter() - now)))


def _guarded(action: Action) -> object:
    """An action whose failure is reported on the terminal, and does not end the thread."""
    try:
        return action()
    except Exception:
        traceback.print_exc(file=sys.stderr)
        return None
