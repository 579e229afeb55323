"""Damage small whole files at random and read them: only kerfwright's own errors may come out, in bounded memory.

Each parser runs in a process of its own with little memory to spare. An input is made from the seed, the parser's name
and its number alone, so that any can be made again: `--only NAME --first NUMBER --inputs 1 --keep DIR` writes it.
"""

from __future__ import annotations

import argparse
import faulthandler
import json
import mmap
import os
import random
import resource
import shutil
import signal
import struct
import sys
import tempfile
import time
import traceback
import warnings
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from hashlib import sha256
from pathlib import Path

from damages import damaged, damaged_e57, damaged_kept, damaged_laz
from fork_server import ForkServer
from tables import markdown

from kerfwright.errors import KerfwrightError

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "support"))

PATIENCE, LONGEST_WAIT = 30.0, 900.0  # seconds of processor, and on the clock, for one input: a hang
LONGEST_MESSAGE = 600
MEMORY = 512 * 2**20  # to spare, beside what the process has once its libraries are loaded


@dataclass(frozen=True)
class Parser:
    """What is fuzzed: the files of a sample folder of which one at a time is damaged, and what reads them."""

    name: str
    files: tuple[str, ...]
    read: Callable[[Path], object]
    damage: Callable[[bytes, random.Random], bytes] = damaged


def parsers() -> list[Parser]:
    """Every reader of files, and of what is said on the command line."""
    from kerfwright.cache import read_kept
    from kerfwright.capture import laz
    from kerfwright.capture.scans import read_las
    from kerfwright.config import read_config
    from kerfwright.model import read_model
    from kerfwright.output import _read_manifest
    from samples import readers

    server = ForkServer()

    def by_name(path: Path) -> object:
        return readers(path.parent)["." + path.name.rsplit(".")[-1]](path.name)

    def by_fork(path: Path) -> object:
        laz._run_unpack = server.run
        return read_las(path)

    def kept(path: Path) -> object:
        return read_kept(path.parent, path.name.split("-")[0])

    return [
        Parser("COLMAP text", ("text/cameras.txt", "text/images.txt"), by_name),
        Parser("COLMAP binary", ("cameras.bin", "images.bin"), by_name),
        Parser("Bundler", ("bundle.out", "list.txt"), by_name),
        Parser("RealityCapture CSV", ("cameras.csv",), by_name),
        Parser("RealityCapture XMP", ("a.xmp",), by_name),
        Parser("Metashape XML", ("cameras.xml",), by_name),
        Parser("Meshroom", ("cameras.sfm",), by_name),
        Parser("nerfstudio", ("transforms.json",), by_name),
        Parser("OpenMVG", ("sfm_data.json",), by_name),
        Parser("PLY", ("simple.ply", "ascii.ply", "binary_little_endian.ply", "binary_big_endian.ply"), by_name),
        Parser("PCD", ("ascii.pcd", "binary.pcd", "compressed.pcd"), by_name),
        Parser("XYZ", ("a.xyz",), by_name),
        Parser("LAS", ("a.las", "b.las"), by_name),
        Parser("LAZ", ("a.laz", "b.laz"), by_fork, damaged_laz),
        Parser("E57", ("a.e57",), by_name, damaged_e57),
        Parser("image headers", ("a.jpg", "a.png", "a.tif"), by_name),
        Parser("model.json", ("model.json",), read_model),
        Parser("manifest", (".kerfwright.json",), _read_manifest),
        Parser("kept stage", (".cache/capture-0", ".cache/identify-0"), kept, damaged_kept),
        Parser("config.toml", ("config.toml",), read_config),
        *_option_parsers(),
    ]  # fmt: skip


def _option_parsers() -> list[Parser]:
    """What reads the texts of options."""
    from kerfwright.capture.markers import parse_markers
    from kerfwright.capture.prepare import crop_options
    from kerfwright.scaling import parse_lengths
    from kerfwright.stock import parse_stock

    def text(parse: Callable, path: Path) -> object:
        return parse(path.read_text(encoding="utf-8", errors="replace"))

    return [
        Parser("--length", ("length.txt",), partial(text, lambda said: parse_lengths(said.split(";")))),
        Parser("--markers", ("markers.txt",), partial(text, parse_markers)),
        Parser("--stock", ("stock.txt",), partial(text, parse_stock)),
        Parser("--crop", ("crop.txt",), partial(text, crop_options)),
    ]


def _parts() -> object:
    """A result of identification with all that a kept stage may hold: arrays in pieces, polygons, paths, numbers."""
    import numpy as np
    from shapely.geometry import Polygon

    from kerfwright.identify.types import Parts, Primitive, Sheet
    from kerfwright.model import Quantity

    idx = np.arange(8)[::2]
    hole = Polygon([(0, 0), (9, 0), (9, 9)], [[(5, 1), (6, 2), (6, 1)]])
    sheet = Sheet("s", np.eye(4), Quantity(value=18), True, hole, idx, idx, idx)
    plane = Primitive(np.eye(3)[0], 1.0, idx, np.zeros(3), 0.1)
    return Parts((sheet,), (plane,), 0.1, notes=("a note",), selection={"gap": np.float64(0), "at": Path("a/b.jpg")})


def in_child(work: Callable[[], object]) -> None:
    """Do it in a child, which takes its libraries along when it ends: small processes are forked more quickly."""
    child = os.fork()
    if child == 0:
        try:
            work()
            os._exit(0)
        except BaseException:
            traceback.print_exc()
            os._exit(1)
    if os.waitpid(child, 0)[1]:
        raise SystemExit("the samples could not be written")


def write_all_samples(folder: Path) -> None:
    """Whole files of all parsers."""
    import pickle

    import numpy as np

    from kerfwright.capture.types import Cloud
    from kerfwright.config import default_config
    from kerfwright.model import write_model
    from samples import write_samples
    from simple import stool

    write_samples(folder)
    (folder / "text").mkdir()
    for name in ("cameras.txt", "images.txt"):
        shutil.copy(folder / name, folder / "text" / name)
    write_model(stool(), folder / "model.json")
    (folder / ".kerfwright.json").write_text('{"program": "kerfwright", "files": {"a/b.dxf": "00", "run.json": null}}')
    (folder / ".cache").mkdir()
    for name, result in (("capture", Cloud(np.eye(3), np.eye(3))), ("identify", _parts())):
        data = pickle.dumps(result, protocol=5)
        (folder / ".cache" / f"{name}-0").write_bytes(sha256(data).digest() + data)
    (folder / "config.toml").write_text(default_config())
    for name, value in (
        ("length", "top:x=420mm;leg one:z=.75in"), ("markers", "4x4_50:40mm"), ("stock", "12,18,1/2in"),
        ("crop", "-1,-2,0.5,1e3,4,5"),
    ):
        (folder / f"{name}.txt").write_text(value)


def used_memory() -> int:
    """Bytes of address space of this process."""
    return int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()


def damaged_input(parser: Parser, folder: Path, seed: int, number: int) -> tuple[str, bytes]:
    """The name and the damaged bytes of one input."""
    chance = random.Random(f"{seed} {parser.name} {number}")
    name = parser.files[number % len(parser.files)]
    return name, parser.damage((folder / name).read_bytes(), chance)


def read_one(parser: Parser, good: Path, folder: Path, seed: int, number: int) -> str:
    """What came of it: read, refused, or a line of what should not have come out."""
    name, data = damaged_input(parser, good, seed, number)
    path = folder / name
    path.write_bytes(data)
    try:
        parser.read(path)
        return "read"
    except KerfwrightError as error:
        short = "\n" not in str(error) and len(str(error)) < LONGEST_MESSAGE
        return "refused" if short else f"message of {len(str(error))} signs: {str(error)[:200]!r}"
    except BaseException as error:
        frame = traceback.extract_tb(error.__traceback__)[-1]
        place = f"{Path(frame.filename).name}:{frame.lineno}"
        return f"{type(error).__name__} at {place}: {' '.join(str(error).split())[:160]}"
    finally:
        path.write_bytes((good / name).read_bytes())


class Tally:
    """Counts that outlive the process that writes them: next number, read, refused."""

    def __init__(self) -> None:
        self._map = mmap.mmap(-1, 24)

    def __getitem__(self, k: int) -> int:
        return struct.unpack_from("<q", self._map, 8 * k)[0]

    def add(self, k: int, count: int = 1) -> None:
        struct.pack_into("<q", self._map, 8 * k, self[k] + count)


def _work(parser: Parser, good: Path, folder: Path, tally: Tally, seed: int, last: int, log: Path) -> None:
    """In a child: read until the last number, or until something ends the process.

    Libraries that keep memory do not use up what one input may have: another child goes on.
    """
    faulthandler.disable()
    warnings.simplefilter("error")
    null = os.open(os.devnull, os.O_WRONLY)
    os.dup2(null, 1)
    os.dup2(null, 2)
    parser.read(folder / parser.files[0])  # loads libraries
    before = used_memory()
    resource.setrlimit(resource.RLIMIT_AS, (before + 2 * MEMORY, resource.RLIM_INFINITY))
    while tally[0] < last and used_memory() < before + MEMORY:
        number = tally[0]
        what = read_one(parser, good, folder, seed, number)
        if what in ("read", "refused"):
            tally.add(1 if what == "read" else 2)
        else:
            _note(log, parser.name, number, what)
        tally.add(0)


def _note(log: Path, name: str, number: int, what: str) -> None:
    with log.open("a") as stream:
        stream.write(json.dumps({"parser": name, "number": number, "what": what}) + "\n")


def _one_process(parser: Parser, good: Path, tally: Tally, seed: int, last: int, log: Path) -> None:
    """Run a child to its end; what ended it early goes into the log, and the input is passed over."""
    with tempfile.TemporaryDirectory(dir=good.parent) as scratch:
        folder = Path(scratch) / "samples"
        shutil.copytree(good, folder)
        child = os.fork()
        if child == 0:
            try:
                _work(parser, good, folder, tally, seed, last, log)
                os._exit(0)
            except BaseException:
                _note(log, parser.name, -1, traceback.format_exc()[-600:])
                os._exit(1)
        status = _watch(child, tally)
    if status == 0:
        return
    if os.WIFEXITED(status):
        raise SystemExit(f"{parser.name}: the fuzzer itself failed: see {log}")
    number = tally[0]
    _note(log, parser.name, number, f"process ended by {signal.Signals(os.WTERMSIG(status)).name}")
    tally.add(0)


def _watch(child: int, tally: Tally) -> int:
    seen, since, used = tally[0], time.monotonic(), 0.0
    while True:
        done, status = os.waitpid(child, os.WNOHANG)
        if done:
            return status
        if tally[0] != seen:
            seen, since, used = tally[0], time.monotonic(), _cpu_seconds(child)
        elif _cpu_seconds(child) - used > PATIENCE or time.monotonic() - since > LONGEST_WAIT:
            os.kill(child, signal.SIGALRM)  # the mark of a hang
        time.sleep(0.05)


def _cpu_seconds(process: int) -> float:
    """Of a process that runs or has ended and was not waited for: a busy machine must not look like a hang."""
    fields = Path(f"/proc/{process}/stat").read_text().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def fuzz(parser: Parser, good: Path, seed: int, first: int, inputs: int, log: Path) -> dict[str, object]:
    """Read so many inputs; what was read, refused and otherwise, and seconds."""
    tally, begin = Tally(), time.monotonic()
    tally.add(0, first)
    last = first + inputs
    while tally[0] < last:
        _one_process(parser, good, tally, seed, last, log)
    count = tally[0] - first
    result = {"parser": parser.name, "inputs": count, "read": tally[1], "refused": tally[2],
              "else": count - tally[1] - tally[2], "seconds": round(time.monotonic() - begin, 1)}  # fmt: skip
    print(json.dumps(result), flush=True)
    return result


def _keep(parser: Parser, good: Path, given: argparse.Namespace) -> None:
    given.keep.mkdir(parents=True, exist_ok=True)
    name, data = damaged_input(parser, good, given.seed, given.first)
    (given.keep / f"{given.first}_{Path(name).name}").write_bytes(data)


def main() -> None:
    command = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    command.add_argument("--out", type=Path, required=True)
    command.add_argument("--inputs", type=int, default=100_000)
    command.add_argument("--first", type=int, default=0)
    command.add_argument("--seed", type=int, default=0)
    command.add_argument("--jobs", type=int, default=1)
    command.add_argument("--only", action="append", help="name of a parser; may be repeated")
    command.add_argument("--keep", type=Path, help="write the first input there instead of reading it")
    given = command.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    log = given.out / "fuzz.jsonl"
    log.unlink(missing_ok=True)
    with tempfile.TemporaryDirectory(dir="/dev/shm" if Path("/dev/shm").is_dir() else None) as scratch:
        good = Path(scratch) / "good"
        good.mkdir()
        in_child(partial(write_all_samples, good))
        chosen = [p for p in parsers() if not given.only or p.name in given.only]
        if given.keep:
            return [_keep(p, good, given) for p in chosen] and None
        with ThreadPoolExecutor(given.jobs) as pool:
            run = partial(fuzz, good=good, seed=given.seed, first=given.first, inputs=given.inputs, log=log)
            results = list(pool.map(run, chosen))
    table = markdown(list(results[0]), [[f"{v}" for v in r.values()] for r in results])
    (given.out / "fuzz.md").write_text(table)
    print(table)
    if any(r["else"] for r in results):
        raise SystemExit(f"see {log}")


if __name__ == "__main__":
    main()
