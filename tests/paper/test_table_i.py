"""Table I of the paper: recomputed, against a second solution in numpy, and as quoted in docs/paper.md."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import least_squares

import polypod as pp
from polypod.paper.table_i import TABLE_I, fit_markdown, fit_table_i, table_i
from support import ROOT

PAGE = ROOT / "docs" / "paper.md"
CORNERS = np.radians([18.0, 90.0, 162.0, 234.0, 306.0])
TABLE_II = (0.150, 0.270, 0.265)  # e, E_1, E_2 in m
ROUNDING = np.radians(0.005)  # of a printed angle


@pytest.fixture(scope="module")
def mech():
    return pp.load("lu-3spu-2rpu-r")


@pytest.fixture(scope="module")
def first(mech):
    return table_i(mech)


@pytest.fixture(scope="module")
def fit(mech):
    return fit_table_i(mech)


def corners(radii):
    return np.stack([radii * np.cos(CORNERS), radii * np.sin(CORNERS), np.zeros(5)], axis=-1)


def turn(axis, angle):
    """The rotation about X (0) or Y (1)."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[1, 0, 0], [0, c, -s], [0, s, c]] if axis == 0 else [[c, 0, s], [0, 1, 0], [-s, 0, c]])


def natural(q, radii):
    """R and the five leg lengths from (α, p, h, β, γ) [T20]: every value satisfies the constraint."""
    e, on_rod, other = radii
    alpha, p, h, beta, gamma = q
    base, platform = corners(np.array([on_rod, other, on_rod, other, other])), corners(np.full(5, e))
    R = turn(0, alpha) @ turn(1, beta) @ turn(0, gamma)
    middle = (base[0] + base[2]) / 2 + [p, 0, 0] + h * turn(0, alpha)[:, 2]
    b = middle + (platform - (platform[0] + platform[2]) / 2) @ R.T
    return R, np.linalg.norm(b - base, axis=-1)


def solved(lengths, start, radii):
    """Angles of z with X, Y, Z at the given lengths, near natural coordinates `start`."""
    found = least_squares(
        lambda q: natural(q, radii)[1] - lengths, start, xtol=1e-15, ftol=1e-15, gtol=1e-15, method="lm"
    )
    assert np.max(np.abs(found.fun)) < 1e-12
    return np.arccos(natural(found.x, radii)[0][:, 2])


def all_solved(orientations, mech, radii):
    coordinates = mech.coordinates(orientations.pose, "natural")
    starts = np.stack([coordinates[name] for name in ("alpha", "p", "h", "beta", "gamma")], axis=-1)
    # Away from the answer, so that the second model must find it by itself.
    return np.array(
        [solved(row, q + 1e-3, radii) for row, q in zip(orientations.lengths, starts, strict=True)]
    )


def test_the_data_are_those_of_the_print(first):
    np.testing.assert_allclose(1e3 * first.lengths, np.array(TABLE_I)[:, :5], rtol=1e-15)
    np.testing.assert_allclose(np.degrees(first.published), np.array(TABLE_I)[:, 5:], rtol=1e-15)


def test_angles_against_natural_coordinates(mech, first):
    np.testing.assert_allclose(first.computed, all_solved(first, mech, TABLE_II), atol=1e-9)


def test_fitted_angles_against_natural_coordinates(fit):
    expected = all_solved(fit.orientations, fit.mechanism, fit.radii)
    np.testing.assert_allclose(fit.orientations.computed, expected, atol=1e-9)


def test_the_chosen_mode_is_the_nearest_above_the_base(first):
    for row in range(6):
        misfit = {
            k: np.sum((first.mode_angles[row, k] - first.published[row]) ** 2)
            for k in range(first.modes.number[row])
            if first.modes.above[row, k] == 1
        }
        assert len(misfit) > 1
        assert first.chosen[row] == min(misfit, key=misfit.__getitem__)
        assert first.pose[row, 2, 3] > 0


def test_squared_cosines_show_that_row_1_is_no_direction(first):
    """The sum is 1 within what rounding to 0.01° explains, but for row 1."""
    explained = ROUNDING * np.sum(np.abs(np.sin(2 * first.published)), axis=-1) + 1e-7
    assert list(np.abs(first.squared_cosines - 1) > explained) == [True] + 5 * [False]


def test_fit_is_the_least_and_does_not_depend_on_the_start(mech, fit):
    def sum_of_squares(radii):
        computed = all_solved(fit.orientations, fit.mechanism, radii)
        return np.sum((computed - fit.orientations.published) ** 2)

    least = sum_of_squares(fit.radii)
    for change in np.vstack([np.eye(3), -np.eye(3)]) * 2e-4:
        assert sum_of_squares(fit.radii + change) > least
    np.testing.assert_allclose(fit.start, TABLE_II, rtol=1e-15)
    data = mech.to_dict()
    data["home"]["position"][1] = (275.0 - 150.0) * np.sin(CORNERS[0])
    data["rods"][0]["point"][1] = 275.0 * np.sin(CORNERS[0])
    for leg in data["legs"]:
        leg["base"]["point"]["radius"] = 275.0 if "rod" in leg["base"] else 262.0
    other = fit_table_i(pp.mechanism.Mechanism.from_dict(data))
    np.testing.assert_allclose(other.radii, fit.radii, atol=1e-7)


def test_fit_in_other_units(mech, fit):
    """The file's unit of length does not matter."""
    data = mech.to_dict()
    data["units"]["length"] = "cm"
    data["rods"][0]["point"] = [x / 10 for x in data["rods"][0]["point"]]
    data["home"]["position"] = [x / 10 for x in data["home"]["position"]]
    for leg in data["legs"]:
        for end in ("base", "platform"):
            leg[end]["point"]["radius"] /= 10
        leg["stroke"] = {"min": 65.0, "max": 85.0}
    np.testing.assert_allclose(
        fit_table_i(pp.mechanism.Mechanism.from_dict(data)).radii, fit.radii, atol=1e-8
    )


def test_another_design_is_refused(mech):
    data = mech.to_dict()
    data["legs"][1]["base"]["point"]["radius"] = 266.0
    with pytest.raises(pp.UnsupportedError, match="one radius"):
        fit_table_i(pp.mechanism.Mechanism.from_dict(data))


def test_the_page_quotes_the_computed_numbers(first, fit):
    text = PAGE.read_text(encoding="utf-8")
    fitted = fit.orientations
    e, on_rod, other = 1e3 * fit.radii
    rounding = ROUNDING * np.sum(np.abs(np.sin(2 * first.published[0])))
    equal = fitted.lengths[0].copy()
    equal[[0, 2]] = equal[[0, 2]].mean()
    level = np.degrees(solved(equal, natural_start(fit), fit.radii))
    below = np.degrees(nearest_of_all(first, 1))
    for quoted in (
        fit_markdown(first, fit),
        f"{np.degrees(first.rms):.2f}° rms, {np.degrees(first.largest):.2f}° at most",
        f"e = {e:.1f}, E₁ = {on_rod:.1f} and E₂ = {other:.1f} mm",
        f"{np.degrees(fitted.rms):.2f}° rms, {np.degrees(fitted.largest):.2f}° at most",
        f"{np.degrees(np.sqrt(np.mean(fitted.difference[1:] ** 2))):.2f}° rms over the other five rows",
        f"φ_zX = {np.degrees(fitted.computed[0, 0]):.2f}°",
        f"is {1e4 * abs(first.squared_cosines[0] - 1):.1f}e-4 off 1",
        f"rounding explains {1e4 * rounding:.1f}e-4",
        f"({', '.join(f'{angle:.2f}' for angle in below)})°, nearer",
        f"φ = ({level[0]:.2f}, {level[1]:.2f}, {level[2]:.2f})°",
    ):
        assert quoted in text, quoted


def nearest_of_all(orientations, row):
    """Angles of the mode nearest to the published, above the base or not."""
    angles = orientations.mode_angles[row]
    return angles[np.nanargmin(np.sum((angles - orientations.published[row]) ** 2, axis=-1))]


def test_the_rule_above_the_base_matters_in_row_2_alone(first):
    same = [np.array_equal(nearest_of_all(first, row), first.computed[row]) for row in range(6)]
    assert same == [True, False, True, True, True, True]


def test_no_mode_of_row_1_has_the_printed_right_angle(first, fit):
    for orientations in (first, fit.orientations):
        assert np.nanmin(np.abs(orientations.mode_angles[0, :, 0] - np.pi / 2)) > np.radians(0.5)
        assert abs(orientations.computed[1, 0] - np.pi / 2) < 1e-9


def natural_start(fit):
    coordinates = fit.mechanism.coordinates(fit.orientations.pose[0], "natural")
    return np.array([float(coordinates[name]) for name in ("alpha", "p", "h", "beta", "gamma")])


def test_fitted_mechanism_keeps_its_home_upright(mech, fit):
    """The plane of legs 1 and 3 is upright at home and the rod passes through their base joints."""
    home = fit.mechanism.coordinates(fit.mechanism.home, "natural")
    assert abs(home["alpha"]) < 1e-12
    assert abs(home["p"]) < 1e-12
    assert fit.mechanism.home[2, 3] == mech.home[2, 3]
    rod, leg = fit.mechanism.to_dict()["rods"][0], 1e3 * fit.radii[1]
    assert rod["point"][1] == pytest.approx(leg * np.sin(CORNERS[0]), rel=1e-12)
