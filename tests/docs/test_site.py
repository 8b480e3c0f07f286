"""The built site in a real browser: no errors, nothing from elsewhere, no broken links, formulas shown."""

from __future__ import annotations

import functools
import http.server
import os
import subprocess
import sys
import threading
import zlib
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import unquote, urldefrag, urljoin

import pytest

import polypod as pp
from support.pages import DOCS, ROOT

pytestmark = pytest.mark.slow

SHOWN = ("", "tutorial/", "how-to/actuators/", "api/", "theory/", "gallery/", "performance/")
"""Pages whose pictures are kept, in light and in dark."""


class Quiet(http.server.SimpleHTTPRequestHandler):
    def log_message(self, *_: object) -> None:
        pass


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of the site, built with warnings as errors."""
    pytest.importorskip("mkdocs")
    folder = tmp_path_factory.mktemp("site")
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--quiet", "-d", str(folder)]
    environment = os.environ | {"NO_MKDOCS_2_WARNING": "1"}
    built = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True)
    assert built.returncode == 0, built.stderr
    return folder


@pytest.fixture(scope="module")
def home(site: Path) -> Iterator[str]:
    """Its address, on this machine."""
    handler = functools.partial(Quiet, directory=str(site))
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield f"http://127.0.0.1:{server.server_port}/"
        server.shutdown()


def paths(site: Path) -> list[str]:
    return sorted(p.parent.relative_to(site).as_posix() for p in site.rglob("index.html"))


def address(home: str, path: str) -> str:
    return home if path == "." else f"{home}{path}/"


def test_every_page_of_the_sources_is_there(site: Path) -> None:
    wanted = {
        p.relative_to(DOCS).with_suffix("").as_posix().removesuffix("index") for p in DOCS.rglob("*.md")
    }
    assert {f"{p}/".removeprefix("./") for p in paths(site)} == {
        f"{p.removesuffix('/')}/".removeprefix("/") for p in wanted
    }


def test_pages_are_whole(browser, watch, site: Path, home: str) -> None:
    """No console errors, nothing from elsewhere; pictures show, links of its own lead somewhere."""
    page = browser.new_page()
    seen = watch(page)
    refused: list[str] = []
    page.on("response", lambda response: refused.append(response.url) if response.status >= 400 else None)
    links: dict[str, set[str]] = {}
    ids: dict[str, set[str]] = {}
    for path in paths(site):
        at = address(home, path)
        page.goto(at, wait_until="networkidle")
        found = page.evaluate(
            """() => ({
                links: [...document.querySelectorAll("a[href]")].map(a => a.getAttribute("href")),
                ids: [...document.querySelectorAll("[id]")].map(e => e.id),
                blank: [...document.images].filter(i => i.complete && !i.naturalWidth).map(i => i.src),
            })"""
        )
        assert not found["blank"], f"{path}: pictures that do not show"
        links[at] = {urljoin(at, link) for link in found["links"]}
        ids[at] = set(found["ids"]) | {""}
    assert not seen.errors
    assert not refused
    assert [url for url in seen.requests if not url.startswith(home)] == []
    for at, targets in links.items():
        for target in filter(lambda url: url.startswith(home), targets):
            url, anchor = urldefrag(target)
            if url in ids:
                assert unquote(anchor) in ids[url], f"{at}: {target}"
            else:
                assert (site / unquote(url.removeprefix(home))).is_file(), f"{at}: {target}"
    page.close()


def test_formulas_are_shown(browser, site: Path, home: str) -> None:
    page = browser.new_page()
    page.goto(f"{home}theory/", wait_until="networkidle")
    assert page.locator("math").count() > 300
    assert page.locator("merror").count() == 0
    sizes = page.evaluate(
        """() => [...document.querySelectorAll("math")].map(m => m.getBoundingClientRect())
            .map(box => [box.width, box.height])"""
    )
    assert min(min(size) for size in sizes) > 3  # pixels
    assert page.evaluate("() => document.documentElement.scrollWidth <= innerWidth")
    text = page.locator("article").inner_text()
    assert "\\frac" not in text
    assert "$$" not in text
    page.close()


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_pictures_of_the_main_pages(browser, screenshots: Path, home: str, scheme: str) -> None:
    page = browser.new_page(viewport={"width": 1280, "height": 900}, color_scheme=scheme)
    for path in SHOWN:
        page.goto(home + path, wait_until="networkidle")
        name = path.strip("/").replace("/", "-") or "home"
        page.screenshot(path=screenshots / f"site-{name}-{scheme}.png")
        wanted = "slate" if scheme == "dark" else "default"
        assert page.locator("body").get_attribute("data-md-color-scheme") == wanted
    page.close()


def test_the_reference_holds_every_public_name(site: Path) -> None:
    """The inventory of the site lists all public names, as other sites would refer to them."""
    _, _, _, _, packed = (site / "objects.inv").read_bytes().split(b"\n", 4)
    listed = {line.split(" ")[0] for line in zlib.decompress(packed).decode().splitlines()}
    for name in pp.__all__:
        thing = getattr(pp, name)
        if callable(thing):
            assert f"{thing.__module__}.{thing.__qualname__}" in listed, name
    for name in (n for n in dir(pp.Mechanism) if not n.startswith("_")):
        assert f"polypod.mechanism.Mechanism.{name}" in listed, name
