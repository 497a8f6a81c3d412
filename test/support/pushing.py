# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Starts of a shortcut in Obstacle 2D: with a block in the hand, push another off the target."""

from slap_ros.domains import get_domain
from slap_ros.planning.problem import Problem
from slap_ros.relational import Target
from slap_ros.shortcuts.signature import Change, Signature
from slap_ros.shortcuts.starts import Start

DOMAIN = get_domain("obstacle2d", "fair")


def start_of(index):
    """Holding the target block, to push the obstacle out of the target area."""
    task = DOMAIN.task(21, index)
    problem = Problem.of(DOMAIN, task.initial_state)
    space = problem.model.space
    (pick,) = [o for g, o in problem.operators if str(g) == "Pick(robot, block1, table)"]
    (ground,) = [g for g, _ in problem.operators if str(g) == "Pick(robot, block1, table)"]
    target = Target.exactly(ground.apply(space.abstract(task.initial_state)))
    held = problem.model.roll_out(pick, task.initial_state, target)
    assert held.reached
    add = space.mask([space.atom("Clear", ["target"]), space.atom("On", ["block2", "table"])])
    return Start(held.final, space, Change(add, space.mask([overlap(space)])))


def overlap(space):
    return space.atom("Overlap", ["block2", "target"])


STARTS = [start_of(index) for index in range(8)]
SIGNATURE = Signature.of(STARTS[0].change, STARTS[0].space)
