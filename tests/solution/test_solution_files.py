"""Solutions in files: equal after reload, bit for bit, and never half a file."""

import tracemalloc
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from polypod.errors import SolutionError
from polypod.solution.solution import Solution, load_solution

SUFFIXES = (".nc", ".csv")


@pytest.fixture
def solution() -> Solution:
    random = np.random.default_rng(5)
    forces = random.normal(scale=1e3, size=(4, 2))
    forces[1] = np.nan, -0.0
    forces[2] = np.inf, 5e-324
    forces[3] = 0.1 + 0.2, 1.7976931348623157e308
    return Solution(
        xr.Dataset(
            {
                "force": (("time", "leg"), forces, {"units": "N", "long_name": "actuator force"}),
                "pose": (("time", "row", "column"), random.normal(size=(4, 4, 4))),
                "status": ("time", np.array([0, 1, 5, 7], np.int8), {"flag_values": [0, 1, 5, 7]}),
                "reached": ("time", np.array([True, False, True, True])),
                "constraint": (("time", "constraint_row"), np.empty((4, 0)), {"units": "N"}),
                "rod_omega": (("time", "rod", "axis"), np.empty((4, 0, 3)), {"units": "rad/s"}),
                "actuated": ("leg", np.array([True, False])),
                "stroke": (("leg", "end"), np.array([[0.65, 0.85], [-np.inf, np.inf]]), {"units": "m"}),
            },
            coords={
                "time": ("time", np.arange(4) / 7, {"units": "s"}),
                "leg": ["1", 'left, "β"'],
                "rod": np.array([], dtype="<U1"),
                "axis": ["x", "y", "z"],
            },
            attrs={"mechanism": 'name = "a"\n# β\n[units]\n', "motion": "", "version": "0.1.0", "branch": -1},
        )
    )


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_reload_is_equal_to_the_bit(solution: Solution, tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"a{suffix}"
    solution.save(path)
    again = load_solution(path)
    assert again == solution
    assert again.dataset.attrs == solution.dataset.attrs
    assert set(again.dataset.coords) == set(solution.dataset.coords)
    for name, variable in solution.dataset.variables.items():
        found = again.dataset.variables[name]
        if variable.dtype.kind in "fib":
            assert found.dtype == variable.dtype
            assert found.values.tobytes() == variable.values.tobytes()
    again.save(path)
    assert load_solution(path) == solution
    assert list(tmp_path.iterdir()) == [path]


def test_netcdf_files_are_those_that_xarray_writes(solution: Solution, tmp_path: Path) -> None:
    """Also of arrays that are no whole blocks of memory, and of read-only ones."""
    forces = np.broadcast_to(np.arange(6.0).reshape(2, 3).T[:, ::-1], (5, 3, 2))
    data = xr.Dataset({"a": (("time", "x", "y"), forces), "n": ("time", np.arange(5)[::-1])})
    for k, dataset in enumerate((solution.dataset.drop_dims(("rod", "constraint_row")), data)):
        ours, theirs = tmp_path / f"{k}.nc", tmp_path / f"{k}-xarray.nc"
        Solution(dataset).save(ours)
        about = {"polypod_format": "polypod solution 1", "polypod_empty": "[]"}
        dataset.assign_attrs(about).to_netcdf(theirs, engine="scipy")
        assert ours.read_bytes() == theirs.read_bytes()


def test_saving_needs_no_second_copy_of_all(tmp_path: Path) -> None:
    """SciPy alone takes the whole once more, in the byte order of the file."""
    columns = {f"v{k}": ("time", np.full(200_000, float(k))) for k in range(10)}
    solution = Solution(xr.Dataset(columns))
    solution.save(tmp_path / "a.nc")
    tracemalloc.start()
    solution.save(tmp_path / "a.nc")
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    # Of one variable at a time its bytes in the file's order, twice.
    assert peak < 0.5 * solution.dataset.nbytes


def test_one_file_becomes_the_other(solution: Solution, tmp_path: Path) -> None:
    solution.save(tmp_path / "a.nc")
    load_solution(tmp_path / "a.nc").save(tmp_path / "a.csv")
    assert load_solution(tmp_path / "a.csv") == solution


def test_the_table_is_readable(solution: Solution, tmp_path: Path) -> None:
    solution.save(tmp_path / "a.csv")
    lines = (tmp_path / "a.csv").read_text(encoding="utf-8").splitlines()
    header, first, *_ = [line for line in lines if not line.startswith("#")]
    assert header.startswith('time [s],force[1] [N],"force[left, ""β""] [N]","pose[1,1]","pose[1,2]"')
    assert first.startswith("0.0," + repr(float(solution.dataset["force"][0, 0])))


def test_equality(solution: Solution) -> None:
    other = Solution(solution.dataset.copy(deep=True))
    assert other == solution
    other.dataset["force"][0, 0] += 1e-9
    assert other != solution
    assert solution != solution.dataset
    renamed = Solution(solution.dataset.assign_attrs(motion="b"))
    assert renamed != solution


def test_saving_leaves_the_solution_alone(solution: Solution, tmp_path: Path) -> None:
    before = solution.dataset.copy(deep=True)
    for suffix in SUFFIXES:
        solution.save(tmp_path / f"a{suffix}")
    assert solution.dataset.identical(before)


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_a_failed_save_keeps_the_old_file(
    solution: Solution, tmp_path: Path, suffix: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / f"a{suffix}"
    path.write_text("old")

    def fail(*_: object) -> None:
        raise OSError("disk full")

    monkeypatch.setattr(Path, "replace", fail)
    with pytest.raises(SolutionError, match="cannot be written: disk full"):
        solution.save(path)
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_a_cut_file_is_refused(solution: Solution, tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"a{suffix}"
    solution.save(path)
    whole = path.read_bytes()
    for size in [*range(0, len(whole), 101), *range(len(whole) - 40, len(whole))]:
        path.write_bytes(whole[:size])
        with suppress(SolutionError):
            assert load_solution(path) == solution  # NetCDF pads its end


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("polypod solution 1", "polypod solution 0"),
        ("force[1] [N]", "force[1] [kN]"),
        ("status,", "stat,"),
        ("nan", "nought"),
        ("\n0.0,", "\n0.0,1.0,"),
        ('"shape": [4, 2]', '"shape": [5, 2]'),
        ("# {", "# "),
    ],
)
def test_a_changed_table_is_refused(solution: Solution, tmp_path: Path, old: str, new: str) -> None:
    path = tmp_path / "a.csv"
    solution.save(path)
    text = path.read_text(encoding="utf-8")
    assert old in text
    path.write_text(text.replace(old, new), encoding="utf-8")
    with pytest.raises(SolutionError, match="no whole Polypod solution"):
        load_solution(path)


def test_files_that_are_none(solution: Solution, tmp_path: Path) -> None:
    with pytest.raises(SolutionError, match="does not exist"):
        load_solution(tmp_path / "a.nc")
    with pytest.raises(SolutionError, match=r"ends in '.txt'; a solution's file ends in .nc or .csv"):
        load_solution(tmp_path / "a.txt")
    with pytest.raises(SolutionError, match=r"ends in ''; "):
        solution.save(tmp_path / "a")
    with pytest.raises(SolutionError, match="cannot be written"):
        solution.save(tmp_path / "none" / "a.nc")
    xr.Dataset({"a": 1.0}).to_netcdf(tmp_path / "b.nc", engine="scipy")
    with pytest.raises(SolutionError, match="does not say 'polypod solution 1'"):
        load_solution(tmp_path / "b.nc")
    (tmp_path / "b.csv").write_text("time,x\n0,1\n")
    with pytest.raises(SolutionError, match="does not say 'polypod solution 1'"):
        load_solution(tmp_path / "b.csv")
