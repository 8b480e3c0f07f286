"""Numbers with rates and second rates."""

from __future__ import annotations

import numpy as np


class Jet:
    """An array x of numbers with their rate d and their second rate dd."""

    __array_ufunc__ = None  # numpy leaves `array * jet` to the jet
    __slots__ = ("d", "dd", "x")

    def __init__(self, x, d=None, dd=None):
        self.x = np.asarray(x, float)
        self.d = np.zeros_like(self.x) if d is None else d
        self.dd = np.zeros_like(self.x) if dd is None else dd

    def __add__(self, other):
        b = jet(other)
        return Jet(self.x + b.x, self.d + b.d, self.dd + b.dd)

    def __neg__(self):
        return Jet(-self.x, -self.d, -self.dd)

    def __sub__(self, other):
        return self + -jet(other)

    def __rsub__(self, other):
        return jet(other) - self

    def __mul__(self, other):
        return bilinear(np.multiply, self, other)

    def __truediv__(self, other):
        b = jet(other)
        return self * chain(b, 1 / b.x, -1 / b.x**2, 2 / b.x**3)

    __radd__, __rmul__ = __add__, __mul__


def jet(x) -> Jet:
    return x if isinstance(x, Jet) else Jet(x)


def bilinear(f, a, b) -> Jet:
    """f(a, b) for an f that is linear in both: the product rule."""
    a, b = jet(a), jet(b)
    return Jet(f(a.x, b.x), f(a.d, b.x) + f(a.x, b.d), f(a.dd, b.x) + 2 * f(a.d, b.d) + f(a.x, b.dd))


def chain(a: Jet, f, f1, f2) -> Jet:
    """A function of a, given by its value and its first and second derivatives there: the chain rule."""
    return Jet(f, f1 * a.d, f1 * a.dd + f2 * a.d**2)


def sin(a) -> Jet:
    a = jet(a)
    return chain(a, np.sin(a.x), np.cos(a.x), -np.sin(a.x))


def cos(a) -> Jet:
    a = jet(a)
    return chain(a, np.cos(a.x), -np.sin(a.x), -np.cos(a.x))


def arccos(a) -> Jet:
    a = jet(a)
    w = 1 - a.x**2
    return chain(a, np.arccos(a.x), -1 / np.sqrt(w), -a.x / w**1.5)


def dot(a, b) -> Jet:
    return bilinear(lambda p, q: np.sum(p * q, axis=-1, keepdims=True), a, b)


def cross(a, b) -> Jet:
    return bilinear(np.cross, a, b)


def apply(R, m) -> Jet:
    return bilinear(lambda p, q: np.einsum("...ij,...j->...i", p, q), R, m)


def matmul(A, B) -> Jet:
    return bilinear(np.matmul, A, B)


def norm(a) -> Jet:
    s = dot(a, a)
    root = np.sqrt(s.x)
    return chain(s, root, 0.5 / root, -0.25 / root**3)


def unit(a) -> Jet:
    return jet(a) / norm(a)


def concat(items) -> Jet:
    """Arrays side by side along the last axis."""
    items = [jet(i) for i in items]
    return Jet(*(side_by_side([getattr(i, s) for i in items]) for s in ("x", "d", "dd")))


def side_by_side(arrays):
    shape = np.broadcast_shapes(*(a.shape[:-1] for a in arrays))
    return np.concatenate([np.broadcast_to(a, (*shape, a.shape[-1])) for a in arrays], axis=-1)


def columns(*vectors) -> Jet:
    """The matrix (..., 3, 3) with these columns."""
    flat = concat(vectors)
    return Jet(*(np.swapaxes(a.reshape(*a.shape[:-1], 3, 3), -1, -2) for a in (flat.x, flat.d, flat.dd)))
