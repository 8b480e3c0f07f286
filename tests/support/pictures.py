"""Texts of figures: where they are, and whether they cover one another."""

from __future__ import annotations

import itertools

import numpy as np
from mpl_toolkits.mplot3d.proj3d import proj_transform


def box(text):
    """Of a drawn text, pixels: least x, least y, greatest x, greatest y."""
    extent = text.get_window_extent()
    if not hasattr(text, "get_position_3d"):
        return np.array(extent.extents)
    x, y, _ = proj_transform(*text.get_position_3d(), text.axes.get_proj())
    middle, half = text.axes.transData.transform((x, y)), np.array([extent.width, extent.height]) / 2
    return np.concatenate([middle - half, middle + half])


def overlaps(figure):
    """Pairs of texts of a figure whose boxes, with room above and below, share a fifth of the smaller."""
    figure.draw_without_rendering()
    texts = [*figure.texts, *(text for ax in figure.axes for text in ax.texts)]
    found = []
    for (first, a), (second, b) in itertools.combinations([(t.get_text(), box(t)) for t in texts], 2):
        sides = np.minimum(a[2:], b[2:]) - np.maximum(a[:2], b[:2])
        least = min(np.prod(a[2:] - a[:2]), np.prod(b[2:] - b[:2]))
        if (sides > 0).all() and np.prod(sides) > 0.2 * least:
            found.append((first, second))
    return found
