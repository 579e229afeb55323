"""Errors that a user can act on.

Every error names the file or option, the field, the value found and the remedy. The command line turns
each of them into one line and exit code 2.
"""

__all__ = [
    "CaptureError", "ExportError", "KerfwrightError", "ModelError", "OptionError", "OutputError", "StageError", "shown",
]  # fmt: skip


SHOWN_LENGTH = 60


def shown(found: object, longest: int = SHOWN_LENGTH) -> str:
    """A value as an error shows it: one line, printable, not too long."""
    text = ascii(found) if not isinstance(found, str) or not found.isprintable() else found
    return text if len(text) <= longest else text[: longest - 3] + "..."


class KerfwrightError(Exception):
    """Root of what kerfwright raises on purpose."""


class CaptureError(KerfwrightError, ValueError):
    """The capture folder, or a file in it, cannot be used."""


class OptionError(KerfwrightError, ValueError):
    """An option has a value that makes no sense."""


class ModelError(KerfwrightError, ValueError):
    """A model file cannot be read, or a model contradicts itself."""


class StageError(KerfwrightError, RuntimeError):
    """A stage found nothing that it can go on with."""


class ExportError(KerfwrightError, RuntimeError):
    """A file format cannot express the model, or the checker forbids the export."""


class OutputError(KerfwrightError, OSError):
    """The output folder cannot be written, or holds files that kerfwright did not make."""
