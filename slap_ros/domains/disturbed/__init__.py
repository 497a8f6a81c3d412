# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Domains whose world differs from what planners know of it (SLAP, Tables 6 to 8).

``generator``: where a state keeps its random numbers; ``disturbances``: what they do to an action;
``worlds``: the world that is disturbed, and the planner's, which is not; ``domain``: a domain with
both.
"""

from slap_ros.domains.disturbed.disturbances import Disturbances
from slap_ros.domains.disturbed.domain import disturbed
from slap_ros.domains.disturbed.generator import with_generator

__all__ = ["Disturbances", "disturbed", "with_generator"]
