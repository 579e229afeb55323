"""What keeps files the same from run to run."""

import hashlib
import os
import re
import subprocess
import sys
from pathlib import Path

from kerfwright.model import write_model
from kerfwright_exporters.steady import without_noise, wrapped_records
from simple import stool


def test_noise_becomes_zero_and_numbers_stay():
    text = "(17.19,7.105427357601E-15,-2.E-17,-0.,1.E-07,-1.5E-12,0.5E-14,-0.25,#30,2.E-130)"
    assert without_noise(text, "0.") == "(17.19,0.,0.,0.,1.E-07,-1.5E-12,0.,-0.25,#30,0.)"
    assert without_noise("1 7.1e-15 -0 -0.5 12e-14x", "0") == "1 0 0 -0.5 12e-14x"


def test_records_do_not_depend_on_where_they_were_broken():
    numbers = ",".join(f"#{k}" for k in range(60))
    whole = f"#1 = SHELL('it, is',({numbers}));\n#2 = POINT('',(0.,1.,2.));"
    broken = whole.replace("#20,", "#20,\n  ").replace("('',", "('',\n    ")
    assert wrapped_records(broken) == wrapped_records(whole)
    lines = wrapped_records(whole).split("\n")
    assert max(map(len, lines)) <= 79 and len(lines) > 3
    assert re.sub(r"\n ", "", wrapped_records(whole)) == whole


def digests(model: Path, out: Path, seed: str) -> dict[str, str]:
    """Hash of each file that every exporter writes, in a process whose sets and hashes are ordered by the seed."""
    command = [sys.executable, "-m", "kerfwright", "export", str(model), "all", "-o", str(out)]
    subprocess.run(command, check=True, env={**os.environ, "PYTHONHASHSEED": seed}, stdout=subprocess.DEVNULL)
    files = [path for path in sorted(out.rglob("*")) if path.is_file()]
    return {str(path.relative_to(out)): hashlib.sha256(path.read_bytes()).hexdigest() for path in files}


def test_every_format_is_the_same_from_process_to_process(tmp_path):
    write_model(stool(), tmp_path / "model.json")
    first, second = (digests(tmp_path / "model.json", tmp_path / seed, seed) for seed in "12")
    assert len(first) > 10
    assert first == second
