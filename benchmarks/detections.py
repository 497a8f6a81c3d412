# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How exact detections of tags are: ``python -m benchmarks.detections``.

A block with a tag of 40 mm is rendered at drawn distances and angles, and its tag is found, by the
AprilTag library and by OpenCV's ArUco module. Then tasks of Obstacle Tower: in how many pictures
every block is seen, and how exact blocks are. ``--output`` gets a page, a picture and all numbers.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from itertools import pairwise
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter, process_time
from typing import TYPE_CHECKING, Any

import cv2
import numpy as np
from numpy.typing import NDArray

from benchmarks.pages import PageOutput
from benchmarks.printing import show
from ensemble.camera_parameters import CameraParameters
from slap_ros.core import task_with_goal
from slap_ros.domains import get_domain
from slap_ros.geometry.pose import IDENTITY, Pose, from_rotation_vector, multiply
from slap_ros.relational import Type
from slap_ros.robot.mujoco.camera import MujocoCamera, add_camera, add_tags
from slap_ros.robot.mujoco.engine import mujoco
from slap_ros.robot.mujoco.model import compiled, scene_around, scene_spec
from slap_ros.robot.mujoco.plant import MujocoPlant
from slap_ros.robot.scene_config import read_scene_config
from slap_ros.robot.tagged_scene import PlacedTag, placed_tags, tagged_scene
from slap_ros.robot.tracking import mean_pose
from slap_ros.studies.results import MarkdownTable, Provenance, StudyReport
from slap_ros.vision.tag_detection import TagDetector, tag_pose

if TYPE_CHECKING:
    from matplotlib.figure import Figure

STUDY, DOMAIN = "detections", "obstacle_tower"
CAMERA = CameraParameters()  # as the nodes have it: 1280 × 720, f = 1200 pixels, 2 grey levels
HALF, SIZE = 0.025, 0.04  # m, of the block and its tag
DISTANCES = (0.4, 0.6, 0.8, 1.0, 1.2, 1.4)  # m
ANGLES = (0.0, 20.0, 40.0, 60.0)  # degrees, between line of sight and the tag's normal
TOWARDS = (1.0, 0.0, 0.0, 0.0)  # of a tag that faces the camera
LIBRARIES = ("AprilTag", "ArUco")
MEASURED = """\
A tag of 40 mm on a block is rendered in MuJoCo by a camera of 1280 × 720 pixels, f = 1200 pixels,
with a noise of 2 grey levels. Errors are of one picture, without averaging: medians, and the 95th
percentile in brackets. AprilTag is the library that `tag_detector` uses (pupil-apriltags). ArUco
is OpenCV's module with its corners refined to subpixels. In the row of tasks, the first state of
each task of Obstacle Tower is seen by the camera at its default place, and a block is the mean of
its tags. Seconds are of one core that others used too."""


@dataclass(frozen=True)
class Sighting:
    """One tag in one picture; errors are NaN where it was not found.

    Args:
        distance: Distance of the tag from the camera, m.
        angle: Angle between line of sight and the tag's normal, degrees.
        millimetres: Error of the position by each library, mm.
        milliradians: Error of the orientation by each library, mrad.
        seconds: Time that each library took to search the picture, s.
    """

    distance: float
    angle: float
    millimetres: Mapping[str, float]
    milliradians: Mapping[str, float]
    seconds: Mapping[str, float]


@dataclass(frozen=True)
class Table:
    """The first state of a task.

    Args:
        seed: Seed of the task.
        hidden: Names of blocks of which no tag was found.
        millimetres: Error of each block's position, mm.
        milliradians: Error of each block's orientation, mrad.
        rendering: Time that the picture took, s.
        searching: Time that the detector took, s.
    """

    seed: int
    hidden: Sequence[str]
    millimetres: Sequence[float]
    milliradians: Sequence[float]
    rendering: float
    searching: float


def off(seen: Pose | None, true: Pose) -> tuple[float, float]:
    """Errors of a pose, mm and mrad; NaN for one that was not found."""
    if seen is None:
        return math.nan, math.nan
    return 1e3 * math.dist(seen.position, true.position), 1e3 * seen.angle_to(true)


def sightings(repeats: int, seed: int) -> Iterator[Sighting]:
    """Pictures of one block at drawn distances and angles."""
    rng = np.random.default_rng(seed)
    tag = PlacedTag(0, SIZE, Type("block")("block"), Pose((0.0, 0.0, HALF)))
    spec = mujoco.MjSpec()
    body = spec.worldbody.add_body(name="block")
    body.add_freejoint()
    body.add_geom(type=mujoco.mjtGeom.mjGEOM_BOX, size=[HALF] * 3, rgba=[0.3, 0.4, 0.7, 1.0])
    add_camera(spec, CAMERA.pinhole, IDENTITY)
    add_tags(spec, [tag])
    camera, detector = MujocoCamera(compiled(spec)), TagDetector({0: SIZE})
    for near, far in pairwise(DISTANCES):
        for low, high in pairwise(ANGLES):
            for _ in range(repeats):
                pose, distance, angle = drawn(rng, (near, far), (low, high))
                yield sighting(camera, detector, rng, tag, pose, distance, angle)
    camera.close()


def drawn(
    rng: np.random.Generator, distances: tuple[float, float], angles: tuple[float, float]
) -> tuple[Pose, float, float]:
    """A pose of a tag that the camera sees whole; its distance, m, and its angle, degrees."""
    distance, angle = rng.uniform(*distances), rng.uniform(*angles)
    sideways, upwards = rng.uniform(-0.35, 0.35), rng.uniform(-0.2, 0.2)
    ray = np.array([sideways, upwards, 1.0]) / math.hypot(sideways, upwards, 1.0)
    about = np.cross(ray, rng.standard_normal(3))
    x, y, z = math.radians(angle) * about / np.linalg.norm(about)
    a, b, c = np.cross((0.0, 0.0, 1.0), ray)
    spin = from_rotation_vector((0.0, 0.0, rng.uniform(-math.pi, math.pi)))
    facing = multiply(from_rotation_vector((float(a), float(b), float(c))), multiply(TOWARDS, spin))
    px, py, pz = distance * ray
    turn = multiply(from_rotation_vector((float(x), float(y), float(z))), facing)
    return Pose((float(px), float(py), float(pz)), turn), distance, angle


def sighting(
    camera: MujocoCamera,
    detector: TagDetector,
    rng: np.random.Generator,
    tag: PlacedTag,
    pose: Pose,
    distance: float,
    angle: float,
) -> Sighting:
    """One picture of a tag at a pose, searched by both libraries."""
    block = pose.compose(tag.pose.inverse())
    x, y, z, w = block.quaternion
    picture = CAMERA.picture_noise.taken(
        camera.picture(np.array([*block.position, w, x, y, z])), rng
    )
    assert picture is not None  # none is lost
    grey = cv2.cvtColor(picture, cv2.COLOR_RGB2GRAY)
    began = perf_counter()
    found = detector.detect(grey, CAMERA.pinhole)
    between = perf_counter()
    other = by_aruco(grey)
    ended = perf_counter()
    errors = {
        "AprilTag": off(found[0].pose if found else None, pose),
        "ArUco": off(other, pose),
    }
    return Sighting(
        distance,
        angle,
        {library: error[0] for library, error in errors.items()},
        {library: error[1] for library, error in errors.items()},
        {"AprilTag": between - began, "ArUco": ended - between},
    )


def by_aruco(grey: NDArray[np.uint8]) -> Pose | None:
    """The pose of tag 0 by OpenCV's corners, refined to subpixels."""
    settings = cv2.aruco.DetectorParameters()
    settings.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
    settings.cornerRefinementWinSize = 4
    settings.relativeCornerRefinmentWinSize = 0.4
    family = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11)
    corners, tags, _ = cv2.aruco.ArucoDetector(family, settings).detectMarkers(grey)
    for place, tag in zip(corners, [] if tags is None else np.ravel(tags), strict=True):
        if tag == 0:  # its first corner is AprilTag's lower right one, and it goes on clockwise
            turned = np.asarray(place[0], np.float64)[[1, 0, 3, 2]]
            return tag_pose(turned, CAMERA.pinhole, SIZE)
    return None


def tables(seeds: Sequence[int]) -> Iterator[Table]:
    """The first states of tasks, as the camera sees them."""
    domain, eye = get_domain(DOMAIN), CAMERA.optical_pose
    for seed in seeds:
        state = task_with_goal(domain, seed, 0, "").initial_state
        with TemporaryDirectory() as folder:
            path = Path(folder) / "scene.yaml"
            path.write_text(tagged_scene(domain, state), encoding="utf-8")
            tags = {tag.tag: tag for tag in placed_tags(read_scene_config(path, domain))}
        scene = scene_around(domain, state)
        spec = scene_spec(scene, state)
        add_camera(spec, CAMERA.pinhole, eye)
        add_tags(spec, list(tags.values()))
        model = compiled(spec)
        plant, camera = MujocoPlant(model, scene, state), MujocoCamera(model)
        camera.picture(plant.positions)  # the first picture compiles shaders
        began = perf_counter()
        picture = camera.picture(plant.positions)
        between = perf_counter()
        camera.close()
        taken = CAMERA.picture_noise.taken(picture, np.random.default_rng(seed))
        detector = TagDetector({number: tag.size for number, tag in tags.items()})
        grey = cv2.cvtColor(taken, cv2.COLOR_RGB2GRAY)
        searching = perf_counter()
        seen: dict[str, list[Pose]] = {}
        for item in detector.detect(grey, CAMERA.pinhole):
            tag = tags[item.tag]
            pose = eye.compose(item.pose).compose(tag.pose.inverse())
            seen.setdefault(tag.obj.name, []).append(pose)
        ended = perf_counter()
        true = plant.poses()
        errors = [off(mean_pose(poses), true[name]) for name, poses in seen.items()]
        yield Table(
            seed,
            sorted(true.keys() - seen.keys()),
            [error[0] for error in errors],
            [error[1] for error in errors],
            between - began,
            ended - searching,
        )


@dataclass(frozen=True)
class Detections:
    """All that was measured.

    Args:
        single: Pictures of one block.
        tasks: Pictures of tasks.
    """

    single: Sequence[Sighting]
    tasks: Sequence[Table]

    def within(self, near: float, far: float, low: float, high: float) -> list[Sighting]:
        """The pictures of one block at distances in m and angles in degrees."""
        return [s for s in self.single if near <= s.distance <= far and low <= s.angle <= high]


def middle(values: Sequence[float]) -> str:
    """Median and 95th percentile of what was found."""
    found = [value for value in values if math.isfinite(value)]
    if not found:
        return "not found"
    return f"{np.median(found):.2g} ({np.percentile(found, 95):.2g})"


def row(name: str, chosen: Sequence[Sighting]) -> list[str]:
    """A row of the table: found, and the errors of both libraries."""
    found = sum(math.isfinite(s.millimetres["AprilTag"]) for s in chosen)
    columns = [
        middle([errors[library] for errors in kind])
        for library in LIBRARIES
        for kind in ([s.millimetres for s in chosen], [s.milliradians for s in chosen])
    ]
    return [name, f"{found} of {len(chosen)}", *columns]


def table(found: Detections) -> MarkdownTable:
    """The table: by distance, by angle, the range that counts, and tasks."""
    every = (ANGLES[0], ANGLES[-1])
    rows = [row("0.6 to 1.2 m", found.within(0.6, 1.2, *every))]
    rows += [
        row(f"{near} to {far} m", found.within(near, far, *every))
        for near, far in pairwise(DISTANCES)
    ]
    rows += [
        row(f"0.6 to 1.2 m, {low:.0f} to {high:.0f}°", found.within(0.6, 1.2, low, high))
        for low, high in pairwise(ANGLES)
    ]
    clear = sum(not task.hidden for task in found.tasks)
    millimetres = middle([value for task in found.tasks for value in task.millimetres])
    milliradians = middle([value for task in found.tasks for value in task.milliradians])
    seen = f"every block in {clear} of {len(found.tasks)}"
    rows.append(["tasks", seen, millimetres, milliradians, "", ""])
    columns = ("pictures", "found", "AprilTag, mm", "mrad", "ArUco, mm", "mrad")
    return MarkdownTable(columns, rows)


def summary(found: Detections) -> dict[str, dict[str, float]]:
    """Medians at 0.6 to 1.2 m, of tasks, and of times."""
    near = found.within(0.6, 1.2, ANGLES[0], ANGLES[-1])
    figures = {
        library: {
            "mm": float(np.nanmedian([s.millimetres[library] for s in near])),
            "mrad": float(np.nanmedian([s.milliradians[library] for s in near])),
            "seconds": float(np.median([s.seconds[library] for s in near])),
        }
        for library in LIBRARIES
    }
    figures["tasks"] = {
        "every_block_seen": float(np.mean([not task.hidden for task in found.tasks])),
        "rendering_s": float(np.median([task.rendering for task in found.tasks])),
        "searching_s": float(np.median([task.searching for task in found.tasks])),
    }
    return figures


def draw(figure: Figure, found: Detections) -> None:
    """Draw the errors over distance."""
    for axes, kind, unit in zip(
        figure.subplots(1, 2), ("millimetres", "milliradians"), ("mm", "mrad"), strict=True
    ):
        for library, colour in zip(LIBRARIES, ("tab:blue", "tab:orange"), strict=True):
            values = [getattr(s, kind)[library] for s in found.single]
            distances = [s.distance for s in found.single]
            axes.scatter(distances, values, s=8, color=colour, label=library)
        axes.set_yscale("log")
        axes.set_xlabel("distance, m")
        axes.set_ylabel(f"error, {unit}")
    axes.legend()


def report(found: Detections) -> StudyReport:
    """The page, the picture and all numbers."""
    return StudyReport(
        study=STUDY,
        source="",
        title="Detections of tags by a camera: Obstacle Tower",
        measured=f"{MEASURED}\n\n{times(found)}",
        table=table(found),
        found={
            "single": [without_nan(asdict(item)) for item in found.single],
            "tasks": [asdict(item) for item in found.tasks],
            "summary": summary(found),
        },
        draw=lambda figure: draw(figure, found),
        size=(7.0, 3.2),
    )


def without_nan(values: Mapping[str, Any]) -> dict[str, Any]:
    """Values for JSON, which has no NaN: None where a tag was not found."""
    return {
        name: without_nan(value)
        if isinstance(value, Mapping)
        else (None if math.isnan(value) else value)
        for name, value in values.items()
    }


def times(found: Detections) -> str:
    """What a picture takes, in words."""
    figures = summary(found)
    task = figures["tasks"]
    return (
        f"A picture of a task takes {task['rendering_s']:.2f} s to render and "
        f"{task['searching_s']:.2f} s to search. For one block, AprilTag takes "
        f"{figures['AprilTag']['seconds']:.2f} s and ArUco {figures['ArUco']['seconds']:.2f} s."
    )


def main() -> None:
    """Print the figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repeats", type=int, default=10, help="per distance and angle")
    parser.add_argument("--tasks", type=int, default=20)
    parser.add_argument("--first-seed", type=int, default=500, help="seed of the first task")
    parser.add_argument("--output", type=Path, help="folder for page, picture and numbers")
    parser.add_argument("--json", action="store_true")
    given: dict[str, Any] = vars(parser.parse_args())
    folder, as_json = given.pop("output"), given.pop("json")
    options = " ".join(f"--{name.replace('_', '-')} {value}" for name, value in given.items())
    source = Provenance(DOMAIN, f"python -m benchmarks.{STUDY} {options}", given)
    output = PageOutput(folder, STUDY, source)
    seeds = range(given["first_seed"], given["first_seed"] + given["tasks"])
    found = Detections(list(sightings(given["repeats"], 0)), list(tables(seeds)))
    output.write(report(found), process_time())
    show(summary(found), as_json)


if __name__ == "__main__":
    main()
