# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""One goal after another: what is known is kept and used, and what was forgotten would show."""

import json

import pytest
from typer.testing import CliRunner

from slap_ros.acquisition.curriculum import jobs
from slap_ros.api.acquisition import AcquisitionWatch, acquirable
from slap_ros.api.acquisition_request import AcquisitionRequest
from slap_ros.api.acquisition_sequence import SequenceRequest, acquire_sequence
from slap_ros.cli import app
from slap_ros.skills.skill_library import load_skill_library
from support.points import POINTS

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
    return CliRunner().invoke(app, [str(argument) for argument in command])


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
    assert record["sequence"] == {"scratch": False, "goals": steps}
    monkeypatch.setattr(jobs, "learn", None)  # nothing is learned when it is asked for again
    assert json.loads(sequence(*asked).stdout) == json.loads(ran.stdout)
    other = sequence(*asked, "--scratch")
    assert other.exit_code != 0
    assert "other settings" in " ".join(other.stderr.split())


TINY = (
    "rollouts=2", "validation=2", "skill_steps=200", "segment_episodes=2", "sac.net_arch=8,8",
    "sac.learning_starts=96", "warm_start.critic_updates=10",
)  # fmt: skip


@pytest.mark.training
def test_an_interrupted_sequence_ends_as_one_that_was_not(tmp_path):
    """Goal by goal it says where it is, and what it found is the same to the bit."""
    begun = []

    def stop(number, goal):
        begun.append((number, goal))
        if number == 1 and len(begun) == 2:
            raise KeyboardInterrupt

    whole = acquire_sequence(tiny(tmp_path / "whole"), None, None, UNWATCHED)
    with pytest.raises(KeyboardInterrupt):
        acquire_sequence(tiny(tmp_path / "cut"), None, None, UNWATCHED, stop)
    assert acquire_sequence(tiny(tmp_path / "cut"), None, None, UNWATCHED, stop) == whole
    assert begun == [(0, "train"), (1, "swapped")] * 2
    found = [load_skill_library(tmp_path / name, POINTS).digest for name in ("whole", "cut")]
    assert found[0] == found[1]


def tiny(folder):
    """A sequence in which hardly anything is learned."""
    acquisition = AcquisitionRequest(
        acquirable("points", None),
        folder,
        folder.parent / f"{folder.name}-training",
        changes=TINY,
        steps=200,
    )
    return SequenceRequest(acquisition, ("train", "swapped"), tasks=2)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--goal", "train"), "a sequence has two goals at least"),
        (("--goal", "train", "--goal", "train"), "stands twice"),
        (("--seeds", 0), "--seeds"),
        (("--steps", 10), "too few to learn anything"),
        (("--set", "sac.magic=1"), "sac.magic"),
    ],
)
def test_what_is_no_sequence_is_refused_at_the_door(tmp_path, arguments, said):
    ran = sequence("--output", tmp_path / "library", *arguments)
    assert ran.exit_code != 0
    assert said in " ".join(ran.stderr.split())
    assert not list(tmp_path.iterdir())
