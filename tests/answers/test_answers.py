"""Answers by name: datasets, and how results show themselves in notebooks and elsewhere."""

from __future__ import annotations

import copy
import html.parser
import pickle
from dataclasses import fields, replace

import numpy as np
import pytest

import polypod as pp
from polypod.answers.answer import Answer
from polypod.answers.notebook import MOST_NUMBERS, MOST_ROWS, numbers, rows_of
from polypod.answers.variables import FURTHER, VARIABLES, variable
from polypod.errors import ShapeError
from polypod.solution.solve import states_along
from support import DATA

MECHANISMS = {"lu-3spu-2rpu-r": "lu-3spu-2rpu-r"} | {file.stem: file for file in DATA.glob("*.toml")}
HEIGHTS = np.array([[0.0, 0.01, 0.02], [0.03, 0.04, 5.0]])
"""By which the home pose is lifted, m; the last is out of reach of every stroke."""
REST = np.zeros(6)


def answers(mech, poses):
    """One of each kind, over the same poses."""
    still = (poses, REST, REST)
    found = [
        mech.inverse_kinematics(poses),
        mech.kinematics(*still),
        mech.platform_twist(poses, np.zeros(mech.n_legs)),
        mech.platform_acceleration(poses, REST, np.zeros(mech.n_legs)),
        mech.inverse_dynamics(*still),
        mech.forward_dynamics(poses, REST, np.zeros(mech.n_legs)),
        mech.equations_of_motion(poses, REST),
        mech.power(*still),
        mech.conditioning(poses),
        mech.determinant(poses),
        mech.singularity(poses),
        mech.singularity_distance(poses),
        mech.joint_reactions(*still),
        mech.inverse_dynamics_derivatives(*still),
        mech.regressor(*still),
        mech.limits(poses),
        mech.forward_kinematics(mech.inverse_kinematics(poses).lengths, poses),
    ]
    if mech.coupled_legs:
        found.append(mech.coupled_forces(poses, mech.inverse_dynamics(*still).constraint))
    return found


@pytest.fixture(scope="module")
def lu():
    return pp.load("lu-3spu-2rpu-r")


@pytest.fixture(scope="module")
def poses(lu):
    natural = {"alpha": 0.1, "p": -0.3, "h": 0.62 + HEIGHTS, "beta": 0.7, "gamma": 0.6}
    return lu.pose(natural)


# --- datasets -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", MECHANISMS)
@pytest.mark.parametrize("shape", [(), (1,), (6,), (2, 3), (0,)], ids=str)
def test_every_answer_goes_to_xarray_with_names_and_units(name, shape):
    mech = pp.load(MECHANISMS[name])
    poses = np.broadcast_to(mech.home, (*shape, 4, 4))
    leading = {0: (), 1: ("state",), 2: ("state_1", "state_2")}[len(shape)]
    for answer in answers(mech, poses):
        data = answer.to_xarray()
        assert data.attrs["mechanism"] == mech.name
        for quantity in answer.quantities():
            if 0 in quantity.values.shape[len(shape) :]:
                continue  # no rods, no constraints, no limits
            key = quantity.name if quantity.name in data.data_vars else quantity.key
            found = data[key]
            states = () if quantity.name in answer._same_for_all else leading
            assert found.dims == (*states, *quantity.about.dims)
            assert np.array_equal(found.values, quantity.values, equal_nan=found.dtype.kind == "f"), key
            assert found.attrs["long_name"]
            assert "units" in found.attrs or "flag_meanings" in found.attrs
        if "leg" in data.dims:
            assert data["leg"].values.tolist() == list(mech.leg_names)
        for dim in data.dims:
            assert dim in data.coords or dim in leading or data.sizes[dim] == 0


@pytest.mark.parametrize("name", MECHANISMS)
def test_every_array_of_an_answer_is_a_quantity(name):
    """A new array may not be forgotten: the fields of an answer are names, or arrays with their quantity."""
    mech = pp.load(MECHANISMS[name])
    more = [mech.base_parameters()] if mech.conditioning(mech.home).sigma_min > 0 else []
    for answer in (*answers(mech, mech.home[None]), *more):
        assert vars(answer).keys() == {field.name for field in fields(answer)}
        for field in fields(answer):
            if isinstance(getattr(answer, field.name), np.ndarray):
                assert field.name in answer._variables, f"{type(answer).__name__}.{field.name}"


def subclasses():
    return sorted(Answer.__subclasses__(), key=lambda kind: kind.__name__)


@pytest.mark.parametrize("kind", subclasses(), ids=lambda kind: kind.__name__)
def test_quantities_are_known(kind):
    assert {*kind._variables.values()} <= {*VARIABLES, *FURTHER, "status"}
    assert {*kind._variables} <= {field.name for field in fields(kind)}


def test_every_quantity_is_of_some_answer():
    used = {key for kind in subclasses() for key in kind._variables.values()}
    assert {*FURTHER} <= used


def test_an_answer_agrees_with_the_solution(lu):
    """The same quantity has the same unit, symbol and dimensions in both."""
    motion = pp.load_motion("lu-3spu-2rpu-r", lu).sample([0.0, 1.0])
    solution = pp.solve(lu, motion).to_xarray()
    state = states_along(lu, motion)
    answer = lu.kinematics(state.pose, state.twist, state.acceleration)
    data = answer.to_xarray("instant")
    for quantity in answer.quantities():
        if quantity.key == "status":
            continue
        mine, theirs = data[quantity.name], solution[quantity.key]
        assert mine.attrs == theirs.attrs
        assert mine.dims[1:] == theirs.dims[1:]
        assert np.array_equal(mine, theirs, equal_nan=True)
    own = state.to_xarray("time")
    for name in ("coordinate_x", "coordinate_rate_beta", "coordinate_second_rate_z"):
        assert own[name].attrs == solution[name].attrs
        assert np.array_equal(own[name], solution[name])
    for name, column in motion.to_xarray().data_vars.items():
        assert column.identical(solution[name].reset_coords(drop=True)), name


def test_states_by_name(lu, poses):
    data = lu.inverse_kinematics(poses).to_xarray("row_of_grid", "height")
    assert data.lengths.dims == ("row_of_grid", "height", "leg")
    assert data.lengths.sel(leg="3").dims == ("row_of_grid", "height")
    assert data.status.values.tolist() == [[0, 0, 0], [0, 0, 5]]
    assert data.status.attrs["flag_meanings"].split()[5] == "OUT_OF_STROKE"


@pytest.mark.parametrize(
    ("names", "message"),
    [
        (("height",), r"1 names for the leading axes \(2, 3\); needs 2"),
        (("leg", "height"), "'leg' is another name of the dataset"),
        (("lengths", "height"), "'lengths' is another name"),
        (("height", "height"), "'height' is another name"),
    ],
)
def test_names_of_states_that_do_not_fit(lu, poses, names, message):
    with pytest.raises(ShapeError, match=message):
        lu.inverse_kinematics(poses).to_xarray(*names)


def test_units_of_limits_and_coordinates_stand_beside_them(lu):
    limits = lu.limits(lu.home).to_xarray()
    assert limits.limit_unit.values.tolist() == [limit.unit for limit in lu.limit_list]
    distance = lu.singularity_distance(lu.home).to_xarray()
    assert dict(zip(distance.coordinate.values, distance.coordinate_unit.values, strict=True)) == {
        "alpha": "rad",
        "p": "m",
        "h": "m",
        "beta": "rad",
        "gamma": "rad",
    }


def test_codes_have_their_meaning(lu, poses):
    data = lu.singularity(poses).to_xarray()
    kinds = dict(zip(data.kind.attrs["flag_values"], data.kind.attrs["flag_meanings"].split(), strict=True))
    assert kinds[int(data.kind[0, 0])] == "NONE"
    assert data["screw_axis"].dims == ("state_1", "state_2", "axis")
    assert data["singular_leg"].dims == ("state_1", "state_2")


def test_coordinates_have_unit_and_symbol():
    second = variable("coordinate_second_rate_alpha")
    assert second == ((), "rad/s^2", "α''", "second rate of coordinate alpha", None)
    with pytest.raises(StopIteration):
        variable("no quantity")


# --- objects ------------------------------------------------------------------------------------------------


def test_an_answer_is_replaced(lu, poses):
    answer = lu.inverse_kinematics(poses)
    longer = replace(answer, lengths=2 * answer.lengths)
    assert longer.mech is lu
    assert np.array_equal(longer.lengths, 2 * answer.lengths)
    assert longer.vectors is answer.vectors


def test_an_answer_travels(lu, poses):
    answer = lu.inverse_kinematics(poses)
    for other in (pickle.loads(pickle.dumps(answer)), copy.deepcopy(answer)):
        assert other.mech == lu
        assert np.array_equal(other.lengths, answer.lengths)
        assert other.to_xarray().identical(answer.to_xarray())


# --- how they show themselves -------------------------------------------------------------------------------


class Reader(html.parser.HTMLParser):
    """Checks that tags are closed; collects texts and rows."""

    VOID = ("img", "br", "hr")

    def __init__(self):
        super().__init__()
        self.open, self.texts, self.rows = [], [], []

    def handle_starttag(self, tag, attrs):
        if tag not in self.VOID:
            self.open.append(tag)
        if tag == "tr":
            self.rows.append([])
        if tag in ("td", "th"):
            self.rows[-1].append("")

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.texts.append(data)
        if self.open and self.open[-1] in ("td", "th"):
            self.rows[-1][-1] += data


def read(result):
    reader = Reader()
    reader.feed(result._repr_html_())
    reader.close()
    assert reader.open == []
    return reader


@pytest.mark.parametrize("name", MECHANISMS)
@pytest.mark.parametrize("shape", [(), (7,), (2, 3), (0,)], ids=str)
def test_every_answer_shows_itself(name, shape):
    mech = pp.load(MECHANISMS[name])
    for answer in answers(mech, np.broadcast_to(mech.home, (*shape, 4, 4))):
        reader, text = read(answer), repr(answer)
        assert f"{type(answer).__name__} of {mech.name}" in reader.texts[1]
        assert text.startswith(f"{type(answer).__name__} of {mech.name}: ")
        shown = {cell for row in reader.rows for cell in row}
        for part in answer.arrays:
            if part != "status":
                assert f"\n  {part} " in text
                empty = 0 in getattr(answer, part).shape[len(shape) :] and part not in answer._same_for_all
                assert empty or any(part in cell.split() for cell in shown), part


def test_legs_are_rows_and_states_are_counted_by_status(lu, poses):
    reader = read(lu.inverse_kinematics(poses))
    said = "".join(reader.texts)
    assert "2 × 3 = 6 states: 5 OK, 1 OUT_OF_STROKE" in said
    assert reader.rows[0] == ["leg", "lengths r / m"]
    assert [row[0] for row in reader.rows[1:6]] == ["1", "2", "3", "4", "5"]
    assert reader.rows[1][1].startswith("0.6")


def test_coordinates_are_rows(lu):
    state = lu.state({"alpha": 0.1, "p": -0.3, "h": [0.6, 0.7], "beta": 0.8, "gamma": 0.6}, {"h": 0.05})
    rows = read(state).rows
    assert rows[0] == ["coordinate", "value", "rate", "second rate"]
    assert ["h / m", "0.6, 0.7", "0.05, 0.05", "0, 0"] in rows
    assert ["beta / rad", "0.8, 0.8", "0, 0", "0, 0"] in rows
    assert [row[0] for row in rows[-3:]] == ["pose", "twist", "acceleration"]
    assert "coordinate_rate_h  " in repr(state)


def test_what_has_no_answer_says_so(lu):
    natural = {"alpha": 0.1, "p": -0.3, "h": [np.nan, 0.7], "beta": 0.7, "gamma": 0.6}
    poses = lu.pose(natural)
    answer = lu.inverse_kinematics(poses)
    assert repr(answer).startswith("InverseKinematics of lu-3spu-2rpu-r: 2 states: ")
    assert "INVALID_INPUT" in repr(answer)
    assert ["1", f"NaN, {answer.lengths[1, 0]:.5g}"] in read(answer).rows
    assert "all NaN" in repr(lu.inverse_kinematics(poses[:1]))


def test_a_huge_batch_is_summarised(lu):
    many = lu.inverse_kinematics(np.broadcast_to(lu.home, (200_000, 4, 4)))
    assert len(repr(many)) < 500
    assert len(many._repr_html_()) < 5_000
    assert "200000 states: 200000 OK" in repr(many)
    parameters = read(lu.base_parameters())
    assert any("more" in text for text in parameters.texts)
    assert len(parameters.rows) < 60


def test_texts_of_a_file_are_escaped():
    content = pp.load("lu-3spu-2rpu-r").to_dict()
    evil = "<script>alert('&')</script>"
    content["name"], content["description"] = evil, evil
    content["legs"][1]["name"] = "<b>left</b>"
    mech = pp.Mechanism.from_dict(content)
    motion = pp.load_motion("lu-3spu-2rpu-r", mech).sample([0.0, 0.5, 1.0])
    shown = (
        mech,
        mech.mobility(),
        motion,
        pp.solve(mech, motion),
        mech.inverse_kinematics(mech.home),
        mech.limits(mech.home),
        pp.workspace(mech, step=0.2),
        pp.length_lattice(mech, step=0.1),
    )
    for result in shown:
        page = result._repr_html_()
        assert "<script" not in page
        assert "<b>left" not in page
        read(result)
    assert evil in "".join(read(mech).texts)


@pytest.mark.parametrize("name", MECHANISMS)
def test_a_mechanism_shows_its_legs_and_itself(name):
    mech = pp.load(MECHANISMS[name])
    reader = read(mech)
    table = [row for row in reader.rows if row and row[0] in mech.leg_names]
    assert [row[0] for row in table] == list(mech.leg_names)
    assert [row[1] for row in table] == list(mech.leg_letters)
    assert f"{mech.dof} degrees of freedom" in "".join(reader.texts)
    assert 'src="data:image/png;base64,iVBORw0KGgo' in mech._repr_html_()
    for warning in mech.warnings:
        assert warning in "".join(reader.texts)


def test_solutions_show_themselves(lu):
    motion = pp.load_motion("lu-3spu-2rpu-r", lu).sample(np.linspace(0.0, 8.0, 50))
    solution = pp.solve(lu, motion)
    assert repr(solution) == (
        "<Solution: lu-3spu-2rpu-r along lu-3spu-2rpu-r; 50 states from 0 s to 8 s: 50 OK>"
    )
    rows = read(solution).rows
    assert rows[0] == ["leg", "leg length r / m", "leg rate v_r / m/s", "active force of the leg f_a / N"]
    force = solution.dataset.force.sel(leg="2").values
    assert rows[2][3] == numbers(force)
    fall = pp.simulate(
        lu, lu.pose({"alpha": 0.1, "p": -0.3, "h": 0.7, "beta": 0.7, "gamma": 0.5}), until=1.0, step=0.01
    )
    assert "stroke max of leg 3" in "".join(read(fall).texts)
    assert "OUT_OF_STROKE" in repr(fall) or "OK" in repr(fall)


def test_solutions_of_other_datasets_show_themselves():
    import xarray as xr

    bare = pp.Solution(xr.Dataset({"force": (("time", "leg"), np.full((2, 2), np.nan))}))
    assert repr(bare).startswith("<Solution")
    read(bare)


def test_workspaces_and_lattices_show_themselves(lu):
    found = pp.workspace(lu, step=0.1)
    assert repr(found).startswith("<Workspace of lu-3spu-2rpu-r; reachable x, y, z: volume 0.2")
    rows = read(found).rows
    low, high = 1e3 * found.extents[0]
    assert rows[1] == ["x", f"{low:.1f} mm", f"{high:.1f} mm", f"{high - low:.1f} mm"]
    tilts = pp.workspace(lu, ["azimuth", "tilt"], {"x": 0.0, "y": 0.1, "z": 0.7}, step=0.2)
    assert "slice azimuth, tilt at x = 0.0 mm, y = 100.0 mm, z = 700.0 mm: area" in repr(tilts)
    read(tilts)
    lattice = pp.length_lattice(lu, step=0.1)
    assert f"{lattice.inside} of {lattice.nodes} combinations inside" in repr(lattice)
    data = lattice.to_xarray()
    assert np.array_equal(data.extents, lattice.extents)
    middles = data.layers.mean("end") > 0.3
    widths = data.profile.sel(layer=middles)
    across = widths.sel(end="greatest").max("layer") - widths.sel(end="least").min("layer")
    assert np.array_equal(across, lattice.widths_above(0.3))
    assert data.attrs["nodes"] == lattice.nodes


def test_numbers_are_honest():
    assert numbers([1.0, np.nan, -0.0]) == "1, NaN, 0"
    many = np.arange(MOST_NUMBERS + 1.0)
    assert numbers(many, "m") == f"0 … {MOST_NUMBERS} m"
    many[2] = np.nan
    assert numbers(many, "m") == f"0 … {MOST_NUMBERS} m; 1 NaN"
    assert numbers(np.full(9, np.nan), "m") == "all NaN"
    assert numbers(np.full(9, np.inf), "m") == "inf m"
    assert numbers(np.empty((0, 3))) == "none"
    assert numbers(np.full(9, 2.0), "m") == "2 m"
    assert numbers([-1.5e-9]) == "−1.5e−09"


def test_long_tables_are_cut_and_say_so():
    table = rows_of(("a",), [(str(i),) for i in range(MOST_ROWS + 3)])
    assert len(table.rows) == MOST_ROWS
    assert table.left_out == 3
