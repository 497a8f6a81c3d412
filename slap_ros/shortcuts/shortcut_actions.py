# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a shortcut acts with: the robot's axes, and the gripper where it changes what is held."""

from __future__ import annotations

from slap_ros.core import Domain
from slap_ros.policies.action_map import ActionMap
from slap_ros.policies.learner_interface import learner_interface
from slap_ros.shortcuts.signature import Signature


def uses_gripper(domain: Domain, signature: Signature) -> bool:
    """Whether the gripper is among its actions: it changes what is held, at its end or before."""
    if signature.regrasps:
        return True
    grasping = {predicate.name for predicate in learner_interface(domain).grasping}
    return any(predicate in grasping for _, predicate, _ in signature.patterns)


def make_action_map(domain: Domain, signature: Signature) -> ActionMap:
    """The map from the policy's actions to the robot's."""
    return ActionMap(domain, uses_gripper(domain, signature))
