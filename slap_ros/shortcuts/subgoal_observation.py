# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What one policy for several shortcuts observes: the state, and which of them it shall be.

An observation has room for the objects of every shortcut, and a bit for each lifted atom that one
of them changes: the multi-hot of the target (Abstract Subgoals, SLAP §5). For one shortcut the bits
and the empty slots never change. So what they add to the first layer is a bias, and what is left
is a policy that observes what a shortcut of its own would: planner, library and evaluation need
nothing new.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from slap_ros.core import Domain
from slap_ros.errors import InvalidStateError
from slap_ros.policies.mlp_policy import MlpPolicy, ObservationNormalisation, Weights
from slap_ros.relational import State
from slap_ros.shortcuts.observation_layout import ObservationLayout, observation_layout
from slap_ros.shortcuts.signature import Kind, Signature

Bit = tuple[object, ...]  # a lifted atom with its sign, or a predicate about what is held


def bits_of(signature: Signature) -> frozenset[Bit]:
    """What tells a shortcut's target from others, whatever the objects."""
    return frozenset({*signature.patterns, *(("held", name) for name in signature.context)})


@dataclass(frozen=True)
class SubgoalObservation:
    """Room for the objects of several shortcuts, and for the bits of their targets.

    Args:
        layout: Features of the robot and of as many slots as any of the shortcuts has.
        bits: What is observed of the target, in order.
    """

    layout: ObservationLayout
    bits: tuple[Bit, ...]

    @classmethod
    def of(cls, domain: Domain, examples: Iterable[tuple[Signature, State]]) -> SubgoalObservation:
        """The observation of some shortcuts.

        Args:
            domain: Domain of the shortcuts.
            examples: Signature of each shortcut, with a state in which it may begin.

        Raises:
            InvalidStateError: A state has no object of one of its signature's kinds.
        """
        slots: dict[Kind, int] = {}
        widths: dict[Kind, int] = {}
        bits: set[Bit] = set()
        robot = 0
        for signature, state in examples:
            layout = observation_layout(domain, signature, state)
            if layout is None:
                raise InvalidStateError(f"{signature.name} cannot begin: objects are missing")
            robot, widths = layout.robot, {**widths, **layout.widths}
            slots |= {kind: max(n, slots.get(kind, 0)) for kind, n in layout.slots.items()}
            bits |= bits_of(signature)
        ordered = ObservationLayout(robot, dict(sorted(slots.items())), widths)
        return cls(ordered, tuple(sorted(bits, key=repr)))

    @property
    def size(self) -> int:
        """The number of features."""
        return self.layout.size + len(self.bits)

    def columns(self, signature: Signature) -> NDArray[np.intp]:
        """Where the features that a shortcut of its own would observe are."""
        found, at = list(range(self.layout.robot)), self.layout.robot
        for kind, count in self.layout.slots.items():
            width = self.layout.widths[kind]
            found += range(at, at + signature.slots.get(kind, 0) * width)
            at += count * width
        return np.array(found, dtype=np.intp)

    def embed(self, signature: Signature, observations: Weights) -> Weights:
        """Observations of a shortcut, shape (n, its size), with its target's bits beside them.

        Args:
            signature: Signature of the shortcut.
            observations: Observations as an
                :class:`~slap_ros.shortcuts.observation_encoder.ObservationEncoder` gives them.

        Returns:
            Shape (n, size).
        """
        own = bits_of(signature)
        embedded = np.zeros((len(observations), self.size), dtype=np.float32)
        embedded[:, self.columns(signature)] = observations
        embedded[:, self.layout.size :] = [bit in own for bit in self.bits]
        return embedded

    def policy_of(self, signature: Signature, shared: MlpPolicy, axes: list[int]) -> MlpPolicy:
        """What a policy for all shortcuts does as one of them.

        Args:
            signature: Signature of the shortcut.
            shared: Policy that observes what :meth:`embed` returns.
            axes: Places of the shortcut's actions among those of the policy.

        Returns:
            The policy that observes what a shortcut of its own would.
        """
        own = self.columns(signature)
        rest = np.setdiff1d(np.arange(self.size), own)
        constant = shared.normalisation(self.embed(signature, np.zeros((1, len(own)), np.float32)))
        (weights, bias), *others = shared.layers
        folded = bias + weights[:, rest].astype(np.float64) @ constant[0, rest]
        *hidden, (last, offset) = [(weights[:, own], folded.astype(np.float32)), *others]
        normalisation = ObservationNormalisation(
            shared.normalisation.mean[own],
            shared.normalisation.deviation[own],
            shared.normalisation.clip,
        )
        return replace(
            shared,
            normalisation=normalisation,
            layers=(*hidden, (last[axes], offset[axes])),
            log_std=shared.log_std[axes],
        )
