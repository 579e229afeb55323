"""Camera files as other programs write them, from their own definitions of axes, pixels and lenses.

Each writer makes up cameras of its kind, projects points by the program's formula, and writes the file. Nothing here
uses kerfwright's cameras.
"""

import json
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

SIZES = ((640, 480), (480, 640), (800, 450), (640, 480))
NAMES = ("1 Foto é.png", "2 a b (2).png", "IMG_0003.png", "x.png")


@dataclass(frozen=True)
class Scene:
    """Points (N, 3), and of each camera the turn camera_from_world (3, 3) and the centre (3,)."""

    points: np.ndarray
    turns: list[np.ndarray]
    centres: list[np.ndarray]

    def in_camera(self, k: int) -> np.ndarray:
        """(N, 3): x right, y down, z forward."""
        return (self.points - self.centres[k]) @ self.turns[k].T


def scene(seed: int = 3) -> Scene:
    """Four cameras about a heap of points, tilted each in its own way."""
    rng = np.random.default_rng(seed)
    turns, centres = [], []
    for angle, height, lean in ((0.2, 0.5, 0.1), (1.9, 1.1, -0.4), (3.3, 0.2, 0.9), (5.1, 2.0, 2.8)):
        centre = np.array([1.5 * np.cos(angle), 1.5 * np.sin(angle), height])
        forward = -centre / np.linalg.norm(centre)
        right = np.cross(forward, [0, 0, 1.0])
        right /= np.linalg.norm(right)
        down = np.cross(forward, right)
        c, s = np.cos(lean), np.sin(lean)
        turns.append(np.stack([c * right + s * down, c * down - s * right, forward]))
        centres.append(centre)
    return Scene(rng.uniform(-0.35, 0.35, (60, 3)), turns, centres)


def images(folder: Path, names=NAMES) -> None:
    (folder / "images").mkdir(parents=True, exist_ok=True)
    for name, (width, height) in zip(names, SIZES, strict=True):
        cv2.imwrite(str(folder / "images" / name), np.zeros((height, width, 3), np.uint8))


def brown(x_in_camera, radial, a, b):
    """Brown's polynomial on z = 1; a belongs to r^2 + 2 x^2 in x, b to r^2 + 2 y^2 in y."""
    x, y = x_in_camera[:, 0] / x_in_camera[:, 2], x_in_camera[:, 1] / x_in_camera[:, 2]
    r2 = x**2 + y**2
    factor = 1 + sum(k * r2 ** (n + 1) for n, k in enumerate(radial))
    return x * factor + a * (r2 + 2 * x**2) + 2 * b * x * y, y * factor + b * (r2 + 2 * y**2) + 2 * a * x * y


def bent(x_in_camera, terms):
    """Kannala and Brandt's fisheye: a polynomial in the angle to the axis."""
    x, y = x_in_camera[:, 0] / x_in_camera[:, 2], x_in_camera[:, 1] / x_in_camera[:, 2]
    r = np.hypot(x, y)
    angle = np.arctan(r)
    reach = angle * (1 + sum(k * angle ** (2 * n + 2) for n, k in enumerate(terms)))
    return x / r * reach, y / r * reach


# --- RealityCapture --------------------------------------------------------------------------------------------------
RC_LENS = (-0.12, 0.05, -0.01, 0.004, 0.0011, -0.0007)  # k1 k2 k3 k4 t1 t2
RC_FOCAL, RC_U, RC_V = 27.5, 0.0123, -0.0045


def rc_pixels(made: Scene, k: int) -> np.ndarray:
    """Shares of the longer side from the middle."""
    (width, height), (*radial, t1, t2) = SIZES[k], RC_LENS
    x, y = brown(made.in_camera(k), radial, t1, t2)
    scale = max(width, height)
    u, v = RC_FOCAL / 36 * x + RC_U, RC_FOCAL / 36 * y + RC_V
    return np.stack([u * scale + width / 2, v * scale + height / 2], axis=1)


def rc_csv(folder: Path, made: Scene) -> list[np.ndarray]:
    rows = ["#cameras 4", "#name,x,y,alt,heading,pitch,roll,f,px,py,k1,k2,k3,k4,t1,t2"]
    for k, name in enumerate(NAMES):
        m = made.turns[k].T @ np.diag([1, -1, -1])  # world from a camera that has x right, y up and looks along -z
        pitch, roll, yaw = np.arcsin(m[2, 1]), np.arctan2(-m[2, 0], m[2, 2]), np.arctan2(-m[0, 1], m[1, 1])
        numbers = (*made.centres[k], *np.degrees([-yaw, pitch, roll]), RC_FOCAL, RC_U, RC_V, *RC_LENS)
        rows.append(",".join([name, *(f"{n:.12g}" for n in numbers)]))
    (folder / "cameras.csv").write_text("\n".join(rows) + "\n", encoding="utf-8")
    return [rc_pixels(made, k) for k in range(len(NAMES))]


def rc_xmp(folder: Path, made: Scene) -> list[np.ndarray]:
    for k, name in enumerate(NAMES):
        rotation, position = (" ".join(f"{n:.12g}" for n in np.ravel(a)) for a in (made.turns[k], made.centres[k]))
        lens = " ".join(map(str, RC_LENS))
        inside = f"<xcr:Position>{position}</xcr:Position>"
        attributes = (
            'xcr:Version="3" xcr:PosePrior="locked" xcr:Coordinates="absolute" xcr:DistortionModel="brown4t2" '
            f'xcr:FocalLength35mm="{RC_FOCAL}" xcr:Skew="0" xcr:AspectRatio="1" xcr:PrincipalPointU="{RC_U}" '
            f'xcr:PrincipalPointV="{RC_V}" xmlns:xcr="http://www.capturingreality.com/ns/xcr/1.1#"'
        )
        if k % 2:  # both forms occur
            attributes += f' xcr:Rotation="{rotation}" xcr:DistortionCoeficients="{lens}"'
        else:
            inside += (
                f"<xcr:Rotation>{rotation}</xcr:Rotation><xcr:DistortionCoeficients>{lens}</xcr:DistortionCoeficients>"
            )
        text = (
            '<x:xmpmeta xmlns:x="adobe:ns:meta/"><rdf:RDF xmlns:rdf="http://www.w3.org/1999/02/22-rdf-syntax-ns#">'
            f"<rdf:Description {attributes}>{inside}</rdf:Description></rdf:RDF></x:xmpmeta>"
        )
        (folder / "images" / name).with_suffix(".xmp").write_text(text, encoding="utf-8")
    return [rc_pixels(made, k) for k in range(len(NAMES))]


# --- Metashape -------------------------------------------------------------------------------------------------------
def metashape(folder: Path, made: Scene, kind: str = "frame") -> list[np.ndarray]:
    """The chunk lies elsewhere than the world, by a similarity, as where a scale bar was set."""
    f, cx, cy, b1, b2 = 610.0, 7.5, -4.25, 1.5, -0.75
    radial, p1, p2 = (
        (-0.09, 0.07, -0.02, 0.003),
        (0.0009 if kind == "frame" else 0.0),
        (-0.0004 if kind == "frame" else 0.0),
    )
    scale, shift = 2.5, np.array([0.3, -1.0, 0.7])
    turn = made.turns[0]  # any rotation
    sensors, cameras, pixels = [], [], []
    for k, name in enumerate(NAMES):
        width, height = SIZES[k]
        x, y = brown(made.in_camera(k), radial, p1, p2) if kind == "frame" else bent(made.in_camera(k), radial)
        u, v = width * 0.5 + cx + x * f + x * b1 + y * b2, height * 0.5 + cy + y * f
        pixels.append(np.stack([u, v], axis=1))
        terms = {"f": f, "cx": cx, "cy": cy, "b1": b1, "b2": b2, "p1": p1, "p2": p2}
        terms |= {f"k{n + 1}": value for n, value in enumerate(radial)}
        inside = "".join(f"<{n}>{value!r}</{n}>" for n, value in terms.items() if value)
        resolution = f'<resolution width="{width}" height="{height}"/>'
        sensors.append(
            f'<sensor id="{k}" label="x" type="{kind}">{resolution}'
            f'<calibration type="{kind}" class="initial">{resolution}<f>1</f></calibration>'
            f'<calibration type="{kind}" class="adjusted">{resolution}{inside}</calibration></sensor>'
        )
        pose = np.eye(4)  # chunk_from_camera
        pose[:3, :3] = turn.T @ made.turns[k].T
        pose[:3, 3] = turn.T @ (made.centres[k] - shift) / scale
        label = name if k else name.removesuffix(".png")  # users set labels; older versions left the ending out
        matrix = " ".join(f"{n:.14g}" for n in pose.ravel())
        cameras.append(f'<camera id="{k}" sensor_id="{k}" label="{label}"><transform>{matrix}</transform></camera>')
    cameras[2] = f'<group id="0" label="Group 1" type="folder">{cameras[2]}</group>'
    numbers = " ".join(f"{n:.14g}" for n in turn.ravel())
    place = " ".join(map(str, shift))
    transform = (
        f"<transform><rotation>{numbers}</rotation><translation>{place}</translation><scale>{scale}</scale></transform>"
    )
    (folder / "cameras.xml").write_text(
        '<?xml version="1.0" encoding="UTF-8"?><document version="2.0.0"><chunk label="Chunk 1" enabled="true">'
        f'<sensors next_id="4">{"".join(sensors)}</sensors><cameras next_id="5">{"".join(cameras)}'
        '<camera id="4" sensor_id="0" label="not aligned.png"/></cameras>'
        f"{transform}</chunk></document>",
        encoding="utf-8",
    )
    return pixels


# --- Meshroom --------------------------------------------------------------------------------------------------------
def meshroom(folder: Path, made: Scene, version=(1, 2, 6), kind: str = "radial3") -> list[np.ndarray]:
    """Pixels from the middle of the first one; written as text, as boost's trees do."""
    fx, ratio, cx, cy, sensor = 590.0, 1.01, 3.5, -6.5, 7.2
    terms = {
        "radial3": (-0.1, 0.04, -0.006),
        "brown": (-0.1, 0.04, -0.006, 0.001, -0.0005),
        "fisheye4": (0.02, -0.01, 0.003, 0.001),
    }
    lens = terms[kind]
    views, intrinsics, poses, pixels = [], [], [], []
    for k, name in enumerate(NAMES):
        width, height = SIZES[k]
        one = ratio if version >= (1, 2, 0) else 1.0
        if kind == "fisheye4":
            x, y = bent(made.in_camera(k), lens)
        else:  # t1 and t2 are OpenCV's p1 and p2: t2 belongs to r^2 + 2 x^2 in x
            t1, t2 = lens[3:] or (0, 0)
            x, y = brown(made.in_camera(k), lens[:3], t2, t1)
        u, v = fx * x + width / 2 + cx, fx * one * y + height / 2 + cy
        pixels.append(np.stack([u + 0.5, v + 0.5], axis=1))  # kerfwright counts from the corner
        middle = (cx, cy) if version >= (1, 2, 1) else (cx + width / 2, cy + height / 2)
        focal = {"pxFocalLength": str(fx)} if version < (1, 2, 0) else {"pxFocalLength": [str(fx), str(fx * one)]}
        if version >= (1, 2, 2):
            stored = one if version >= (1, 2, 5) else 1 / one
            focal = {"focalLength": str(fx * sensor / width), "pixelRatio": str(stored), "sensorWidth": str(sensor)}
        intrinsics.append(
            {
                "intrinsicId": str(900 + k),
                "width": str(width),
                "height": str(height),
                "type": kind,
                **focal,
                "principalPoint": [str(n) for n in middle],
                "distortionParams": [str(n) for n in lens],
            }
        )
        path = f"D:\\Photos of mine\\été\\{name}" if k % 2 else f"/home/me/photos/{name}"
        views.append({"viewId": str(k), "poseId": str(70 + k), "intrinsicId": str(900 + k), "path": path})
        columns = [str(n) for n in made.turns[k].T.ravel()]
        transform = {"rotation": columns, "center": [str(n) for n in made.centres[k]]}
        poses.append({"poseId": str(70 + k), "pose": {"transform": transform, "locked": "0"}})
    views.append({"viewId": "9", "poseId": "9", "intrinsicId": "900", "path": "/home/me/not posed.png"})
    content = {"version": [str(n) for n in version], "views": views, "intrinsics": intrinsics, "poses": poses}
    (folder / "cameras.sfm").write_text(json.dumps(content, indent=1), encoding="utf-8")
    return pixels


# --- nerfstudio ------------------------------------------------------------------------------------------------------
def nerfstudio(folder: Path, made: Scene, model: str = "OPENCV") -> list[np.ndarray]:
    lens = {"k1": -0.11, "k2": 0.05, "k3": -0.004, "k4": 0.001, "p1": 0.0008, "p2": -0.0006}
    frames, pixels = [], []
    for k, name in enumerate(NAMES):
        width, height = SIZES[k]
        fx, fy, cx, cy = 600.0, 604.0, width / 2 + 2.5, height / 2 - 3.5
        radial = [lens[f"k{n}"] for n in (1, 2, 3, 4)]
        fish = model == "OPENCV_FISHEYE"
        x, y = bent(made.in_camera(k), radial) if fish else brown(made.in_camera(k), radial, lens["p2"], lens["p1"])
        pixels.append(np.stack([fx * x + cx, fy * y + cy], axis=1))
        matrix = np.eye(4)
        matrix[:3, :3], matrix[:3, 3] = made.turns[k].T @ np.diag([1, -1, -1]), made.centres[k]
        frames.append(
            {
                "file_path": f"images/{name}",
                "transform_matrix": matrix.tolist(),
                "w": width,
                "h": height,
                "fl_x": fx,
                "fl_y": fy,
                "cx": cx,
                "cy": cy,
            }
        )
    content = {"camera_model": model, **lens, "frames": frames}
    (folder / "transforms.json").write_text(json.dumps(content), encoding="utf-8")
    return pixels


# --- OpenMVG ---------------------------------------------------------------------------------------------------------
def openmvg(folder: Path, made: Scene, kind: str = "pinhole_brown_t2") -> list[np.ndarray]:
    lenses = {
        "pinhole_brown_t2": ("disto_t2", (-0.1, 0.05, -0.008, 0.0012, -0.0004)),
        "pinhole_radial_k3": ("disto_k3", (-0.1, 0.05, -0.008)),
        "pinhole_radial_k1": ("disto_k1", (-0.1,)),
        "fisheye": ("fisheye", (0.02, -0.01, 0.003, 0.001)),
        "pinhole": ("", ()),
    }
    field, lens = lenses[kind]
    views, intrinsics, extrinsics, pixels = [], [], [], []
    for k, name in enumerate(NAMES):
        width, height = SIZES[k]
        f, cx, cy = 605.0, width / 2 + 4.0, height / 2 - 2.0
        t1, t2 = lens[3:5] if kind == "pinhole_brown_t2" else (0, 0)
        x, y = bent(made.in_camera(k), lens) if kind == "fisheye" else brown(made.in_camera(k), lens[:3], t2, t1)
        pixels.append(np.stack([f * x + cx + 0.5, f * y + cy + 0.5], axis=1))
        data = {
            "local_path": "",
            "filename": name,
            "width": width,
            "height": height,
            "id_view": k,
            "id_intrinsic": k,
            "id_pose": k,
        }
        views.append(
            {"key": k, "value": {"polymorphic_id": 1073741824, "ptr_wrapper": {"id": 2147483649 + k, "data": data}}}
        )
        camera = {"width": width, "height": height, "focal_length": f, "principal_point": [cx, cy]}
        camera |= {field: list(lens)} if field else {}
        named = {"polymorphic_id": 2147483649, "polymorphic_name": kind} if k == 0 else {"polymorphic_id": 1}
        intrinsics.append({"key": k, "value": {**named, "ptr_wrapper": {"id": 2147483660 + k, "data": camera}}})
        extrinsics.append({"key": k, "value": {"rotation": made.turns[k].tolist(), "center": made.centres[k].tolist()}})
    content = {
        "sfm_data_version": "0.3",
        "root_path": "/home/me/photos",
        "views": views,
        "intrinsics": intrinsics,
        "extrinsics": extrinsics,
        "structure": [],
        "control_points": [],
    }
    (folder / "sfm_data.json").write_text(json.dumps(content), encoding="utf-8")
    return pixels
