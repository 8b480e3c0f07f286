"""Joints and limits of a mechanism, by name."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Joint:
    """A joint between two links, whose reaction is told of."""

    name: str
    """Such as "platform joint 3" or "rod L"."""
    kind: str
    """R, S, U or P; F where two links are one, so that the reaction is the load of their connection."""
    links: tuple[str, str]
    """The link on the base's side, which acts, and that on the platform's, which is acted on."""


@dataclass(frozen=True)
class Limit:
    """One limit of a mechanism."""

    name: str
    """Such as "stroke max of leg 3"."""
    kind: str
    """stroke min, stroke max, base cone, platform cone, base angle, platform angle, rod angle, leg clearance,
    platform clearance, conditioning, force min or force max."""
    legs: tuple[str, ...]
    """Names of the legs that it concerns."""
    unit: str
    """m, rad, N or 1: of bounds, scale and margins."""
    least: float
    """-inf where it has no lower bound."""
    greatest: float
    """inf where it has no upper bound."""
    scale: float
    """Scale of the relative slack."""
