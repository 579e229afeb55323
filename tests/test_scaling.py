"""The scale from boards: lengths that were measured, or thicknesses of stock."""

import numpy as np
import pytest

import simple
from kerfwright.errors import OptionError
from kerfwright.model import Finding, Model, Origin, Quantity, Scale
from kerfwright.scaling import parse_lengths, scaled_by_lengths, scaled_by_stock

ASSUMED = Finding(code="K003", severity="warning", message="assumed")
LYING, STANDING = np.eye(4), np.array([[1, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1.0]])


def model(thicknesses=(18.0, 18.0), factor=1.0, error=0.05, sizes=((400, 300), (380, 350))) -> Model:
    """A top that lies on a board that stands, all lengths times a factor."""
    boards = []
    for k, (thickness, (x, y)) in enumerate(zip(thicknesses, sizes, strict=False)):
        pose = (LYING if k == 0 else STANDING).copy()
        pose[2, 3] = 350 * factor if k == 0 else 0
        made = simple.board(simple.rectangle(x * factor, y * factor), f"board_{k + 1:02d}", thickness * factor, pose)
        quantity = Quantity(value=thickness * factor, standard_error=error * factor, origin=Origin.MEASURED)
        boards.append(made.model_copy(update={"thickness": quantity}))
    capture_from_model = tuple(map(tuple, np.diag([1e-3, 1e-3, 1e-3, 1.0])))
    return Model(boards=tuple(boards), findings=(ASSUMED,), capture_from_model=capture_from_model)


def place(found: Model) -> np.ndarray:
    """Where a corner of the first board lies in the capture: no scale may move it."""
    x, y = found.boards[0].cut_path.outer.edges[1].start
    return np.array(found.capture_from_model) @ np.array(found.boards[0].model_from_board) @ [x, y, 0, 1]


@pytest.mark.parametrize(
    "text", ["top:x=420mm", "top:length=42cm", "board_01:x=0.42m", "top:y=315", "object:z=386.4mm", "board_02:z=18.9mm"]
)
def test_one_length(text):
    before = model()
    after = scaled_by_lengths(before, parse_lengths([text]))
    assert after.scale.millimetres_per_unit == pytest.approx(1050) and after.scale.origin == "measured"
    assert np.ptp([e.start[0] for e in after.boards[0].cut_path.outer.edges]) == pytest.approx(420)
    assert after.boards[1].thickness.value == pytest.approx(18.9)
    np.testing.assert_allclose(place(after), place(before), atol=1e-12)
    assert after.findings == () and "0.00)" in after.scale.note


def test_several_lengths_give_residuals_and_an_error():
    after = scaled_by_lengths(model(), parse_lengths(["top:x=401mm", "top:y=299.5mm", "board_02:y=351mm"]))
    assert after.scale.millimetres_per_unit == pytest.approx(1001.9, abs=0.5)
    assert 0.5 < after.scale.standard_error < 3 and after.findings == ()
    assert "top:x=401mm (-0." in after.scale.note


def test_lengths_that_contradict_are_told():
    after = scaled_by_lengths(model(), parse_lengths(["top:x=400mm", "top:y=330mm"]))
    assert [(f.code, f.severity) for f in after.findings] == [("K004", "warning")]
    assert "contradict" in after.findings[0].message


NO_LENGTHS = ("", "top", "top:x", "top:x=", "top:w=4", "top:x=-4mm", "top:x=0", "top:x=4 feet", ":x=4")


@pytest.mark.parametrize("text", NO_LENGTHS)
def test_what_is_no_length_is_told(text):
    with pytest.raises(OptionError, match=r"--length: .*such as top:x=420mm"):
        parse_lengths([text])


def test_a_board_that_is_not_there_is_told():
    with pytest.raises(OptionError, match="--length: leg: no such board: use one of top, object, board_01, board_02"):
        scaled_by_lengths(model(), parse_lengths(["leg:x=4mm"]))


@pytest.mark.parametrize("factor", [0.5, 1.0, 1.7])
def test_several_thicknesses_tell_the_scale(factor):
    sizes = ((400, 300), (380, 350), (500, 90), (300, 300), (200, 100))
    before = model((18.05, 12.0, 6.02, 21.95, 27.1), factor, sizes=sizes)
    after = scaled_by_stock(before)
    assert after.scale.millimetres_per_unit == pytest.approx(1000 / factor, rel=0.01)
    assert after.scale.origin == "inferred"
    assert "18" in after.scale.note and "Confidence" in after.scale.note
    np.testing.assert_allclose(place(after), place(before), atol=1e-12)
    assert {f.code for f in after.findings} == {"K004"}


def test_one_thickness_tells_little_and_says_so():
    after = scaled_by_stock(model())
    (finding,) = after.findings
    assert finding.severity == "warning" and "; else " in finding.message
    assert float(after.scale.note.split("Confidence ")[1].split(" %")[0]) < 30


def test_inferred_thicknesses_do_not_count():
    first, second = model((18.0, 7.77)).boards
    guessed = second.model_copy(update={"thickness": Quantity(value=7.77, origin=Origin.INFERRED)})
    scale = Scale(millimetres_per_unit=9)
    after = scaled_by_stock(model().model_copy(update={"boards": (first, guessed), "scale": scale}))
    assert "from 1 thicknesses" in after.findings[0].message
