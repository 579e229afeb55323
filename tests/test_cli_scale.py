"""The options that say how large, how cropped and how high: refused in one line before any work."""

import sys

import cv2
import numpy as np
import pytest

from kerfwright.demo import demo_capture


@pytest.mark.parametrize(
    ("options", "told"),
    [
        (["--scale", "0"], "--scale: 0: not a length: give the millimetres of one capture unit, or auto"),
        (["--scale", "large"], "--scale: large: not a length"),
        (["--scale", "1", "--length", "top:x=4mm"], "--scale and --length: each gives the scale: use one of them"),
        (["--scale", "auto", "--markers", "4x4_50:4cm"], "--scale and --markers: each gives the scale"),
        (["--length", "top"], "--length: top: give BOARD:AXIS=LENGTH"),
        (["--length", "top:x=4mm", "--length", "top:y"], "--length: top:y: give BOARD:AXIS=LENGTH"),
        (["--markers", "40mm"], "--markers: 40mm: give FAMILY:SIDE"),
        (["--stock", "oak"], "--stock: 'oak': neither a table nor a thickness: give metric, inch, or"),
        (["--stock", "12,,18"], "--stock: '': neither a table nor a thickness"),
        (["--crop", "half"], "--crop: half: give auto, none, or the box"),
        (["--crop", "0,0,0,1,1,-1"], "--crop: 0,0,0,1,1,-1: give auto"),
        (["--ground", "low"], "'--ground'"),
    ],
)
def test_options_that_make_no_sense(kerfwright, tmp_path, options, told):
    done = kerfwright("reconstruct", demo_capture(), "-o", tmp_path / "out", *options)
    assert done.returncode == 2 and told in done.stderr
    assert len(done.stderr.splitlines()) == 1 and not (tmp_path / "out").exists()


def test_info_with_a_box(kerfwright):
    done = kerfwright("info", demo_capture(), "--crop", "-1,-1,0.2,1,1,1", "--ground", "0", "--scale", "auto")
    assert done.returncode == 0 and "--crop left" in done.stdout and "1000 mm a unit, assumed" in done.stdout


def test_poses_need_photographs_and_a_new_folder(kerfwright, tmp_path):
    for name in "ab":
        cv2.imwrite(str(tmp_path / f"{name}.png"), np.zeros((9, 9, 3), np.uint8))
    done = kerfwright("poses", tmp_path, "-o", tmp_path / "capture")
    assert done.returncode == 2 and "photographs: 2: at least 3 are needed" in done.stderr
    done = kerfwright("poses", tmp_path / "none", "-o", tmp_path / "capture")
    assert done.returncode == 2 and "no such folder" in done.stderr
    cv2.imwrite(str(tmp_path / "c.png"), np.zeros((9, 9, 3), np.uint8))
    (tmp_path / "capture" / "images").mkdir(parents=True)
    done = kerfwright("poses", tmp_path, "-o", tmp_path / "capture")
    assert done.returncode == 2 and "capture/images: folder: is there already" in done.stderr


def test_poses_without_colmap_tell_how_to_get_it(kerfwright, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "pycolmap", None)
    for name in "abc":
        cv2.imwrite(str(tmp_path / f"{name}.png"), np.zeros((9, 9, 3), np.uint8))
    done = kerfwright("poses", tmp_path, "-o", tmp_path / "capture")
    assert done.returncode == 2 and "needs pycolmap: run `pip install 'pycolmap" in done.stderr


def test_photographs_that_show_nothing_are_told(kerfwright, tmp_path):
    pytest.importorskip("pycolmap")
    for name in "abc":
        cv2.imwrite(str(tmp_path / f"{name}.png"), np.full((120, 160, 3), 90, np.uint8))
    done = kerfwright("poses", tmp_path, "-o", tmp_path / "capture", "-q")
    assert done.returncode == 2 and "3 could not be placed: overlap them more" in done.stderr
    assert not (tmp_path / "capture").exists()
