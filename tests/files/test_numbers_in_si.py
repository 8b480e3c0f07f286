"""The numbers of a mechanism file in SI, by a second reading."""

from __future__ import annotations

import numpy as np

from support.cases import EXACT, any_case, each


@each
def test_file_is_read_into_the_same_numbers(name):
    c = any_case(name)
    got, want = c.mech.geometry, c.spec

    def same(a, b):
        if b is None or isinstance(b, str | bool | int):
            assert a == b
        else:
            np.testing.assert_allclose(a, b, rtol=EXACT, atol=EXACT)

    for key in ("name", "gravity", "efficiency", "linear_damping", "angular_damping"):
        same(got[key], want[key])
    for section, keys in (("load", ("force", "torque", "axes")), ("home", ("position", "rotation_vector"))):
        for key in keys:
            same(got[section][key], want[section][key])

    def same_body(a, b):
        assert (a is None) == (b is None)
        for key in b or ():
            same(a[key], b[key])

    same_body(got["platform"], want["platform"])
    for a, b in zip(got["legs"], want["legs"], strict=True):
        for key in ("name", "actuated", "stroke"):
            same(a[key], b[key])
        for end in ("base", "platform"):
            for key in ("joint", "point", "rod"):
                same(a[end][key], b[end][key])
            for key in ("axis", "normal"):
                assert (a[end][key] is None) == (b[end][key] is None)
                if b[end][key] is not None:
                    same(np.array(a[end][key]) / np.linalg.norm(a[end][key]), b[end][key])
        same_body(a["cylinder"], b["cylinder"])
        same_body(a["piston"], b["piston"])
    for a, b in zip(got["rods"], want["rods"], strict=True):
        same(a["point"], b["point"])
        same_body(a["body"], b["body"])
