"""The notebook tour runs from top to bottom in a kernel of its own."""

from __future__ import annotations

import asyncio
import os
import sys
import warnings
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from support import ROOT

nbclient = pytest.importorskip("nbclient")
nbformat = pytest.importorskip("nbformat")

TOUR = ROOT / "examples" / "tour.ipynb"


@pytest.fixture(scope="module")
def tour():
    return nbformat.read(TOUR, as_version=4)


def test_the_tour_is_kept_without_outputs(tour):
    nbformat.validate(tour)
    code = [cell for cell in tour.cells if cell.cell_type == "code"]
    assert code
    assert all(cell.outputs == [] and cell.execution_count is None for cell in code)
    assert TOUR.stat().st_size < 30_000


def test_the_tour_runs(tour, tmp_path, monkeypatch):
    # The kernel takes the package that is tested here; a warning in a cell is a failure, as elsewhere.
    package = str(Path(sys.modules["polypod"].__file__).parent.parent) if "polypod" in sys.modules else ""
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(filter(None, [package, os.environ.get("PYTHONPATH")])))
    monkeypatch.setenv("MPLBACKEND", "module://matplotlib_inline.backend_inline")
    for name in ("JUPYTER_RUNTIME_DIR", "IPYTHONDIR", "JUPYTER_CONFIG_DIR"):
        monkeypatch.setenv(name, str(tmp_path / name))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # what the machinery of notebooks warns of is not ours
        client = nbclient.NotebookClient(
            tour, timeout=120, kernel_name="python3", resources={"metadata": {"path": str(tmp_path)}}
        )
        # In a thread of its own: a browser that other tests have opened keeps a loop running in this one.
        with ThreadPoolExecutor(1) as thread:
            thread.submit(lambda: asyncio.run(client.async_execute())).result()
    code = [cell for cell in tour.cells if cell.cell_type == "code"]
    outputs = [output for cell in code for output in cell.outputs]
    assert not [o for o in outputs if o.output_type == "error"]
    assert not [o.text for o in outputs if o.output_type == "stream" and o.name == "stderr"]
    shown = [o.data for o in outputs if "data" in o]
    assert sum("image/png" in data for data in shown) == sum("plot" in cell.source for cell in code[1:])
    cards = [data["text/html"] for data in shown if "polypod" in data.get("text/html", "")]
    assert len(cards) >= 8
    assert any("100000 states" in card for card in cards)
    assert any("Mechanism" in data["text/plain"] for data in shown)
