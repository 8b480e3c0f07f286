"""Fixtures of several test files."""

from __future__ import annotations

import os
import re
from dataclasses import dataclass, field
from pathlib import Path

import pytest

import polypod as pp
from polypod import cli
from support import DATA, ROOT

CHROMIUM = Path("/usr/bin/chromium")
"""Debian's package, which a test machine has or lacks; Playwright's own downloads are not used."""

SCREENSHOTS = ROOT / "build" / "screenshots"
"""Pictures of pages, kept to be looked at."""

_QUIET = (
    *("--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-sync"),
    *("--disable-background-networking", "--disable-component-update"),
)


@pytest.fixture
def run(request, monkeypatch, capsys):
    """Runs the command line in this process: exit status, standard output and error without colours.

    A test file may set COLUMNS, the width of the terminal.
    """
    monkeypatch.setenv("COLUMNS", str(getattr(request.module, "COLUMNS", 100)))
    monkeypatch.delenv("FORCE_COLOR", raising=False)

    def run(*args):
        monkeypatch.setattr("sys.argv", ["polypod", *map(str, args)])
        with pytest.raises(SystemExit) as exit:
            cli.main()
        out, err = (re.sub(r"\x1b\[[0-9;]*m", "", text) for text in capsys.readouterr())
        return exit.value.code or 0, out, err

    return run


@pytest.fixture(scope="session")
def tricept():
    """Makes a Tricept: three UPS legs around a passive UPF post of that name; no strokes."""
    data = pp.load(DATA / "stewart-gough.toml").to_dict()
    data.pop("published", None)
    arms = [
        {
            "base": {"joint": "U", "point": {"radius": 500, "angle": angle}, "axis": {"angle": angle + 90}},
            "platform": {"joint": "S", "point": {"radius": 200, "angle": angle}},
        }
        for angle in (90, 210, 330)
    ]
    post = {
        "actuated": False,
        "base": {"joint": "U", "point": [0, 0, 0], "axis": [1, 0, 0]},
        "platform": {"joint": "F", "point": [0, 0, 0], "axis": [0, 0, 1], "normal": [0, 1, 0]},
    }
    return lambda name="post": pp.Mechanism.from_dict({**data, "legs": [*arms, {"name": name, **post}]})


# --- pages in a real browser --------------------------------------------------------------------------------


@pytest.fixture(scope="session")
def without_tool():
    """Leaves a test out that needs a tool beside Python and Rust, or fails it where all must be there."""
    return pytest.fail if os.environ.get("POLYPOD_ALL_TOOLS") else pytest.skip


@pytest.fixture(scope="session")
def browser(without_tool):
    """Debian's Chromium as a Playwright Browser; it may lack where `make tools` does not work."""
    try:
        from playwright.sync_api import sync_playwright
    except ImportError as error:
        without_tool(f"no browser: Playwright is not installed ({error})")
    if not CHROMIUM.is_file():
        without_tool(f"no browser: {CHROMIUM} is not there; on Debian: apt-get install chromium")
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=str(CHROMIUM), args=[*_QUIET])
        yield browser
        browser.close()


@dataclass
class Watched:
    """Console messages and requests of a page while it was open."""

    errors: list[str] = field(default_factory=list)
    """Errors on the console, and exceptions that nothing caught."""
    warnings: list[str] = field(default_factory=list)
    """Warnings on the console: of a graphics driver, too."""
    requests: list[str] = field(default_factory=list)
    """Addresses asked for over the network, web sockets too: neither file: nor data: nor blob: ones."""
    failed: list[str] = field(default_factory=list)
    """Addresses that could not be had."""


@pytest.fixture
def watch():
    """Collects from then on what a page says and asks for; called before the page goes anywhere."""

    def watch(page) -> Watched:
        seen = Watched()

        def hear(message) -> None:
            lists = {"error": seen.errors, "warning": seen.warnings}
            lists.get(message.type, []).append(message.text)

        def note(request) -> None:
            if not request.url.startswith(("file:", "data:", "blob:")):
                seen.requests.append(request.url)

        page.on("pageerror", lambda error: seen.errors.append(str(error)))
        page.on("console", hear)
        page.on("request", note)
        page.on("websocket", lambda socket: seen.requests.append(socket.url))
        page.on("requestfailed", lambda request: seen.failed.append(request.url))
        return seen

    return watch


@pytest.fixture(scope="session")
def screenshots() -> Path:
    """The directory of pictures, made if need be."""
    SCREENSHOTS.mkdir(parents=True, exist_ok=True)
    return SCREENSHOTS
