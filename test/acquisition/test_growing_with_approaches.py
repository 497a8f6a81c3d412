# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Rounds of growth whose shortcuts begin with an approach: the hand goes behind a thing first."""

import json
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path

import pytest

from acquisition_node.training_request import TrainingRequest
from ensemble.acquisition_parameters import AcquisitionParameters
from slap_ros.api.growing import GrowthWatch, grow_rounds
from slap_ros.api.growth import GrowthRequest, GrowthRound, TriedShortcut
from slap_ros.api.growth_page import growth_page
from slap_ros.api.training import Unwatched, train
from slap_ros.domains import get_domain
from slap_ros.errors import ErrorCode
from slap_ros.learning.setting_changes import changed, parse_changes
from slap_ros.learning.task_distribution import TaskDistribution
from slap_ros.learning.work_folder import WorkFolder
from slap_ros.learning.workers import SequentialWorkers
from slap_ros.shortcuts import jobs
from slap_ros.shortcuts.approaches import APPROACHED
from slap_ros.shortcuts.candidate_groups import rank
from slap_ros.shortcuts.demonstrations import DemonstrationAttempt
from slap_ros.shortcuts.exploration_result import mean_operator_steps
from slap_ros.shortcuts.kept_shortcuts import NOTHING_KEPT
from slap_ros.shortcuts.named_settings import APPROACHES, training_settings
from slap_ros.shortcuts.settings import TrainingSettings
from slap_ros.shortcuts.shortcut import Shortcut
from slap_ros.shortcuts.shortcut_library import load_library
from slap_ros.shortcuts.shortcut_record import with_demonstrations
from slap_ros.shortcuts.training_steps import IN_VAIN, TrainingSteps
from slap_ros.skills.domain_choice import DomainChoice, open_domain
from support.slap_command import slap
from support.steady_skills import PICKING, write_library

pytestmark = pytest.mark.usefixtures("points_installed")
STARTS = 24
FEW = [
    f"starts={STARTS}", "validation=3", "shortcuts=1", "horizon=12", "exploration.tasks=2",
    "exploration.nodes=1", "exploration.length=8", "cloning.straightened=4",
    "cloning.total_steps=320",
]  # fmt: skip
BEHIND = "thing from behind"


class Interrupted(Unwatched):
    """Ctrl-C while shortcuts are demonstrated."""

    def on_progress(self, what, done, total):
        if (what, done) == ("straightening skills", 7):
            raise KeyboardInterrupt


def request(folder, **changes):
    given = {
        "domain": get_domain("points", "line"), "folder": folder / "grown",
        "keep": write_library(folder / "steady"), "skill_changes": ["rollouts=2", "validation=2"],
        "shortcut_settings": APPROACHES, "shortcut_changes": FEW, "steps": 100_000,
    }  # fmt: skip
    return GrowthRequest(**{**given, **changes})


@pytest.mark.training
def test_a_round_learns_what_training_with_approaches_does_interrupted_or_not(tmp_path):
    """And says what the shortcut begins with: in its library, in the round, and on the page."""
    asked = request(tmp_path)
    with pytest.raises(KeyboardInterrupt):
        grow_rounds(asked, watch=GrowthWatch(shortcuts=lambda: nullcontext(Interrupted())))
    grown = grow_rounds(asked)
    (tried,) = grown.rounds[0].tried
    assert tried.kept and tried.approaches == {BEHIND: STARTS}
    assert grown.rounds[0].length < 0.5 * grown.rounds[0].length_alone
    page = (asked.folder / "report.md").read_text()
    assert (
        f"steps; begins with an approach: {BEHIND} ({STARTS} of {STARTS} demonstrations)\n" in page
    )
    assert " --settings ours_approaches " in page
    choice = DomainChoice("points", "line", str(tmp_path / "steady"))
    made = train(open_domain(choice), tmp_path / "made", settings=APPROACHES, changes=FEW)
    library = load_library(asked.folder / "shortcuts", asked.domain)
    assert library.digest == made.digest and library.skills_digest == made.skills_digest
    (learned,), taken = library.shortcuts, library.record["environment_steps"]
    assert learned.record["found_by"] == [APPROACHED]
    assert learned.record["demonstrations"] == made.shortcuts[0].record["demonstrations"]
    assert taken["spent"] == taken["exploring"] + taken["learning"] == grown.rounds[0].steps
    assert GrowthRound.from_json(grown.rounds[0].as_json()) == grown.rounds[0]


def test_a_budget_below_a_round_is_refused_with_what_approaches_take(tmp_path):
    """By the command and, with the same parameter, by the node."""
    wanted = request(tmp_path)
    without = [*FEW, "exploration.approaches=0"]
    bare = request(tmp_path, shortcut_changes=without)
    thing = 20 + 8  # an approach, as a rule, and a push; there is one side to be at
    assert wanted.exploration_steps == bare.exploration_steps + 2 * thing == 72
    parameters = AcquisitionParameters(
        output=str(tmp_path), shortcut_settings=APPROACHES, shortcut_changes=" ".join(FEW)
    )
    asked = TrainingRequest(wanted.domain, "train", "", "", wanted.least_steps - 1, 0, None)
    for answer in (
        slap("grow", *asked.growth_arguments(parameters)),
        slap(
            "grow", "points", "--preset", "line", "--settings", APPROACHES, "--output", tmp_path,
            *(word for text in FEW for word in ("--set", text)), "--steps", asked.steps,
        ),
    ):  # fmt: skip
        assert answer.exit_code == ErrorCode.INVALID_PARAMETER, answer.output
        said = " ".join(answer.stderr.split())
        assert "of exploration usually take 72, and a shortcut usually takes 7184" in said
        assert f"give --steps {wanted.least_steps} or more" in said
    assert not (tmp_path / "grown").exists()


def steps_of_training(folder, settings):
    choice = DomainChoice("points", "line", str(folder / "steady"))
    distribution = TaskDistribution(DomainChoice.opened_as(open_domain(choice)), 0)
    work = WorkFolder(folder / "work")
    return TrainingSteps(
        distribution, settings, work, SequentialWorkers(), Unwatched(), NOTHING_KEPT
    )


@pytest.fixture
def settings():
    domain = get_domain("points", "line")
    return changed(training_settings(APPROACHES, domain), parse_changes(FEW, TrainingSettings))


def test_demonstrations_are_as_many_as_can_be_paid_whatever_they_take(tmp_path, settings):
    """The first ones are those that would be made with more to spend."""
    write_library(tmp_path / "steady")
    steps = steps_of_training(tmp_path, settings)
    explored = steps.explore()
    group = rank(explored)[0]
    assert group.found_by == (APPROACHED,)
    starts = steps.starts(group, mean_operator_steps(explored))
    file = tmp_path / "work" / group.signature.name / "demonstrations.json"
    made = {}
    for left in (0, 1_300, 1_500, 1_700, float("inf")):
        made[left] = steps.demonstrations(group, starts, left)
        file.unlink()
        assert sum(one.total_steps(settings.cloning.repetitions) for one in made[left]) <= left
        assert {one.shown.approach for one in made[left]} <= {BEHIND}
    numbers = [len(each) for each in made.values()]
    assert numbers == sorted(numbers)
    assert 0 == numbers[0] < numbers[2] < numbers[3] <= numbers[-1] == STARTS
    assert made[1_500] == made[float("inf")][: numbers[2]]


def test_steps_from_starts_in_which_nothing_shows_it_are_counted(tmp_path, settings):
    """A push of one step leads nowhere; all approaches are tried in vain."""
    write_library(tmp_path / "steady")
    steps = steps_of_training(tmp_path, settings)
    explored = steps.explore()
    group = rank(explored)[0]
    start, *_ = steps.starts(group, mean_operator_steps(explored))
    attempts = [
        DemonstrationAttempt.from_json(
            jobs.demonstration(steps.distribution, start, group.signature, 4, push=push)
        )
        for push in (8, 1)
    ]
    shown, failed = attempts
    assert shown.shown is not None and failed.shown is None
    assert shown.environment_steps > 0 < failed.environment_steps
    assert DemonstrationAttempt.from_json(shown.as_json()) == shown
    assert DemonstrationAttempt.from_json(None) == DemonstrationAttempt(None, 0)  # not counted then
    learned = Shortcut(group.signature, PICKING.policy, 3, {"environment_steps": 100})
    record = with_demonstrations(learned, attempts, 5).record
    both = shown.environment_steps + failed.environment_steps + 5 * len(shown.shown.actions)
    assert record["environment_steps"] == 100 + both
    assert record["demonstrations"]["environment_steps"] == both
    assert record["demonstrations"]["number"] == record["demonstrations"]["approaches"][BEHIND] == 1


def test_a_shortcut_that_nothing_shows_is_given_up_before_all_starts_are_tried(tmp_path, settings):
    write_library(tmp_path / "steady")
    steps = steps_of_training(tmp_path, settings)
    explored = steps.explore()
    group = rank(explored)[0]
    starts = steps.starts(group, mean_operator_steps(explored))
    no_push = replace(settings, exploration=replace(settings.exploration, length=1))
    attempts = steps_of_training(tmp_path, no_push).demonstrations(group, starts)
    assert len(starts) == STARTS > len(attempts) == IN_VAIN
    assert all(one.shown is None and one.environment_steps > 0 for one in attempts)


def test_growth_without_approaches_is_written_as_before():
    """In what a round keeps, and on the page."""
    tried = TriedShortcut("At-1", 20.0, 10.0, True)
    assert tried.as_json() == {"name": "At-1", "before": 20.0, "after": 10.0, "kept": True}
    one = GrowthRound(("Pick",), "1", 1.0, "nothing fails", 20.0, 10.0, (tried,), 1, 1)
    asked = GrowthRequest(get_domain("points", "line"), Path("grown"))
    assert "approaches" not in asked.training.as_json()["exploration"]
    assert "\n- At-1: 20.0 steps → 10.0 steps\n" in growth_page(asked, [one], 0, "")
    begun = replace(one, tried=(replace(tried, approaches={BEHIND: 2, "thing": 1}),))
    assert json.loads(json.dumps(begun.as_json()))["tried"][0]["approaches"] == {
        BEHIND: 2, "thing": 1
    }  # fmt: skip
    page = growth_page(asked, [begun], 0, "")
    assert f"an approach: {BEHIND} (2 of 3 demonstrations), thing (1)\n" in page
