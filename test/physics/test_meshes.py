# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Bodies of many pieces: they weigh, stand, fall, are held and pushed as they should."""

import numpy as np
import pytest

from benchmarks.physics_step import BLOCK, NAMES, SCENE, tower
from slap_ros.domains.cleanup_table.shapes import make, shipped
from slap_ros.errors import InvalidStateError
from slap_ros.geometry.pose import Pose
from slap_ros.meshes.solid import Solid
from slap_ros.worlds.bullet import pybullet
from slap_ros.worlds.joint_space.gripper import finger_around
from slap_ros.worlds.joint_space.scene import (
    CUBE_EDGE,
    CUBE_MATERIAL,
    TABLE,
    TABLE_TOP,
    Mesh,
    Scene,
    cube,
)
from slap_ros.worlds.joint_space.simulation import Simulation, Stepping
from slap_ros.worlds.joint_space.visuals import SceneVisuals
from slap_ros.worlds.joint_space.world import PandaWorld
from slap_ros.worlds.panda import HOME
from slap_ros.worlds.rendering import Camera
from support.toys import TOYS, heap
from support.transitions import GRASP, holding

CUBE = Solid.of([make.block((0.0, 0.0, 0.0), (CUBE_EDGE,) * 3)])
CUBES = Scene((TABLE, *(Mesh(name, CUBE).with_material(CUBE_MATERIAL) for name in NAMES)))
STILL = np.zeros(8)


def settle(world, steps=40):
    for _ in range(steps):
        world.step(STILL)
    return world.state


def at_rest(state):
    return all((state[BLOCK(name)][7:13] == 0.0).all() for name in NAMES)


def apart(heights):
    """Every body above the table, none over another."""
    state = tower()
    changes = {}
    for i, name in enumerate(NAMES):
        changes |= {(BLOCK(name), "x"): 0.35 + 0.1 * i, (BLOCK(name), "y"): (0.2, -0.2)[i % 2]}
        changes[BLOCK(name), "z"] = TABLE_TOP + heights[i]
    return state.replace(changes)


def test_masses_are_spread_as_geometry_says():
    simulation = Simulation(TOYS, Stepping())
    free = simulation._free
    for body, mesh in zip(free, TOYS.free, strict=True):
        mass, _, inertia, *_ = pybullet.getDynamicsInfo(body, -1, simulation.client)
        assert mass == mesh.mass_kg
        assert inertia == pytest.approx([mesh.mass_kg * x for x in mesh.shape.inertia])
    simulation.close()


def test_a_cube_of_triangles_falls_and_stacks_like_a_cube():
    with PandaWorld(CUBES, tower()) as world:
        stands = settle(world)
    for name in NAMES:
        assert stands[BLOCK(name)][:3] == pytest.approx(tower()[BLOCK(name)][:3], abs=0.006)
        assert stands[BLOCK(name)][3:7] == pytest.approx([0, 0, 0, 1], abs=1e-3)
    assert at_rest(stands)


def test_toys_put_down_upright_stay_so():
    shapes = list(shipped().values())
    state = apart([0.0015 - float(shape.points[:, 2].min()) for shape in shapes])
    with PandaWorld(TOYS, state) as world:
        after = settle(world, 10)
    assert at_rest(after)
    for name in NAMES:
        moved = np.abs(after[BLOCK(name)] - state[BLOCK(name)])[:7]
        assert moved.max() < 0.002


def test_a_heap_comes_to_rest_and_never_is_a_scene_that_cannot_be():
    """Boxes around toys overlap where the toys do not."""
    for seed in range(6):
        start = heap(np.random.default_rng(seed))
        with PandaWorld(TOYS, start) as world, PandaWorld(TOYS, start) as other:
            for _ in range(60):
                other.reset(world.step(STILL))
            assert at_rest(world.state)
            heights = [float(world.state.get(BLOCK(name), "z")) for name in NAMES]
            assert min(heights) > TABLE_TOP


def test_meshes_inside_one_another_or_in_the_table_are_refused():
    state = apart([0.1] * 4)
    into = state.replace(
        {(BLOCK("B"), axis): float(state.get(BLOCK("T"), axis)) for axis in ("x", "y", "z")}
    )
    under = state.replace({(BLOCK("D"), "z"): TABLE_TOP - 0.1})
    for impossible, what in ((into, "B and T|T and B"), (under, "D is inside")):
        with pytest.raises(InvalidStateError, match=what):
            PandaWorld(CUBES, impossible)


def test_fingers_stand_at_the_sides_of_what_they_hold():
    duck, cubic = TOYS.free[0], cube("cube")
    across = Pose()  # fingers along the duck's y
    assert finger_around(duck, across) == pytest.approx(duck.shape.points[:, 1].max())
    assert finger_around(Mesh("cube", CUBE, mass_kg=1.0), GRASP) == pytest.approx(
        finger_around(cubic, GRASP)
    )


@pytest.mark.parametrize("scene", [SCENE, CUBES], ids=["boxes", "triangles"])
def test_a_held_body_pushes_others(scene):
    """The ghost that stands for it has its shape."""
    start = holding(tower(), "T", HOME, scene)
    held = start[BLOCK("T")][:3]
    beside = {(BLOCK("B"), axis): value for axis, value in zip("xyz", held, strict=True)}
    beside[BLOCK("B"), "y"] = held[1] + 0.06  # falls past it
    with PandaWorld(scene, start.replace(beside)) as world:
        before = world.state.get(BLOCK("B"), "y")
        world.step(np.array([0.087, 0, 0, 0, 0, 0, 0, 0]))  # the whole arm turns left
        assert world.state.get(BLOCK("B"), "y") - before > 0.02


def test_an_arm_far_away_skips_what_rests_and_a_near_one_does_not():
    state = apart([0.0015 - float(shape.points[:, 2].min()) for shape in shipped().values()])
    with PandaWorld(TOYS, state) as world:
        settled = settle(world)
        simulation, world._simulation = world._simulation, None  # asking it would fail
        assert world.step(STILL) == settled
        with pytest.raises(AttributeError):
            for _ in range(20):
                world.step(np.array([0.02, 0.05, 0, 0, 0, 0.05, 0, 0]))  # down to a toy
        world._simulation = simulation


def test_pictures_show_toys_where_they_are():
    state = apart([0.05] * 4)
    with (
        Camera(SceneVisuals(TOYS)) as camera,
        Camera(SceneVisuals(Scene((TABLE,), TOYS.floor_m))) as empty,
    ):
        differ = (camera.picture(state) != empty.picture(state)).any(axis=-1)
    assert 200 < differ.sum() < 20_000  # pixels
