"""Arrays on their way to the core: doubles, contiguous, the same leading axes for all."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from polypod import _core
from polypod.errors import ShapeError, UnknownNameError

Array = NDArray[np.float64]
Axes = tuple[int, ...]
Loaded = tuple[Any, ...]
"""Arrays, the load or None for the own one, and whether it is in platform axes."""


class Arguments:
    """The arrays that a call takes, by name, and the last axes of each.

    >>> import numpy as np
    >>> poses, twists = Arguments(pose=(4, 4), twist=(6,))(np.zeros((3, 4, 4)), np.zeros(6))
    >>> poses.shape, twists.shape
    ((3, 4, 4), (3, 6))
    """

    def __init__(self, **axes: Axes) -> None:
        self._axes = axes
        self._core = _core.Axes(list(axes.values()))
        self._with_load = None if "wrench" in axes else Arguments(**axes, wrench=(6,))

    def __call__(self, *values: ArrayLike) -> Sequence[Array]:
        """The values as arrays with the same leading axes.

        Raises:
            ShapeError: something that is no array of numbers, or axes that do not fit.
        """
        # Plain calls, those of a controller, do without numpy's slow ways.
        if self._core.fit(values):
            return values  # type: ignore[return-value]
        arrays = [doubles(*given) for given in zip(self._axes, values, self._axes.values(), strict=True)]
        pairs = list(zip(arrays, self._axes.values(), strict=True))
        shape = common(*(a.shape[: a.ndim - len(last)] for a, last in pairs))
        return [spread(a, shape + last) for a, last in pairs]

    def loaded(self, wrench: ArrayLike | None, wrench_axes: str, *values: ArrayLike) -> Loaded:
        """The checked arguments, then the load as the core takes it."""
        check_wrench_axes(wrench_axes)
        if wrench is None or self._with_load is None:
            return (*self(*values), None, False)
        return (*self._with_load(*values, wrench), wrench_axes == "platform")


POSE = Arguments(pose=(4, 4))
MOVING = Arguments(pose=(4, 4), twist=(6,))
MOTION = Arguments(pose=(4, 4), twist=(6,), acceleration=(6,))


def check_wrench_axes(name: str) -> None:
    """Refuses axes that a load cannot be given in."""
    if name not in ("base", "platform"):
        raise UnknownNameError("wrench_axes", name, ("base", "platform"))


def doubles(name: str, value: ArrayLike, last: Axes = (), *, batch: bool = True) -> Array:
    """`value` as contiguous doubles whose last axes are `last`; its only ones unless it may be a batch."""
    try:
        array = np.asarray(value, np.float64, order="C")
    except (TypeError, ValueError) as error:
        raise ShapeError(f"{name} is not an array of numbers: {error}") from None
    own = array.shape[array.ndim - len(last) :] if batch else array.shape
    if own != last:
        expected = f"({', '.join(['...', *map(str, last)])})" if batch else last
        raise ShapeError(f"{name} has the shape {array.shape}; needs {expected}")
    return array


def common(*shapes: Axes) -> Axes:
    """The leading axes that all these broadcast to."""
    if shapes.count(shapes[0]) == len(shapes):
        return shapes[0]
    try:
        return np.broadcast_shapes(*shapes)
    except ValueError:
        raise ShapeError(f"leading axes {', '.join(map(str, shapes))} do not broadcast") from None


def spread(array: Array, shape: Axes) -> Array:
    """The array with that shape, contiguous, whatever its strides and its place in memory."""
    if array.shape == shape and array.flags.c_contiguous and array.flags.aligned:
        return array
    return np.require(np.broadcast_to(array, shape), requirements=("C", "A"))
