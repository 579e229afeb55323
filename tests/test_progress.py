"""Reporters tell every stage, once, with its time."""

import io
import json

import pytest

from kerfwright.progress import JsonReporter, PlainReporter, Reporter, RichReporter, reporter_for


class Terminal(io.StringIO):
    def isatty(self):
        return True


def run(reporter: Reporter) -> None:
    with reporter.stage("one", "Doing one"):
        reporter.note("detail [red]")
    with reporter.stage("two", "Doing two"):
        reporter.reuse("two")
    with pytest.raises(KeyError), reporter.stage("three", "Doing three"):
        raise KeyError
    reporter.close()


def test_times_are_kept_of_finished_stages_only():
    reporter = Reporter()
    run(reporter)
    assert list(reporter.seconds) == ["one", "two"] and all(0 <= s < 1 for s in reporter.seconds.values())
    assert list(reporter.cpu_seconds) == ["one", "two"] and all(0 <= s < 1 for s in reporter.cpu_seconds.values())
    assert reporter.reused == ["two"]


def test_plain_lines():
    stream = io.StringIO()
    run(PlainReporter(stream, verbose=True))
    note, one, two = stream.getvalue().splitlines()
    assert note == "    detail [red]"
    assert one.startswith("Doing one") and one.endswith("0.0 s")
    assert two.startswith("Doing two") and two.endswith("0.0 s (from the cache)")


def test_json_lines():
    stream = io.StringIO()
    run(JsonReporter(stream))
    events = [json.loads(line) for line in stream.getvalue().splitlines()]
    assert [(e["event"], e.get("stage")) for e in events] == [
        ("started", "one"), ("note", None), ("finished", "one"), ("started", "two"), ("finished", "two"),
        ("started", "three"), ("failed", "three"),
    ]
    assert events[4]["cached"] and not events[2]["cached"]


def test_time_left_follows_from_the_usual_shares():
    reporter = Reporter()
    assert reporter.left() is None
    reporter.plan({"a": 0.1, "b": 0.2, "c": 0.7})
    reporter.seconds["a"] = 3.0
    assert reporter.left() == pytest.approx(27)
    reporter.seconds["b"] = 0.01
    reporter.reuse("b")
    assert reporter.left() == pytest.approx(21), "what came from the cache tells nothing of speed"


def test_steps_are_counted_when_they_were_announced():
    stream = io.StringIO()
    reporter = PlainReporter(stream)
    reporter.plan({"one": 1, "two": 1, "three": 1})
    run(reporter)
    assert [line.split()[0] for line in stream.getvalue().splitlines()] == ["1/3", "2/3"]


def test_a_terminal_gets_its_cursor_back():
    stream = Terminal()
    run(RichReporter(stream, verbose=True))
    text = stream.getvalue()
    assert "✓" in text and "Doing one" in text and "[red]" in text
    assert text.count("\x1b[?25l") == text.count("\x1b[?25h"), "hidden as often as shown again"


def test_who_reports_where():
    assert type(reporter_for(Terminal())) is RichReporter
    assert type(reporter_for(io.StringIO())) is PlainReporter
    assert type(reporter_for(Terminal(), as_json=True)) is JsonReporter
    assert type(reporter_for(Terminal(), quiet=True)) is Reporter
