# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""From what is there to what is known of it: poses, atoms, and what was lost sight of.

Swappable: whatever is a :class:`~slap_ros.perception.percept.Perceiver` can be in its place.
"""

from slap_ros.perception.exact import ExactPerceiver
from slap_ros.perception.noisy import NoisyPerceiver
from slap_ros.perception.percept import Perceiver, Percept
from slap_ros.perception.quality import Quality

__all__ = ["ExactPerceiver", "NoisyPerceiver", "Perceiver", "Percept", "Quality"]
