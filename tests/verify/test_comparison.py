"""What the errors of a comparison are relative to."""

from __future__ import annotations

import numpy as np
import pytest

import polypod as pp
from polypod.verify import verify_states

pytest.importorskip("pinocchio")

from polypod.verify.pinocchio import Twin

ERROR = 1e-3
"""Put into one part of each quantity, in its unit."""


def test_errors_are_relative_to_the_motion_where_it_is_greater(monkeypatch):
    """Where a platform hardly accelerates, its squared speed by a length is what accelerations count with."""
    mech = pp.load("lu-3spu-2rpu-r")
    natural = {"alpha": 0.1, "p": -0.3, "h": 0.6, "beta": 0.8, "gamma": 0.6}
    speeds = {"alpha": 0.4, "p": 0.2, "h": 0.3, "beta": -0.5, "gamma": 0.7}
    state = mech.state(natural, speeds)
    mine = {"platform_acceleration": state.acceleration[:3], "platform_eps": state.acceleration[3:]}

    answer = Twin.answer

    def wrong(self, *given):
        found, status = answer(self, *given)
        for name in ("rates", "leg_omega", "accelerations", "leg_eps"):
            found[name] = np.array(found[name])
            found[name].flat[0] += ERROR
        return found | {name: np.add(array, (ERROR, 0, 0)) for name, array in mine.items()}, status

    monkeypatch.setattr(Twin, "answer", wrong)
    found = verify_states(mech, state.pose[None], state.twist[None], state.acceleration[None])
    rows = {row.quantity: row for row in found.comparisons[0].rows}

    size = mech.characteristic_length
    velocity, turning, gain, turning_gain = (
        np.linalg.norm(part) for part in (*np.split(state.twist, 2), *np.split(state.acceleration, 2))
    )
    speed = velocity + size * turning
    growth = gain + size * turning_gain + speed**2 / size
    scales = {"rates": speed, "leg_omega": speed / size, "accelerations": growth, "leg_eps": growth / size}
    scales |= {"platform_acceleration": growth, "platform_eps": growth / size}
    for quantity, scale in scales.items():
        row = rows[quantity]
        assert row.greatest < scale, "the motion is what counts here"
        assert row.relative_max == pytest.approx(row.max / scale, rel=1e-9), quantity
