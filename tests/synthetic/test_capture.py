"""Captures: what is written reads back, agrees with the truth, and comes out the same twice."""

import json

import numpy as np
import pytest

from kerfwright.capture import Camera
from kerfwright.errors import OutputError
from kerfwright.model.frames import invert, matrix, transform_points
from kerfwright.synthetic import PRESETS, in_memory, random_assembly, tiny_assembly, tiny_capture, write_capture
from kerfwright.synthetic.assemblies import inside
from kerfwright.synthetic.cameras import camera_rays, looking_at
from kerfwright.synthetic.meshes import mesh_in_model
from kerfwright.synthetic.options import CaptureOptions, CloudOptions, DatasetOptions, ImageOptions
from kerfwright.synthetic.tiny import TINY

SMALL = CaptureOptions(
    dataset=DatasetOptions(images=4, width=160, height=120, turn=30.0, scale=2.5, shift=(1.0, -2.0, 0.5)),
    images=ImageOptions(samples=1, texels=0.01, floor_texels=256, room_nodes=8, light_rays=6),
    cloud=CloudOptions(points=4000, views=2, noise=0.03, drift=0.03),
)


def distance_to(model, points):
    import open3d

    scene = open3d.t.geometry.RaycastingScene()
    for board in model.boards:
        v, t = mesh_in_model(board)
        scene.add_triangles(open3d.core.Tensor(v.astype(np.float32)), open3d.core.Tensor(t.astype(np.uint32)))
    return scene.compute_distance(open3d.core.Tensor(points.astype(np.float32))).numpy()


def test_a_cloud_alone_is_the_photographed_objects():
    alone, whole = in_memory(tiny_assembly(), TINY, photographed=False), tiny_capture()
    assert alone.views == ()
    assert np.array_equal(alone.cloud.points, whole.cloud.points)


def test_tiny_capture_is_whole_and_made_once():
    capture = tiny_capture(8)
    assert len(capture.views) == 8
    assert capture.views[0].image().shape == (120, 160, 3)
    assert 4000 < len(capture.cloud) <= 6000
    assert np.allclose(np.linalg.norm(capture.cloud.normals, axis=1), 1)
    assert tiny_capture(8) is capture


def test_tiny_cloud_lies_on_its_boards():
    capture = tiny_capture()
    distance = distance_to(tiny_assembly(), capture.cloud.points)
    assert np.median(distance) < 0.3
    assert np.percentile(distance, 95) < 2.0


def test_photographs_frame_the_whole_object():
    corners = np.array([(x, y, 218.0) for x in (-150, 150) for y in (-90, 90)])
    for view in tiny_capture().views:
        pixels, depth = view.project(corners)
        assert (depth > 0).all()
        assert ((pixels > 0) & (pixels < (160, 120))).all()


def test_clean_capture_lies_exactly_on_its_surface():
    clean = PRESETS["clean"]
    options = CaptureOptions(
        dataset=SMALL.dataset, images=SMALL.images, cloud=CloudOptions(**{**vars(clean.cloud), "points": 3000})
    )
    model = tiny_assembly()
    capture = in_memory(model, options)
    assert distance_to(model, capture.cloud.points).max() < 0.01


def test_points_are_where_somebody_looked():
    """The undersides that stand on the floor have no points."""
    capture = tiny_capture()
    near_floor = capture.cloud.points[np.abs(capture.cloud.points[:, 2]) < 0.5]
    assert not (capture.cloud.normals[np.abs(capture.cloud.points[:, 2]) < 0.5, 2] < -0.9).any()
    assert len(near_floor) < 0.01 * len(capture.cloud)


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    return write_capture(tiny_assembly(), tmp_path_factory.mktemp("captures") / "tiny", SMALL)


def test_truth_is_laid_on_the_capture_by_its_frame(written):
    frame = json.loads((written / "truth/frame.json").read_text())
    raw = (written / "cloud.ply").read_bytes()
    count = int(raw.split(b"element vertex ")[1].split()[0])
    rows = np.frombuffer(raw.split(b"end_header\n")[1], [("x", "<f4", 6), ("c", "u1", 3)], count)
    x_in_truth = (rows["x"][:, :3] - frame["shift"]) @ np.array(frame["turn"]) / frame["scale"] * 1000
    assert np.median(distance_to(tiny_assembly(), x_in_truth)) < 0.6
    assert np.allclose(np.linalg.norm(rows["x"][:, 3:], axis=1), 1, atol=1e-5)


def test_truth_has_the_keys_of_the_shared_captures(written):
    truth = json.loads((written / "truth/truth.json").read_text())
    assert list(truth) == ["name", "units", "parts", "connections", "bounds"]
    part = truth["parts"][0]
    assert set(part) == {"name", "thickness", "pose", "wood", "volume", "loops", "bevels", "mesh"}
    assert part["thickness"] == pytest.approx(0.018)
    assert part["volume"] == pytest.approx(0.3 * 0.18 * 0.018)
    assert truth["bounds"] == [[-0.15, -0.09, 0.0], [0.15, 0.09, 0.218]]
    assert {(c["a"], c["b"], c["a_face"], c["b_face"]) for c in truth["connections"]} == {
        ("top", "left", "sheet", "cut"),
        ("top", "right", "sheet", "cut"),
    }


def test_truth_step_holds_every_board_in_place(written):
    from build123d import import_step

    solids = import_step(str(written / "truth/truth.step")).solids()
    assert sorted(round(s.volume) for s in solids) == [480_000, 480_000, 972_000]
    top = max(solids, key=lambda s: s.volume).bounding_box()
    assert pytest.approx((200, 218), abs=1e-6) == (top.min.Z, top.max.Z)


def test_written_cameras_see_the_cloud(written):
    """Points projected by the written poses fall on wood-coloured pixels like their own colour."""
    import cv2
    from scipy.spatial.transform import Rotation

    line = (written / "sparse/0/cameras.txt").read_text().splitlines()[-1].split()
    camera = Camera(line[1], int(line[2]), int(line[3]), tuple(map(float, line[4:])))
    raw = (written / "cloud.ply").read_bytes()
    rows = np.frombuffer(raw.split(b"end_header\n")[1], [("x", "<f4", 6), ("c", "u1", 3)])
    entries = [r.split() for r in (written / "sparse/0/images.txt").read_text().splitlines() if r.endswith(".jpg")]
    assert len(entries) == 4
    for entry in entries:
        w, *xyz = map(float, entry[1:5])
        turn = Rotation.from_quat([*xyz, w]).as_matrix()
        x = rows["x"][:, :3] @ turn.T + np.array(entry[5:8], float)
        facing = np.einsum("ij,ij->i", rows["x"][:, 3:] @ turn.T, x) < 0
        pixels = camera.project(x[facing]).astype(int)
        assert (pixels >= 0).all() and (pixels < (160, 120)).all()
        image = cv2.imread(str(written / "images" / entry[9]))[..., ::-1].astype(float)
        gap = np.abs(image[pixels[:, 1], pixels[:, 0]] - rows["c"][facing]).mean(axis=1)
        assert np.median(gap) < 25


def test_same_options_same_bytes(written, tmp_path):
    again = write_capture(tiny_assembly(), tmp_path / "tiny", SMALL)
    for path in sorted(p for p in written.rglob("*") if p.is_file() and p.suffix != ".step"):
        assert (again / path.relative_to(written)).read_bytes() == path.read_bytes()


def test_full_folder_is_refused(written):
    with pytest.raises(OutputError, match="not empty"):
        write_capture(tiny_assembly(), written, SMALL)


@pytest.mark.parametrize("name", ["distorted", "radial"])
def test_distorted_rays_end_in_their_own_pixels(name):
    from dataclasses import replace

    from kerfwright.synthetic.cameras import intrinsics

    camera = intrinsics(replace(PRESETS[name].dataset, width=64, height=48))
    rays = camera_rays(camera).reshape(-1, 3).astype(float)
    x, y = np.meshgrid(np.arange(64) + 0.5, np.arange(48) + 0.5)
    assert np.allclose(camera.project(rays), np.stack([x, y], axis=-1).reshape(-1, 2), atol=1e-3)


def test_looking_at_puts_the_target_in_the_middle_and_up_up():
    pose = looking_at(np.array([500.0, -300, 400]), np.array([10.0, 20, 30]))
    assert transform_points(pose, np.array([10.0, 20, 30]))[:2] == pytest.approx([0, 0], abs=1e-9)
    assert np.linalg.det(pose[:3, :3]) == pytest.approx(1)
    assert (pose[:3, :3] @ [0, 0, 1.0])[1] < 0  # y of the camera looks down


def test_inside_knows_holes_and_bevels():
    leg = next(b for b in random_assembly("tilted_stool", 0).boards if b.name == "leg_left")
    middle = mesh_in_model(leg)[0].mean(axis=0)
    assert inside(leg, middle[None])[0]
    corners = np.array([(x, y, z) for x in (0.01, 1) for y in (1.0, 2) for z in (0.01, leg.thickness.value - 0.01)])
    world = transform_points(matrix(leg.model_from_board), corners)
    assert 0 < inside(leg, world).sum() < len(corners)
    assert np.allclose(transform_points(invert(matrix(leg.model_from_board)), world), corners)


def test_windows_light_what_faces_them_and_blinds_cast_edges():
    from kerfwright.synthetic.lighting import Light, irradiance
    from kerfwright.synthetic.stage import RayScene

    box, wall = mesh_in_model(tiny_assembly().boards[0]), 4000.0
    corners = np.array([(wall, -9e3, 0), (wall, 9e3, 0), (wall, 0, 2e4)])  # stands behind the window
    scene = RayScene(np.concatenate([box[0], corners]), np.concatenate([box[1], len(box[0]) + np.array([[0, 1, 2]])]))
    light = Light(np.array([[3900.0, 0, 900]]), 50.0, np.ones((1, 3)), np.full(3, 0.3), 300.0, None)
    x = np.column_stack([np.linspace(-140, 140, 80), np.zeros(80), np.full(80, 218.0)])
    rng = np.random.default_rng(0)
    up, down = (irradiance(scene, light, x, np.tile([0, 0, s], (80, 1)), 24, rng)[:, 0] for s in (1.0, -1.0))
    assert up.min() > down.max() + 0.1  # the board's own underside is in its shadow
    from dataclasses import replace

    striped = irradiance(scene, replace(light, bars=60.0), x, np.tile([0, 0, 1.0], (80, 1)), 24, rng)[:, 0]
    assert striped.max() - striped.min() > 0.1
    assert (np.abs(np.diff(striped)) > 0.1).sum() >= 2


@pytest.mark.parametrize("samples", [1, 2])
def test_a_pixel_is_the_mean_colour_of_what_its_rays_meet(samples):
    """The compiled picture against the stage's own colours, ray by ray; matt wood."""
    from kerfwright.synthetic.render import _fill
    from kerfwright.synthetic.stage import build_stage

    options = ImageOptions(samples=samples, texels=0.01, floor_texels=256, room_nodes=8, light_rays=6, gloss=0.0)
    stage = build_stage(tiny_assembly(), options, np.random.default_rng(0))
    camera, pose = (
        Camera("PINHOLE", 40, 30, (40.0, 40.0, 20.0, 15.0)),
        looking_at(np.array([500.0, -400, 350]), np.zeros(3)),
    )
    rays, out = camera_rays(camera, samples), np.empty((30, 40, 3), np.float32)
    _fill(out, stage, rays, pose)
    eye, toward = -pose[:3, :3].T @ pose[:3, 3], rays.reshape(-1, 3) @ pose[:3, :3].astype(np.float32)
    hits = stage.scene.cast(eye, toward)
    assert np.isfinite(hits.distance).all()
    single = stage.colour(eye + hits.distance[:, None] * toward, hits.triangle)
    mean = single.reshape(30, samples, 40, samples, 3).mean(axis=(1, 3))
    assert np.abs(out - mean).mean() < 1e-3
    assert (stage.owner[hits.triangle] >= 0).any()
