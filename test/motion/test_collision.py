# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The collision checker never calls free what touches, and seldom the other way round."""

import numpy as np
import pytest

from slap_ros.geometry.box_separation import separated
from slap_ros.geometry.oriented_box import OrientedBox
from slap_ros.motion import CollisionChecker, inverse_kinematics
from slap_ros.motion.kinematics import matrix
from slap_ros.worlds.panda import FINGER_OPEN, HAND, LINKS, Pose, link_poses
from support.motion_scenes import (
    HELD,
    START,
    STRAIGHT,
    TABLE,
    block,
    random_box,
    random_configurations,
    top_down,
    tower,
)


def place(obstacles, x, y, z, **options):
    """Whether the arm is free with the grasp point there, pointing down."""
    q = inverse_kinematics(top_down(x, y, z), START)
    return bool(CollisionChecker(obstacles, **options)(q))


def test_scenes_by_hand():
    assert CollisionChecker([TABLE, *tower(0.5, 0.0)])(START)
    assert CollisionChecker([block(0.5, 0.0, 0.5)])(START)  # between the open fingers
    assert not CollisionChecker([block(0.5, 0.0, 0.54)])(START)  # in the palm
    assert place([TABLE], 0.5, 0.0, 0.095)
    assert not place([TABLE], 0.5, 0.0, 0.085)  # the fingertips end 9 mm below the grasp point
    assert place([TABLE, *tower(0.5, 0.0, 2)], 0.5, 0.0, 0.2, held=HELD)  # set down, in contact
    assert not place([TABLE, *tower(0.5, 0.0, 2)], 0.5, 0.0, 0.197, held=HELD)
    assert place([block(0.5, 0.0, 0.1)], 0.5, 0.0, 0.1)  # around a block, without touching
    assert not place([block(0.5, 0.0, 0.1)], 0.5, 0.0, 0.1, finger=0.028)
    assert not place([block(0.5, 0.03, 0.1)], 0.5, 0.0, 0.1)


def test_no_obstacles():
    q = random_configurations(np.random.default_rng(0), 5)
    assert CollisionChecker([], base=False)(q).all()


def test_the_base_is_in_the_way_of_the_hand_alone():
    rng = np.random.default_rng(8)
    q = random_configurations(rng, 2000)
    free = CollisionChecker([])(q)
    hands = np.array([link_poses(row, FINGER_OPEN)[HAND].position for row in q])
    in_base = (np.hypot(hands[:, 0], hands[:, 1]) < 0.1) & (hands[:, 2] > 0) & (hands[:, 2] < 0.3)
    assert in_base.sum() > 5
    assert not free[in_base].any()
    reach = np.linalg.norm(hands - (0.0, 0.0, 0.2), axis=1)
    assert free[reach > 0.8].all()


def test_many_at_once_are_as_one_by_one():
    rng = np.random.default_rng(1)
    free = CollisionChecker([TABLE, *tower(0.5, 0.1), random_box(rng)], held=HELD)
    q = random_configurations(rng, 1500)
    assert free(q).tolist() == [bool(free(row)) for row in q]
    assert free(q.reshape(3, 500, 7)).shape == (3, 500)
    assert free(q[:0]).shape == (0,)


def test_key_tells_scenes_apart():
    checkers = [
        CollisionChecker([TABLE]),
        CollisionChecker([TABLE, TABLE]),
        CollisionChecker([TABLE], held=HELD),
        CollisionChecker([TABLE], finger=0.0),
        CollisionChecker([TABLE], margin=0.01),
        CollisionChecker([TABLE], base=False),
        CollisionChecker([block(0.5, 0.0, 0.1)]),
        CollisionChecker([block(0.5, 0.0, 0.1, yaw=0.1)]),
    ]
    assert len({checker.key for checker in checkers}) == len(checkers)
    assert CollisionChecker([TABLE]).key == checkers[0].key


def corners(box, transform):
    signs = np.stack(np.meshgrid(*[[-1, 1]] * 3), -1).reshape(-1, 3)
    return signs * box.half @ transform[:3, :3].T + transform[:3, 3]


def test_boxes_apart_agree_with_separation_by_sampled_points():
    rng = np.random.default_rng(2)
    grid = np.stack(np.meshgrid(*[np.linspace(-1, 1, 15)] * 3), -1).reshape(-1, 3)
    touching = separate = 0
    for _ in range(400):
        a, b = random_box(rng), random_box(rng)
        a, b = a._replace(half=(0.1, 0.2, 0.05)), b._replace(half=(0.15, 0.02, 0.1))
        in_a, in_b = matrix(a.pose), matrix(b.pose)
        seen = np.linalg.inv(in_a) @ in_b
        offset = np.linalg.inv(in_b) @ in_a[:, 3]

        def keep(distance, turn=seen[:3, :3], offset=offset[:3], a=a, b=b):
            sizes = np.array([a.half]), np.array([b.half])
            return bool(separated(turn[None], offset[None], *sizes, np.array([distance]))[0])

        # The true distance, from below by nothing and from above by points of both.
        points = grid * b.half @ seen[:3, :3].T + seen[:3, 3]
        distance = np.linalg.norm(np.maximum(np.abs(points) - a.half, 0.0), axis=1).min()
        assert not keep(distance + 1e-6)
        if distance == 0.0:
            touching += 1
        if distance > 0.05:
            separate += 1
            assert keep(0.7 * distance - 0.02)
    assert touching > 10
    assert separate > 200


@pytest.fixture(scope="module")
def bullet():
    """PyBullet with the Panda's meshes."""
    pybullet = pytest.importorskip("pybullet")
    data = pytest.importorskip("pybullet_data")
    client = pybullet.connect(pybullet.DIRECT)
    robot = pybullet.loadURDF(
        f"{data.getDataPath()}/franka_panda/panda.urdf", useFixedBase=True, physicsClientId=client
    )
    yield pybullet, client, robot
    pybullet.disconnect(client)


MOVING = [i for i in range(11) if i not in (7,)]  # the URDF's links; 7 is link 8, without a shape


def set_joints(bullet, q):
    pybullet, client, robot = bullet
    for joint, angle in enumerate(q):
        pybullet.resetJointState(robot, joint, angle, physicsClientId=client)
    for finger in (9, 10):
        pybullet.resetJointState(robot, finger, FINGER_OPEN, physicsClientId=client)


def add_box(bullet, box):
    pybullet, client, _ = bullet
    shape = pybullet.createCollisionShape(
        pybullet.GEOM_BOX, halfExtents=box.half, physicsClientId=client
    )
    return pybullet.createMultiBody(0, shape, -1, *box.pose, physicsClientId=client)


def distance_in_bullet(bullet, bodies):
    """Least distance of the moving links from the bodies, m; below 0, the penetration."""
    pybullet, client, robot = bullet
    contacts = [
        contact[8]
        for body in bodies
        for contact in pybullet.getClosestPoints(robot, body, 0.2, physicsClientId=client)
        if contact[3] in MOVING
    ]
    return min(contacts, default=0.2)


def test_links_are_where_bullet_has_them(bullet):
    pybullet, client, robot = bullet
    for q in random_configurations(np.random.default_rng(3), 20):
        set_joints(bullet, q)
        states = pybullet.getLinkStates(
            robot, range(7), computeForwardKinematics=True, physicsClientId=client
        )
        expected = link_poses(q, FINGER_OPEN)[1 : LINKS.index("hand")]
        for state, pose in zip(states, expected, strict=True):
            np.testing.assert_allclose(state[4], pose.position, atol=1e-6)


def false_alarms(bullet, obstacles, configurations):
    """Configurations free by 5 mm in PyBullet, and those of them that the checker refuses."""
    pybullet, client, _ = bullet
    bodies = [add_box(bullet, box) for box in obstacles]
    free = CollisionChecker(obstacles, margin=0.0, base=False)(configurations)
    truly_free = alarms = 0
    for q, says_free in zip(configurations, free, strict=True):
        set_joints(bullet, q)
        distance = distance_in_bullet(bullet, bodies)
        assert not (says_free and distance < -1e-3), f"{q} overlaps by {-distance} m"
        truly_free += distance > 0.005
        alarms += distance > 0.005 and not says_free
    for body in bodies:
        pybullet.removeBody(body, physicsClientId=client)
    return alarms, truly_free


def test_never_free_where_bullet_finds_contact(bullet):
    rng = np.random.default_rng(5)
    counts = [
        false_alarms(bullet, [random_box(rng) for _ in range(3)], random_configurations(rng, 200))
        for _ in range(10)
    ]
    alarms, truly_free = np.sum(counts, axis=0)
    assert truly_free > 300
    assert alarms < 0.15 * truly_free


def test_around_a_tower_too(bullet):
    rng = np.random.default_rng(6)
    configurations = []
    while len(configurations) < 400:
        position = rng.uniform((0.4, -0.15, 0.1), (0.6, 0.15, 0.3))
        q = inverse_kinematics(top_down(*position, rng.uniform(-3, 3)), START)
        if q is not None:
            configurations.append(q + rng.normal(0.0, 0.05, 7))
    obstacles = [TABLE, *tower(0.5, 0.0), block(0.375, -0.2, 0.1)]
    alarms, truly_free = false_alarms(bullet, obstacles, np.array(configurations))
    assert truly_free > 50
    assert alarms < 0.1 * truly_free


def test_an_obstacle_far_off_does_not_matter():
    far = OrientedBox(Pose((5.0, 5.0, 5.0), STRAIGHT), (0.1, 0.1, 0.1))
    assert CollisionChecker([far], base=False)(
        random_configurations(np.random.default_rng(7), 100)
    ).all()
