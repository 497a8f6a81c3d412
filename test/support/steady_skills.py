# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A library for the domain `points` whose weights were written by hand: its skills always work."""

import numpy as np

from slap_ros.acquisition.training.sac import AS_OBSERVED
from slap_ros.policies.mlp_policy import MlpPolicy
from slap_ros.skills.observations import OBJECT_FEATURES, ROBOT_FEATURES, SIZE
from slap_ros.skills.skill_library import AcquiredSkill, SkillLibrary, save_skill_library
from support.points import HORIZON, PICK, POINTS, PUT, REWARDS

GAIN = 2.5  # of the hand's way to the object
RELEASE = 0.15  # where it lets go, as observed: 7.5 mm


def towards(slot, releases, gain=GAIN):
    """Go to the object in a slot, closed; there, let go of what is held if that is meant."""
    x = ROBOT_FEATURES + slot * (1 + OBJECT_FEATURES) + 1
    hidden = np.zeros((4, SIZE), dtype=np.float32)
    for row, (column, sign) in enumerate([(x, 1), (x, -1), (x + 1, 1), (x + 1, -1)]):
        hidden[row, column] = sign
    out = np.array([[gain, -gain, 0, 0], [0, 0, gain, -gain], [0, 0, 0, 0]], dtype=np.float32)
    bias = np.array([0, 0, 3], dtype=np.float32)
    if releases:
        out[2], bias[2] = 40, -40 * RELEASE
    layers = ((hidden, np.zeros(4, dtype=np.float32)), (out, bias))
    return MlpPolicy(AS_OBSERVED, layers, np.zeros(3, dtype=np.float32), "relu", squashed=True)


PICKING = AcquiredSkill(PICK, REWARDS["Pick"], towards(0, False), HORIZON)
PUTTING = AcquiredSkill(PUT, REWARDS["Put"], towards(1, True), HORIZON)


def write_library(path, *skills):
    """Write a library of these skills, or of both, and return its path."""
    skills = sorted(skills or (PICKING, PUTTING), key=lambda skill: skill.folder_name)
    save_skill_library(path, SkillLibrary(POINTS.name, tuple(skills), {"preset": "two"}))
    return path
