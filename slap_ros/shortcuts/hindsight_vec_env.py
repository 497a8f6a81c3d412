# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a step on the way to one shortcut's target was on the way to another's (Abstract HER).

SLAP §5: goals are relabelled with the targets of other candidates of the same source. Each step is
encoded and rewarded again for one of them, drawn at random. A state in which that target holds
already is left out: a success of length 0 teaches nothing.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from slap_ros.core import Domain
from slap_ros.learning.vec_env import VecEnvStep
from slap_ros.policies.action_map import ActionMap
from slap_ros.relational import State
from slap_ros.relational.predicates import Bools
from slap_ros.relational.state import Array
from slap_ros.shortcuts.observation_encoder import ObservationEncoder
from slap_ros.shortcuts.rewards import Rewards
from slap_ros.shortcuts.shortcut_vec_env import GroupTransitions, ShortcutVecEnv
from slap_ros.shortcuts.signature import Signature
from slap_ros.shortcuts.starts import Start, restore_starts
from slap_ros.shortcuts.subgoal_observation import SubgoalObservation
from slap_ros.shortcuts.subgoal_vec_env import SubgoalEnvSpec, SubgoalVecEnv

Source = tuple[object, ...]  # what is the same for all shortcuts that begin in one state
Aim = tuple[Signature, Start]  # a shortcut, and where it begins


@dataclass(frozen=True)
class HindsightStep(VecEnvStep):
    """A step, and what it was for another shortcut that begins where the episode did.

    Args:
        relabelled: Whether there is such a shortcut, shape (n,).
        before: Observations before the step, for that shortcut, shape (n, size).
        after: Observations after the step, for that shortcut, shape (n, size).
        other_rewards: Rewards of that shortcut, shape (n,).
        other_dones: Whether its target was reached, or cannot be any more, shape (n,).
    """

    relabelled: Bools
    before: NDArray[np.float32]
    after: NDArray[np.float32]
    other_rewards: Array
    other_dones: Bools


def source_of(start: Start) -> Source:
    """What tells the state in which an episode begins from others."""
    space = start.space
    return (space.layout.objects, space.static_truth, start.state.data.tobytes())


def aims_by_source(pools: Mapping[Signature, Sequence[Start]]) -> dict[Source, list[Aim]]:
    """All shortcuts that begin in each state.

    Args:
        pools: Starts of each shortcut.
    """
    found: dict[Source, list[Aim]] = {}
    for signature, starts in pools.items():
        for start in starts:
            found.setdefault(source_of(start), []).append((signature, start))
    return found


class HindsightVecEnv(SubgoalVecEnv):
    """Environments of several shortcuts, which relabel their steps."""

    def __init__(
        self,
        envs: Sequence[tuple[Signature, ShortcutVecEnv]],
        observation: SubgoalObservation,
        action_map: ActionMap,
        domain: Domain,
        aims: Mapping[Source, Sequence[Aim]],
        rewards: Rewards,
        rng: np.random.Generator,
    ) -> None:
        """Begin an episode in each environment.

        Args:
            envs: Environments of each shortcut.
            observation: What is observed in all of them.
            action_map: Map from actions to all axes that one of the shortcuts commands.
            domain: Domain of the worlds.
            aims: Shortcuts that begin in each state.
            rewards: Reward function.
            rng: Generator that draws for which shortcut a step is relabelled.
        """
        super().__init__(envs, observation, action_map)
        self._domain, self._aims, self._rewards, self._rng = domain, aims, rewards, rng
        self._encoders: dict[object, ObservationEncoder] = {}

    def step(self, actions: Array) -> HindsightStep:
        """See :meth:`slap_ros.learning.vec_env.VecEnv.step`."""
        step = super().step(actions)
        blank = np.zeros((self.num_envs, self._observation.size), np.float32)
        nobody = np.zeros(self.num_envs, dtype=bool)
        other = HindsightStep(
            **{field.name: getattr(step, field.name) for field in fields(VecEnvStep)},
            relabelled=nobody,
            before=blank,
            after=blank.copy(),
            other_rewards=np.zeros(self.num_envs),
            other_dones=nobody.copy(),
        )
        first = 0
        for signature, env in self._envs:
            for group in env.transitions:
                self._relabel(other, first, signature, group)
                first += len(group.starts)
        return other

    def _relabel(
        self, into: HindsightStep, first: int, signature: Signature, group: GroupTransitions
    ) -> None:
        """Write what the steps of a group were for another shortcut.

        Args:
            into: Step to write to.
            first: Number of the group's first environment.
            signature: Signature of the shortcut that was meant.
            group: Steps of environments with the same objects.
        """
        rows: dict[tuple[Signature, int, int], list[tuple[int, Start]]] = {}
        for i, start in enumerate(group.starts):
            others = [aim for aim in self._aims[source_of(start)] if aim[0] != signature]
            if others:
                chosen, begun = others[int(self._rng.integers(len(others)))]
                key = (chosen, begun.change.add, begun.change.delete)
                rows.setdefault(key, []).append((i, begun))
        for (chosen, _, _), aimed in rows.items():
            numbers = [i for i, _ in aimed]
            where = np.array(numbers) + first
            states = [State(s.layout, s.data[numbers]) for s in (group.before, group.after)]
            self._write(into, where, chosen, [start for _, start in aimed], *states)

    def _write(
        self,
        into: HindsightStep,
        where: NDArray[np.intp],
        signature: Signature,
        starts: Sequence[Start],
        before: State,
        after: State,
    ) -> None:
        """Encode and reward steps for one change of a shortcut."""
        encoder = self._encoder(signature, starts[0])
        begun, ended = encoder.encode(before), encoder.encode(after)
        success = encoder.success(after, ended, [start.target for start in starts])
        failure = ended.failure & ~success
        gain = np.where(success, 0.0, ended.potential) - begun.potential
        into.relabelled[where] = ~begun.achieved
        into.before[where] = self._observation.embed(signature, begun.observations)
        into.after[where] = self._observation.embed(signature, ended.observations)
        into.other_rewards[where] = self._rewards.of(gain, success, failure)
        into.other_dones[where] = success | failure

    def _encoder(self, signature: Signature, start: Start) -> ObservationEncoder:
        key = (signature, start.space.layout.objects, start.space.static_truth, start.change)
        if key not in self._encoders:
            about = (self._domain, start.space, signature, start.change)
            self._encoders[key] = ObservationEncoder(*about)
        return self._encoders[key]


@dataclass(frozen=True)
class HindsightEnvSpec(SubgoalEnvSpec):
    """What a :class:`HindsightVecEnv` is made from, as data that other processes can be sent."""

    def make(self) -> HindsightVecEnv:
        """The environments themselves, in this process."""
        domain = self.parts[0].domain.make()
        pools = {part.signature: restore_starts(domain, part.starts) for part in self.parts}
        return HindsightVecEnv(
            [(part.signature, part.make()) for part in self.parts],
            self.observation(),
            self.action_map,
            domain,
            aims_by_source(pools),
            self.parts[0].rewards,
            np.random.default_rng((*self.parts[0].seed, len(self.parts))),
        )
