# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Drawers and lids in MuJoCo: joints with the scene's range, damping and friction."""

import math
from dataclasses import replace

import pytest

from slap_ros.core import task_with_goal
from slap_ros.domains import get_domain
from slap_ros.domains.benchtop.state_access import pose_of
from slap_ros.domains.make_coffee.scenery import LID_HIGH
from slap_ros.evaluation.approaches import PURE_PLANNING
from slap_ros.evaluation.experiment import solve
from slap_ros.geometry.pose import rotate
from slap_ros.robot.gripper import GripperAction
from slap_ros.robot.recorded_motion import RecordedMotion
from slap_ros.skills.domain_choice import DEMONSTRATOR, DomainChoice, open_domain
from slap_ros.worlds.contact.command import HandCommand
from slap_ros.worlds.contact.snapshot import ContactIndex

pytest.importorskip("pybullet")
mujoco = pytest.importorskip("mujoco")

from slap_ros.robot.mujoco.contact_state import measured_state  # noqa: E402
from slap_ros.robot.mujoco.model import scene_around  # noqa: E402
from slap_ros.robot.mujoco.open_loop import OpenLoopPlayer  # noqa: E402
from slap_ros.robot.mujoco.plant import PERIOD_S, MujocoPlant  # noqa: E402

STOPS_WITHIN = 5e-4  # m, of the end that a drawer is pressed against
SAME = 1e-4  # m and rad


def stowing():
    domain = get_domain("stow_hammer")
    return domain, domain.task(3).initial_state


def coffee():
    domain = get_domain("make_coffee")
    return domain, domain.task(3).initial_state


def opened(state, **openings):
    return state.replace(
        {(state.layout.object(name), "opening"): value for name, value in openings.items()}
    )


def passed(plant, seconds):
    for _ in range(round(seconds / PERIOD_S)):
        plant.step()


def pull(plant, name, force):
    """Pull a drawer along its way from now on, N."""
    model, data = plant._model, plant._data
    data.xfrc_applied[model.body(f"{name}_moving").id][:3] = force * along(plant, name)


def along(plant, name):
    return plant._data.xaxis[plant._model.joint(name).id]


def joint_of(scene, name):
    (body,) = (body for body in scene.jointed if body.name == name)
    return body, body.joint


def test_a_drawer_takes_force_opens_and_stops_at_its_range():
    domain, state = stowing()
    plant = MujocoPlant.of(domain, state)
    _, joint = joint_of(scene_around(domain, state), "cabinet1")
    pull(plant, "cabinet1", 0.9 * joint.dry_friction)
    passed(plant, 1.0)
    assert plant.openings()["cabinet1"].position < SAME
    pull(plant, "cabinet1", 2.0 * joint.dry_friction)
    passed(plant, 3.0)
    assert plant.openings()["cabinet1"].position == pytest.approx(joint.high, abs=STOPS_WITHIN)
    pull(plant, "cabinet1", 0.0)
    passed(plant, 1.0)
    assert plant.openings()["cabinet1"].position == pytest.approx(joint.high, abs=STOPS_WITHIN)
    pull(plant, "cabinet1", -2.0 * joint.dry_friction)
    passed(plant, 3.0)
    opening = plant.openings()
    assert opening["cabinet1"].position == pytest.approx(0.0, abs=STOPS_WITHIN)
    assert opening["cabinet0"].position == pytest.approx(0.0, abs=SAME)  # nobody pulled that one


def test_a_drawer_moves_as_its_mass_damping_and_dry_friction_say():
    domain, state = stowing()
    plant = MujocoPlant.of(domain, state)
    body, joint = joint_of(scene_around(domain, state), "cabinet0")
    force, time = 25.0, 0.15  # N, s
    pull(plant, "cabinet0", force)
    passed(plant, time)
    fastest, lag = (force - joint.dry_friction) / joint.damping, body.mass_kg / joint.damping
    way = fastest * (time - lag * (1.0 - math.exp(-time / lag)))
    speed = fastest * (1.0 - math.exp(-time / lag))
    found = plant.openings()["cabinet0"]
    assert 0.05 < way < joint.high
    assert found.position == pytest.approx(way, rel=0.03)
    assert found.velocity == pytest.approx(speed, rel=0.03)


@pytest.mark.parametrize(("angle", "fallen"), [(0.3, 0.0), (1.2, 0.0), (1.9, LID_HIGH)])
def test_a_lid_stays_where_it_is_left_and_falls_without_its_friction(angle, fallen):
    domain, state = coffee()
    plant = MujocoPlant.of(domain, opened(state, holder=angle))
    passed(plant, 2.0)
    assert plant.openings()["holder"].position == pytest.approx(angle, abs=SAME)
    plant._model.dof_frictionloss[plant._model.joint("holder").dofadr] = 0.0
    passed(plant, 3.0)
    assert plant.openings()["holder"].position == pytest.approx(fallen, abs=0.01)


@pytest.mark.parametrize(("drawer", "lid"), [(0.0, 2.1), (0.08, 0.9), (0.16, 0.0)])
def test_a_state_that_a_plant_begins_in_is_measured_there(drawer, lid):
    domain, state = coffee()
    cabinet, pod = (state.layout.object(name) for name in ("cabinet", "pod"))
    ahead = rotate(pose_of(state, cabinet).quaternion, (0.0, drawer, 0.0))  # its pod goes with it
    there = {
        (pod, axis): float(state.get(pod, axis)) + way
        for axis, way in zip("xyz", ahead, strict=True)
    }
    begun = opened(state, cabinet=drawer, holder=lid).replace(there)
    plant, scene = MujocoPlant.of(domain, begun), scene_around(domain, begun)
    told = HandCommand.of(ContactIndex.of(scene, begun.layout).read(begun).hand)
    measured = measured_state(scene, begun, plant, told)
    for name, opening in (("cabinet", drawer), ("holder", lid)):
        obj = measured.layout.object(name)
        assert measured.get(obj, "opening") == pytest.approx(opening, abs=SAME)
        assert measured.get(obj, "opening_velocity") == pytest.approx(0.0, abs=SAME)
    space = domain.atom_space(begun)
    assert space.abstract(measured) == space.abstract(begun)
    with domain.make_world(measured):  # which refuses what cannot be
        pass
    again = MujocoPlant.of(domain, measured).openings()
    assert {name: opening.position for name, opening in again.items()} == pytest.approx(
        {"cabinet": drawer, "holder": lid}, abs=SAME
    )


def test_parts_that_move_are_where_the_scene_has_them_and_do_not_touch_their_frames():
    domain, state = coffee()
    begun = opened(state, holder=0.7)
    plant, scene = MujocoPlant.of(domain, begun), scene_around(domain, begun)
    model, data = plant._model, plant._data
    for name, opening in (("cabinet", 0.0), ("holder", 0.7)):
        body, _ = joint_of(scene, name)
        placed = body.moving_pose(pose_of(begun, begun.layout.object(name)), opening)
        moving = model.body(f"{name}_moving")
        assert data.xpos[moving.id] == pytest.approx(placed.position, abs=1e-6)
        assert model.body_mass[moving.id] == body.mass_kg
    touching = [
        {model.body(model.geom_bodyid[geom]).name for geom in contact.geom}
        for contact in data.contact
    ]
    assert {"pod", "cabinet_moving"} in touching  # it stands in the drawer
    assert not any(
        {name, f"{name}_moving"} <= pair for pair in touching for name in ("cabinet", "holder")
    )


def recorded(name, steps=None, goal=None):
    """What the demonstrator's scripts do, up to a step; for the task's own goal or another one."""
    domain = open_domain(DomainChoice(name, skills=DEMONSTRATOR))
    task = task_with_goal(domain, 300, 0, goal)
    episode = solve(domain, task, PURE_PLANNING)
    assert episode.success
    motion = RecordedMotion.of(domain, 300, 0, episode.states, task.goal)
    if steps is None:
        return motion
    return replace(motion, states=motion.states[: steps + 1], waypoints=motion.waypoints[:steps])


def holds(motion, state, atom):
    space = motion.domain.atom_space(state)
    return atom in space.describe(space.abstract(state))


@pytest.fixture(scope="module")
def pulled():
    """A drawer with a pod is pulled open by its handle, which the hand still has."""
    return recorded("make_coffee", steps=45)


def test_a_drawer_that_a_plan_opens_is_open_in_the_plant(pulled):
    player = OpenLoopPlayer(pulled)
    assert not holds(pulled, pulled.states[0], "IsCabinetOpen(cabinet)")
    assert player.plant._model.neq == 1  # one coupling, of both fingers: nothing is welded
    final = player.play()
    assert holds(pulled, final, "IsCabinetOpen(cabinet)")
    assert holds(pulled, final, "InCabinet(pod, cabinet)")  # it went with it
    cabinet, robot = final.layout.object("cabinet"), final.layout.object("robot")
    planned = float(pulled.states[-1].get(cabinet, "opening"))
    there = player.plant.openings()["cabinet"].position
    assert final.get(cabinet, "opening") == there
    assert 1e-4 < abs(there - planned) < 0.01  # another physics, and near
    assert final.get(robot, "gripper") == 1.0  # it closes on what is no thing
    assert not any(final.get(o, "held") for o in final.objects if "held" in o.type.column)


def test_a_cabinet_elsewhere_stays_shut(pulled):
    """The motion is the same, so only what stands in MuJoCo can tell."""
    first = pulled.states[0]
    cabinet = first.layout.object("cabinet")
    aside = first.replace({(cabinet, "x"): float(first.get(cabinet, "x")) + 0.2})
    player = OpenLoopPlayer(replace(pulled, states=(aside, *pulled.states[1:])))
    assert not holds(pulled, player.play(), "IsCabinetOpen(cabinet)")


def test_fingers_close_where_those_of_the_recording_have_closed(pulled):
    """Around a bar, or altogether: a fist is made away from what was let go before."""
    (closing,) = (w.step for w in pulled.waypoints if w.gripper is GripperAction.CLOSE)
    assert left_finger(pulled.states[closing - 1]) == pytest.approx(0.007, abs=5e-4)  # half the bar
    assert left_finger(pulled.states[closing - 3]) > 0.008
    whole = recorded("make_coffee")
    *_, fist, _ = (w.step for w in whole.waypoints if w.gripper is GripperAction.CLOSE)
    assert left_finger(whole.states[fist - 1]) < 5e-4
    assert whole.waypoints[fist - 1].gap == 0.0
    whole.waypoints[fist - 1].require_grasp(-1e-5)  # as it is measured when fingers are shut


def left_finger(state):
    return float(state.get(state.layout.object("robot"), "left_finger"))


@pytest.mark.slow  # 80 s of the robot's time
@pytest.mark.timeout(180)
def test_a_hammer_is_stowed_in_a_drawer_by_contact_alone():
    """The other one would be stowed in the same way."""
    motion = recorded(
        "stow_hammer", goal="(and (InCabinet hammer0 cabinet0) (IsCabinetClose cabinet0))"
    )
    final = OpenLoopPlayer(motion).play()
    space = motion.domain.atom_space(motion.states[0])
    assert space.abstract(final) & motion.goal == motion.goal
