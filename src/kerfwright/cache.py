"""Results of stages, kept so that a run that was ended goes on where it was.

The key of a result is a hash of everything that it can depend on: kerfwright's own source, the versions of the
libraries, the options that its stage is told, and the bytes of what it needs: the capture's files, or other stages'
results. So a stage whose inputs come out as before is not run again, though what made them was. Nothing is ever looked
up by name or time alone.
"""

from __future__ import annotations

import hashlib
import io
import os
import pickle
import sys
from collections.abc import Callable, Iterable
from functools import cache
from pathlib import Path
from typing import Any, ClassVar

from kerfwright.errors import CaptureError, OutputError, shown
from kerfwright.versions import library_versions

__all__ = ["NO_CACHE", "StageCache", "folder_hash", "program_hash", "read_kept"]

# What unpickling may call besides kerfwright's own classes: builders of arrays and of polygons, and plain values.
_ALLOWED = frozenset((
    ("builtins", "frozenset"), ("builtins", "set"), ("numpy", "dtype"), ("numpy", "ndarray"),
    ("numpy._core.multiarray", "_reconstruct"), ("numpy._core.multiarray", "scalar"),
    ("numpy._core.numeric", "_frombuffer"), ("pathlib", "PosixPath"), ("shapely.io", "from_wkb"),
))
_DIGEST_BYTES = 32


class StageCache:
    """Results by stage and key, one file each, in a folder.

    Parameters
    ----------
    folder : made when the first result is kept; None keeps nothing.
    basis : called once, when the first key is needed: a hash of what all results depend on.
    path : called once, when a stage needs it: a hash of the capture's files.
    """

    def __init__(self, folder: Path | None, basis: Callable[[], str] = str, path: Callable[[], str] = str) -> None:
        self._folder = folder
        self._basis = cache(basis)
        self._path = cache(path)
        self._files: dict[str, Path] = {}
        self._digests: dict[str, str] = {}

    def get(
        self, name: str, needs: Iterable[str], make: Callable[[], Any], other: Callable[[], str] = str
    ) -> tuple[Any, bool]:
        """The result of stage `name`, and whether it was there already; made and kept otherwise.

        `needs` names results that were got before, or "path"; `other` tells what it depends on besides.
        Raises OutputError when the disk is full.
        """
        if self._folder is None:
            return make(), False
        parts = [name, self._basis(), other(), *map(self._digest, needs)]
        key = hashlib.sha256("\n".join(parts).encode()).hexdigest()
        path = self._files[name] = self._folder / f"{name}-{key[:32]}"
        kept = _read(path)
        if kept is None:
            result = make()
            self._digests[name] = self._keep(path, result)
            return result, False
        self._digests[name] = kept[1]
        return kept[0], True

    def _digest(self, need: str) -> str:
        return self._path() if need == "path" else self._digests[need]

    def prune(self) -> None:
        """Drop what this run did not use."""
        if self._folder is not None and self._folder.is_dir():
            used = set(self._files.values())
            for path in sorted(self._folder.iterdir()):
                if path not in used:
                    path.unlink()

    def _keep(self, path: Path, result: Any) -> str:
        """Write the result; the hash of its bytes."""
        data = _pickled(result)
        digest = hashlib.sha256(data)
        beside = path.with_name(f"{path.name}.partial")
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            beside.write_bytes(digest.digest() + data)
            os.replace(beside, path)
        except OSError as error:
            beside.unlink(missing_ok=True)
            raise OutputError(f"{path}: cache: {error.strerror}: free some space or choose another folder") from error
        return digest.hexdigest()


NO_CACHE = StageCache(None)


def read_kept(folder: Path, name: str) -> Any:
    """The newest result of stage `name` in a cache folder, whatever its key; None when there is none that is whole."""
    paths = sorted(folder.glob(f"{name}-*"), key=lambda p: (p.stat().st_mtime_ns, p.name), reverse=True)
    kept = next((found for p in paths if p.suffix != ".partial" and (found := _read(p)) is not None), None)
    return None if kept is None else kept[0]


def _read(path: Path) -> tuple[Any, str] | None:
    """The result in a file, and the hash of its bytes; None when it is not there or not whole."""
    try:
        data = path.read_bytes()
    except FileNotFoundError:
        return None
    except OSError as error:
        raise OutputError(f"{path}: cache: {error.strerror}: delete the folder's .cache") from error
    digest, body = data[:_DIGEST_BYTES], data[_DIGEST_BYTES:]
    if hashlib.sha256(body).digest() != digest:
        return None
    try:
        return _Unpickler(io.BytesIO(body)).load(), digest.hex()
    except OutputError:
        raise
    except Exception as error:  # a pickle that somebody made can raise anything
        raise OutputError(
            f"{path}: cache: {shown(type(error).__name__)}: not what kerfwright keeps there: delete the folder's .cache"
        ) from error


def _pickled(result: Any) -> bytes:
    """The same bytes in every process: sets, whose order depends on Python's seed of hashes, are sorted."""
    stream = io.BytesIO()
    _Pickler(stream, protocol=5).dump(result)
    return stream.getvalue()


class _Pickler(pickle._Pickler):
    dispatch: ClassVar = dict(pickle._Pickler.dispatch)

    def save_set(self, things: set) -> None:
        self.write(pickle.EMPTY_SET)
        self.memoize(things)
        self.write(pickle.MARK)
        for thing in sorted(things, key=repr):
            self.save(thing)
        self.write(pickle.ADDITEMS)

    def save_frozenset(self, things: frozenset) -> None:
        self.write(pickle.MARK)
        for thing in sorted(things, key=repr):
            self.save(thing)
        self.write(pickle.FROZENSET)
        self.memoize(things)

    def save_picklebuffer(self, buffer: pickle.PickleBuffer) -> None:
        # Python's own stumbles over the second empty array: their bytes are one object
        with buffer.raw() as data:
            self.save(data.tobytes() if data.readonly else bytearray(data))

    dispatch[set], dispatch[frozenset] = save_set, save_frozenset
    dispatch[pickle.PickleBuffer] = save_picklebuffer


class _Unpickler(pickle._Unpickler):
    """Builds results of stages and nothing else: an output folder may come from a stranger.

    It is the one written in Python, some .05 s a capture slower, whose steps can be looked at: which globals are
    allowed is not enough, for a dtype that is given a state that is no dtype's brings NumPy down.
    """

    dispatch: ClassVar = dict(pickle._Unpickler.dispatch)

    def find_class(self, module: str, name: str) -> Any:
        """The class or function of that name, if a result may hold it."""
        if module.split(".")[0] == "kerfwright":
            found = super().find_class(module, name)
            if isinstance(found, type):
                return found
        elif (module, name) in _ALLOWED:
            return super().find_class(module, name)
        raise _not_kept(f"{module}.{name}")

    def load_build(self) -> None:
        """Give the object below the top of the stack the state on top."""
        if not _may_have(*self.stack[-2:]):
            raise _not_kept(type(self.stack[-2]).__name__)
        super().load_build()

    dispatch[pickle.BUILD[0]] = load_build


def _may_have(thing: Any, state: Any) -> bool:
    """Whether a thing may be given that state: dtypes of plain numbers, arrays of such, kerfwright's own objects."""
    import numpy as np

    if isinstance(thing, np.dtype):
        return thing.kind in "biufSU" and isinstance(state, tuple) and state in _dtype_states(thing)
    if isinstance(thing, np.ndarray):
        return isinstance(state, tuple) and len(state) == 5 and not getattr(state[2], "hasobject", True)
    return type(thing).__module__.split(".")[0] == "kerfwright"


def _dtype_states(kind: Any) -> list[tuple]:
    """The states that NumPy itself writes for a dtype, of either order of bytes."""
    return [kind.newbyteorder(order).__reduce__()[2] for order in "<>"]


def _not_kept(found: str) -> OutputError:
    return OutputError(f"cache: {shown(found)}: not what kerfwright keeps there: delete the folder's .cache")


def folder_hash(folder: Path, leave_out: Path | None = None) -> str:
    """Hash of the names and bytes of a folder's files, hidden ones and those below `leave_out` apart.

    Raises CaptureError when a file cannot be read.
    """
    total = hashlib.sha256(str(folder.resolve()).encode())
    for path in _files(folder, leave_out):
        try:
            with path.open("rb") as stream:
                digest = hashlib.file_digest(stream, "sha256").hexdigest()
        except OSError as error:
            raise CaptureError(f"{path}: file: {error.strerror}: make it readable or take it away") from error
        total.update(f"{path.relative_to(folder).as_posix()}\0{digest}\n".encode("utf-8", "surrogateescape"))
    return total.hexdigest()


def _files(folder: Path, leave_out: Path | None) -> list[Path]:
    if not folder.is_dir():
        return []
    excluded = None if leave_out is None else leave_out.resolve()
    return [
        path for path in sorted(folder.rglob("*"))
        if path.is_file() and not any(part.startswith(".") for part in path.relative_to(folder).parts)
        and excluded not in path.resolve().parents
    ]


def program_hash() -> str:
    """Hash of what computes: kerfwright's source, Python, and the libraries' versions."""
    package = Path(__file__).parent
    total = hashlib.sha256(sys.version.encode())
    for path in sorted(package.rglob("*.py")):
        total.update(path.relative_to(package).as_posix().encode() + b"\0" + path.read_bytes())
    total.update(repr(library_versions()).encode())
    return total.hexdigest()
