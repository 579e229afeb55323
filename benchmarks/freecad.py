"""Open STEP files in FreeCAD and compare what it sees with the model: names, volumes, validity, common volumes.

    python benchmarks/freecad.py MODEL.json FILE.step [MODEL.json FILE.step ...]
    python benchmarks/freecad.py truths --out DIR

FreeCAD has an OCCT and a STEP reader of its own, of another version; on Debian: apt-get install --no-install-recommends
freecad. The second form takes the models that exports.py takes, and writes both STEP formats to DIR first.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import subprocess
import tempfile
from pathlib import Path

from models import named_models
from tables import markdown

from kerfwright.model import Model
from kerfwright.solid import assembly_solids, check
from kerfwright_exporters import ExportOptions, export_all
from kerfwright_exporters.naming import plain_name

# Runs inside FreeCAD. Without the first setting, FreeCAD 0.20 crashes on assemblies when it has no window.
PROGRAM = """
import itertools, json, os
import FreeCAD
FreeCAD.ParamGet("User parameter:BaseApp/Preferences/Mod/Import/hSTEP").SetBool("ReadShapeCompoundMode", False)
import Import, Part

def leaves(thing, placement):
    here = placement.multiply(thing.Placement)
    inside = getattr(thing, "Group", None) or getattr(thing, "ElementList", None) or []
    if inside:
        for part in inside:
            yield from leaves(part, here)
    else:
        shape = getattr(thing, "LinkedObject", thing).Shape.copy()
        shape.Placement = here
        yield thing.Label, shape

document = FreeCAD.newDocument("read")
Import.insert(os.environ["KERFWRIGHT_STEP"], "read")
document.recompute()
roots = [thing for thing in document.Objects if not thing.InList]
found = [leaf for root in roots for leaf in leaves(root, FreeCAD.Placement())]
answer = {
    "version": ".".join(FreeCAD.Version()[:3]) + ", OCCT " + Part.OCC_VERSION,
    "boards": [[name, shape.Volume, len(shape.Solids), shape.isValid()] for name, shape in found],
    "common": [[a, b, x.common(y).Volume] for (a, x), (b, y) in itertools.combinations(found, 2)
               if x.BoundBox.intersect(y.BoundBox)],
}
with open(os.environ["KERFWRIGHT_ANSWER"], "w") as stream:
    json.dump(answer, stream)
os._exit(0)
"""


def main() -> None:
    """Print one row a file; exit code 1 if FreeCAD disagrees on any."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("models", nargs="+", help="`truths`, the name of one, or a model.json; or MODEL.json FILE.step")
    parser.add_argument("--out", type=Path, help="write the STEP files here first")
    arguments = parser.parse_args()
    command = shutil.which("freecadcmd") or shutil.which("FreeCADCmd")
    if command is None:
        raise SystemExit("freecadcmd: not found: apt-get install --no-install-recommends freecad")
    rows = [_row(command, name, model, path) for name, model, path in _cases(arguments.models, arguments.out)]
    print(markdown(["file", "FreeCAD", "boards", "names", "valid", "volume off", "common volume, mm3"], rows))
    raise SystemExit(any("NO" in cell for row in rows for cell in row))


def _cases(models: list[str], out: Path | None):
    """Label, model and STEP file."""
    if out is None:
        for source, path in zip(models[::2], models[1::2], strict=True):
            (named,) = named_models([source])
            yield *named, Path(path)
        return
    for name, model in named_models(models):
        folder = out / name.replace(" ", "_")
        errors = any(f.severity == "error" for f in check(model))
        for path in export_all(model, ["step", "step214"], folder, ExportOptions(), force=errors):
            yield f"{name}{', NOT VERIFIED' if errors else ''}: {path.name}", model, path


def _row(command: str, name: str, model: Model, path: Path) -> list[str]:
    seen = _opened(command, path)
    if seen is None:
        return [name, "NO: it crashed", *["-"] * 5]
    wanted = {plain_name(board): solid.volume for board, solid in assembly_solids(model)}
    names, volumes, solids, valid = zip(*seen["boards"], strict=True)
    same_names = list(names) == list(wanted)
    off = max(abs(v / w - 1) for v, w in zip(volumes, wanted.values(), strict=True)) if same_names else None
    common = max((volume for *_, volume in seen["common"]), default=0.0)
    return [
        name, seen["version"], str(len(names)), "same" if same_names else f"NO: {names}",
        "all" if all(valid) and set(solids) == {1} else "NO", "NO" if off is None or off > 1e-6 else f"{off:.0e}",
        f"{common:.3f}" + (" NO" if common > 1 and "NOT VERIFIED" not in name else ""),
    ]  # fmt: skip


def _opened(command: str, path: Path) -> dict | None:
    """What FreeCAD says of a file; None where it dies."""
    with tempfile.TemporaryDirectory() as folder:
        program, answer = Path(folder) / "look.py", Path(folder) / "answer.json"
        program.write_text(PROGRAM)
        home = dict.fromkeys(("HOME", "XDG_CONFIG_HOME", "XDG_DATA_HOME"), folder)
        asked = {"KERFWRIGHT_STEP": str(path.resolve()), "KERFWRIGHT_ANSWER": str(answer)}
        environment = {**os.environ, **home, **asked, "QT_QPA_PLATFORM": "offscreen"}
        subprocess.run([command, str(program)], env=environment, capture_output=True, check=False)
        return json.loads(answer.read_text()) if answer.exists() else None


if __name__ == "__main__":
    main()
