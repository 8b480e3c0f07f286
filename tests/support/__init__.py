"""What tests share: mechanisms and states, an independent model of them, and readers of pages and files."""

from pathlib import Path

DATA = Path(__file__).parent / "data"
"""Mechanism files of the tests."""

ROOT = Path(__file__).parents[2]
"""Of the repository."""
