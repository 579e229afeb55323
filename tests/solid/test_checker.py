"""Every finding can be provoked, says who, and is absent from a sound model."""

import time

import numpy as np
import pytest

from kerfwright.errors import OptionError
from kerfwright.model import Arc, Bezier, Line, Loop, Model, Quantity
from kerfwright.model.frames import rows
from kerfwright.model.resize import resized_board, resized_contact
from kerfwright.solid import CheckOptions, check
from simple import bevel, board, hole, placed, polygon, rectangle, stool


def change(model: Model, index: int, **fields) -> Model:
    boards = list(model.boards)
    boards[index] = boards[index].model_copy(update=fields)
    return model.model_copy(update={"boards": tuple(boards)})


def moved(model: Model, index: int, x=0.0, y=0.0, z=0.0) -> Model:
    pose = np.array(model.boards[index].model_from_board)
    pose[:3, 3] += (x, y, z)
    return change(model, index, model_from_board=rows(pose))


def shrunk(model: Model, factor: float) -> Model:
    smaller = np.diag([factor, factor, factor, 1.0])
    return model.model_copy(update={
        "boards": tuple(resized_board(b, smaller) for b in model.boards),
        "contacts": tuple(resized_contact(c, smaller) for c in model.contacts),
    })


def codes(model: Model, **options) -> list[str]:
    return [f.code for f in check(model, CheckOptions(**options))]


def lone(outline, **fields) -> Model:
    """One board that lies on the floor."""
    return Model(boards=(board(outline, **fields),))


def test_a_sound_model_has_no_findings():
    assert check(stool()) == ()


def test_gaps_and_overlaps_are_measured():
    (gap,) = [f for f in check(moved(stool(), 0, z=0.2)) if f.boards == ("top", "leg left")]
    assert gap.code == "K201" and gap.severity == "warning" and gap.value == pytest.approx(0.2, abs=1e-6)
    assert "leg left" in gap.message and "lengthen leg left" in gap.remedy
    overlap = [f for f in check(moved(stool(), 0, z=-0.02)) if f.code == "K202"]
    assert len(overlap) == 2 and overlap[0].value == pytest.approx(0.02, abs=1e-6)
    assert codes(moved(stool(), 0, z=0.009)) == []


def test_a_tilted_contact_is_measured_at_its_widest():
    turn = np.radians(0.05)
    model = stool()
    pose = np.array(model.boards[0].model_from_board)
    pose[:3, :3] = np.array([[np.cos(turn), 0, np.sin(turn)], [0, 1, 0], [-np.sin(turn), 0, np.cos(turn)]])
    found = {f.boards[1]: f for f in check(change(model, 0, model_from_board=rows(pose))) if f.code == "K202"}
    assert found["leg right"].value == pytest.approx(350 * np.sin(turn), rel=0.01)


def test_interference_is_an_error_with_its_volume():
    model = moved(stool(), 0, z=-5)
    found = [f for f in check(model) if f.code == "K110"]
    assert [f.boards for f in found] == [("top", "leg left"), ("top", "leg right")]
    assert found[0].severity == "error" and found[0].value == pytest.approx(18 * 300 * 5)


def test_notched_boards_that_cross_without_touching_each_other_are_fine():
    slot = [(0, 0), (91, 0), (91, 50), (109, 50), (109, 0), (200, 0), (200, 100), (0, 100)]
    low = [(0, 0), (200, 0), (200, 100), (109, 100), (109, 50), (91, 50), (91, 100), (0, 100)]
    across = board(low, "low", 18.0, placed((1, 0, 0), (0, 0, 1), (0, 18, 0)))
    over = board(slot, "over", 18.0, placed((0, 1, 0), (0, 0, 1), (91, -91, 0)))
    assert "K110" not in codes(Model(boards=(across, over)))
    deep = board(slot, "over", 18.0, placed((0, 1, 0), (0, 0, 1), (91, -91, -1)))
    found = [f for f in check(Model(boards=(across, deep))) if f.code == "K110"]
    assert found[0].value == pytest.approx(18 * 18 * 1)


def test_contacts_that_do_not_touch_and_floating_boards():
    found = check(moved(stool(), 1, x=-300))
    assert {(f.code, f.boards) for f in found if f.severity == "error"} == {
        ("K111", ("top", "leg left")),
        ("K112", ("leg left",)),
    }


def test_what_is_smaller_than_the_tolerances_is_checked_in_proportion():
    tiny = shrunk(stool(), 1e-3)
    assert {f.code for f in check(tiny)} == {"K204", "K211"}, "its boards are narrower than any tool"
    apart = check(shrunk(moved(stool(), 1, x=-300), 1e-3))
    assert {f.code for f in apart if f.severity == "error"} == {"K111", "K112"}


def test_unlisted_contacts_are_noted_and_hold():
    model = stool().model_copy(update={"contacts": ()})
    found = check(model)
    assert [f.code for f in found] == ["K301", "K301"] and found[0].value == pytest.approx(5400)


def test_stated_area_is_compared():
    model = stool()
    contacts = (model.contacts[0].model_copy(update={"area": 9999.0}), model.contacts[1])
    assert codes(model.model_copy(update={"contacts": contacts})) == ["K210"]


def test_ground_and_balance():
    assert codes(lone(rectangle(100, 50), pose=placed(at=(0, 0, 40)))) == ["K207"]
    leaning = polygon([(0, 0), (20, 0), (200, 200), (180, 200)])
    assert codes(lone(leaning, pose=placed((1, 0, 0), (0, 0, 1)))) == ["K208"]


INSIDE = {
    "sharp": (polygon([(0, 0), (200, 0), (200, 90), (100, 90), (100, 200), (0, 200)]), 0.0),
    "round": (
        Loop(
            edges=(
                *polygon([(0, 0), (200, 0), (200, 90), (102, 90)]).edges[:3],
                Arc(start=(102, 90), mid=(102 - 2 * np.sin(np.pi / 4), 92 - 2 * np.cos(np.pi / 4)), end=(100, 92)),
                *polygon([(100, 92), (100, 200), (0, 200), (0, 0)]).edges[:3],
            )
        ),
        2.0,
    ),
    "bezier": (
        Loop(
            edges=(
                *polygon([(0, 0), (200, 0), (200, 90), (102, 90)]).edges[:3],
                Bezier(start=(102, 90), control_1=(100.9, 90), control_2=(100, 90.9), end=(100, 92)),
                *polygon([(100, 92), (100, 200), (0, 200), (0, 0)]).edges[:3],
            )
        ),
        2.0,
    ),
}


@pytest.mark.parametrize("case", INSIDE)
def test_inside_corners_against_the_tool(case):
    outline, radius = INSIDE[case]
    (found,) = check(lone(outline))
    assert found.code == "K203" and found.value == pytest.approx(radius, abs=0.05) and "board" in found.message
    if radius:
        assert codes(lone(outline), tool_diameter=2 * radius - 0.2) == []


def test_holes_smaller_than_the_tool():
    assert codes(lone(rectangle(100, 50), holes=(hole(50, 25, 2.9),))) == ["K203"]
    assert codes(lone(rectangle(100, 50), holes=(hole(50, 25, 3.1),))) == []


def test_narrow_webs_and_fingers():
    (web,) = check(lone(rectangle(100, 50), holes=(hole(50, 14, 10),)))
    assert web.code == "K204" and web.value == pytest.approx(4.2, abs=0.61)
    finger = polygon([(0, 0), (100, 0), (100, 4), (30, 4), (30, 50), (0, 50)])
    assert "K204" in codes(lone(finger))
    assert codes(lone(rectangle(100, 50), holes=(hole(50, 17, 10),))) == []


def test_saw_range_and_contradicting_angles():
    edge = ((0.0, 0.0), (100.0, 0.0))
    assert codes(lone(rectangle(100, 50), bevels=(bevel(*edge, 50),))) == ["K205"]
    assert codes(lone(rectangle(100, 50), bevels=(bevel(*edge, 45),))) == []
    wrong = bevel(*edge, 30).model_copy(update={"angle": Quantity(value=-30)})
    assert codes(lone(rectangle(100, 50), bevels=(wrong,))) == ["K209"]


def test_sheets_are_tried_at_every_turn():
    assert codes(lone(rectangle(2400, 1200))) == []
    assert codes(lone(rectangle(2700, 300))) == ["K206"]
    turn = np.radians(20)
    points = np.array(rectangle(2430, 1210)) @ np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
    assert codes(lone([tuple(p) for p in points])) == []


def test_contradictions_are_findings_and_the_rest_is_still_checked():
    bow = Loop(edges=tuple(polygon([(0, 0), (100, 40), (100, 0), (0, 40)]).edges))
    model = moved(change(stool(), 2, cut_path=stool().boards[2].cut_path.model_copy(update={"outer": bow})), 1, x=-300)
    found = {f.code: f for f in check(model)}
    assert {"K106", "K111"} <= set(found) and found["K106"].boards == ("leg right",)
    assert codes(change(stool(), 0, thickness=Quantity(value=0)))[0] == "K103"
    assert codes(change(stool(), 1, name="leg/left"))[0] == "K101"
    assert "K102" in codes(change(stool(), 1, name="LEG RIGHT"))
    open_path = Loop(edges=(Line(start=(0, 0), end=(100, 0)), Line(start=(100, 0), end=(0, 50))))
    assert codes(lone(open_path)) == ["K105"]


def test_options_are_checked():
    with pytest.raises(OptionError, match="tool_diameter: nan"):
        CheckOptions(tool_diameter=float("nan"))


def test_thirty_boards_are_checked_in_five_seconds():
    boards = [board(rectangle(400, 300), f"shelf {k}", 18.0, placed(at=(0, 0, 200 * k))) for k in range(6)]
    uprights = [
        board(
            rectangle(182, 300), f"upright {k} {i}", 18.0, placed((0, 0, 1), (0, 1, 0), (18 + 60 * i, 0, 200 * k + 18))
        )
        for k in range(5)
        for i in range(5)
    ]
    model = Model(boards=(*boards, *uprights[:24]))
    check(model)  # imports
    start = time.process_time()
    found = check(model)
    assert time.process_time() - start < 5
    assert {f.code for f in found} == {"K301"} and len(found) == 48
