"""What `laz._run_unpack` does, in forks of one small process that has lazrs loaded.

The server reads one line of JSON a task, forks, and answers with a line: the child's exit code and what it said. The
same UNPACK is run, with the same arguments, standard input and limit of memory, in a process of its own.
"""

from __future__ import annotations

import base64
import json
import os
import resource
import signal
import subprocess
import sys
import traceback
from collections.abc import Sequence
from pathlib import Path

__all__ = ["ForkServer"]

LONGEST, LONGEST_WAIT = 15, 600  # seconds of processor, and on the clock, for one input: a hang


class ForkServer:
    """Start the server when the first task comes; it ends when this process does."""

    def __init__(self) -> None:
        self._server: subprocess.Popen | None = None

    def run(self, arguments: Sequence[str], record: bytes) -> tuple[int, bytes]:
        """Exit code, negative for a signal, and what was said on standard error. TimeoutError at a hang."""
        from kerfwright.capture.laz import UNPACK, UNPACK_ENVIRONMENT

        if self._server is None:
            command = [sys.executable, "-P", __file__, UNPACK]
            self._server = subprocess.Popen(
                command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, env=os.environ | UNPACK_ENVIRONMENT
            )
        task = {"arguments": arguments, "record": base64.b64encode(record).decode()}
        self._server.stdin.write(json.dumps(task).encode() + b"\n")
        self._server.stdin.flush()
        answer = json.loads(self._server.stdout.readline())
        if answer["code"] in (-signal.SIGALRM, -signal.SIGXCPU, -signal.SIGKILL):
            raise TimeoutError("lazrs did not end")
        return answer["code"], base64.b64decode(answer["said"])


def serve(program: str) -> None:
    """Fork for each task, one after the other, until there are no more."""
    import lazrs  # noqa: F401

    code = compile(program, "<unpack>", "exec")
    used = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    for line in sys.stdin.buffer:
        task = json.loads(line)
        given, said = os.memfd_create("record"), os.memfd_create("said")
        os.pwrite(given, base64.b64decode(task["record"]), 0)
        child = os.fork()
        if child == 0:
            os._exit(_in_child(code, task["arguments"], used, given, said))
        ended = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
        answer = {"code": ended, "said": base64.b64encode(os.pread(said, 10**6, 0)).decode()}
        os.close(given)
        os.close(said)
        print(json.dumps(answer), flush=True)


def _in_child(code, arguments: Sequence[str], used: int, given: int, said: int) -> int:
    """Run the program as if it had been started with these arguments; its limit counts from what is used by now."""
    signal.alarm(LONGEST_WAIT)
    resource.setrlimit(resource.RLIMIT_CPU, (LONGEST, LONGEST))
    os.dup2(said, 2)
    *others, memory = arguments
    sys.argv, sys.stdin = ["-c", *others, str(int(memory) + used)], open(given)  # noqa: SIM115
    try:
        exec(code, {})
        return 0
    except BaseException:
        traceback.print_exc()
        sys.stderr.flush()
        return 1


if __name__ == "__main__":
    serve(sys.argv[1])
