"""The report says what the model says, opens offline, and runs in a browser without an error."""

import json
import os
import queue
import re
import shutil
import signal
import subprocess
import threading
from contextlib import contextmanager
from html.parser import HTMLParser
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import cv2
import numpy as np
import pytest

from kerfwright.capture.camera import Camera
from kerfwright.capture.types import Capture, Cloud, View
from kerfwright.model import (
    Bevel,
    Board,
    Choice,
    Contact,
    ContactEvidence,
    CutPath,
    Finding,
    Line,
    Loop,
    Model,
    Provenance,
    Quantity,
    Scale,
)
from kerfwright.report.cutting import CutSheet, LaidPart
from kerfwright.report.page import report_html

CHROMIUM = shutil.which("chromium") or shutil.which("google-chrome")
COLOURS = [(0.8, 0.5, 0.3), (0.4, 0.6, 0.7), (0.5, 0.7, 0.5)]
HOSTILE = "</script><img src=x onerror=alert(1)>"


def board(name: str, x: float, **more) -> Board:
    """300 x 80 x 18, its sheet normal along the model's x, standing at x."""
    corners = [(0, 0), (300, 0), (300, 80), (0, 80)]
    edges = tuple(Line(start=a, end=b) for a, b in zip(corners, corners[1:] + corners[:1], strict=True))
    pose = ((0, 0, 1, x), (1, 0, 0, -150), (0, 1, 0, 0), (0, 0, 0, 1))
    return Board(
        name=name,
        model_from_board=pose,
        thickness=Quantity(value=18, standard_error=0.12),
        cut_path=CutPath(outer=Loop(edges=edges)),
        **more,
    )


BEVEL = Bevel(start=(300, 80), end=(0, 80), point=(0, 80, 0), normal=(0, 0.98, 0.2), angle=Quantity(value=11.5))
CONTACT = Contact(
    type=2,
    a="left",
    b=HOSTILE,
    face_a="top",
    face_b="edge",
    point=(0, 0, 0),
    normal=(1, 0, 0),
    interface=(),
    area=1440.0,
    angle=90.0,
    evidence=ContactEvidence(seam_score=0.8, seam_score_other=0.3, views=5, decided_by="seam"),
)
CHOICE = Choice(
    method="exact", candidates=6, chosen=3, objective=0.8125, bound=0.8135, gap=0.001, explained=0.9
)
MODEL = Model(
    name="a <b>tray</b>",
    boards=(
        board("left", 0),
        board("right", 200, same_as="left", mirrored=True),
        board(HOSTILE, 100, bevels=(BEVEL,), notes=("inferred & doubtful",)),
    ),
    contacts=(CONTACT,),
    scale=Scale(millimetres_per_unit=500, origin="given"),
    findings=(
        Finding(code="K003", severity="warning", message="a warning"),
        Finding(code="K110", severity="error", message="an error", remedy="mend it"),
    ),
    provenance=Provenance(version="1.2", capture="c", images=2, points=900, choice=CHOICE),
)


SHEETS = (CutSheet(18, 2440, 1220, 0.03, (LaidPart("left", (MODEL.boards[0].cut_path.outer,)),)),)


@pytest.fixture
def capture(tmp_path) -> Capture:
    """Two photographs of nothing, and a cloud on the inner sides of the two outer boards."""
    views = []
    for k, side in enumerate((1, -1)):
        cv2.imwrite(str(tmp_path / f"{k}.png"), np.full((120, 160, 3), 80 + 20 * k, np.uint8))
        turn = np.array([[side, 0, 0], [0, 0, -1], [0, side, 0]], float)
        pose = np.eye(4)
        pose[:3, :3], pose[:3, 3] = turn, -turn @ [110, -side * 700, 40]
        views.append(View(f"{k}.png", tmp_path / f"{k}.png", Camera("SIMPLE_PINHOLE", 160, 120, (150, 80, 60)), pose))
    y, z = (g.ravel() for g in np.meshgrid(np.linspace(-150, 150, 30), np.linspace(0, 80, 15)))
    points = np.concatenate([np.column_stack([np.full(450, x), y, z]) for x in (18.5, 200)])
    return Capture("c", tuple(views), Cloud(points, np.zeros_like(points)), MODEL.scale)


class Page(HTMLParser):
    """Tags with their attributes, and the text of the page by the tag that holds it."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.tags, self.texts, self._open = [], [], []
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))
        self._open.append(tag)

    def handle_endtag(self, tag):
        while self._open and self._open.pop() != tag:
            pass

    def handle_data(self, data):
        if self._open and self._open[-1] not in ("script", "style"):
            self.texts.append(data)

    @property
    def text(self) -> str:
        return " ".join(" ".join(self.texts).split())


def test_it_needs_nothing_from_elsewhere(capture):
    page = Page(report_html(MODEL, capture, COLOURS))
    addresses = [v for _, attrs in page.tags for k, v in attrs.items() if k in ("src", "href", "data", "action")]
    assert len(addresses) == 6 and all(a.startswith("data:image/") for a in addresses)


def test_it_says_what_the_model_says(capture):
    text = Page(report_html(MODEL, capture, COLOURS)).text
    for words in (
        "a <b>tray</b>",
        "3 boards, 2 different; 1 contacts",
        "500 mm, given",
        "left, right",
        "2, 1 of them turned over",
        "300.0 × 80.0 mm",
        "18.00 mm ± 0.12, measured",
        "+11.5°",
        "inferred & doubtful",
        HOSTILE,
        "edge on face, at a corner 14.4 90.0 seam in the photographs: 0.80 against 0.30 in 5 views",
        "error K110 an error mend it warning K003 a warning",
        "1.2 from c: 2 photographs, 900 points",
        "3 of 6 candidates chosen, which explain 90 % of the cloud; objective 0.8125 (exact), "
        "no choice is better by more than 0.001",
    ):
        assert words in text, words


def test_distances_of_the_cloud_are_measured(capture):
    text = Page(report_html(MODEL, capture, COLOURS)).text
    # Half of the points lie 0.5 mm off a board and half on one: RMS 0.354.
    assert "RMS 0.35 mm, 95 % within 0.50 mm" in text


def test_names_from_a_file_cannot_become_markup(capture):
    page = Page(report_html(MODEL, capture, COLOURS))
    assert not [attrs for tag, attrs in page.tags if tag == "img" and "onerror" in attrs]
    assert [tag for tag, _ in page.tags].count("script") == 2
    assert "b" not in [tag for tag, _ in page.tags]


def test_the_scene_holds_every_board(capture):
    text = report_html(MODEL, capture, COLOURS)
    scene = json.loads(re.search(r'id="scene">(.*?)</script>', text, re.S).group(1))
    assert [b["name"] for b in scene["boards"]] == [b.name for b in MODEL.boards]
    assert scene["boards"][0]["centre"] == [9.0, 0.0, 40.0]
    import base64

    edges = [len(base64.b64decode(b["edges"])) // 8 for b in scene["boards"]]
    assert edges[0] == 12 and edges[1] == 12, "a box has twelve edges"


def test_what_to_photograph_next(capture):
    text = Page(report_html(MODEL, capture, COLOURS)).text
    assert "Photograph these next" in text, "two photographs of three boards don't show all"
    assert re.search(r"\d+° to the (right|left) of [01]\.png", text)
    assert "Take two or three from each place" in text


def test_cut_sheets_or_why_there_are_none(capture):
    text = Page(report_html(MODEL, capture, COLOURS, SHEETS)).text
    assert "Cut sheets" in text and "2440 × 1220 × 18.0 mm: 1 board, 3 % used" in text
    assert "board 'left' does not fit" in Page(report_html(MODEL, None, COLOURS, (), "board 'left' does not fit")).text
    assert "Cut sheets" not in Page(report_html(MODEL, None, COLOURS)).text


@pytest.mark.parametrize("origin", ["assumed", "given", "file", "measured", "inferred"])
def test_where_the_scale_is_from(origin):
    model = MODEL.model_copy(update={"scale": Scale(millimetres_per_unit=7.5, origin=origin, note="From a tape.")})
    text = Page(report_html(model, None, COLOURS)).text
    words = {"file": "of the cloud's format", "inferred": "guessed from the boards"}.get(origin, origin)
    assert re.search(rf"1 capture unit = 7.5 mm, {words}[^.]*\. From a tape\.", text)


def test_without_a_capture_it_shows_the_model_alone():
    page = Page(report_html(MODEL, None, COLOURS))
    assert "photographs" not in page.text.replace("seam in the photographs", "").replace("2 photographs", "")
    assert "img" not in [tag for tag, _ in page.tags]


def test_the_same_bytes_each_time(capture):
    assert report_html(MODEL, capture, COLOURS) == report_html(MODEL, capture, COLOURS)


PROBE = """
<script>
const drawn = (next) => requestAnimationFrame(() => requestAnimationFrame(next));
window.addEventListener("load", () => drawn(() => {
  const canvas = document.querySelector(".stage canvas");
  const colours = () => {
    const flat = document.createElement("canvas");
    flat.width = canvas.width; flat.height = canvas.height;
    const pen = flat.getContext("2d");
    pen.drawImage(canvas, 0, 0);
    const data = pen.getImageData(0, 0, flat.width, flat.height).data;
    let painted = 0, sum = 0;
    for (let k = 0; k < data.length; k += 4) if (data[k + 3] > 0) { painted += 1; sum = (sum * 31 + data[k]) % 1e9; }
    return { painted, sum };
  };
  const say = { first: colours() };
  const slider = document.getElementById("explode");
  slider.value = 1; slider.dispatchEvent(new Event("input"));
  drawn(() => {
    say.exploded = colours();
    const box = canvas.getBoundingClientRect();
    const at = { clientX: box.left + box.width / 2, clientY: box.top + box.height / 2, pointerId: 1, bubbles: true };
    canvas.setPointerCapture = () => {};
    slider.value = 0;
    canvas.dispatchEvent(new PointerEvent("pointerdown", at));
    canvas.dispatchEvent(new PointerEvent("pointerup", at));
    say.chosen = document.querySelector(".stage .name").textContent;
    say.card = document.querySelectorAll(".card.chosen").length;
    const style = document.getElementById("style");
    style.value = "shaded"; style.dispatchEvent(new Event("change"));
    say.body = document.body.className;
    document.getElementById("blend").value = 0.25;
    document.getElementById("blend").dispatchEvent(new Event("input"));
    say.opacity = document.querySelector(".layers img + img").style.opacity;
    say.stock = [...document.querySelectorAll(".sheets svg .stock")].map((r) => r.getBoundingClientRect().width > 100);
    say.headings = [...document.querySelectorAll("h2")].map((h) => h.textContent);
    const cloud = document.getElementById("cloud");
    const plain = colours().sum;
    cloud.checked = true; cloud.dispatchEvent(new Event("input"));
    const blink = document.getElementById("blink");
    blink.checked = true;
    const seen = new Set();
    const watch = setInterval(() => seen.add(document.querySelector(".layers img + img").style.opacity), 60);
    drawn(() => {
      say.deviation = colours().sum !== plain;
      const wait = setInterval(() => {
        if (!seen.has("0") || !seen.has("1")) return;
        clearInterval(watch); clearInterval(wait);
        say.blinks = [...seen].sort();
        fetch("REPORT_TO", { method: "POST", mode: "no-cors", body: JSON.stringify(say) });
      }, 100);
    });
  });
}));
</script>
"""


@contextmanager
def listener():
    """A server that puts what is posted to it into a queue: the page itself tells when it is done."""
    heard: queue.Queue[bytes] = queue.Queue()

    class Listener(BaseHTTPRequestHandler):
        def do_POST(self):
            heard.put(self.rfile.read(int(self.headers["Content-Length"])))
            self.send_response(204)
            self.end_headers()

        def log_message(self, *_):
            pass

    server = ThreadingHTTPServer(("127.0.0.1", 0), Listener)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    try:
        yield f"http://127.0.0.1:{server.server_port}/", heard
    finally:
        server.shutdown()
        server.server_close()


@contextmanager
def browser(page: Path, log: Path):
    """Headless Chromium showing the page, its console in the log; stopped at the end."""
    arguments = [
        "--headless",
        "--no-sandbox",
        "--disable-gpu",
        "--use-angle=swiftshader",
        "--enable-unsafe-swiftshader",
        "--disable-quic",
        "--no-first-run",
        "--disable-background-networking",
        "--disable-component-update",
        "--disable-sync",
        f"--user-data-dir={page.parent / 'profile'}",
        "--window-size=1000,900",
        "--enable-logging=stderr",
    ]
    with log.open("wb") as console:
        process = subprocess.Popen(
            [CHROMIUM, *arguments, page.as_uri()], stdout=console, stderr=console, start_new_session=True
        )
        try:
            yield
        finally:
            os.killpg(process.pid, signal.SIGKILL)
            process.wait()


@pytest.mark.skipif(CHROMIUM is None, reason="no Chromium here")
def test_it_runs_in_a_browser(capture, tmp_path):
    page, log = tmp_path / "report.html", tmp_path / "chromium.log"
    with listener() as (address, heard):
        html = report_html(MODEL, capture, COLOURS, SHEETS)
        page.write_text(html.replace("</body>", PROBE.replace("REPORT_TO", address) + "</body>"))
        with browser(page, log):
            said = json.loads(heard.get(timeout=120))
    console = [line for line in log.read_text(errors="replace").splitlines() if "CONSOLE" in line]
    assert [line for line in console if "GL Driver Message" not in line] == []
    assert said["first"]["painted"] > 20_000, "the boards are drawn"
    assert said["exploded"] != said["first"], "the slider moves them"
    assert said["chosen"] in [b.name for b in MODEL.boards] and said["card"] == 1, "a click chooses a board"
    assert said["body"] == "shaded" and said["opacity"] == "0.25"
    assert said["stock"] == [True] and said["deviation"], "sheets are drawn; the cloud's distances colour the view"
    assert {"0", "1"} <= set(said["blinks"]), "the drawing comes and goes"
    assert said["headings"] == [
        "Assembly", "Over the photographs", "Boards", "Cut sheets", "Contacts", "Findings", "Photograph these next",
    ]  # fmt: skip


def test_assets_ship_with_the_package():
    from importlib.resources import files

    assert {p.name for p in (files("kerfwright.report") / "assets").iterdir()} >= {"page.css", "viewer.js"}
    assert Path(str(files("kerfwright.report"))).is_dir()
