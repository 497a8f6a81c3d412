# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Tags in a rendered picture are found where physics has them; printed ones have their size."""

import math

import numpy as np
import pytest
import yaml

from slap_ros.core import task_with_goal
from slap_ros.domains import get_domain
from slap_ros.errors import InvalidMeasurementError, InvalidParameterError, InvalidSceneError
from slap_ros.robot.scene_config import read_scene_config
from slap_ros.robot.tagged_scene import placed_tags, tagged_scene
from slap_ros.vision.image_encoding import compressed, decompressed, grey_values
from slap_ros.vision.image_noise import ImageNoise
from slap_ros.vision.pinhole_camera import PinholeCamera, looking_at
from slap_ros.vision.tag_detection import TagDetector
from slap_ros.vision.tag_sheets import PrintedTag, tag_sheets
from slap_ros.vision.tags import tag_image
from support.tagged_tower import CAMERA, EYE, tagged_tower


@pytest.fixture(scope="module")
def tower(tmp_path_factory):
    return tagged_tower(tmp_path_factory.mktemp("tower"))


@pytest.fixture(scope="module")
def detector(tower):
    return TagDetector({tag.tag: tag.size for tag in tower.tags.values()})


def errors(tower, found):
    """Position in m and orientation in rad that a detection of each object is off."""
    for item in found:
        tag = tower.tags[item.tag]
        seen = EYE.compose(item.pose).compose(tag.pose.inverse())
        true = tower.poses[tag.obj.name]
        yield math.dist(seen.position, true.position), seen.angle_to(true)


def grey(picture):
    height, width, channels = picture.shape
    return grey_values("rgb8", height, width, width * channels, picture.tobytes())


def test_every_block_is_seen_where_it_is(tower, detector):
    noise = ImageNoise(grey_levels=2.0, blur=0.5)
    picture = noise.taken(tower.picture, np.random.default_rng(0))
    found = detector.detect(grey(picture), CAMERA)
    assert {tower.tags[item.tag].obj.name for item in found} == set(tower.poses)
    off, turned = zip(*errors(tower, found), strict=True)
    assert np.median(off) < 0.002
    assert np.median(turned) < 0.015
    assert max(off) < 0.01
    assert max(turned) < 0.06


def test_noise_is_a_function_of_its_seed(tower):
    noise = ImageNoise(grey_levels=3.0, blur=1.0, lost=0.5)
    first, again = (
        [noise.taken(tower.picture[:40, :40], rng) for _ in range(12)]
        for rng in (np.random.default_rng(4), np.random.default_rng(4))
    )
    assert {frame is None for frame in first} == {True, False}
    for a, b in zip(first, again, strict=True):
        assert (a is None) == (b is None)
        assert a is None or np.array_equal(a, b)


def test_what_is_covered_is_not_seen_and_nothing_is_invented(tower, detector):
    names = {tower.tags[i.tag].obj.name for i in detector.detect(grey(tower.picture), CAMERA)}
    half = tower.picture.copy()
    half[:, :640] = 128
    assert {tower.tags[i.tag].obj.name for i in detector.detect(grey(half), CAMERA)} < names
    rng = np.random.default_rng(1)
    assert not detector.detect(rng.integers(0, 255, (720, 1280), dtype=np.uint8), CAMERA)


def test_encodings_of_a_picture_are_the_same_picture(tower):
    picture = tower.picture
    height, width, _ = picture.shape
    expected = grey(picture).astype(int)
    padded = np.pad(picture[:, :, ::-1].reshape(height, -1), ((0, 0), (0, 5)))
    turned = grey_values("bgr8", height, width, padded.shape[1], padded.tobytes())
    assert np.abs(turned - expected).max() <= 1
    assert np.abs(decompressed(compressed(picture)) - expected).mean() < 1.0
    for wrong in (
        ("rgb16", 4, 4, 24, bytes(96)),
        ("rgb8", 4, 4, 12, bytes(47)),
        ("mono8", 0, 4, 4, b""),
    ):
        with pytest.raises(InvalidMeasurementError):
            grey_values(*wrong)
    for content in (b"", b"no picture"):
        with pytest.raises(InvalidMeasurementError, match="cannot be decoded"):
            decompressed(content)


def test_cameras_that_there_are_not_are_refused():
    for focal in (0.0, math.nan, -1.0):
        with pytest.raises(InvalidParameterError, match="not calibrated"):
            PinholeCamera.centred(640, 480, focal)
    with pytest.raises(InvalidParameterError, match="no upright camera"):
        looking_at((0.5, 0.0, 1.0), (0.5, 0.0, 0.0))
    with pytest.raises(InvalidParameterError):
        ImageNoise(lost=1.0)


def test_printed_tags_have_the_size_that_is_stated():
    """A page as a renderer of PDFs shows it, and the tags that are found on it."""
    pypdfium2 = pytest.importorskip("pypdfium2")
    sizes = {tag: 0.04 if tag % 2 else 0.0235 for tag in range(26)}
    document = pypdfium2.PdfDocument(
        tag_sheets([PrintedTag(tag, size, "block") for tag, size in sizes.items()])
    )
    dots_m = 200.0 / 0.0254
    seen = {}
    for page in document:
        assert np.allclose(np.array(page.get_size()) / 72 * 25.4, (210, 297), atol=0.1)
        picture = np.asarray(page.render(scale=200 / 72).to_pil().convert("L"))
        height, width = picture.shape
        camera = PinholeCamera.centred(width, height, 1000.0)
        for item in TagDetector(sizes).detect(picture, camera):
            edges = np.linalg.norm(item.corners - np.roll(item.corners, 1, axis=0), axis=1)
            seen[item.tag] = edges / dots_m
    assert seen.keys() == sizes.keys()
    for tag, edges in seen.items():
        assert np.abs(edges - sizes[tag]).max() < 0.0002, tag


def test_tags_have_a_white_margin():
    picture = tag_image(3, 5)
    assert picture.shape == (50, 50)
    assert picture[:5].min() == picture[:, -5:].min() == 255
    assert picture[5:10, 5:-5].max() == 0


def test_tags_that_no_page_has_room_for_are_refused():
    with pytest.raises(InvalidSceneError, match="does not fit on a page"):
        tag_sheets([PrintedTag(0, 0.3, "house")])
    with pytest.raises(InvalidSceneError, match="no tag"):
        tag_sheets([])


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda o: o["block2"]["frames"].update({"tag36h11:0": [0, 0, 0, 0, 0, 0, 1]}), "both"),
        (lambda o: o["block2"]["frames"].update({"tag36h11:00": [0, 0, 0, 0, 0, 0, 1]}), "both"),
        (lambda o: o["block2"]["frames"].update({"tag25h9:3": [0, 0, 0, 0, 0, 0, 1]}), "25h9"),
        (lambda o: o["block2"]["frames"].update({"tag36h11:587": [0, 0, 0, 0, 0, 0, 1]}), "586"),
        (lambda o: o["block2"]["frames"].update({"cup": [0, 0, 0, 0, 0, 0, 1]}), "not a tag's"),
        (lambda o: o["block2"].update(tag_size=0.05), "does not fit"),
        (lambda o: o["block2"].update(tag_size=0.001), "tag_size"),
        (lambda o: o["block2"].update(tag_size=float("nan")), "tag_size"),
        (lambda o: o["block2"].pop("tag_size"), "needs tag_size"),
        (lambda o: o["block2"]["frames"].clear(), "frames is empty"),
        (lambda o: o["block2"].update(offset=[0, 0, 0]), "offset belongs to frame"),
        (lambda o: o["block2"].update(frame="tag36h11:90"), "either"),
        (lambda o: o["block2"]["frames"].update({"tag36h11:6": [0, 0, 0]}), "quaternion"),
    ],
)
def test_scene_files_with_impossible_tags_are_refused(tower, tmp_path, change, said):
    content = yaml.safe_load(tower.scene_file.read_text(encoding="utf-8"))
    change(content["objects"])
    path = tmp_path / "scene.yaml"
    path.write_text(yaml.safe_dump(content, sort_keys=False), encoding="utf-8")
    with pytest.raises(InvalidSceneError, match=said):
        placed_tags(read_scene_config(path, get_domain("obstacle_tower")))


def test_a_tag_that_one_object_has_twice_is_refused(tower, tmp_path):
    text = tower.scene_file.read_text(encoding="utf-8")
    path = tmp_path / "scene.yaml"
    path.write_text(text.replace("tag36h11:7:", "tag36h11:6:"), encoding="utf-8")
    with pytest.raises(InvalidSceneError, match="tag36h11:6 is stated twice"):
        read_scene_config(path, get_domain("obstacle_tower"))


@pytest.mark.parametrize("name", ["obstacle_tower", "cluttered_drawer"])
def test_a_scene_file_says_what_the_task_has(name, tmp_path):
    domain = get_domain(name)
    state = task_with_goal(domain, 3, 0, "").initial_state
    path = tmp_path / "scene.yaml"
    path.write_text(tagged_scene(domain, state), encoding="utf-8")
    config = read_scene_config(path, domain)
    assert config.template.objects == state.objects
    for obj in state.objects:
        for feature in obj.type.features:
            if obj not in config.detected:
                given, true = (s.get(obj, feature.name) for s in (config.template, state))
                assert given == pytest.approx(true, abs=1e-8) or obj.type.name == "robot"
    for tag in placed_tags(config):
        outwards = tag.pose.apply((0.0, 0.0, 1.0))
        assert math.hypot(*outwards) > math.hypot(*tag.pose.position)  # z is out of the object


def test_objects_without_flat_faces_are_named():
    domain = get_domain("cleanup_table")
    with pytest.raises(InvalidSceneError, match="duck has no flat faces"):
        tagged_scene(domain, task_with_goal(domain, 1, 0, "").initial_state)
