# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A model of a pose sensor: noise, lost sightings, and where unseen objects are taken to be."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from slap_ros.geometry.pose import from_rotation_vector, multiply
from slap_ros.perception.quality import Quality
from slap_ros.relational import Object, State

POSITION = ("x", "y", "z")
QUATERNION = ("qx", "qy", "qz", "qw")
TWIST = ("vx", "vy", "vz", "wx", "wy", "wz")
HELD = "held"  # a feature of whatever can be grasped, and so moved

Features = Mapping[str, float]  # of an object, by name


@dataclass
class PoseSensorModel:
    """Measures the poses of what can be moved; robot and fixed bodies are known exactly.

    Args:
        quality: Quality of the measurements.
        rng: Source of random numbers for the noise.
        latest: Latest pose of each object; before the first sighting, the pose in the task.
    """

    quality: Quality
    rng: np.random.Generator
    latest: dict[Object, Features]
    _unseen: dict[Object, int] = field(default_factory=dict)  # steps, of what is not seen

    @classmethod
    def of(cls, quality: Quality, rng: np.random.Generator, initial: State) -> PoseSensorModel:
        """The sensor of an episode.

        Args:
            quality: Quality of the measurements.
            rng: Source of random numbers for the noise.
            initial: Initial state of the task, with the poses of things before they are seen.

        Returns:
            A sensor that has measured nothing yet.
        """
        movable = [obj for obj in initial.objects if HELD in obj.type.column]
        # What is never detected was not detected before either, whatever the task says.
        unseen = {obj: quality.memory_steps for obj in movable if obj.name in quality.hidden}
        return cls(quality, rng, {obj: _pose(initial, obj) for obj in movable}, unseen)

    def measure(self, state: State) -> State:
        """The state as measured; to be called once for each environment step."""
        changes: dict[tuple[Object, str], float] = {}
        for obj in self.latest:
            if state.get(obj, HELD) > 0.5:
                # Not seen but felt: what is in the hand is where the hand is.
                self.latest[obj] = _pose(state, obj)
                self._unseen[obj] = 0
            elif self._overlooked(obj):
                self._unseen[obj] = self._unseen.get(obj, 0) + 1
                at_rest = {name: 0.0 for name in TWIST if name in obj.type.column}
                changes |= _of(obj, {**self.latest[obj], **at_rest})
            else:
                self.latest[obj] = self._disturbed(_pose(state, obj))
                self._unseen[obj] = 0
                changes |= _of(obj, self.latest[obj])
        return state.replace(changes)

    @property
    def missing(self) -> frozenset[str]:
        """Objects that were not seen for longer than ``memory_steps``, or never."""
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
        if QUATERNION[0] in seen and noise[1] > 0.0:
            a, b, c = (noise[1] * self.rng.standard_normal(3)).tolist()
            x, y, z, w = (seen[name] for name in QUATERNION)
            turned = multiply(from_rotation_vector((a, b, c)), (x, y, z, w))
            seen |= dict(zip(QUATERNION, turned, strict=True))
        return seen


def _pose(state: State, obj: Object) -> Features:
    names = [name for name in (*POSITION, *QUATERNION) if name in obj.type.column]
    return {name: float(state.get(obj, name)) for name in names}


def _of(obj: Object, features: Features) -> dict[tuple[Object, str], float]:
    return {(obj, name): value for name, value in features.items()}
