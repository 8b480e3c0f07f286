"""What several test files need."""

from __future__ import annotations

import re

import pytest

from polypod import cli


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
