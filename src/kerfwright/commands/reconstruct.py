"""`kerfwright reconstruct`: from a capture to a checked model."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from kerfwright.cli import guarded
from kerfwright.errors import OptionError
from kerfwright.output import OutputFolder
from kerfwright.pipeline import ReconstructOptions, left_out
from kerfwright.progress import Reporter, reporter_for
from kerfwright.supervise import supervised

if TYPE_CHECKING:
    from kerfwright.model import Finding

__all__ = [
    "Crop", "Ground", "ScaleMm", "Up", "checked_axis", "checked_crop", "checked_scale", "reconstruct",
    "run_reconstruct", "say_errors",
]

AUTO = "auto"
_UP = ("x", "y", "z", "-x", "-y", "-z")
# Read by the numeric libraries when they are first imported.
_THREAD_VARIABLES = (
    "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS", "OPENCV_FOR_THREADS_NUM",
)

Out = Annotated[Path, typer.Option("-o", "--out", metavar="OUT", help="Folder for the results; made if need be.")]
Up = Annotated[str, typer.Option("--up", metavar="AXIS", help="Axis of the capture that is up: x, y, z, -x, -y, -z.")]
ScaleMm = Annotated[
    str | None,
    typer.Option(
        "--scale", metavar="MM|auto",
        help="Millimetres a capture unit; auto: guess from stock thicknesses. If not said, a unit is a metre.",
    ),
]
Lengths = Annotated[
    list[str] | None,
    typer.Option(
        "--length", metavar="BOARD:AXIS=LENGTH",
        help="A length that you measured, instead of --scale, such as top:x=420mm. May be repeated.",
    ),
]
Markers = Annotated[
    str, typer.Option("--markers", metavar="FAMILY:SIDE", help="Printed markers in the photographs, as 4x4_50:40mm.")
]
StockSizes = Annotated[
    str,
    typer.Option(
        "--stock", metavar="metric|inch|LIST",
        help="Snap thicknesses to what is sold, or to your own, as 12,18,1/2in, where the scale is given.",
    ),
]
Crop = Annotated[
    str,
    typer.Option("--crop", metavar="auto|none|BOX", help="Box to keep: X0,Y0,Z0,X1,Y1,Z1 in the cloud's coordinates."),
]
Ground = Annotated[
    float | None,
    typer.Option("--ground", metavar="HEIGHT", help="Of the floor along the up axis, capture units; else it is found."),
]
Seed = Annotated[int, typer.Option("--seed", min=0, help="Of the random generator; the same seed, the same files.")]
Jobs = Annotated[
    int | None, typer.Option("-j", "--jobs", min=1, help="Cores to use; all if not said. The results are the same.")
]
Without = Annotated[
    str,
    typer.Option("--without", metavar="PARTS", hidden=True, help="For benchmarks: parts of refinement to leave out."),
]
Quiet = Annotated[bool, typer.Option("-q", "--quiet", help="Say nothing but errors.")]
AsJson = Annotated[bool, typer.Option("--json", help="Progress as one JSON object a line, on standard output.")]
Verbose = Annotated[bool, typer.Option("-v", "--verbose", help="Say more.")]


def reconstruct(
    capture: Annotated[Path, typer.Argument(metavar="CAPTURE", help="Folder with images, cameras and a cloud.")],
    out: Out,
    up: Up = "z",
    scale: ScaleMm = None,
    length: Lengths = None,
    markers: Markers = "",
    stock: StockSizes = "",
    crop: Crop = "auto",
    ground: Ground = None,
    seed: Seed = 0,
    jobs: Jobs = None,
    without: Without = "",
    quiet: Quiet = False,
    as_json: AsJson = False,
    verbose: Verbose = False,
) -> None:
    """Reconstruct the boards of CAPTURE: a STEP assembly, a DXF file a board, the model and a report."""
    _check_one_scale(scale, length, markers)
    options = ReconstructOptions(
        up=checked_axis(up), millimetres_per_unit=checked_scale(scale), seed=seed, crop=checked_crop(crop),
        ground=ground, length=_checked_lengths(length or []), markers=_checked_markers(markers),
        scale_by_stock=scale == AUTO, stock=_checked_stock(stock), without=_checked_without(without),
    )  # fmt: skip
    _limit_threads(jobs)
    reporter = reporter_for(sys.stdout if as_json else sys.stderr, quiet=quiet, as_json=as_json, verbose=verbose)
    farewell = f"Results in {out}: open report.html in a browser, model.step in FreeCAD or another CAD program."
    raise typer.Exit(run_reconstruct(capture, out, options, reporter, "" if quiet or as_json else farewell))


def run_reconstruct(
    capture: Path, out: Path, options: ReconstructOptions, reporter: Reporter, farewell: str = ""
) -> int:
    """Reconstruct into a folder, in a child process, and say the farewell when it is done; returns the exit code."""

    def work() -> int:
        found = _reconstruct_into(folder, capture, options, reporter)
        if farewell:
            typer.echo(farewell)
        return 1 if say_errors(found) else 0

    with OutputFolder(out).claimed() as folder:
        code = supervised(lambda: guarded(work))
        if code == 2:  # what was computed from unusable input is of no use
            folder.drop_cache()
    if code > 128:
        sys.stderr.write("\x1b[?25h" if sys.stderr.isatty() else "")  # the child may have hidden the cursor
        typer.echo(f"kerfwright: {_ending(code)}", err=True)
    return code


def _reconstruct_into(
    folder: OutputFolder, capture: Path, options: ReconstructOptions, reporter: Reporter
) -> tuple[Finding, ...]:
    from kerfwright import pipeline
    from kerfwright.results import write_results, write_run

    def fill(partial: Path) -> None:
        with reporter.stage("write", "Writing the results"):
            write_results(found, partial)
        write_run(reporter, partial / "run.json")

    found = pipeline.reconstruct(capture, options, reporter, pipeline.stage_cache(capture, folder))
    folder.write(fill)
    return found.model.findings


def say_errors(findings: tuple[Finding, ...]) -> int:
    """Say on standard error what forbids cutting; returns how much there is."""
    errors = [f for f in findings if f.severity == "error"]
    for finding in errors:
        typer.echo(f"kerfwright: {finding.code}: {finding.message}: {finding.remedy}", err=True)
    return len(errors)


def _ending(code: int) -> str:
    import signal

    number = code - 128
    if number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        return "interrupted; earlier results are as they were, and the same command goes on where this one was"
    if number == signal.SIGKILL:
        return "error: the system ended it, most likely for want of memory: thin the cloud or shrink the photographs"
    return f"error: a library ended it with {signal.Signals(number).name}: this is a bug; report it with your command"


def checked_axis(up: str) -> str:
    """The axis, if it is one."""
    if up not in _UP:
        raise OptionError(f"--up: {up}: not an axis: use one of {', '.join(_UP)}")
    return up


def checked_scale(scale: str | None) -> float | None:
    """The scale, if it is a length; None where it is to be found out."""
    if scale is None or scale == AUTO:
        return None
    try:
        value = float(scale)
    except ValueError:
        value = 0.0
    if not 0 < value < float("inf"):
        raise OptionError(f"--scale: {scale}: not a length: give the millimetres of one capture unit, or auto")
    return value


def checked_crop(crop: str) -> str:
    """The crop, if it is one."""
    from kerfwright.capture.prepare import crop_options

    crop_options(crop)
    return crop


def _checked_lengths(lengths: Sequence[str]) -> str:
    if not lengths:
        return ""
    from kerfwright.scaling import parse_lengths

    return ";".join(length.text for length in parse_lengths(lengths))


def _checked_markers(markers: str) -> str:
    if markers:
        from kerfwright.capture.markers import parse_markers

        parse_markers(markers)
    return markers


def _checked_stock(stock: str) -> str:
    if stock:
        from kerfwright.stock import parse_stock

        parse_stock(stock)
    return stock


def _checked_without(without: str) -> str:
    left_out(without)
    return without


def _check_one_scale(scale: str | None, lengths: Sequence[str] | None, markers: str) -> None:
    given = [name for name, value in (("--scale", scale), ("--length", lengths), ("--markers", markers)) if value]
    if len(given) > 1:
        raise OptionError(f"{' and '.join(given)}: each gives the scale: use one of them")


def _limit_threads(jobs: int | None) -> None:
    """Keep this process, and what it starts, to as many cores; libraries that count cores are told as well."""
    if jobs is None:
        return
    os.environ.update(dict.fromkeys(_THREAD_VARIABLES, str(jobs)))
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, sorted(os.sched_getaffinity(0))[:jobs])
