# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Where an object is that no picture shows: where it was, unless the arm pushed it meanwhile.

How it was pushed is what the planner's model says of the command: the prediction of a filter whose
correction has to wait. Whatever is seen again is where it is seen.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from slap_ros.core import ActionSpace, World
from slap_ros.geometry.pose import Pose
from slap_ros.relational import Object, State
from slap_ros.worlds.features import POSE_FEATURES, VELOCITY_FEATURES

LONGEST = 40  # steps after which what still moves is taken to be where it is


@dataclass(frozen=True)
class PredictedMotion:
    """What a command does to objects, as the model has it.

    Args:
        before: State in which the command was given.
        after: State in which the model comes to rest after it.
    """

    before: State
    after: State

    @classmethod
    def of(cls, world: World, actions: ActionSpace, before: State, after: State) -> PredictedMotion:
        """Let the model come to rest: a robot measures nothing before.

        Args:
            world: Model, in the state after the command.
            actions: Actions of the model.
            before: State in which the command was given.
            after: State after the command.

        Returns:
            The motion from the command until nothing moves.
        """
        nothing = np.zeros(len(actions.axes))
        for _ in range(LONGEST):
            if not _moves(after):
                break
            after = world.step(nothing)
        return cls(before, after)

    def moved(self, obj: Object) -> Pose | None:
        """Where an object was pushed to; None for one that stays, or that the hand is to have."""
        if self.after.get(obj, "held") > 0.5:
            return None
        pose = _pose(self.after, obj)
        return None if pose == _pose(self.before, obj) else pose


def _moves(state: State) -> bool:
    names = [feature.name for feature in VELOCITY_FEATURES]
    return any(
        float(state.get(obj, name)) != 0.0
        for obj in state.objects
        if names[0] in obj.type.column
        for name in names
    )


def _pose(state: State, obj: Object) -> Pose:
    x, y, z, qx, qy, qz, qw = (float(state.get(obj, f.name)) for f in POSE_FEATURES)
    return Pose((x, y, z), (qx, qy, qz, qw))
