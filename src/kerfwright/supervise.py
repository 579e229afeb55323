"""Run work in a child process, so that an interrupt ends it at once, even inside a long call of a library.

Python sees a signal only between two of its own instructions; a mixed-integer solve or a boolean of solids can hold it
for seconds. The child dies of the signal itself, and the parent, which does nothing but wait, tidies up.
"""

from __future__ import annotations

import ctypes
import os
import signal
import sys
import traceback
from collections.abc import Callable

__all__ = ["supervised"]

_PR_SET_PDEATHSIG = 1  # linux/prctl.h
_ENDING = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


def supervised(work: Callable[[], int]) -> int:
    """Run `work` in a child process and return its exit code; 128 + the signal's number when a signal ended it.

    The child never outlives this process. SIGINT, SIGTERM and SIGHUP kill the child.
    """
    _flush()
    parent = os.getpid()
    signal.pthread_sigmask(signal.SIG_BLOCK, _ENDING)  # until each of the two knows what to do with them
    child = os.fork()
    if child == 0:
        os._exit(_in_child(work, parent))
    return _wait(child)


def _in_child(work: Callable[[], int], parent: int) -> int:
    for number in _ENDING:
        signal.signal(number, signal.SIG_DFL)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, _ENDING)
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
        if os.getppid() != parent:  # it died before the line above
            return 1
    try:
        return work()
    except BaseException:  # whatever it is, it must not unwind into what the parent is in the middle of
        traceback.print_exc()
        return 1
    finally:
        _flush()


def _wait(child: int) -> int:
    received: list[int] = []

    def end_child(number: int, _frame: object) -> None:
        received.append(number)
        os.kill(child, signal.SIGKILL)

    before = {number: signal.signal(number, end_child) for number in _ENDING}
    signal.pthread_sigmask(signal.SIG_UNBLOCK, _ENDING)
    # WNOWAIT leaves a dead child's number taken, so that a late signal cannot hit another process.
    os.waitid(os.P_PID, child, os.WEXITED | os.WNOWAIT)
    for number, handler in before.items():
        signal.signal(number, handler)
    code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    if received:
        return 128 + received[0]
    return code if code >= 0 else 128 - code


def _flush() -> None:
    sys.stdout.flush()
    sys.stderr.flush()
