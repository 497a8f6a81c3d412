# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Terms are left out as they are named, and a study that is killed goes on where it was."""

import json
from dataclasses import fields, replace

import pytest

from slap_ros.domains import domain_names, get_domain
from slap_ros.errors import ErrorCode, InvalidParameterError
from slap_ros.policies.learner_interface import learner_interface, without
from slap_ros.shortcuts import learning_attempt
from slap_ros.shortcuts.named_settings import training_settings
from slap_ros.studies.slap import ablation
from support.slap_command import slap

PLAIN = "all of them (plain)"
SMALL = ["--trainings", "1", "--steps", "4096", "--tasks", "1", "--samples", "2"]


def ablated_domains():
    domains = [get_domain(name) for name in domain_names()]
    return [d for d in domains if d.learning is not None and d.learning.ablations]


def changed(domain, term):
    """The terms' places in the interface, and what each is now."""
    own, other = learner_interface(domain), learner_interface(without(domain, term))
    return {
        field.name: getattr(other, field.name)
        for field in fields(own)
        if getattr(own, field.name) != getattr(other, field.name)
    }


@pytest.mark.parametrize("domain", ablated_domains(), ids=lambda domain: domain.name)
def test_each_term_changes_something_and_the_plain_interface_everything(domain):
    terms = {term: changed(domain, term) for term in domain.learning.ablations}
    assert all(terms.values())
    assert set(terms.pop(PLAIN)) == {place for places in terms.values() for place in places}


def test_a_term_that_is_not_there():
    with pytest.raises(InvalidParameterError, match="without 'eyes'; there are reach of what"):
        without(get_domain("obstacle2d"), "eyes")
    with pytest.raises(InvalidParameterError, match="without 'eyes'; there is none"):
        without(get_domain("bowls"), "eyes")


def study(output, domain, *more):
    result = slap("study", "ablation", domain, "--output", output, *SMALL, *more)
    return result.exit_code, " ".join(result.stderr.split())


@pytest.mark.parametrize(
    ("domain", "more", "said"),
    [
        ("obstacle2d", ["--term", "eyes"], "no term 'eyes'"),
        ("obstacle2d", ["--steps", "0"], "--steps"),
        ("bowls", [], "does not say what in its learner's interface was made by hand"),
    ],
)
def test_what_cannot_be_studied_is_refused_before_anything_is_learned(tmp_path, domain, more, said):
    code, complaint = study(tmp_path, domain, *more)
    assert code != 0
    assert said in complaint
    assert not list(tmp_path.iterdir())


@pytest.mark.training
@pytest.mark.slow
@pytest.mark.timeout(180)  # explores, and trains twice
def test_a_study_that_was_killed_goes_on(tmp_path, monkeypatch):
    learn, learned = learning_attempt.learn, []

    def killed(attempt, **options):
        if learned:
            raise KeyboardInterrupt
        learned.append(attempt.distribution.domain.term)
        return learn(attempt, **options)

    def few(name, domain):
        own = training_settings(name, domain)
        return replace(own, exploration=replace(own.exploration, tasks=3), starts=30)

    monkeypatch.setattr(ablation, "training_settings", few)
    terms = ["--term", ablation.NOTHING, "--term", PLAIN]
    with monkeypatch.context() as patch:
        patch.setattr(learning_attempt, "learn", killed)
        assert study(tmp_path, "obstacle2d", *terms)[0] != 0
    assert not (tmp_path / "ablation_obstacle2d.json").exists()
    code, complaint = study(tmp_path, "obstacle2d")
    assert (code, learned) == (ErrorCode.INVALID_PARAMETER, [ablation.NOTHING])
    assert "go on with that command" in complaint

    def counted(attempt, **options):
        learned.append(attempt.distribution.domain.term)
        return learn(attempt, **options)

    monkeypatch.setattr(learning_attempt, "learn", counted)
    assert study(tmp_path, "obstacle2d", *terms)[0] == 0
    assert learned == [ablation.NOTHING, PLAIN]
    assert not [path for path in tmp_path.iterdir() if path.name.startswith(".")]
    found = json.loads((tmp_path / "ablation_obstacle2d.json").read_text())["found"]
    assert [row["without"] for row in found["terms"]] == [ablation.NOTHING, PLAIN]
    for row in found["terms"]:
        assert [len(training["slap"]) for training in row["trainings"]] == [1]
