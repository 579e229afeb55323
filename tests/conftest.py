"""The command line, run in the tests' own process."""

import sys
from types import SimpleNamespace

import pytest

from kerfwright import cli


@pytest.fixture
def kerfwright(monkeypatch, capsys):
    """Run the command line; exit code, standard output and standard error."""
    monkeypatch.setenv("XDG_CONFIG_HOME", "/nonexistent")

    def run(*arguments) -> SimpleNamespace:
        monkeypatch.setattr(sys, "argv", ["kerfwright", *map(str, arguments)])
        with pytest.raises(SystemExit) as ended:
            cli.main()
        said = capsys.readouterr()
        return SimpleNamespace(returncode=ended.value.code, stdout=said.out, stderr=said.err)

    return run
