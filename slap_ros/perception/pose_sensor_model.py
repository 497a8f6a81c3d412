# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Where objects are seen, and where those are taken to be that are not seen."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from slap_ros.geometry.pose import from_rotation_vector, multiply
from slap_ros.perception.quality import Quality
from slap_ros.relational import Object, State

POSITION = ("x", "y", "z")
TURN = ("qx", "qy", "qz", "qw")
MOTION = ("vx", "vy", "vz", "wx", "wy", "wz")
HELD = "held"  # a feature of whatever can be grasped, and so moved

Features = Mapping[str, float]  # of an object, by name


@dataclass
class PoseSensorModel:
    """Sees what can be moved. The robot and what stands fixed are where they are known to be.

    Args:
        quality: How well.
        rng: Noise comes from it.
        known: Where everything was last seen; to begin with, where it is said to be.
    """

    quality: Quality
    rng: np.random.Generator
    known: dict[Object, Features]
    _unseen: dict[Object, int] = field(default_factory=dict)  # steps, of what is not seen

    @classmethod
    def of(cls, quality: Quality, rng: np.random.Generator, initial: State) -> PoseSensorModel:
        """The sight of an episode; a task says where things are before they are seen."""
        movable = [obj for obj in initial.objects if HELD in obj.type.column]
        return cls(quality, rng, {obj: _pose(initial, obj) for obj in movable})

    def measure(self, state: State) -> State:
        """The state as seen: one look, a step."""
        changes: dict[tuple[Object, str], float] = {}
        for obj in self.known:
            if state.get(obj, HELD) > 0.5:
                # Not seen but felt: what is in the hand is where the hand is.
                self.known[obj] = _pose(state, obj)
                self._unseen[obj] = 0
            elif self._overlooked(obj):
                self._unseen[obj] = self._unseen.get(obj, 0) + 1
                at_rest = {name: 0.0 for name in MOTION if name in obj.type.column}
                changes |= _of(obj, {**self.known[obj], **at_rest})
            else:
                self.known[obj] = self._disturbed(_pose(state, obj))
                self._unseen[obj] = 0
                changes |= _of(obj, self.known[obj])
        return state.replace(changes)

    @property
    def missing(self) -> frozenset[str]:
        """Objects that were not seen for longer than they are remembered."""
        memory = self.quality.memory_steps
        return frozenset(obj.name for obj, steps in self._unseen.items() if steps > memory)

    def _overlooked(self, obj: Object) -> bool:
        lost = self.quality.dropout > 0.0 and self.rng.random() < self.quality.dropout
        return lost or obj.name in self.quality.hidden

    def _disturbed(self, pose: Features) -> Features:
        noise = self.quality.position_noise_m, self.quality.turn_noise_rad
        seen = dict(pose)
        for name in POSITION:
            if name in seen:
                seen[name] += noise[0] * float(self.rng.standard_normal())
        if TURN[0] in seen and noise[1] > 0.0:
            a, b, c = (noise[1] * self.rng.standard_normal(3)).tolist()
            x, y, z, w = (seen[name] for name in TURN)
            turned = multiply(from_rotation_vector((a, b, c)), (x, y, z, w))
            seen |= dict(zip(TURN, turned, strict=True))
        return seen


def _pose(state: State, obj: Object) -> Features:
    names = [name for name in (*POSITION, *TURN) if name in obj.type.column]
    return {name: float(state.get(obj, name)) for name in names}


def _of(obj: Object, features: Features) -> dict[tuple[Object, str], float]:
    return {(obj, name): value for name, value in features.items()}
