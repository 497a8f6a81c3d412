# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Oriented boxes against PyBullet's own closest points."""

from __future__ import annotations

import numpy as np
import pytest

from slap_ros.geometry.oriented_box import OrientedBox
from slap_ros.geometry.pose import Pose
from slap_ros.worlds.bullet import pybullet

UNSURE = 2e-3  # m, distance within which either answer will do: PyBullet keeps margins


def random_box(rng: np.random.Generator) -> OrientedBox:
    turn = rng.normal(size=4)
    turn /= np.linalg.norm(turn)
    pose = Pose(tuple(rng.uniform(-0.3, 0.3, 3).tolist()), tuple(turn.tolist()))
    return OrientedBox(pose, tuple(rng.uniform(0.02, 0.2, 3).tolist()))


@pytest.fixture
def distance():
    client = pybullet.connect(pybullet.DIRECT)

    def between(a: OrientedBox, b: OrientedBox) -> float:
        pybullet.resetSimulation(physicsClientId=client)
        for box in (a, b):
            shape = pybullet.createCollisionShape(
                pybullet.GEOM_BOX, halfExtents=box.half, physicsClientId=client
            )
            pybullet.createMultiBody(1.0, shape, -1, *box.pose, physicsClientId=client)
        points = pybullet.getClosestPoints(0, 1, 2.0, physicsClientId=client)
        return min(point[8] for point in points)

    yield between
    pybullet.disconnect(client)


def test_overlap_is_a_distance_below_zero(distance):
    rng = np.random.default_rng(0)
    counts = {True: 0, False: 0}
    for _ in range(400):
        a, b = random_box(rng), random_box(rng)
        separated = distance(a, b)
        if abs(separated) < UNSURE:
            continue
        assert a.overlaps(b) == b.overlaps(a) == (separated < 0)
        counts[separated < 0] += 1
    assert min(counts.values()) > 50


def test_a_point_is_near_where_the_nearest_point_of_the_box_is():
    rng = np.random.default_rng(1)
    for _ in range(300):
        box, point = random_box(rng), tuple(rng.uniform(-0.5, 0.5, 3).tolist())
        inside = np.array(box.pose.inverse().apply(point))
        away = float(np.linalg.norm(np.maximum(np.abs(inside) - box.half, 0.0)))
        assert box.near(point, away + 1e-9)
        assert away == 0.0 or not box.near(point, away - 1e-9)


def test_aligned_boxes_that_touch_edge_to_edge():
    a = OrientedBox(Pose(), (0.1, 0.1, 0.1))
    for x, expected in ((0.199, True), (0.201, False)):
        b = OrientedBox(Pose((x, x, x)), (0.1, 0.1, 0.1))
        assert a.overlaps(b) is expected


def test_what_is_thinner_than_the_layer_shrinks_to_a_sheet():
    sheet = OrientedBox(Pose(), (0.1, 0.004, 0.02)).shrunk(0.01)
    assert sheet.half == pytest.approx((0.09, 0.0, 0.01))
