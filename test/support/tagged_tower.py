# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A task of the tower whose blocks have tags, seen by a camera in MuJoCo."""

from dataclasses import dataclass
from pathlib import Path

from slap_ros.core import task_with_goal
from slap_ros.domains import get_domain
from slap_ros.robot.mujoco.camera import MujocoCamera, add_camera, add_tags
from slap_ros.robot.mujoco.model import compiled, scene_around, scene_spec
from slap_ros.robot.mujoco.plant import MujocoPlant
from slap_ros.robot.scene_config import read_scene_config
from slap_ros.robot.tagged_scene import placed_tags, tagged_scene
from slap_ros.vision.pinhole_camera import PinholeCamera, looking_at

CAMERA = PinholeCamera.centred(1280, 720, 1200.0)
EYE = looking_at((1.05, -0.45, 0.75), (0.5, -0.02, 0.15))


@dataclass(frozen=True)
class TaggedTower:
    scene_file: Path
    tags: dict
    poses: dict  # of blocks, as the physics has them
    picture: object  # red, green, blue


def tagged_tower(folder, seed=1):
    """One frame of a task."""
    domain = get_domain("obstacle_tower")
    state = task_with_goal(domain, seed, 0, "").initial_state
    path = Path(folder) / "scene.yaml"
    path.write_text(tagged_scene(domain, state), encoding="utf-8")
    tags = placed_tags(read_scene_config(path, domain))
    scene = scene_around(domain, state)
    spec = scene_spec(scene, state)
    add_camera(spec, CAMERA, EYE)
    add_tags(spec, tags)
    model = compiled(spec)
    plant = MujocoPlant(model, scene, state)
    camera = MujocoCamera(model)
    picture = camera.picture(plant.positions)
    camera.close()
    return TaggedTower(path, {tag.tag: tag for tag in tags}, plant.poses(), picture)
