# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""States of domains at a bench in which everything is anywhere: near its place, off it, in mid-air.

Predicates and metrics are functions of any state, also of one that no world would accept.
"""

from __future__ import annotations

from functools import cache

import numpy as np

from slap_ros.core import Domain
from slap_ros.domains import get_domain
from slap_ros.domains.benchtop.features import PLACE, THING
from slap_ros.domains.benchtop.state_access import ANGULAR, LINEAR, POSITION, QUATERNION
from slap_ros.domains.registry import OURS
from slap_ros.geometry.pose import from_rotation_vector, from_yaw, multiply, rotate
from slap_ros.relational import Layout, Metric, Object, State
from slap_ros.worlds.contact.features import ROBOT

BENCHTOP = [name for name in OURS if PLACE in get_domain(name).types]
STATES = 2_000
WIDEST = {"m": 0.16, "rad": 2.0}  # openings of drawers and lids


@cache
def scattered(name: str) -> State:
    """So many states of a domain, the same ones in every test."""
    initial = get_domain(name).task(0).initial_state
    return scattered_states(initial, np.random.default_rng(0), STATES)


def metrics_of(domain: Domain) -> tuple[Metric, ...]:
    """Every metric of a domain, each once."""
    behind = (c.metric for p in domain.predicates for c in p.conditions)
    return tuple(dict.fromkeys((*domain.metrics, *behind)))


def scattered_states(initial: State, rng: np.random.Generator, count: int) -> State:
    """A batch, its rows drawn one by one from a task's initial state."""
    rows = np.repeat(initial.data[None], count, axis=0)
    for row in rows:
        _scatter(initial.layout, row, rng)
    return State(initial.layout, rows)


def _scatter(layout: Layout, row: np.ndarray, rng: np.random.Generator) -> None:
    for jointed in layout.objects:
        if "opening" in jointed.type.column:
            unit = jointed.type.features[jointed.type.column["opening"]].unit
            share = rng.choice([0.0, 0.05 * rng.random(), rng.random(), 1.0])
            row[layout.column(jointed, "opening")] = share * WIDEST[unit]
    things = layout.of_type(THING)
    for thing in things:
        _put(layout, row, thing, rng)
        row[_columns(layout, thing, (*LINEAR, *ANGULAR))] = rng.normal(size=6) * rng.choice(
            [0.0, 0.0, 0.02, 1.0]
        )
        row[layout.column(thing, "held")] = 0.0
    if rng.random() < 0.4:
        row[layout.column(things[rng.integers(len(things))], "held")] = 1.0
    (robot,) = layout.of_type(ROBOT)
    row[_columns(layout, robot, POSITION)] += rng.normal(0.0, 0.1, 3)


def _put(layout: Layout, row: np.ndarray, thing: Object, rng: np.random.Generator) -> None:
    """Somewhere over the table, or about where it would stand on a place, or be in it."""
    where = _columns(layout, thing, POSITION)
    turn = tuple(row[_columns(layout, thing, QUATERNION)].tolist())
    rest = row[layout.column(thing, "rest_height")]
    off = rng.normal(0.0, 10.0 ** rng.uniform(-3.5, -1.0), 3)
    others = [place for place in layout.of_type(PLACE) if place != thing]
    if rng.random() < 0.3:
        row[where] = (*rng.uniform((0.4, -0.3), (0.7, 0.3)), rest + off[2])
    else:
        place = others[rng.integers(len(others))]
        at = row[_columns(layout, place, POSITION)]
        turned = tuple(row[_columns(layout, place, QUATERNION)].tolist())
        if "opening" in place.type.column:  # into the middle of the drawer
            out = row[layout.column(place, "opening")]
            off = off + rotate(turned, (0.0, out - 0.06, 0.0))
        inside = rng.random() < 0.3
        up = 0.0 if inside else row[layout.column(place, "support_height")] + rest
        row[where] = at + off + [0.0, 0.0, up]
        turn = turned if inside else turn
    wobble = rng.normal(0.0, rng.choice([0.0, 0.1, 1.0]), 3)
    spun = multiply(from_yaw(rng.choice([0.0, rng.uniform(-3.0, 3.0)])), turn)
    row[_columns(layout, thing, QUATERNION)] = multiply(
        from_rotation_vector(tuple(wobble.tolist())), spun
    )


def _columns(layout: Layout, obj: Object, features: tuple[str, ...]) -> list[int]:
    return [layout.column(obj, feature) for feature in features]
