"""The documentation names what there is, and nothing else."""

import re
from pathlib import Path

import pytest
import typer

from kerfwright.commands import app

ROOT = Path(__file__).resolve().parents[1]
COMMANDS = typer.main.get_command(app).commands
REFERENCE = ROOT / "docs" / "commands.md"


def sections() -> dict[str, str]:
    parts = re.split(r"^## (\w+).*$", REFERENCE.read_text(encoding="utf-8"), flags=re.M)
    return dict(zip(parts[1::2], parts[2::2], strict=True))


def test_every_command_has_a_section_and_every_section_a_command():
    assert {name for name in sections() if name.islower()} == set(COMMANDS)


@pytest.mark.parametrize("name", sorted(COMMANDS))
def test_every_option_is_described_and_every_description_an_option(name):
    there = {o for p in COMMANDS[name].params for o in p.opts if o.startswith("--") and o != "--help"}
    assert set(re.findall(r"`[^`]*?(--[a-z]+)", sections()[name])) == there


@pytest.mark.parametrize("name", sorted(COMMANDS))
def test_every_command_and_option_has_its_help(name):
    command = COMMANDS[name]
    assert command.help and command.help.strip().endswith(".")
    assert all(getattr(p, "help", None) for p in command.params if "--help" not in p.opts), name


PAGES = ["README.md", "fixtures/README.md", *sorted(f"docs/{p.name}" for p in (ROOT / "docs").glob("*.md"))]


@pytest.mark.parametrize("page", PAGES)
def test_links_lead_somewhere(page):
    text = (ROOT / page).read_text(encoding="utf-8")
    for target in re.findall(r"\]\((?!http)([^)#]+)", text):
        assert (ROOT / page).parent.joinpath(target).exists(), target


def test_the_architecture_names_modules_that_exist():
    text = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
    for name in re.findall(r"^\| `([\w./]+)`", text, flags=re.M):
        assert (ROOT / "src" / "kerfwright" / name).exists(), name
