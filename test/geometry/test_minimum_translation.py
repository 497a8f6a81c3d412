# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The shortest way out of a box, against whether boxes overlap."""

from __future__ import annotations

import math

import numpy as np

from slap_ros.geometry.minimum_translation import minimum_translation
from slap_ros.geometry.oriented_box import OrientedBox
from slap_ros.geometry.pose import Pose

PAIRS, DIRECTIONS = 300, 30
SHORT = 0.98  # of the shortest way: no direction leads out so soon


def random_box(rng: np.random.Generator) -> OrientedBox:
    turn = rng.normal(size=4)
    turn /= np.linalg.norm(turn)
    pose = Pose(tuple(rng.uniform(-0.15, 0.15, 3).tolist()), tuple(turn.tolist()))
    return OrientedBox(pose, tuple(rng.uniform(0.02, 0.2, 3).tolist()))


def moved(box: OrientedBox, way) -> OrientedBox:
    return box.at(Pose(tuple(float(w) for w in way)))


def test_it_leads_out_and_nothing_shorter_does():
    rng, overlapping = np.random.default_rng(0), 0
    for _ in range(PAIRS):
        box, other = random_box(rng), random_box(rng)
        way = minimum_translation(box, other)
        assert (way is not None) == box.overlaps(other)
        if way is None:
            continue
        overlapping += 1
        length = math.hypot(*way)
        assert not moved(box, np.multiply(way, 1.0 + 1e-6)).overlaps(other)
        directions = rng.normal(size=(DIRECTIONS, 3))
        directions /= np.linalg.norm(directions, axis=1)[:, None]
        assert all(moved(box, SHORT * length * d).overlaps(other) for d in directions)
    assert 0.3 * PAIRS < overlapping < 0.9 * PAIRS


def test_it_leads_to_the_nearer_side():
    low, high = (OrientedBox(Pose((0.0, 0.0, z)), (0.1, 0.1, 0.1)) for z in (0.0, 0.15))
    assert np.allclose(minimum_translation(high, low), (0.0, 0.0, 0.05))
    assert np.allclose(minimum_translation(low, high), (0.0, 0.0, -0.05))
