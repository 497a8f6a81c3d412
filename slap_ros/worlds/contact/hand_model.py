# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How a hand follows its target and grips: one that is quick, and one like a Panda's."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass

from slap_ros.errors import InvalidDomainError


@dataclass(frozen=True)
class HandModel:
    """What a hand can do.

    Args:
        pull_n: The largest force along each axis that pulls the hand to its target, N.
        grip_n: The force with which each finger closes or opens, N.
        share: Share of the way to the target that is gone in a substep where the force allows it,
            below 1: the hand lags by about a substep over this.
        finger_speed: The largest speed of a finger, m/s; faster ones enter what they close on.
        friction: Coefficient of friction of the fingers.

    Raises:
        InvalidDomainError: A number is not above 0, or a share not below 1.
    """

    pull_n: float = 60.0
    grip_n: float = 40.0
    share: float = 0.2
    finger_speed: float = 0.15
    friction: float = 2.0  # of rubber

    def __post_init__(self) -> None:
        """Check that a hand can be so."""
        for name, value in asdict(self).items():
            if not 0.0 < value < (1.0 if name == "share" else math.inf):
                wanted = "between 0 and 1" if name == "share" else "above 0"
                raise InvalidDomainError(f"the hand's {name} must be {wanted}, not {value}")


QUICK = HandModel()
# A Panda's whose arm is an impedance as stiff as Franka's takes: it lags by 50 ms, and its pads are
# less rough.
PANDA = HandModel(share=0.05, finger_speed=0.05, friction=1.0)
HANDS = {"quick": QUICK, "panda": PANDA}
