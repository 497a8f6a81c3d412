# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a retrieved skill is worth in the place of another one, and what the study refuses."""

import pytest

from slap_ros.errors import ErrorCode
from slap_ros.skills.domain_choice import NO_SKILLS, DomainChoice, open_domain
from slap_ros.studies.lg_sail.library_progress import learned_skills
from slap_ros.studies.lg_sail.retrieval import Known, try_in_place
from support.slap_command import slap

PEGS = DomainChoice("peg_in_hole", "fair:clearance=5")


def shipped(domain, name):
    return Known(domain, learned_skills(open_domain(DomainChoice(domain)))[name].operator)


def test_another_skill_acts_in_the_place_of_the_own_one():
    own = try_in_place(PEGS, "Insert", None, 1, 500)
    assert own[0] == own[1] > 0
    done, begun = try_in_place(PEGS, "Insert", shipped("stow_hammer", "Open"), 1, 500)
    assert (done, begun) == (0, 1)  # and the plan ends there
    assert try_in_place(PEGS, "Insert", None, 1, 500) == own  # the library is as it was


def test_where_a_domain_has_no_skill_none_is_tried():
    bare = DomainChoice("bowls", skills=NO_SKILLS)
    assert try_in_place(bare, "Pick", shipped("peg_in_hole", "Pick"), 1, 500) == (0, 0)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["make_coffee", "--encoder", "words"], "give local:PACKAGE"),
        (["make_coffee", "--encoder", "local:json"], "no package 'json'"),
        (["obstacle2d"], "no hand-written operators"),
    ],
)
def test_what_cannot_be_compared_is_refused(arguments, said, tmp_path):
    ran = slap("study", "retrieval", *arguments, "--output", tmp_path)
    assert ran.exit_code in (ErrorCode.INVALID_PARAMETER, ErrorCode.LANGUAGE_UNAVAILABLE)
    assert said in " ".join(ran.stderr.split())
    assert not list(tmp_path.iterdir())
