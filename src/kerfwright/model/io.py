"""The model as a JSON file: the same model gives the same bytes, and what is read back equals what was written."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from kerfwright.errors import ModelError, OutputError
from kerfwright.model.faults import faults
from kerfwright.model.types import FORMAT_VERSION, Model

__all__ = ["model_from_json", "model_to_json", "read_model", "write_bytes", "write_model"]


def read_model(path: str | Path, *, strict: bool = True) -> Model:
    """Read a model file.

    Parameters
    ----------
    path : path of model.json
    strict : refuse a model that contradicts itself (`kerfwright.model.faults`); the checker reads on and reports all

    Raises
    ------
    ModelError
        If the file is missing, truncated, of another version, or says what a model cannot: one line.
    """
    path = Path(path)
    try:
        text = path.read_text(encoding="utf-8")
    except UnicodeDecodeError as error:
        raise ModelError(
            f"{path}: byte {error.start}: not UTF-8 text: give a model.json that kerfwright wrote"
        ) from error
    except OSError as error:
        raise ModelError(f"{path}: {error.strerror}: give a model.json that kerfwright wrote") from error
    model = model_from_json(text, str(path))
    if strict and (found := faults(model)):
        raise ModelError(f"{path}: {found[0]}{_more(len(found) - 1)}")
    return model


def model_from_json(text: str, source: str) -> Model:
    """Parse a model; `source` names the text in errors.

    Raises
    ------
    ModelError
        One line with source, field, value and remedy.
    """
    try:
        data = json.loads(text, parse_constant=_refuse_constant)
    except (ValueError, RecursionError) as error:
        raise ModelError(f"{source}: {_one_line(error)}: not whole JSON: the file is cut short or damaged") from error
    _check_format(data, source)
    try:
        return Model.model_validate(data)
    except ValidationError as error:
        raise ModelError(f"{source}: {_explain(error)}") from error


def _refuse_constant(name: str) -> float:
    raise ValueError(f"{name} is not a number")


def _check_format(data: Any, source: str) -> None:
    if not isinstance(data, dict) or data.get("format") != "kerfwright-model":
        found = data.get("format", "nothing") if isinstance(data, dict) else type(data).__name__
        raise ModelError(
            f"{source}: format: {found!r:.60}: not a kerfwright model: give a model.json that kerfwright wrote"
        )
    version = data.get("version")
    if type(version) is not int or version != FORMAT_VERSION:
        raise ModelError(
            f"{source}: version: {version!r:.60}: this kerfwright reads version {FORMAT_VERSION}: use the "
            "kerfwright that wrote the file, or reconstruct again"
        )


def _explain(error: ValidationError) -> str:
    """The first of pydantic's complaints in one line: field: value: remedy."""
    first = error.errors(include_url=False)[0]
    field = "".join(f"[{p}]" if isinstance(p, int) else f".{p}" for p in first["loc"]).lstrip(".")
    field = field if len(field) < 100 else field[:97] + "..."
    value = _one_line(repr(first["input"]))
    return f"{field}: {value if len(value) < 60 else value[:57] + '...'}: {_one_line(first['msg'])[:200]}" + _more(
        error.error_count() - 1
    )


def _more(count: int) -> str:
    return f" (and {count} more)" if count else ""


def _one_line(value: object) -> str:
    return " ".join(str(value).split())


def write_model(model: Model, path: str | Path) -> None:
    """Write a model file in one step: the old file or the whole new one, never half.

    Raises
    ------
    OutputError
        If the file cannot be written.
    """
    write_bytes(Path(path), model_to_json(model).encode("utf-8"))


def write_bytes(path: Path, data: bytes) -> None:
    """Write beside the file, then rename over it.

    Raises
    ------
    OutputError
        If the folder cannot be written.
    """
    beside = path.with_name(f".{path.name}.part")
    try:
        beside.write_bytes(data)
        os.replace(beside, path)
    except OSError as error:
        beside.unlink(missing_ok=True) if path.parent.is_dir() else None
        raise OutputError(f"{path}: {error.strerror}: give a folder that can be written") from error


def model_to_json(model: Model) -> str:
    """The model as text: fields in the order of the types, floats as their shortest exact decimals."""
    clean = Model.model_validate(model.model_dump())  # so that defaults given as whole numbers are floats as well
    return _encode(clean.model_dump(mode="json"), "") + "\n"


def _encode(value: Any, indent: str) -> str:
    """JSON with one field or record a line and lists of numbers on one line."""
    inner = indent + " "
    if isinstance(value, dict) and value and not _is_flat(value):
        rows = (f"{inner}{json.dumps(k)}: {_encode(v, inner)}" for k, v in value.items())
        return "{\n" + ",\n".join(rows) + f"\n{indent}}}"
    if isinstance(value, list) and not _is_numeric(value):
        return "[\n" + ",\n".join(inner + _encode(v, inner) for v in value) + f"\n{indent}]"
    return json.dumps(_plain_zero(value), ensure_ascii=False, allow_nan=False)


def _is_numeric(value: Any) -> bool:
    """Whether a list holds numbers only, at any depth."""
    return all(isinstance(v, int | float) or (isinstance(v, list) and _is_numeric(v)) for v in value)


def _is_flat(record: dict) -> bool:
    """Whether a record is short enough for one line: an edge of a cut path, a quantity."""
    return "kind" in record or set(record) == {"value", "standard_error", "origin"}


def _plain_zero(value: Any) -> Any:
    """-0.0 as 0.0: which of the two a sum gives differs between machines."""
    if isinstance(value, list):
        return [_plain_zero(v) for v in value]
    if isinstance(value, dict):
        return {k: _plain_zero(v) for k, v in value.items()}
    return 0.0 if isinstance(value, float) and value == 0 else value
