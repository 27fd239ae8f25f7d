"""A folder to work in for all tests of the command line."""

import textwrap

import pytest
from commands import PLANET

from fieldsim import files


@pytest.fixture
def here(tmp_path, monkeypatch):
    """A folder with scenarios/planet.py, to work in."""
    files.appeared.clear()
    monkeypatch.chdir(tmp_path)
    (tmp_path / "scenarios").mkdir()
    (tmp_path / "scenarios" / "planet.py").write_text(textwrap.dedent(PLANET))
    return tmp_path
