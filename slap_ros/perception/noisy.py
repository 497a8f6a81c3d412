# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Perception with noise and lost sightings, and what is done about them.

Poses are measured, those that err put where physics would have them, and abstracted with
thresholds that are not quite right; then atoms are debounced. The planner plans from the poses, not
from the debounced atoms: its model has predicates of its own, and the two must agree where a plan
begins.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from slap_ros.core import Domain
from slap_ros.perception.debounce import Debouncer
from slap_ros.perception.percept import Percept, known_part
from slap_ros.perception.pose_sensor_model import PoseSensorModel
from slap_ros.perception.quality import Quality
from slap_ros.relational import AtomSpace, Layout, State


@dataclass
class NoisyPerceiver:
    """Perceives an episode. The same generator and states give the same percepts."""

    domain: Domain
    space: AtomSpace
    quality: Quality
    rng: np.random.Generator
    sensor: PoseSensorModel
    debouncer: Debouncer
    _spaces: dict[Layout, AtomSpace] = field(default_factory=dict, init=False, repr=False)

    @classmethod
    def of(
        cls,
        domain: Domain,
        space: AtomSpace,
        initial: State,
        quality: Quality,
        rng: np.random.Generator,
    ) -> NoisyPerceiver:
        """The perceiver of an episode.

        Args:
            domain: Domain with the ``settle`` that corrects measured poses.
            space: Ground atoms of the task.
            initial: Initial state of the task.
            quality: Quality of the perception.
            rng: Source of random numbers for the noise; only this perceiver uses it.

        Returns:
            One that has perceived nothing yet.

        Raises:
            InvalidParameterError: An object that is to be hidden is none of the task's.
        """
        quality.require_known(initial.layout.by_name.keys())
        sensor = PoseSensorModel.of(quality, rng, initial)
        return cls(domain, space, quality, rng, sensor, Debouncer(quality.debounce))

    def perceive(self, state: State) -> Percept:
        """Measure a state, settle what rests if poses err, then abstract and debounce.

        See :class:`~slap_ros.perception.percept.Perceiver`.
        """
        measured = self.sensor.measure(state)
        missing = self.sensor.missing
        seen = known_part(measured, missing)
        if not self.quality.exact_poses:
            seen = self.domain.execution.settle(seen)
        abstract = self.debouncer.add(self._abstract(seen))
        return Percept(seen, abstract, missing, self.quality.exact)

    def _abstract(self, seen: State) -> int:
        """The atoms of the whole task that hold among the objects that are known."""
        space = self._space_of(seen)
        if self.quality.threshold_noise == 0.0:
            abstract = space.abstract(seen)
        else:
            shifts = self.quality.threshold_noise * self.rng.standard_normal(len(space.atoms))
            abstract = space.abstract_within(seen, shifts)
        return abstract if space is self.space else space.project(abstract, self.space)

    def _space_of(self, seen: State) -> AtomSpace:
        if seen.layout == self.space.layout:
            return self.space
        if seen.layout not in self._spaces:
            self._spaces[seen.layout] = self.domain.atom_space(seen)
        return self._spaces[seen.layout]
