"""The command line: arguments to options, errors to exit codes.

0: done. 1: the checker found errors, or kerfwright itself failed. 2: the input, an option or the output folder is
wrong. 128 + n: ended by signal n.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from typing import Any

from kerfwright import __version__
from kerfwright.errors import KerfwrightError

__all__ = ["guarded", "main"]


def main() -> None:
    """Entry point of `kerfwright`."""
    if sys.argv[1:] in (["-V"], ["--version"]):  # answered before any import that could be broken
        print(f"kerfwright {__version__}")
        return
    # Stages run boards and views in threads of their own. A BLAS that shares out its work as the machine's load has it
    # sums in another order each time, and the last bits then differ from run to run.
    os.environ["OPENBLAS_NUM_THREADS"] = "1"
    sys.exit(guarded(_run_app))


def _run_app() -> int:
    import typer

    from kerfwright.commands import app

    usage_error = typer.BadParameter.__mro__[1]  # of click, which newer versions of typer carry within themselves
    try:
        return app(standalone_mode=False) or 0
    except typer.Abort:
        return 130
    except usage_error as error:
        return _say(f"{error.format_message().rstrip('.')}: see `{_command_path(error)} --help`")


def _command_path(usage_error: Any) -> str:
    return usage_error.ctx.command_path if usage_error.ctx else "kerfwright"


def guarded(work: Callable[[], int]) -> int:
    """Run `work`; what it raises becomes one line on stderr and an exit code. Only our own bugs show a traceback."""
    try:
        return work()
    except KerfwrightError as error:
        return _say(str(error))
    except KeyboardInterrupt:
        return 130
    except BrokenPipeError:
        sys.stderr.close()  # else Python complains once more on its way out
        return 1
    except MemoryError:
        return _say("out of memory: give the program more, or thin the cloud and shrink the photographs", code=1)
    except Exception:
        return _own_failure()


def _say(message: str, code: int = 2) -> int:
    print("kerfwright: error: " + " ".join(message.split()), file=sys.stderr)
    return code


def _own_failure() -> int:
    import platform
    import traceback

    traceback.print_exc()
    system = f"kerfwright {__version__}, Python {platform.python_version()}, {platform.platform()}"
    return _say(f"this is a bug in kerfwright: report the lines above, your command and `{system}`", code=1)
