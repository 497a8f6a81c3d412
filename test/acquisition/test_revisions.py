# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A model is told how a skill failed, and what it changes is learned again."""

import json
from dataclasses import replace
from types import SimpleNamespace

import pytest

from slap_ros.acquisition.curriculum.curriculum import Curriculum
from slap_ros.acquisition.curriculum.task_source import TaskSource
from slap_ros.acquisition.proposals.attempt_log import AttemptLog
from slap_ros.acquisition.proposals.inquiry import Inquiry
from slap_ros.acquisition.proposals.problem import AcquisitionProblem
from slap_ros.acquisition.proposals.proposal_request import ProposalRequest
from slap_ros.acquisition.proposals.revision import Reviser
from slap_ros.acquisition.training.sac_settings import SacSettings
from slap_ros.acquisition.training.settings import AcquisitionSettings
from slap_ros.api.acquisition import UnwatchedCurriculum
from slap_ros.api.acquisition_request import AcquisitionRequest
from slap_ros.api.proposers import Proposers
from slap_ros.api.revisions import Revisions
from slap_ros.errors import InvalidParameterError
from slap_ros.learning.workers import SequentialWorkers
from slap_ros.skills.operator_json import operator_data
from support.model_answers import LIMITS, SETTINGS, good_script
from support.points import PICK, POINTS, PUT
from support.scripted_server import serving

pytestmark = pytest.mark.usefixtures("points_installed")
TASK = POINTS.task(0)
PRINTED = SimpleNamespace(problem=AcquisitionProblem.of_task(POINTS, TASK), operators=(PICK, PUT))
WRITTEN = ProposalRequest.of_task(POINTS, TASK, "manual", "manual").propose()
ASKED = ProposalRequest.of_task(POINTS, TASK, "language", "language")
OTHER = json.dumps({"terms": [{"metric": "dis_to_obj", "arguments": ["?thing"], "weight": 0.25}]})
FAILURE = {
    "why": "no progress",
    "states": 40,
    "ends": {"effect not reached": 37, "something else disturbed": 3},
    "atoms": {"Holding(thing0)": 37},
    "metrics": {"dis_to_obj(?thing)": 0.125},
}
STUCK = AcquisitionSettings(
    SacSettings(
        net_arch=(32, 32),
        batch_size=64,
        learning_rate=1e-12,
        gamma=0.9,
        tau=0.02,
        learning_starts=192,
    ),
    rollouts=12,
    validation=12,
    judged=24,
    segment_episodes=4,
    skill_steps=800,
    total_steps=60_000,
    patience=1,
)
LEARNING = replace(STUCK, skill_steps=4_000, patience=3, sac=replace(STUCK.sac, learning_rate=2e-3))


def revised(server, failures):
    settings = replace(SETTINGS, base_url=server.url)
    inquiry = Inquiry.opened(settings, "live", LIMITS, AttemptLog())
    return Reviser(ASKED, inquiry).revise(WRITTEN, failures)


def test_a_model_is_told_how_it_failed_and_what_it_changes_counts():
    with serving(good_script(PRINTED, reward_of_Pick=[OTHER])) as server:
        proposal = revised(server, {"Pick": FAILURE})
        said = [request["messages"][-1]["content"] for request in server.requests]
        before = [request["messages"][-2]["content"] for request in server.requests]
    assert [server.asked(f"{what} Pick") for what in ("operator", "reward of")] == [1, 1]
    assert json.loads(before[0]) == operator_data(PICK)
    for text in said:
        assert "37 times effect not reached, 3 times something else disturbed" in text
        assert "wrong in the end, most often: Holding(thing0)" in text
        assert "dis_to_obj(?thing) = 0.125" in text
    assert str(proposal.rewards["Pick"]) == "Pick: 0.25 dis_to_obj(?thing)"
    assert proposal.rewards["Put"] == WRITTEN.rewards["Put"]
    assert proposal.operators == WRITTEN.operators


def test_an_operator_without_which_there_is_no_plan_is_not_taken():
    hand_empty = {"predicate": "HandEmpty", "arguments": []}
    loose = {"predicate": "Loose", "arguments": ["?thing"]}
    effects = {"preconditions": [hand_empty], "delete_effects": [], "add_effects": [loose]}
    dropping = json.dumps(operator_data(PICK) | effects)
    with serving(good_script(PRINTED, Pick=[dropping])) as server:
        proposal = revised(server, {"Pick": FAILURE})
    assert proposal.operators == WRITTEN.operators


@pytest.mark.slow
@pytest.mark.training
@pytest.mark.timeout(180)  # learns two skills
def test_what_was_given_up_is_learned_and_told(tmp_path, monkeypatch):
    """Nothing is learned at first, with weights that hardly change; then with others."""
    monkeypatch.setenv("OPENAI_API_KEY", "none")
    learned = []

    def learn(proposal, folder, settings, kept):
        learned.append((folder, set(kept), settings.total_steps))
        source = TaskSource.of(POINTS, "train", 1, proposal.operators, proposal.rewards)
        chosen = LEARNING if len(learned) > 1 else STUCK
        chosen = replace(chosen, total_steps=settings.total_steps)
        workers, nobody = SequentialWorkers(), UnwatchedCurriculum()
        return Curriculum(source, chosen, folder, workers, nobody, kept=dict(kept)).run()

    with serving(good_script(PRINTED)) as server:
        request = AcquisitionRequest(
            POINTS,
            tmp_path / "library",
            tmp_path / "work",
            Proposers("language", model="scripted", base_url=server.url),
            rewarder="language",
            revise=True,
        )
        first = learn(WRITTEN, request.work_folder, STUCK, {})
        revisions = Revisions(request, STUCK, 480, learn, lambda _: None, print)
        library = revisions.carry_out(WRITTEN, first)
        asked = len(server.requests)
        again = revisions.carry_out(WRITTEN, first)
        assert len(server.requests) == asked  # what was answered is in the work folder
    assert set(first.record["left"]) == {"Pick"}
    told = library.record["revisions"]
    assert told[0]["left"] == first.record["left"]
    assert set(told[0]["left"]["Pick"]["metrics"]) == {
        f"{term.metric}(?thing)" for term in WRITTEN.rewards["Pick"].terms
    }
    assert library.record["progress_on_fresh_tasks"] >= 0.9
    assert library.record["steps"] == first.record["steps"] + sum(one["steps"] for one in told)
    assert learned[1][2] == STUCK.total_steps - first.record["steps"]
    assert again.digest == library.digest
    assert again.record["revisions"] == told


def test_nobody_but_a_model_is_asked_to_revise(tmp_path):
    with pytest.raises(InvalidParameterError, match="--revise is for --proposer language"):
        AcquisitionRequest(POINTS, tmp_path / "library", tmp_path / "work", revise=True)
