"""The output folder: nothing half-written, nothing lost that kerfwright did not make, one writer at a time.

Files are made in `.partial` inside the folder. When all of them are whole, `.partial` becomes `.ready` in one rename,
and the files move from there to their places. A run that dies before the rename leaves the old results as they were;
one that dies after it is finished by whoever opens the folder next. `.kerfwright.json` lists what kerfwright wrote.
"""

from __future__ import annotations

import errno
import fcntl
import hashlib
import json
import os
import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path, PurePosixPath

from kerfwright.errors import OutputError

__all__ = ["OutputFolder"]

CACHE, LOCK, MANIFEST, PARTIAL, READY = ".cache", ".lock", ".kerfwright.json", ".partial", ".ready"
_OWN = frozenset((CACHE, LOCK, MANIFEST, PARTIAL, READY))
# What may differ from run to run; its hash would make the manifest differ too.
_VOLATILE = frozenset(("run.json",))


class OutputFolder:
    """A folder of results that kerfwright may replace.

    Examples
    --------
    >>> with OutputFolder(Path("out")).claimed() as folder:      # doctest: +SKIP
    ...     folder.write(lambda partial: (partial / "model.json").write_text("{}"))
    """

    def __init__(self, path: Path) -> None:
        self.path = Path(path)

    @property
    def cache(self) -> Path:
        """Where stages keep their results; may not exist yet."""
        return self.path / CACHE

    def drop_cache(self) -> None:
        """Forget the stages' results."""
        shutil.rmtree(self.cache, ignore_errors=True)

    @contextmanager
    def claimed(self) -> Iterator[OutputFolder]:
        """Hold the folder: checked, created, locked. On leaving, what is half done goes, as does a folder left empty.

        Raises OutputError when the folder cannot be made, is held by another run, or has files in it that are not
        kerfwright's.
        """
        self._refuse_what_is_not_ours()
        made = _make_folders(self.path)
        lock = None
        try:
            lock = self._lock()
            self._settle()
            self._refuse_what_is_not_ours()
            yield self
        finally:
            if lock is not None:
                self._settle()
                (self.path / LOCK).unlink(missing_ok=True)
                os.close(lock)
            _remove_empty(made)

    def write(self, fill: Callable[[Path], object], *, keep_others: bool = False) -> list[Path]:
        """Replace the folder's files by those that `fill` makes in the folder it is given.

        Returns the files in their final places, sorted. With `keep_others`, files of earlier runs that this one does
        not write stay. Raises OutputError when the disk is full or the folder cannot be written; the old files are
        then untouched.
        """
        partial = self.path / PARTIAL
        shutil.rmtree(partial, ignore_errors=True)
        with _output_errors(self.path):
            partial.mkdir()
            fill(partial)
            new = _hashes(partial)
            kept = {name: mark for name, mark in self._manifest().items() if keep_others and name not in new}
            _write_manifest(partial / MANIFEST, {**kept, **new})
            partial.rename(self.path / READY)
            self._settle()
        return [self.path / name for name in sorted(new)]

    def _settle(self) -> None:
        """Finish the move that a dead run began; forget what a dead run did not finish."""
        shutil.rmtree(self.path / PARTIAL, ignore_errors=True)
        ready = self.path / READY
        if not ready.is_dir():
            return
        if (ready / MANIFEST).exists():
            new = _read_manifest(ready / MANIFEST)
            for name in sorted(set(self._manifest()) - set(new)):
                (self.path / name).unlink(missing_ok=True)
                _remove_empty([p for p in (self.path / name).parents if self.path in p.parents])
            for name in [*sorted(_hashes(ready)), MANIFEST]:
                (self.path / name).parent.mkdir(parents=True, exist_ok=True)
                if (ready / name).exists():
                    os.replace(ready / name, self.path / name)
        shutil.rmtree(ready)

    def _manifest(self) -> dict[str, str | None]:
        return _read_manifest(self.path / MANIFEST) if (self.path / MANIFEST).exists() else {}

    def _refuse_what_is_not_ours(self) -> None:
        if self.path.is_dir():
            # In mid-move the manifest is not yet true; the check is made again once the move is finished.
            problem = None if (self.path / READY).exists() else _first_foreign(self.path, self._manifest())
            if problem:
                raise OutputError(f"{problem}: move it away or choose another folder")
        elif self.path.exists() or self.path.is_symlink():
            raise OutputError(f"{self.path}: output folder: is a file: choose another name")

    def _lock(self) -> int:
        """An exclusive lock that the system drops when its last holder dies, whatever it died of."""
        with _output_errors(self.path):
            handle = os.open(self.path / LOCK, os.O_RDWR | os.O_CREAT, 0o644)
        if not _locked(handle) or not os.path.exists(self.path / LOCK):
            holder = os.read(handle, 32).decode("ascii", "replace").strip() or "another"
            os.close(handle)
            raise OutputError(
                f"{self.path}: output folder: process {holder} is writing to it: wait for it or choose another folder"
            )
        os.ftruncate(handle, 0)
        os.write(handle, f"{os.getpid()}\n".encode("ascii"))
        return handle


def _locked(handle: int) -> bool:
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True


def _first_foreign(folder: Path, manifest: dict[str, str | None]) -> str | None:
    """The first file, in sorted order, that kerfwright did not write or that somebody has changed since."""
    for path in sorted(folder.rglob("*")):
        name = path.relative_to(folder).as_posix()
        if name.split("/")[0] in _OWN or (path.is_dir() and not path.is_symlink()):
            continue
        if name not in manifest:
            return f"{path}: output folder: holds a file that kerfwright did not write"
        if manifest[name] is not None and manifest[name] != _hash(path):
            return f"{path}: output folder: changed since kerfwright wrote it"
    return None


def _make_folders(path: Path) -> list[Path]:
    """Make a folder and its parents; returns those that were made, the deepest first."""
    missing = [p for p in (path, *path.parents) if not p.exists()]
    with _output_errors(path):
        path.mkdir(parents=True, exist_ok=True)
    return missing


def _remove_empty(folders: list[Path]) -> None:
    for folder in folders:
        if folder.is_dir() and not any(folder.iterdir()):
            folder.rmdir()


@contextmanager
def _output_errors(path: Path) -> Iterator[None]:
    """Turn what the system says of a folder into an error that says what to do."""
    try:
        yield
    except OutputError:
        raise
    except OSError as error:
        where = error.filename or path
        remedies = {
            errno.ENOSPC: "free some space or choose a folder on another disk",
            errno.EDQUOT: "free some space or choose a folder on another disk",
            errno.EACCES: "choose a folder that you may write to",
            errno.EROFS: "choose a folder that you may write to",
        }
        remedy = remedies.get(error.errno or 0, "choose another folder")
        raise OutputError(f"{where}: output folder: {error.strerror or error}: {remedy}") from error


def _hash(path: Path) -> str:
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


def _hashes(folder: Path) -> dict[str, str | None]:
    files = sorted(p for p in folder.rglob("*") if p.is_file())
    names = [p.relative_to(folder).as_posix() for p in files]
    return {n: None if n in _VOLATILE else _hash(p) for n, p in zip(names, files, strict=True) if n != MANIFEST}


def _write_manifest(path: Path, files: dict[str, str | None]) -> None:
    content = {"program": "kerfwright", "files": dict(sorted(files.items()))}
    path.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")


def _read_manifest(path: Path) -> dict[str, str | None]:
    """Read a manifest, distrusting it: its names decide what may be deleted."""
    try:
        files = json.loads(path.read_text(encoding="utf-8"))["files"]
        sound = all(_is_inside(name) and (mark is None or isinstance(mark, str)) for name, mark in files.items())
    except (OSError, ValueError, KeyError, TypeError, AttributeError, RecursionError):
        sound = False
    if not sound:
        raise OutputError(f"{path}: manifest: not as kerfwright writes it: delete the folder or choose another one")
    return files


def _is_inside(name: str) -> bool:
    parts = PurePosixPath(name).parts
    return bool(parts) and not name.startswith("/") and ".." not in parts and "\\" not in name
