# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Which known skill a new one begins with, over the domains' hand-written operators."""

import pytest

from slap_ros.acquisition.training.retrieval import nearest
from slap_ros.acquisition.training.settings import AcquisitionSettings
from slap_ros.domains import get_domain
from slap_ros.skills.skill_signature import SkillSignature, signature_of

PAIRS = [
    ("make_coffee", "Open", "stow_hammer", "Open"),
    ("make_coffee", "Close", "stow_hammer", "Close"),
    ("make_coffee", "Pick", "stow_hammer", "Pick"),
    ("make_coffee", "Insert", "stow_hammer", "Place"),
    ("peg_in_hole", "Pick", "stow_hammer", "Pick"),
    ("peg_in_hole", "Insert", "stow_hammer", "Place"),
    ("stack_at_target", "Place", "peg_in_hole", "Insert"),
    ("bowls", "Pick", "groceries", "Pick"),
]


def keys(domain):
    return {o.name: signature_of(o) for o in get_domain(domain).acquisition.operators}


@pytest.mark.parametrize(("domain", "skill", "library", "expected"), PAIRS)
def test_the_skill_of_the_same_kind_is_retrieved(domain, skill, library, expected):
    name, similarity = nearest(keys(domain)[skill], keys(library))
    assert name == expected
    assert similarity >= AcquisitionSettings().least_similarity


def test_what_no_known_skill_does_begins_with_none():
    """No drawer is a lid: the nearest key is far below the least similarity."""
    _, similarity = nearest(keys("make_coffee")["CloseLid"], keys("stow_hammer"))
    assert similarity < AcquisitionSettings().least_similarity


def test_opposite_skills_have_little_in_common():
    drawers = keys("stow_hammer")
    assert drawers["Open"].similarity(drawers["Close"]) < 0.1
    assert drawers["Pick"].similarity(drawers["Place"]) < 0.1


def test_keys_are_read_as_they_were_written():
    for key in keys("make_coffee").values():
        assert SkillSignature.from_json(key.as_json()).similarity(key) == pytest.approx(1.0)
