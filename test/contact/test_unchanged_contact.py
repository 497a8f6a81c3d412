# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Skills are learned in these worlds: the same commands lead to the same states as before.

The commands are those of demonstrations, rounded: drawers are pulled, things grasped, stacked and
pushed into a hole. States are compared to 1e-6, since other processors may round the last bits
differently. Contact magnifies that: of some demonstrations to centimetres, of these to less than
1e-9, tried with commands that differ in their last bits.
"""

import hashlib
import json
from importlib.metadata import version
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

from slap_ros.domains import get_domain

COMMANDS = json.loads((Path(__file__).parent / "data" / "recorded_commands.json").read_text())
PYBULLET = "3.2.7"  # another version simulates something else


class Recorded(NamedTuple):
    """Where the commands of a domain begin, and what came of them."""

    task: int
    held: int  # steps in which something is held
    digest: str  # of all states


RECORDED = {
    "stow_hammer": Recorded(1, 52, "77d83991b0d39e8c"),
    "peg_in_hole": Recorded(2, 69, "78695752954d21a9"),
    "stack_at_target": Recorded(4, 44, "3d93bbb646fe23ae"),
}


@pytest.mark.skipif(version("pybullet") != PYBULLET, reason=f"recorded with PyBullet {PYBULLET}")
@pytest.mark.parametrize("name", RECORDED)
def test_recorded_commands_lead_to_the_states_that_they_did(name):
    task, held, digest = RECORDED[name]
    domain = get_domain(name)
    start = domain.task(task).initial_state
    bodies = [obj for obj in start.objects if "held" in obj.type.column]
    with domain.make_world(start) as world:
        states = [world.step(np.array(command)) for command in COMMANDS[name]]
    assert sum(any(state.get(body, "held") for body in bodies) for state in states) == held
    rounded = np.round([state.data for state in states], 6) + 0.0  # without negative zeros
    assert hashlib.sha256(rounded.tobytes()).hexdigest()[:16] == digest
