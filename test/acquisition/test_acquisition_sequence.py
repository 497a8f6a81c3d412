# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""One goal after another: what is known is kept and used, and what was forgotten would show."""

import json
from contextlib import nullcontext, suppress
from dataclasses import replace

import pytest

from slap_ros.acquisition.curriculum import jobs
from slap_ros.acquisition.training.continued_training import earlier_starts
from slap_ros.acquisition.training.skill_training import rounds_in
from slap_ros.api import acquisition_sequence
from slap_ros.api.acquisition import AcquisitionWatch, UnwatchedCurriculum, acquirable
from slap_ros.api.acquisition_request import AcquisitionRequest
from slap_ros.api.acquisition_sequence import acquire_sequence
from slap_ros.api.sequence_request import SequenceRequest
from slap_ros.skills.skill_library import load_skill_library
from support.points import POINTS
from support.slap_command import slap

pytestmark = pytest.mark.usefixtures("points_installed", "in_this_process")
SETTINGS = (
    "rollouts=6", "validation=6", "judged=12", "segment_episodes=4", "skill_steps=2000",
    "sac.net_arch=32,32", "sac.batch_size=64", "sac.learning_rate=0.002", "sac.gamma=0.9",
    "sac.tau=0.02", "sac.learning_starts=192",
)  # fmt: skip
UNWATCHED = AcquisitionWatch(tell=lambda _: None)
BUDGET = [*(word for one in SETTINGS for word in ("--set", one)), "--steps", 6_000, "--tasks", 4]


def sequence(*arguments):
    command = ["acquire-sequence", "points", "--jobs", 1, "--json", *arguments]
    return slap(*command)


@pytest.mark.training
@pytest.mark.slow
@pytest.mark.timeout(300)  # learns two skills to their end
def test_a_second_goal_is_learned_with_the_skills_of_the_first(tmp_path, monkeypatch):
    """Both goals need the same skills: the second costs next to nothing, and nothing is lost."""
    asked = ("--output", tmp_path / "library", *BUDGET)
    ran = sequence(*asked)
    assert ran.exit_code == 0, ran.output
    (steps,) = json.loads(ran.stdout)["seeds"].values()
    first, second = steps
    assert [step["goal"] for step in steps] == ["train", "swapped"]
    assert first["steps"] > 0
    assert set(first["learned"]) == {"Pick", "Put"}
    assert list(second["tried"]) == ["train", "swapped"]
    assert second["steps"] <= 0.5 * first["steps"]
    assert second["solved"]["train"] >= first["solved"]["train"] - 0.25
    assert first["retrieved"] == {}
    assert set(second["retrieved"]) == set(second["learned"])
    record = json.loads((tmp_path / "library" / "library.json").read_text())
    made_by = record["sequence"].pop("command")
    assert made_by.startswith("slap acquire-sequence points --preset")
    assert record["sequence"] == {
        "scratch": False, "relearn": False, "goals": steps, "to_come": []
    }  # fmt: skip
    monkeypatch.setattr(jobs, "learn", None)  # nothing is learned when it is asked for again
    assert json.loads(sequence(*asked).stdout) == json.loads(ran.stdout)
    other = sequence(*asked, "--scratch")
    assert other.exit_code != 0
    assert "other settings" in " ".join(other.stderr.split())


TINY = (
    "rollouts=2", "validation=2", "skill_steps=200", "segment_episodes=2", "sac.net_arch=8,8",
    "sac.learning_starts=96", "warm_start.critic_updates=10",
)  # fmt: skip


class Interrupted(UnwatchedCurriculum):
    """Interrupts each step of an acquisition once, after its first job: judging, trying, learning.

    Args:
        before: Names of the steps that were interrupted before.
    """

    def __init__(self, before):
        self.before = before

    def on_progress(self, what, done, total):
        if done and (what, total) not in self.before:
            self.before.add((what, total))
            raise KeyboardInterrupt


@pytest.mark.training
def test_a_sequence_interrupted_within_its_goals_ends_as_one_that_was_not(tmp_path, monkeypatch):
    """Whatever had ended is not done again, and all files are the same to the byte."""
    asked = tiny(tmp_path / "whole" / "library", relearn=True)
    whole = acquire_sequence(asked, None, None, UNWATCHED)
    tried, interrupted = [], set()
    original = acquisition_sequence.try_goal
    monkeypatch.setattr(
        acquisition_sequence, "try_goal", lambda *given: (tried.append(given), original(*given))[1]
    )
    watch = replace(UNWATCHED, curriculum=lambda: nullcontext(Interrupted(interrupted)))
    steps = None
    while steps is None:
        with suppress(KeyboardInterrupt):
            asked = tiny(tmp_path / "cut" / "library", relearn=True)
            steps = acquire_sequence(asked, None, None, watch)
    assert steps == whole
    names = {what for what, _ in interrupted}
    assert {"carrying out plans", "learning skills", "trying all goals"} <= names
    assert [goal for _, goal, _ in tried] == ["train", "swapped"]  # the skills stay as they are
    assert files(tmp_path / "cut") == files(tmp_path / "whole")
    first, second, again = (
        rounds_in(tmp_path / "whole" / "library-training" / goal / "training" / "Pick")
        for goal in ("0-train", "1-swapped", "1-swapped/again-train")
    )
    for further in (second, again):  # its training went on
        assert further[: len(first)] == first
        assert len(further) > len(first)
    assert whole[1].again == {"train": whole[0].steps}  # the budget: none of its tasks were solved
    earlier = tmp_path / "whole" / "library-training" / "0-train" / "training" / "Pick"
    rehearsed = earlier_starts(earlier, POINTS.types_by_name, 3)
    assert len(rehearsed) == len({start.state.data.tobytes() for start in rehearsed}) == 2  # tasks


def files(folder):
    """What is kept, by name, but for checkpoints, which have more than what follows from them."""
    paths = [path for path in folder.rglob("*") if path.is_file() and path.suffix != ".pt"]
    return {str(path.relative_to(folder)): path.read_bytes() for path in paths}


@pytest.mark.training
def test_each_goal_leaves_a_library_of_the_sequence_so_far(tmp_path):
    """So what is known of a sequence can be used before its end."""
    folder, begun = tmp_path / "library", []

    def stop(number, goal):
        begun.append((number, goal))
        if number == 1:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        acquire_sequence(tiny(folder), None, None, UNWATCHED, stop)
    assert begun == [(0, "train"), (1, "swapped")]
    sequence = load_skill_library(folder, POINTS).record["sequence"]
    assert [step["goal"] for step in sequence["goals"]] == ["train"]
    assert sequence["to_come"] == ["swapped"]
    assert sequence["command"].startswith("slap acquire-sequence points --preset")
    assert "--steps 200 --set rollouts=2 --set validation=2" in sequence["command"]


@pytest.mark.training
def test_from_scratch_no_goal_begins_with_what_another_learned(tmp_path):
    work = tmp_path / "library-training"
    steps = acquire_sequence(tiny(tmp_path / "library", scratch=True), None, None, UNWATCHED)
    assert [step.retrieved for step in steps] == [{}, {}]
    rounds = [rounds_in(work / goal / "training" / "Pick") for goal in ("0-train", "1-swapped")]
    assert [len(of_goal) for of_goal in rounds] == [1, 1]
    assert load_skill_library(tmp_path / "library", POINTS).record["sequence"]["scratch"]


@pytest.mark.parametrize(
    ("changes", "solved"), [(("patience=3",), 0.8), (("solved=0.9", "patience=3"), 0.9)]
)
def test_a_goal_is_done_at_the_papers_share_unless_it_is_said_otherwise(tmp_path, changes, solved):
    asked = tiny(tmp_path)
    asked = replace(asked, acquisition=replace(asked.acquisition, changes=changes))
    settings = asked.acquisition_of("swapped", tmp_path, None).chosen_settings()
    assert (settings.solved, settings.patience) == (solved, 3)


def tiny(folder, **options):
    """A sequence in which hardly anything is learned."""
    acquisition = AcquisitionRequest(
        acquirable("points", None),
        folder,
        folder.parent / f"{folder.name}-training",
        changes=TINY,
        steps=200,
    )
    return SequenceRequest(acquisition, ("train", "swapped"), tasks=2, **options)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--goal", "train"), "a sequence has two goals at least"),
        (("--goal", "train", "--goal", "train"), "stands twice"),
        (("--seeds", 0), "--seeds"),
        (("--steps", 10), "too few to learn anything"),
        (("--scratch", "--relearn"), "leave out --scratch or --relearn"),
        (("--set", "sac.magic=1"), "sac.magic"),
    ],
)
def test_what_is_no_sequence_is_refused_at_the_door(tmp_path, arguments, said):
    ran = sequence("--output", tmp_path / "library", *arguments)
    assert ran.exit_code != 0
    assert said in " ".join(ran.stderr.split())
    assert not list(tmp_path.iterdir())
