# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Whoever dies in the middle of a skill leaves the robot holding, and the others say so."""

import pytest

from ensemble.network import is_embedded
from slap_ros.errors import ErrorCode
from slap_ros.messages.events import SkillEventKind
from slap_ros.messages.interfaces import SKILL_EVENT, STATE
from support.living_ensemble import laboratory
from support.process_faults import LIMIT

SLOWLY = 1.0  # environment steps a second: a skill takes longer than a dead node is missed
PATIENCE = 3.0  # a state that a loaded machine delays by as long as a step is not missed
# As embedded_ros has it; CycloneDDS's own is 10 s, in which a skill ends even so.
LEASE = (
    "<CycloneDDS><Domain><Discovery><LeaseDuration>4 s</LeaseDuration></Discovery></Domain>"
    "</CycloneDDS>"
)


@pytest.fixture(autouse=True)
def short_lease(network, monkeypatch):
    if not is_embedded():
        monkeypatch.setenv("CYCLONEDDS_URI", LEASE)


def require_rest(bench):
    """The robot stands still: one command may be under way, after that there are no more."""
    before = len(bench.told(STATE))
    bench.spinner.spin_until(lambda: False, 4.0 / SLOWLY)
    assert len(bench.told(STATE)) <= before + 1


@pytest.mark.slow
@pytest.mark.timeout(3 * LIMIT)
def test_a_planner_that_dies_leaves_the_robot_holding(network):
    with laboratory(3, None, SLOWLY, PATIENCE) as bench:
        bench.ask()
        bench.until(lambda: len(bench.told(STATE)) > 1)
        bench.kill("planner_node")
        bench.until(lambda: len(bench.told(SKILL_EVENT)) == 2)
        _, end = bench.told(SKILL_EVENT)
        assert (end.kind, end.error_code) == (SkillEventKind.FAILED, ErrorCode.NODE_DIED)
        assert "the planner is gone" in end.error_msg
        require_rest(bench)


@pytest.mark.slow
@pytest.mark.timeout(3 * LIMIT)
@pytest.mark.parametrize(
    ("victim", "code"),
    [
        ("perception_node", ErrorCode.NO_STATE),
        ("sim_node", ErrorCode.NO_STATE),
        ("skill_server", ErrorCode.NODE_DIED),
    ],
)
def test_whoever_else_dies_ends_the_run_and_the_robot_holds(network, victim, code):
    with laboratory(3, None, SLOWLY, PATIENCE) as bench:
        result = bench.ask()
        bench.until(lambda: len(bench.told(STATE)) > 1)
        bench.kill(victim)
        bench.until(result.done)
        assert result.result().result.error_code == code
        require_rest(bench)
