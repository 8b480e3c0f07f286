"""The equations as a user would write them for this one mechanism, for numpy and for numba.

Vectors are tuples of three numbers, or of three arrays with an entry for each state, so that the same
lines serve both. They are the equations of docs/theory.md with what this mechanism's data allow: mass
centres on the legs' lines and at o, inertias that are multiples of the unit matrix, no damping. Nothing
is checked, there is no status.
"""

from typing import NamedTuple

import numpy as np

try:
    from numba.extending import register_jitable
except ImportError:  # numpy gets by without

    def register_jitable(function):
        return function


class Leg(NamedTuple):
    """The numbers of a leg, SI. No arrays: numba would count their references in every call."""

    base: tuple  # B
    platform: tuple  # b in platform axes
    axis: tuple  # u, in base axes where it stands on the rod (RPU), else in platform axes (SPU)
    cylinder: tuple  # mass, distance of the mass centre from B, inertia
    piston: tuple  # mass, distance of the mass centre from b, inertia
    on_rod: float  # 1 or 0
    rod_inertia: float  # of the rod that it leads, else 0


class Rest(NamedTuple):
    """The other numbers of the mechanism, SI."""

    rod: tuple  # L
    cross_axis: tuple  # l, in platform axes
    mass: float  # of the platform
    inertia: float
    gravity: tuple
    force: tuple  # load
    torque: tuple
    scale: float  # characteristic length


def data_of(mech):
    """A table with a row for each leg, as `leg_of` reads it, and the rest."""
    geometry = mech.geometry
    legs, rod, platform, load = (geometry[key] for key in ("legs", "rods", "platform", "load"))
    rod = rod[0]
    plain = (geometry["efficiency"], geometry["linear_damping"], geometry["angular_damping"]) == (1, 0, 0)
    if not plain or np.any(platform["center"]) or np.any(rod["body"]["center"]) or load["axes"] != "base":
        raise ValueError(
            f"{mech.name}: these equations have no such efficiency, damping, mass centre or load"
        )
    table, leader = [], 1.0
    for leg in legs:
        on_rod = leg["base"]["rod"] is not None
        table.append(
            (
                *leg["base"]["point"],
                *leg["platform"]["point"],
                *(rod["axis"] if on_rod else leg["platform"]["axis"]),
                *_axial(leg["cylinder"], 1.0),
                *_axial(leg["piston"], -1.0),
                on_rod,
                leader * on_rod * _isotropic(rod["body"]),
            )
        )
        leader = leader * (not on_rod)
    rest = Rest(
        rod=tuple(rod["axis"]),
        cross_axis=tuple(legs[0]["platform"]["axis"]),
        mass=platform["mass"],
        inertia=_isotropic(platform),
        gravity=tuple(geometry["gravity"]),
        force=tuple(load["force"]),
        torque=tuple(load["torque"]),
        scale=mech.characteristic_length,
    )
    return np.array(table, dtype=float), rest


def _isotropic(body):
    inertia = np.array(body["inertia"])
    if np.any(inertia != inertia[0, 0] * np.eye(3)):
        raise ValueError(f"inertia is {inertia.tolist()}; these equations take a multiple of the unit matrix")
    return float(inertia[0, 0])


def _axial(body, sign):
    x, y, z = body["center"]
    if x != 0.0 or z != 0.0:
        raise ValueError(f"center is {body['center']}; these equations take one on the leg's line")
    return body["mass"], sign * y, _isotropic(body)


@register_jitable
def leg_of(table, k):
    """The numbers of leg k."""
    return Leg(
        (table[k, 0], table[k, 1], table[k, 2]),
        (table[k, 3], table[k, 4], table[k, 5]),
        (table[k, 6], table[k, 7], table[k, 8]),
        (table[k, 9], table[k, 10], table[k, 11]),
        (table[k, 12], table[k, 13], table[k, 14]),
        table[k, 15],
        table[k, 16],
    )


@register_jitable
def add(a, b):
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@register_jitable
def sub(a, b):
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


@register_jitable
def times(a, x):
    return a[0] * x, a[1] * x, a[2] * x


@register_jitable
def dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@register_jitable
def cross(a, b):
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@register_jitable
def turned(R, m):
    """R m, R being the tuple of its columns."""
    return add(add(times(R[0], m[0]), times(R[1], m[1])), times(R[2], m[2]))


@register_jitable
def position(leg, R, o):
    """e, r, length and δ [T1]."""
    e = turned(R, leg.platform)
    r = sub(add(o, e), leg.base)
    length = np.sqrt(dot(r, r))
    return e, r, length, times(r, 1.0 / length)


@register_jitable
def constraint_row(leg, rest, R, o):
    """The constraint of leg 1, (c, τ) [T10]."""
    e, r, _, _ = position(leg, R, o)
    cross_axis = turned(R, rest.cross_axis)
    c = cross(rest.rod, cross_axis)
    return c, sub(cross(e, c), cross(cross_axis, cross(rest.rod, r)))


@register_jitable
def constraint_value(leg, rest, R, o):
    """The error of the constraint of leg 1, g [T9]."""
    _, r, _, _ = position(leg, R, o)
    return dot(cross(turned(R, rest.cross_axis), r), rest.rod)


@register_jitable
def wrench(leg, gravity, R, o, v, omega, a, eps):
    """The leg's row of J, and its weight and inertia carried to the platform [T1-T8, T13, T14]."""
    e, _, length, delta = position(leg, R, o)
    inverse = 1.0 / length
    spin_e = cross(omega, e)
    v_b = add(v, spin_e)
    a_b = add(add(a, cross(eps, e)), cross(omega, spin_e))
    rate = dot(delta, v_b)
    delta1 = times(sub(v_b, times(delta, rate)), inverse)
    second = dot(delta, a_b) + dot(v_b, delta1)
    delta2 = times(sub(sub(a_b, times(delta, second)), times(delta1, 2.0 * rate)), inverse)

    # N = u×δ and its rates; u rotates with the platform in the SPU legs.
    if leg.on_rod > 0.0:
        u = leg.axis
        normal = cross(u, delta)
        normal1 = cross(u, delta1)
        normal2 = cross(u, delta2)
    else:
        u = turned(R, leg.axis)
        u1 = cross(omega, u)
        u2 = add(cross(eps, u), cross(omega, u1))
        normal = cross(u, delta)
        normal1 = add(cross(u1, delta), cross(u, delta1))
        normal2 = add(add(cross(u2, delta), times(cross(u1, delta1), 2.0)), cross(u, delta2))
    part = 1.0 / dot(normal, normal)
    w = times(cross(delta, normal), part)
    spin = dot(normal1, w)
    stretch = dot(normal, normal1) * part
    spin1 = dot(normal2, w) + dot(normal1, cross(delta1, normal)) * part - 2.0 * spin * stretch
    leg_eps = add(add(cross(delta, delta2), times(delta, spin1)), times(delta1, spin))

    # Mass centres lie on the line: b - l_p δ and B + l_q δ.
    mass_q, l_q, inertia_q = leg.cylinder
    mass_p, l_p, inertia_p = leg.piston
    force_q = times(sub(gravity, times(delta2, l_q)), mass_q)
    force_p = times(sub(gravity, sub(a_b, times(delta2, l_p))), mass_p)
    moment = cross(delta, sub(times(force_q, l_q), times(force_p, l_p)))
    moment = sub(moment, times(leg_eps, inertia_q + inertia_p))

    about = dot(moment, delta)
    conjugate = add(cross(moment, delta), times(cross(w, u), about))
    if leg.rod_inertia > 0.0:
        # The rod rotates with this leg [T7].
        rod_rate = dot(normal, delta1) * part
        rod_acceleration = dot(normal, delta2) * part - 2.0 * rod_rate * stretch
        conjugate = sub(conjugate, times(normal, leg.rod_inertia * rod_acceleration * part))
    across = sub(conjugate, times(delta, dot(delta, conjugate)))
    force = add(force_p, times(across, inverse))
    torque = cross(e, force)
    if not leg.on_rod > 0.0:
        torque = add(torque, times(cross(u, cross(delta, w)), about))
    return delta, cross(e, delta), force, torque


@register_jitable
def platform_wrench(rest, a, eps):
    """Load, weight and inertia of the platform [T15]."""
    force = times(sub(rest.gravity, a), rest.mass)
    return add(rest.force, force), sub(rest.torque, times(eps, rest.inertia))
