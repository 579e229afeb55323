"""The configuration file sets defaults, and is checked as strictly as the command line."""

import tomllib

import pytest

from kerfwright.config import CONFIGURABLE, config_path, default_config, read_config
from kerfwright.errors import OptionError


def test_the_file_written_is_the_defaults_and_reads_back(tmp_path):
    path = tmp_path / "config.toml"
    path.write_text(default_config())
    assert read_config(path) == {
        "reconstruct": {"up": "z", "markers": "", "stock": "", "seed": 0, "quiet": False, "verbose": False},
    }
    assert set(tomllib.loads(default_config())) == CONFIGURABLE


def test_every_option_of_the_file_is_one_of_the_command():
    import inspect

    from kerfwright.commands.reconstruct import reconstruct
    from kerfwright.config import _OPTIONS

    parameters = inspect.signature(reconstruct).parameters
    for name, (_, default, _) in _OPTIONS["reconstruct"].items():
        expected = tomllib.loads(f"x = {default}")["x"] if default is not None else None
        assert parameters[name].default == expected, name


def test_no_file_is_no_options(tmp_path):
    assert read_config(tmp_path / "none.toml") == {}


@pytest.mark.parametrize(("text", "words"), [
    ("[reconstruct\n", "mend it"), ("[construct]\nup = 'z'\n", "construct"), ("reconstruct = 3\n", "not a table"),
    ("[reconstruct]\nups = 'z'\n", "reconstruct.ups: no such option"), ("[reconstruct]\nseed = true\n", "seed: True"),
    ("[reconstruct]\nup = 3\n", "up: 3"), ("[reconstruct]\njobs = 1.5\n", "jobs: 1.5"), ("\x00", "mend it"),
])
def test_a_wrong_file_is_one_clear_error(tmp_path, text, words):
    path = tmp_path / "config.toml"
    path.write_text(text)
    with pytest.raises(OptionError) as caught:
        read_config(path)
    assert words in str(caught.value) and str(path) in str(caught.value)


def test_where_it_is_looked_for(monkeypatch, tmp_path):
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    assert config_path() == tmp_path / "kerfwright" / "config.toml"
    monkeypatch.delenv("XDG_CONFIG_HOME")
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    assert config_path() == tmp_path / "home" / ".config" / "kerfwright" / "config.toml"


@pytest.mark.parametrize("text", ["a = " + "[" * 20_000, f"[{'x' * 9000}]", f'[reconstruct]\nup = ["{"y" * 9000}"]'])
def test_what_is_told_is_one_short_line(tmp_path, text):
    (tmp_path / "config.toml").write_text(text)
    with pytest.raises(OptionError) as caught:
        read_config(tmp_path / "config.toml")
    assert "\n" not in str(caught.value) and len(str(caught.value)) < 400
