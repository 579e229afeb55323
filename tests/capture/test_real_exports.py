"""Fragments of files that the programs themselves wrote, as found in public repositories (docs/formats.md names them).

They have no known points in them. What must hold all the same: cameras that went round a thing look at one place, and a
drone's camera that its log says looked down and north or south does so.
"""

from __future__ import annotations

import json

import cv2
import numpy as np
import pytest

from kerfwright.capture.alicevision import read_alicevision
from kerfwright.capture.crop import focus
from kerfwright.capture.metashape import read_metashape
from kerfwright.capture.openmvg import read_openmvg
from kerfwright.capture.realitycapture import find_rc_csv, read_rc_csv, read_rc_xmp
from kerfwright.capture.types import View
from kerfwright.errors import CaptureError


def nowhere(name):
    raise AssertionError("no file is needed")


# Meshroom 2023 (.sfm version 1.2.6) of a house, written on Windows: intrinsic, and twelve of its poses.
MESHROOM = {
    "intrinsicId": "2390361049",
    "width": "4000",
    "height": "3000",
    "sensorWidth": "8.1265990486979671",
    "sensorHeight": "6.0949492865234758",
    "type": "radial3",
    "initialFocalLength": "5.4000000000000004",
    "focalLength": "5.678361290663454",
    "pixelRatio": "1",
    "pixelRatioLocked": "true",
    "principalPoint": ["-32.291769408137576", "-65.688458120059806"],
    "distortionInitializationMode": "none",
    "distortionParams": ["0.082661234054845489", "-0.1084229596836524", "0.030428071832084524"],
    "undistortionOffset": ["0", "0"],
    "undistortionParams": "",
    "locked": "false",
}
MESHROOM_POSES = {
    "5265981": "-0.547261 -0.083008 -0.832836 0.012702 0.994131 -0.107431 0.836866 -0.069371 -0.542995 "
    "29.7311 -5.0991 2.5924",
    "19210386": "0.003237 0.251132 0.967947 -0.038613 0.967262 -0.250825 -0.999249 -0.036563 0.012828 "
    "-21.5612 -2.9265 -11.2801",
    "83212614": "-0.955855 0.097656 0.277136 0.009010 0.952455 -0.304547 -0.293700 -0.288605 -0.911289 "
    "-11.9706 -2.5166 18.7199",
    "96377894": "-0.158880 -0.046668 -0.986194 -0.000654 0.998887 -0.047164 0.987298 -0.006848 -0.158734 "
    "33.0666 -6.6628 -12.1412",
    "398843337": "0.895121 0.057134 0.442148 -0.000733 0.991941 -0.126695 -0.445824 0.113083 0.887949 "
    "-15.0714 -3.7492 -25.5268",
    "677376955": "-0.285820 -0.032670 -0.957726 -0.015186 0.999448 -0.029562 0.958163 0.006095 -0.286158 "
    "36.0855 -6.4699 -6.6834",
    "1039549876": "-0.988568 0.004502 0.150707 -0.005806 0.997676 -0.067886 -0.150663 -0.067984 -0.986245 "
    "-3.9477 -4.8781 31.6503",
}


def meshroom_file(folder):
    poses, views = [], []
    for key, numbers in MESHROOM_POSES.items():
        words = numbers.split()
        pose = {"transform": {"rotation": words[:9], "center": words[9:]}, "locked": "0"}
        poses.append({"poseId": key, "pose": pose})
        path = f"D:\\DHBW\\Studienarbeit\\data\\{key}.jpg"
        views.append({"viewId": key, "poseId": key, "intrinsicId": "2390361049", "path": path, "metadata": {}})
    content = {"version": ["1", "2", "6"], "views": views, "intrinsics": [MESHROOM], "poses": poses}
    (folder / "cameras.sfm").write_text(json.dumps(content), encoding="utf-8")
    return folder / "cameras.sfm"


def test_cameras_of_meshroom_went_round_a_house(tmp_path):
    images = read_alicevision(meshroom_file(tmp_path), nowhere)
    views = [View(i.name, tmp_path, i.camera, i.camera_from_capture) for i in images]
    place = focus(views)
    for view in views:
        (pixel,), (depth,) = view.project(place[None])
        assert 10 < depth < 60 and (pixel > 0).all() and (pixel < [4000, 3000]).all()
    assert views[0].camera.matrix[0, 0] == pytest.approx(2794.95, abs=0.01)
    np.testing.assert_allclose(views[0].camera.matrix[:2, 2], [2000 - 32.2918 + 0.5, 1500 - 65.6885 + 0.5], atol=1e-3)


# Metashape 2 of a drone's flight: its log says yaw 179.9, pitch 0.1, at 39.4119 N 120.4180 W.
METASHAPE = """<?xml version="1.0" encoding="UTF-8"?>
<document version="2.0.0">
  <chunk label="Chunk 1" enabled="true">
    <sensors next_id="1">
      <sensor id="0" label="M3M (12.29mm)" type="frame">
        <resolution width="5280" height="3956"/>
        <property name="layer_index" value="0"/>
        <calibration type="frame" class="adjusted">
          <resolution width="5280" height="3956"/>
          <f>3705.4728792737214</f> <cx>11.6738523909</cx> <cy>-27.7497969199</cy>
          <b1>0.5262024073</b1> <b2>-0.3058334293</b2>
          <k1>-0.0919367147</k1> <k2>-0.0762807468</k2> <k3>0.1162639394</k3> <k4>-0.0761413904</k4>
          <p1>-0.0003134847</p1> <p2>0.0001164035</p2>
        </calibration>
      </sensor>
    </sensors>
    <components next_id="1" active_id="0">
      <component id="0" label="Component 1">
        <transform>
          <rotation locked="true">0.8710699454 0.3070967021 -0.3833128821 -0.4909742007 0.5658364395 -0.6623997719
           0.0134716110 0.7651932691 0.6436596744</rotation>
          <translation locked="true">-2499366.429888 -4256836.520906 4029217.965003</translation>
          <scale locked="true">12.354192447331316</scale>
        </transform>
      </component>
    </components>
    <cameras next_id="816" next_group_id="2">
      <group id="0" label="Group 1" type="folder">
        <camera id="0" sensor_id="0" component_id="0" label="/home/user/image_sets/0001/nadir/000001-01_00001.JPG">
          <transform>-0.99988146 -0.00872749 0.01268391 7.04224697 -0.00842932 0.99969124 0.02337453 7.05403071
           -0.01288400 0.02326485 -0.99964631 0.43561421 0 0 0 1</transform>
          <orientation>1</orientation>
          <reference x="-120.417985477" y="39.411917469999999" z="2420.1089999999999" yaw="179.90000000000001"
           pitch="0.099999999999993788" roll="-0" enabled="true" rotation_enabled="false"/>
        </camera>
      </group>
    </cameras>
  </chunk>
</document>
"""


def test_a_georeferenced_project_is_told(tmp_path):
    (tmp_path / "cameras.xml").write_text(METASHAPE)
    with pytest.raises(CaptureError, match=r"component 0 transform: .*georeferenced: .*Local Coordinates"):
        read_metashape(tmp_path / "cameras.xml", nowhere)


def test_a_drone_in_metashape_looks_down_with_its_top_to_the_south(tmp_path):
    near = METASHAPE.replace("-2499366.429888 -4256836.520906 4029217.965003", "0 0 0")
    (tmp_path / "cameras.xml").write_text(near)
    (image,) = read_metashape(tmp_path / "cameras.xml", nowhere)
    right, down, forward = image.camera_from_capture[:3, :3]
    longitude, latitude = np.radians([-120.417985477, 39.41191747])
    up = np.array([np.cos(latitude) * np.cos(longitude), np.cos(latitude) * np.sin(longitude), np.sin(latitude)])
    east = np.array([-np.sin(longitude), np.cos(longitude), 0])
    assert forward @ -up > np.cos(np.radians(3))
    assert down @ np.cross(up, east) > np.cos(np.radians(3)), "its bottom to the north"
    assert right @ -east > np.cos(np.radians(3))
    assert image.camera.matrix[0, 0] == pytest.approx(3705.4728792737214 + 0.5262024073)


# OpenMVG: two cameras that watch a person, from a page that shows its sfm_data.json.
OPENMVG = [
    (
        1600,
        1200,
        925.8363072132307,
        (750.2385492176366, 670.8484096780304),
        (0.028722041026780624, 0.08575024821506944, -0.11633708450381754),
        [
            [0.9994263985769297, -0.00339050658615223, 0.03369537494430535],
            [0.004279933294603813, 0.9996433755483238, -0.026359133015834318],
            [-0.03359398753559637, 0.026488227336723823, 0.9990844898275703],
        ],
        (-0.039157284812806638, 0.09134569728949421, -0.2497508521039661),
    ),
    (
        1600,
        900,
        1027.799075163841,
        (690.2165444936014, 777.7579150457667),
        (0.011201482123224093, 0.06511654286639639, -0.19514421123446228),
        [
            [0.7975303128668473, 0.0626394695598846, 0.6000180804873841],
            [-0.02945414114062568, 0.9974517685343063, -0.06498017403372238],
            [-0.6025594191680824, 0.034150641297654087, 0.7973430128061462],
        ],
        (1.0978753524509717, 0.26713902953526806, 0.24711853543123198),
    ),
]


def test_two_cameras_of_openmvg_look_at_one_place_before_them(tmp_path):
    views, intrinsics, extrinsics = [], [], []
    for k, (width, height, f, middle, lens, rotation, centre) in enumerate(OPENMVG):
        data = {"local_path": "", "filename": f"{k}.jpg", "width": width, "height": height, "id_view": k}
        data |= {"id_intrinsic": k, "id_pose": k}
        views.append({"key": k, "value": {"polymorphic_id": 1073741824, "ptr_wrapper": {"id": 1, "data": data}}})
        camera = {"width": width, "height": height, "focal_length": f, "principal_point": middle, "disto_k3": lens}
        name = {"polymorphic_id": 2147483649, "polymorphic_name": "pinhole_radial_k3"}
        intrinsics.append({"key": k, "value": {**name, "ptr_wrapper": {"id": 2147483652, "data": camera}}})
        extrinsics.append({"key": k, "value": {"rotation": rotation, "center": centre}})
    content = {"views": views, "intrinsics": intrinsics, "extrinsics": extrinsics}
    (tmp_path / "sfm_data.json").write_text(json.dumps(content))
    images = read_openmvg(tmp_path / "sfm_data.json", nowhere)
    found = [View(i.name, tmp_path, i.camera, i.camera_from_capture) for i in images]
    place = focus(found)
    for view in found:
        (pixel,), (depth,) = view.project(place[None])
        assert 0.5 < depth < 5 and (pixel > 0).all() and (pixel < [view.camera.width, view.camera.height]).all()


# RealityCapture: a row of a sample that comes with Jawset Postshot.
RC_ROW = (
    "#name,x,y,alt,heading,pitch,roll,f,px,py,k1,k2,k3,k4,t1,t2\n"
    "frame_00001.jpeg,44.5876747664166,138.823621534044,6.821916401534405,170.3483067926429,85.18637269312288,"
    "-22.74995074830745,14.2390682243052,-9.482184385774318e-004,-2.446553068050568e-004,3.114799768048152e-003,"
    "4.026391718074555e-003,-1.795976992379612e-003,0,0,0\n"
)


def test_a_row_of_realitycapture(tmp_path):
    cv2.imwrite(str(tmp_path / "frame_00001.jpeg"), np.zeros((2880, 3840, 3), np.uint8))
    (tmp_path / "poses.csv").write_text(RC_ROW)
    (found,) = find_rc_csv(tmp_path)
    (image,) = read_rc_csv(found, lambda name: tmp_path / name)
    forward = image.camera_from_capture[2, :3]
    assert abs(forward[2]) < np.sin(np.radians(6)), "pitch 85: nearly level"
    np.testing.assert_allclose(image.camera.matrix[:2, 2], [1920 - 3.641, 1440 - 0.939], atol=1e-3)


# RealityCapture's XMP with the division model, which was its default once; from a page on Adobe's and Autodesk's tools.
RC_XMP = """<x:xmpmeta xmlns:x="adobe:ns:meta/">
  <rdf:RDF xmlns:rdf="http://www.w3.org/1999/02/22-rdf-syntax-ns#">
    <rdf:Description xcr:Version="2" xcr:PosePrior="locked" xcr:ComponentId="{02FFA67D-FB37-48C9-AAAE-115D1A41F754}"
       xcr:DistortionModel="division" xcr:DistortionCoeficients="-0.266409870680064 0 0 0 0 0"
       xcr:FocalLength35mm="15.8017301481925" xcr:Skew="0" xcr:AspectRatio="1"
       xcr:PrincipalPointU="0.00460590178527446" xcr:PrincipalPointV="-0.00856809553444162"
       xcr:CalibrationPrior="locked" xcr:CalibrationGroup="-1" xcr:DistortionGroup="-1"
       xcr:InTexturing="1" xcr:InColoring="0" xcr:InMeshing="1" xcr:latitude="179.984035152606480N"
       xmlns:xcr="http://www.capturingreality.com/ns/xcr/1.1#">
      <xcr:Rotation>-0.134784620568843 0.851774231082322 -0.506274397261226 0.00661363302515503 -0.510152020736598
       -0.860058821009682 -0.990852847761129 -0.119271014930193 0.0631273243627475</xcr:Rotation>
      <xcr:Position>2.24050332940992 1.49823826996755 11.8964921935577</xcr:Position>
    </rdf:Description>
  </rdf:RDF>
</x:xmpmeta>
"""


def test_xmp_of_realitycapture(tmp_path):
    cv2.imwrite(str(tmp_path / "a.jpg"), np.zeros((600, 800, 3), np.uint8))
    (tmp_path / "a.xmp").write_text(RC_XMP)
    with pytest.raises(CaptureError, match=r"a\.xmp: DistortionModel: division: set Alignment settings"):
        read_rc_xmp([tmp_path / "a.xmp"], lambda name: tmp_path / "a.jpg")
    (tmp_path / "a.xmp").write_text(RC_XMP.replace('"division"', '"brown3"'))
    (image,) = read_rc_xmp([tmp_path / "a.xmp"], lambda name: tmp_path / "a.jpg")
    view = View("a", tmp_path, image.camera, image.camera_from_capture)
    np.testing.assert_allclose(view.centre, [2.24050332940992, 1.49823826996755, 11.8964921935577])
    assert image.camera.focal == pytest.approx(15.8017301481925 / 36 * 800)
    assert view.camera_from_world[1, 2] < -0.8, "the picture's down is the world's down"
