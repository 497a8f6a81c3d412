# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What is painted last is what is nearest, wherever a ray from the viewer hits."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from slap_ros.core import VisibleBody
from slap_ros.domains.benchtop.visualization import prism_triangles
from slap_ros.drawing.occlusion import painting_order
from slap_ros.drawing.projection import OBLIQUE, SIDE, TOP, Projection
from slap_ros.geometry.pose import from_rotation_vector, rotation_matrix

WHITE = (1.0, 1.0, 1.0, 1.0)
VIEWS = [OBLIQUE, SIDE, TOP]


def boxes(rng: np.random.Generator) -> list[VisibleBody]:
    """Boxes of all sizes and turns, each in a cell of its own, on a wide table."""
    found = [VisibleBody("table", (0.0, 0.0, -0.55), (0, 0, 0, 1), (3.0, 3.0, 0.1), WHITE)]
    for cell in product((-1.0, 0.0, 1.0), repeat=3):
        x, y, z = (0.3 * c for c in cell)
        turn = from_rotation_vector(tuple(rng.normal(0.0, 1.0, 3)))
        size = tuple(rng.uniform(0.02, 0.16, 3))
        found.append(VisibleBody("box", (x, y, z), turn, size, WHITE))
    return found


def hits(bodies: list[VisibleBody], view: Projection, point: np.ndarray) -> dict[int, float]:
    """How near to the viewer a ray enters each body that it hits."""
    found = {}
    for i, body in enumerate(bodies):
        turn = np.array(rotation_matrix(body.quaternion))
        start, way = turn.T @ (point - body.position), turn.T @ np.array(view.toward)
        half = np.array(body.size) / 2
        with np.errstate(divide="ignore", invalid="ignore"):
            ends = np.sort(np.array([(-half - start) / way, (half - start) / way]), axis=0)
        enters, leaves = np.nanmax(ends[0]), np.nanmin(ends[1])
        if enters < leaves:
            found[i] = float(leaves)
    return found


@pytest.mark.parametrize("view", VIEWS, ids=lambda view: view.name)
@pytest.mark.parametrize("seed", range(3))
def test_the_nearest_of_what_a_ray_hits_is_painted_last(view, seed):
    rng = np.random.default_rng(seed)
    bodies = boxes(rng)
    order = painting_order(bodies, view, list(rng.permutation(len(bodies))))
    assert sorted(order) == list(range(len(bodies)))
    several = 0
    for body in bodies * 4:
        found = hits(bodies, view, np.array(body.position) + rng.normal(0.0, 0.03, 3))
        if len(found) > 1:
            several += 1
            assert max(found, key=order.index) == max(found, key=found.get)
    assert several > 20


def test_a_drawer_is_hidden_by_the_cabinet_that_it_is_in():
    still = (0.0, 0.0, 0.0, 1.0)
    roof = VisibleBody("roof", (0.5, 0.0, 0.1), still, (0.2, 0.2, 0.01), WHITE)
    floor = replace(roof, position=(0.5, 0.0, 0.0))
    bottom = replace(roof, position=(0.4, 0.0, 0.05), size=(0.2, 0.15, 0.01))
    rod = replace(roof, position=(0.4, 0.0, 0.075), triangles=prism_triangles(0.01, 0.03))
    bodies = [roof, rod, bottom, floor]
    for ranks in ([0, 1, 2, 3], [3, 2, 1, 0], [1, 3, 0, 2]):
        assert painting_order(bodies, OBLIQUE, ranks) == [3, 2, 1, 0]


def test_what_hides_nothing_comes_in_the_order_of_its_rank():
    still = (0.0, 0.0, 0.0, 1.0)
    row = [VisibleBody("box", (i, 0.0, 0.0), still, (0.1, 0.1, 0.1), WHITE) for i in range(4)]
    assert painting_order(row, TOP, [2, 0, 3, 1, -1]) == [4, 1, 3, 0, 2]
    assert painting_order([], TOP, [5, 4]) == [1, 0]
    # Bodies that are inside one another have no order of their own.
    assert painting_order([row[0]] * 3, TOP, [2, 1, 0]) == [2, 1, 0]
