"""Model files: the same bytes, exact round trips, one line for what is wrong."""

import json
import stat

import numpy as np
import pytest

from kerfwright.errors import ModelError, OutputError
from kerfwright.model import (
    Bevel,
    Board,
    Circle,
    Contact,
    CutPath,
    Line,
    Loop,
    Model,
    Quantity,
    read_model,
    write_model,
)
from kerfwright.model.frames import board_from_model, model_from_board, rows
from kerfwright.model.io import model_to_json
from simple import stool


def rectangle(width: float, height: float) -> Loop:
    corners = [(0.0, 0.0), (width, 0.0), (width, height), (0.0, height)]
    return Loop(edges=tuple(Line(start=a, end=b) for a, b in zip(corners, corners[1:] + corners[:1], strict=True)))


def board(name: str = "leg", **changes) -> Board:
    values = {
        "name": name,
        "model_from_board": rows(np.eye(4)),
        "thickness": Quantity(value=18.1 / 3, standard_error=0.02),
        "cut_path": CutPath(
            outer=rectangle(100, 40), holes=(Loop(edges=(Circle(centre=(50, 20), radius=5, clockwise=True),)),)
        ),
    }
    return Board(**(values | changes))


def model() -> Model:
    bevel = Bevel(
        start=(0, 0), end=(100, 0), point=(0, 0, 0), normal=(0, -1, 0.2), angle=Quantity(value=11.3), contact=0
    )
    touch = Contact(type=1, a="leg", b="top", face_a="top", face_b="edge", point=(0, 0, 0), normal=(0, 0, 1),
                    interface=(((0, 0, 0), (1, 0, 0), (1, 1, 0)),), area=0.5, angle=90)  # fmt: skip
    return Model(boards=(board(bevels=(bevel,)), board("top")), contacts=(touch,))


def test_round_trip_is_exact_and_byte_identical(tmp_path):
    first, second = tmp_path / "a.json", tmp_path / "b.json"
    write_model(model(), first)
    again = read_model(first)
    assert again == model()
    write_model(again, second)
    assert first.read_bytes() == second.read_bytes()
    assert [p.name for p in sorted(tmp_path.iterdir())] == ["a.json", "b.json"]


def test_minus_zero_is_written_as_zero():
    text = model_to_json(Model(boards=(board(thickness=Quantity(value=-0.0)),)))
    assert "-0.0" not in text


def test_frames_invert():
    turn = np.array([[0.0, -1, 0, 5], [1, 0, 0, 6], [0, 0, 1, 7], [0, 0, 0, 1]])
    one = board(model_from_board=rows(turn))
    np.testing.assert_allclose(board_from_model(one) @ model_from_board(one), np.eye(4), atol=1e-15)


def broken(change) -> str:
    data = json.loads(model_to_json(model()))
    change(data)
    return json.dumps(data)


def outline(data, points):
    edges = [{"kind": "line", "start": a, "end": b} for a, b in zip(points, points[1:] + points[:1], strict=True)]
    data["boards"][0]["cut_path"] = {"outer": {"edges": edges}}


def edges(data) -> list:
    return data["boards"][0]["cut_path"]["outer"]["edges"]


def hole(data) -> dict:
    return data["boards"][0]["cut_path"]["holes"][0]["edges"][0]


def first(**changes) -> str:
    """The model with changes in its first board."""
    return broken(lambda d: d["boards"][0].update(changes))


def name(data, *names) -> None:
    for board, text in zip(data["boards"], names, strict=True):
        board["name"] = text


def thick(value) -> str:
    return first(thickness={"value": value})


def drawn(*points) -> str:
    return broken(lambda d: outline(d, [list(p) for p in points]))


HOSTILE = {
    "truncated": (lambda: model_to_json(model())[:-40], "cut short"),
    "empty": (lambda: "", "cut short"),
    "nan": (lambda: model_to_json(model()).replace("6.03", "NaN", 1), "NaN"),
    "nested": (lambda: "[" * 100_000, "cut short"),
    "list": (lambda: "[]", "format: 'list'"),
    "other file": (lambda: "{}", "format: 'nothing'"),
    "other version": (lambda: broken(lambda d: d.update(version=2)), "version: 2"),
    "version true": (lambda: broken(lambda d: d.update(version=True)), "version: True"),
    "text thickness": (lambda: thick("thick"), "thickness.value: 'thick'"),
    "unknown field": (lambda: first(colour="red"), "boards[0].colour: 'red'"),
    "zero thickness": (lambda: thick(0), "thickness: 0 mm"),
    "huge thickness": (lambda: thick(1e308), "thickness: 1e+308 mm"),
    "huge outline": (lambda: drawn((0, 0), (1e300, 0), (1e300, 40), (0, 40)), "reaches beyond 1e+06 mm"),
    "huge shift": (lambda: broken(lambda d: d["boards"][0]["model_from_board"][0].__setitem__(3, 1e9)), "shift"),
    "crossing": (lambda: drawn((0, 0), (100, 40), (100, 0), (0, 40)), "crosses itself near (50.00, 20.00)"),
    "clockwise": (lambda: drawn((0, 0), (0, 40), (100, 40), (100, 0)), "wrong way round"),
    "open": (lambda: broken(lambda d: edges(d).pop()), "open by 40 mm after edge 2"),
    "hole outside": (lambda: broken(lambda d: hole(d).update(centre=[99, 20])), "holes cross"),
    "slash": (lambda: first(name="../leg"), "boards[0].name: '../leg'"),
    "quote": (lambda: first(name='le"g'), "boards[0].name"),
    "formula": (lambda: first(name="=1+1"), "boards[0].name: '=1+1'"),
    "newline": (lambda: first(name="le\ng"), "boards[0].name"),
    "turned letters": (lambda: first(name="leg\u202e"), "boards[0].name: 'leg\\u202e'"),
    "same but for coding": (lambda: broken(lambda d: name(d, "T\u00fcr", "Tu\u0308r")), "boards[1].name: 'Tu\u0308r'"),
    "same name": (lambda: broken(lambda d: d["boards"][1].update(name="Leg")), "boards[1].name: 'Leg'"),
    "no such board": (lambda: broken(lambda d: d["contacts"][0].update(b="seat")), "contacts[0].b: 'seat'"),
    "no such contact": (lambda: broken(lambda d: d["boards"][0]["bevels"][0].update(contact=7)), "[0].contact: 7"),
    "sheared pose": (lambda: broken(lambda d: d["boards"][0]["model_from_board"][0].__setitem__(1, 0.5)), "shears"),
}  # fmt: skip


@pytest.mark.parametrize("case", HOSTILE)
def test_bad_files_get_one_line(case, tmp_path):
    make, expected = HOSTILE[case]
    path = tmp_path / "model.json"
    path.write_text(make(), encoding="utf-8")
    with pytest.raises(ModelError) as caught:
        read_model(path)
    message = str(caught.value)
    assert message.startswith(f"{path}: ") and expected in message and "\n" not in message and len(message) < 400


@pytest.mark.parametrize("text", ["Rückwand", "Łódź 2", "棚板", "शेल्फ", "Ru\u0308ckwand"])
def test_names_of_any_script_are_read(text, tmp_path):
    path = tmp_path / "model.json"
    path.write_text(
        broken(lambda d: (name(d, text, "other"), d.update(contacts=[], connectors=[], build_steps=[]), unlink(d))),
        encoding="utf-8",
    )
    assert read_model(path).boards[0].name == text


def unlink(data) -> None:
    for board in data["boards"]:
        board["same_as"] = None
        for bevel in board["bevels"]:
            bevel["contact"] = None


def test_missing_binary_and_unwritable_files(tmp_path):
    with pytest.raises(ModelError, match="No such file"):
        read_model(tmp_path / "none.json")
    (tmp_path / "binary.json").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(ModelError, match="byte 0: not UTF-8"):
        read_model(tmp_path / "binary.json")
    with pytest.raises(OutputError, match="can be written"):
        write_model(model(), tmp_path / "no" / "model.json")


def test_lenient_reading_leaves_contradictions_to_the_checker(tmp_path):
    path = tmp_path / "model.json"
    path.write_text(broken(lambda d: d["boards"][0]["thickness"].update(value=0)))
    assert read_model(path, strict=False).boards[0].thickness.value == 0


def test_a_failed_write_leaves_the_old_file(tmp_path):
    path = tmp_path / "model.json"
    path.mkdir()
    with pytest.raises(OutputError):
        write_model(model(), path)
    assert path.is_dir() and stat.S_ISDIR(path.stat().st_mode)
    assert [p.name for p in tmp_path.iterdir()] == ["model.json"]


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ('"name": "top"', f'"name": "{"<" * 9000}"'), ('"stock"', f'"{"(" * 9000}"'),
        ('"kind": "line"', f'"kind": "{"x" * 9000}"'), ('"a": "top"', f'"a": "{"[" * 9000}"'),
    ],
)  # fmt: skip
def test_long_names_are_told_shortly(tmp_path, old, new):
    path = tmp_path / "model.json"
    text = model_to_json(stool())
    assert old in text
    path.write_text(text.replace(old, new, 1))
    with pytest.raises(ModelError) as caught:
        read_model(path)
    assert len(str(caught.value)) < 600


@pytest.mark.filterwarnings("error")
def test_a_pose_of_absurd_numbers_is_told_without_a_warning(tmp_path):
    path = tmp_path / "model.json"
    path.write_text(model_to_json(stool()).replace("[[1.0,", "[[1e308,", 1))
    with pytest.raises(ModelError, match="stretches or shears"):
        read_model(path)
