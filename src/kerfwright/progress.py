"""One place through which everything that runs says how far it is."""

from __future__ import annotations

import json
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any, TextIO

__all__ = ["JsonReporter", "PlainReporter", "Reporter", "RichReporter", "reporter_for"]


class Reporter:
    """Says nothing and keeps the times; the base of those that speak.

    Attributes
    ----------
    seconds : wall-clock seconds a finished stage took, in the order of the stages.
    cpu_seconds : of all cores together; unlike wall-clock seconds they tell little of what else the machine did.
    reused : names of the stages whose results came from the cache.
    """

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}
        self.cpu_seconds: dict[str, float] = {}
        self.reused: list[str] = []
        self._shares: dict[str, float] = {}

    def plan(self, shares: Mapping[str, float]) -> None:
        """Announce the stages to come, each with its usual share of the time."""
        self._shares = dict(shares)

    def left(self) -> float | None:
        """Seconds for the stages not yet finished, if they take their usual shares; None while nothing tells."""
        measured = [name for name in self.seconds if name in self._shares and name not in self.reused]
        share = sum(self._shares[name] for name in measured)
        if not share:
            return None
        ahead = sum(part for name, part in self._shares.items() if name not in self.seconds)
        return sum(self.seconds[name] for name in measured) / share * ahead

    @contextmanager
    def stage(self, name: str, text: str = "") -> Iterator[None]:
        """Time what happens inside; a stage that raises has no time."""
        start, cpu_start = time.perf_counter(), time.process_time()
        self._started(name, text or name)
        try:
            yield
        except BaseException:
            self._failed(name)
            raise
        self.seconds[name] = time.perf_counter() - start
        self.cpu_seconds[name] = time.process_time() - cpu_start
        self._finished(name, text or name, self.seconds[name])

    def reuse(self, name: str) -> None:
        """The stage that is running takes its result from the cache."""
        self.reused.append(name)

    def note(self, message: str) -> None:
        """Something that a person who asked for details wants to know."""

    def close(self) -> None:
        """Give the terminal back."""

    def _started(self, name: str, text: str) -> None: ...

    def _finished(self, name: str, text: str, seconds: float) -> None: ...

    def _failed(self, name: str) -> None: ...

    def _step(self, name: str) -> str:
        """Which of the announced stages this is."""
        names = list(self._shares)
        return f"{names.index(name) + 1}/{len(names)} " if name in names else ""

    def _remark(self, name: str) -> str:
        return " (from the cache)" if name in self.reused else ""


class PlainReporter(Reporter):
    """One line a finished stage, for logs and pipes."""

    def __init__(self, stream: TextIO, verbose: bool = False) -> None:
        super().__init__()
        self._stream, self._verbose = stream, verbose

    def note(self, message: str) -> None:
        if self._verbose:
            self._say(f"    {message}")

    def _finished(self, name: str, text: str, seconds: float) -> None:
        self._say(f"{self._step(name) + text:<42} {seconds:6.1f} s{self._remark(name)}")

    def _say(self, line: str) -> None:
        print(line, file=self._stream, flush=True)


class JsonReporter(Reporter):
    """One JSON object a line, for programs."""

    def __init__(self, stream: TextIO) -> None:
        super().__init__()
        self._stream = stream

    def note(self, message: str) -> None:
        self._say(event="note", message=message)

    def _started(self, name: str, text: str) -> None:
        left = self.left()
        self._say(event="started", stage=name, left_seconds=None if left is None else round(left, 1))

    def _finished(self, name: str, text: str, seconds: float) -> None:
        self._say(event="finished", stage=name, seconds=round(seconds, 3), cached=name in self.reused)

    def _failed(self, name: str) -> None:
        self._say(event="failed", stage=name)

    def _say(self, **fields: Any) -> None:
        print(json.dumps(fields), file=self._stream, flush=True)


class RichReporter(Reporter):
    """A line that moves while a stage runs, for people."""

    def __init__(self, stream: TextIO, verbose: bool = False) -> None:
        from rich.console import Console

        super().__init__()
        self._console = Console(file=stream, highlight=False)
        self._verbose = verbose
        self._live: Any = None

    def note(self, message: str) -> None:
        if self._verbose:
            self._console.print(f"    {message}", style="dim", markup=False)

    def close(self) -> None:
        if self._live is not None:
            self._live.stop()
            self._live = None

    def _started(self, name: str, text: str) -> None:
        from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

        left = self.left()
        ahead = "" if left is None else f"about {left:.0f} s left"
        columns = (SpinnerColumn(), TextColumn("{task.description:<42}"), TimeElapsedColumn(), TextColumn(ahead))
        # Standard output is for results: only what libraries say on standard error would break the line.
        self._live = Progress(*columns, console=self._console, transient=True, redirect_stdout=False)
        self._live.add_task(self._step(name) + text)
        self._live.start()

    def _finished(self, name: str, text: str, seconds: float) -> None:
        self.close()
        self._console.print(f"[green]✓[/] {self._step(name) + text:<42} {seconds:6.1f} s{self._remark(name)}")

    def _failed(self, name: str) -> None:
        self.close()


def reporter_for(stream: TextIO, *, quiet: bool = False, as_json: bool = False, verbose: bool = False) -> Reporter:
    """The reporter that suits the stream and what the user asked for."""
    if quiet:
        return Reporter()
    if as_json:
        return JsonReporter(stream)
    return RichReporter(stream, verbose) if stream.isatty() else PlainReporter(stream, verbose)
