"""A signal ends the work at once, whatever the work is doing."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

# The child blocks signals' Python handlers as a long call of a C library does: the handler would run only afterwards.
WORK = """
import ctypes, sys
from kerfwright.supervise import supervised
def work():
    print("working", flush=True)
    ctypes.PyDLL(None).sleep(30)  # PyDLL keeps the interpreter's lock
    return 0
sys.exit(supervised(work))
"""


def start() -> subprocess.Popen:
    process = subprocess.Popen([sys.executable, "-c", WORK], stdout=subprocess.PIPE, text=True, start_new_session=True)
    assert process.stdout.readline() == "working\n"
    return process


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
@pytest.mark.parametrize("whole_group", [True, False])
def test_signals_end_it_at_once(number, whole_group):
    process = start()
    began = time.monotonic()
    (os.killpg if whole_group else os.kill)(process.pid, number)
    assert process.wait(5) == 128 + number
    assert time.monotonic() - began < 3


def test_the_child_dies_with_its_parent():
    process = start()
    child = int(Path(f"/proc/{process.pid}/task/{process.pid}/children").read_text())
    process.kill()
    process.wait(5)
    deadline = time.monotonic() + 2
    status = Path(f"/proc/{child}/stat")
    while status.exists() and status.read_text().split()[2] != "Z":
        assert time.monotonic() < deadline, "the child outlived its parent"
        time.sleep(0.01)


@pytest.mark.parametrize(("line", "code"), [("return 7", 7), ("os.kill(os.getpid(), 11)", 128 + 11)])
def test_exit_codes(line, code):
    script = f"import sys, os\nfrom kerfwright.supervise import supervised\ndef work():\n    {line}\n"
    assert subprocess.run([sys.executable, "-c", script + "sys.exit(supervised(work))"]).returncode == code
