"""Derivatives by the numbers of bodies, the regressor, and base parameters, against the oracle."""

from __future__ import annotations

import copy
import re

import numpy as np
import pytest

from support import oracle as o
from support.cases import any_case
from support.varied import derivatives, each, motions, sample

LINEAR = 1e-11  # forces by two linear roads, times the condition number of the actuated legs' rows
ROUND_TRIP = 1e-7  # base parameters from forces: rounding times the condition number of their regressor


ENTRIES = {"xx": (0, 0), "xy": (0, 1), "xz": (0, 2), "yy": (1, 1), "yz": (1, 2), "zz": (2, 2)}


def body_of(spec, link):
    """The oracle's body of a link by its name."""
    kind, _, name = link.partition(" ")
    if kind == "platform":
        return spec["platform"]
    if kind == "rod":
        return next(r for r in spec["rods"] if r["name"] == name)["body"]
    return next(leg for leg in spec["legs"] if leg["name"] == name)[kind]


def parts(name):
    """Link and numbers of a parameter: "piston 1 I_xx = I_zz" has two."""
    link, numbers = re.fullmatch(r"(.*?) (\w+(?: = \w+)*)", name).groups()
    return link, numbers.split(" = ")


def change(spec, name, by):
    link, numbers = parts(name)
    body = body_of(spec, link)
    for number in numbers:
        key, _, entry = number.partition("_")
        if key == "mass":
            body["mass"] += by
        elif key == "center":
            body["center"] = body["center"] + by * np.eye(3)["xyz".index(entry)]
        else:
            i, j = ENTRIES[entry]
            inertia = body["inertia"].copy()
            inertia[i, j] += by
            inertia[j, i] = inertia[i, j]
            body["inertia"] = inertia


def value(spec, name):
    """A standard parameter from the oracle's bodies: inertia about the origin."""
    link, (number, *_) = parts(name)
    body = body_of(spec, link)
    if body is None:
        return 0.0
    m, c = body["mass"], body["center"]
    if number == "m":
        return m
    if number.startswith("mc_"):
        return m * c["xyz".index(number[-1])]
    return (body["inertia"] + m * (c @ c * np.eye(3) - np.outer(c, c)))[ENTRIES[number[-2:]]]


def with_bodies(name):
    """The sample with a body on every link, as the oracle sees it."""
    mech, spec, at = sample(name)
    spec = copy.deepcopy(spec)
    links = {parts(n)[0] for n in mech.regressor(*at).names}
    assert all(body_of(spec, link) is not None for link in links)
    return mech, spec, at


def oracle_forces(spec, at):
    T, twist, acceleration = at
    return o.active_forces(spec, (T[:, :3, :3], T[:, :3, 3]), twist, acceleration)


BODIED = ("6-sps", "6-ups", "3-spr", "rod-lined", "upf", "rpf", "fpr")


@pytest.mark.parametrize("name", BODIED)
def test_by_bodies(name):
    """Forces are quadratic in mass centres, linear in masses and inertias: central differences are exact."""
    mech, spec, at = with_bodies(name)
    by, actuated = derivatives(name), mech.actuated
    found = by.forces_by_bodies[:, actuated]
    expected = []
    for body in by.bodies:
        ends = []
        for sign in (1, -1):
            changed = copy.deepcopy(spec)
            change(changed, body, sign * 0.1)
            ends.append(oracle_forces(changed, at))
        expected.append((ends[0] - ends[1]) / 0.2)
    scale = np.maximum(np.abs(found).max(axis=(1, 2), keepdims=True), 1.0)
    assert np.all(np.abs(found - np.stack(expected, axis=-1)) <= 1e-10 * scale)
    assert not np.any(by.forces_by_bodies[:, ~actuated])


@pytest.mark.parametrize("name", BODIED)
def test_regressor_gives_the_forces_of_any_bodies(name):
    """Of the file's bodies and of others, drawn at random, in the oracle."""
    mech, spec, at = with_bodies(name)
    y, actuated = mech.regressor(*at), mech.actuated
    rng = np.random.default_rng(len(name))
    assert np.allclose(y.values, [value(spec, n) for n in y.names], rtol=1e-13, atol=1e-15)
    for body in (*mech.inverse_dynamics_derivatives(*at).bodies, ""):
        if body:
            change(spec, body, rng.uniform(0.01, 0.1))
    values = np.array([value(spec, n) for n in y.names])
    expected = oracle_forces(spec, at)
    found = (y.forces @ values + y.forces_offset)[:, actuated]
    scale = np.abs(expected).max(axis=-1, keepdims=True)
    assert np.all(np.abs(found - expected) <= LINEAR * scale)


@each
def test_regressor_with_the_files_parameters(name):
    """Forces and multipliers, with load, damping and efficiency."""
    mech, _, at = sample(name)
    wrench = np.array([30.0, -20.0, 50.0, 2.0, 3.0, -4.0])
    for load in ((), (wrench, "platform"), (wrench, "base")):
        y, d = mech.regressor(*at, *load), mech.inverse_dynamics(*at, *load)
        for kind in ("forces", "constraint"):
            found = getattr(y, kind) @ y.values + getattr(y, f"{kind}_offset")
            expected = getattr(d, kind)
            size = np.abs(expected).max(axis=-1, initial=1.0, keepdims=True)
            assert np.all(np.abs(found - expected) <= LINEAR * size)
        assert np.array_equal(y.status, d.status)


@each
def test_base_parameters_stand_for_all(name):
    """Forces of all parameters, whatever these are, are those of the base parameters."""
    mech, _, at = sample(name)
    y, base = mech.regressor(*at), mech.base_parameters()
    assert base.parameters == y.names
    assert base.names == tuple(y.names[i] for i in base.columns)
    assert np.array_equal(base.combination[:, base.columns], np.eye(len(base.names)))
    assert np.allclose(base.combination @ y.values, base.values, rtol=1e-12, atol=0)
    kept = y.forces[..., base.columns]
    scale = np.abs(y.forces).max(axis=(1, 2), keepdims=True)
    assert np.all(np.abs(kept @ base.combination - y.forces) <= 1e-9 * scale)
    dependent = np.setdiff1d(np.arange(len(y.names)), base.columns)
    assert base.remainders[dependent].max(initial=0.0) < 1e-11
    assert base.remainders[base.columns].min() > 1e-5


@pytest.mark.parametrize("name", ["6-ups", "3-rps-skew", "rpr", "rod-of-one"])
def test_the_number_of_base_parameters_is_the_rank(name):
    """From the oracle's forces of unit changes, at states of its own."""
    mech, spec = any_case(name).mech, any_case(name).spec
    T, twist, acceleration = motions(name, 80, seed=2)

    none, columns = oracle_forces(spec, (T, twist, acceleration)), []
    for body in derivatives(name).bodies:
        changed = copy.deepcopy(spec)
        change(changed, body, 0.3)
        columns.append((oracle_forces(changed, (T, twist, acceleration)) - none).ravel())
    size = np.linalg.norm(columns, axis=1)
    columns = [c / max(n, 1e-6 * size.max()) for c, n in zip(columns, size, strict=True)]
    s = np.linalg.svd(np.stack(columns, axis=-1), compute_uv=False)
    b = len(mech.base_parameters().names)
    assert s[b - 1] > 1e-6
    assert s[b:].max(initial=0.0) < 1e-9 * s[0]


@pytest.mark.parametrize("name", ["lu", "stewart-gough", "rod-lined"])
def test_identification_round_trip(name):
    """Random motions' forces, least squares: the file's base parameters, and forces of other motions."""
    mech, base = any_case(name).mech, any_case(name).mech.base_parameters()
    at = motions(name, 150, seed=3)
    y, d = mech.regressor(*at), mech.inverse_dynamics(*at)
    train, other = slice(0, None, 2), slice(1, None, 2)
    Y = y.forces[..., base.columns]
    target = d.forces - y.forces_offset
    rows, right = Y[train].reshape(-1, Y.shape[-1]), target[train].ravel()
    size = np.linalg.norm(rows, axis=0)
    found = np.linalg.lstsq(rows / size, right, rcond=None)[0] / size
    assert np.linalg.matrix_rank(rows / size) == len(base.names)
    contribution = np.abs(found - base.values) * size
    assert contribution.max() <= ROUND_TRIP * np.linalg.norm(right)
    assert np.allclose(Y[other] @ found, target[other], atol=1e-8 * np.abs(target[other]).max())
