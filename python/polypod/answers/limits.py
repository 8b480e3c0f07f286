"""Answers about limits: conditioning, and the slack of every limit."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from polypod.answers.answer import Answer, Array, Codes


@dataclass(eq=False, repr=False)
class Conditioning(Answer):
    """Singular values of the leg Jacobian on the twists that the constraints allow [T24]; pure numbers."""

    sigma_min: Array
    """(...): the smallest: near zero the platform moves with hardly any change of the leg lengths."""
    sigma_max: Array
    """(...): the largest."""
    condition: Array
    """(...): their quotient, sigma_max / sigma_min."""
    status: Codes
    """(...): `Status` of each state."""

    _variables: ClassVar = {
        "sigma_min": "sigma_min",
        "sigma_max": "sigma_max",
        "condition": "condition",
        "status": "status",
    }


@dataclass(eq=False, repr=False)
class Limits(Answer):
    """How far states are from the limits of their mechanism [T35]; m limits in the order of `limit_list`."""

    names: tuple[str, ...]
    """Such as "stroke max of leg 3"."""
    margins: Array
    """(..., m): signed slack of each in its own unit (m, rad, 1 or N), positive inside; NaN where it is not
    determined."""
    relative: Array
    """(..., m): the same as a part of the limit's scale, a pure number."""
    binding: NDArray[np.int64]
    """(...): index of the limit with the least relative slack; -1 where there is none."""
    within: NDArray[np.bool_]
    """(...): whether no limit is passed; False where a margin is NaN or the state has no answer."""
    status: Codes
    """(...): `Status` of each state."""

    _variables: ClassVar = {
        "margins": "limit_margin",
        "relative": "limit_relative",
        "binding": "binding_limit",
        "within": "within_limits",
        "status": "status",
    }
