"""The gallery: its pictures can be made again, look as the ones that are kept, and all stand on its page."""

from __future__ import annotations

import importlib.util
import re
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import polypod as pp
from polypod.bodies.links import link_frames, links_of
from support.pages import DOCS, blocks, read

spec = importlib.util.spec_from_file_location("gallery", DOCS / "gallery.py")
gallery = importlib.util.module_from_spec(spec)
spec.loader.exec_module(gallery)

QUICK = {"actuators", "head", "head-tilts", "slice-of-positions", "topology"}
"""Made in every run; the others take longer."""

MOST_BYTES = 3_000_000
"""Of all pictures together: everyone who fetches the source fetches them."""

DIFFERENCE = 0.15
"""Greatest difference of grey, of 1, between small pictures: of letters that are set a little otherwise.

A curve that moves or is missing makes more.
"""


def grey(path: Path) -> np.ndarray:
    """The picture, so small that letters do not matter."""
    return np.asarray(Image.open(path).convert("L").resize((64, 64)), dtype=float) / 255.0


def test_quick_ones_exist() -> None:
    assert set(gallery.PICTURES) > QUICK


@pytest.mark.parametrize(
    "name", [n if n in QUICK else pytest.param(n, marks=pytest.mark.slow) for n in gallery.PICTURES]
)
def test_pictures_are_made(name: str, tmp_path: Path) -> None:
    gallery.save(gallery.PICTURES[name](), tmp_path / "made.png")
    made, kept = grey(tmp_path / "made.png"), grey(gallery.IMAGES / f"{name}.png")
    assert np.ptp(made) > 0.2, "nothing is drawn"
    assert abs(made - kept).max() < DIFFERENCE, "make gallery has not been run"


def test_pictures_and_page_belong_together() -> None:
    page = read(DOCS / "gallery.md")
    shown = set(re.findall(r"\(images/gallery/([\w-]+)\.png\)", page))
    included = set(re.findall(r'--8<-- "docs/gallery\.py:([\w-]+)"', page))
    kept = {path.stem for path in gallery.IMAGES.iterdir()}
    marked = set(re.findall(r"--8<-- \[start:([\w-]+)\]", read(DOCS / "gallery.py")))
    assert shown == kept == set(gallery.PICTURES)
    assert included == marked >= shown


def test_pictures_are_small() -> None:
    assert sum(path.stat().st_size for path in gallery.IMAGES.iterdir()) < MOST_BYTES


def test_the_head_is_that_of_the_tutorial() -> None:
    text = next(block.text for block in blocks(DOCS / "tutorial.md") if block.title == "head.toml")
    assert pp.Mechanism.from_toml(text) == gallery.mechanism("head")


@pytest.mark.parametrize("path", sorted(gallery.MECHANISMS.glob("*.toml")), ids=lambda path: path.stem)
def test_mechanisms_of_the_gallery_are_sound(path: Path) -> None:
    mech = pp.load(path)
    assert mech.name == path.stem
    assert bool(mech.limits(mech.home).within)
    assert not any("singular" in warning for warning in mech.warnings)


def test_planar_platforms_are_drawn_above_their_joints() -> None:
    """Though base and platform joints lie in one plane, their plates are on both sides of it."""
    mech = gallery.mechanism("planar")
    thick = 1e-3 * mech.to_dict()["legs"][0]["radius"]
    height = {
        link.name: (link.mesh().vertices @ frame[:3, :3].T + frame[:3, 3])[:, 2] / thick
        for link, frame in zip(links_of(mech), link_frames(mech, mech.home).frames, strict=True)
    }
    # The inner side of a plate is two radii from its joints, the outer one nearly three; pins end at two.
    assert 2.5 < height["platform"].max() < 3.5
    assert -3.5 < height["base"].min() < -2.5
