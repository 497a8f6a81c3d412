# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Warm starts: a good skill survives its first updates, and a useless one begins nothing."""

import json
from dataclasses import replace

import numpy as np
import pytest
import torch

from slap_ros.acquisition.curriculum.curriculum import Curriculum
from slap_ros.acquisition.curriculum.solved_shares import Point
from slap_ros.acquisition.curriculum.task_source import TaskSource
from slap_ros.acquisition.training.episodes import load_episodes, save_episodes
from slap_ros.acquisition.training.guided_sac import Guide, GuidedSac
from slap_ros.acquisition.training.sac import SkillLearner
from slap_ros.acquisition.training.sac_settings import SMALL
from slap_ros.acquisition.training.settings import AcquisitionSettings
from slap_ros.acquisition.training.skill_env import SkillMdp, SkillVecEnv
from slap_ros.acquisition.training.warm_start import ChosenStart, TriedStart, WarmStart
from slap_ros.acquisition.training.warm_start_settings import WarmStartSettings
from slap_ros.api.acquisition import UnwatchedCurriculum
from slap_ros.cli.skills import beginning
from slap_ros.errors import InvalidParameterError
from slap_ros.learning.workers import SequentialWorkers
from slap_ros.skills.groundings import Groundings
from slap_ros.skills.reward import SkillReward
from slap_ros.skills.skill_library import AcquiredSkill
from slap_ros.studies.lg_sail.warm_start import StartComparison
from support.marks import slow
from support.points import HORIZON, INTERFACE, PICK, POINTS, REWARDS, begin
from support.slap_command import slap
from support.steady_skills import PICKING, towards, write_library

pytestmark = pytest.mark.usefixtures("points_installed")
SAC = replace(SMALL, net_arch=(4,), critic_net_arch=(32, 32), learning_starts=192)
WARM = WarmStartSettings(
    acting=0.75, critic_updates=200, cloning=0.5, cloning_steps=1_000, noise=0.4, entropy=0.2
)
UNPROTECTED = WarmStartSettings(acting=0.0, critic_updates=0, noise=1.0, entropy=1.0)
STARTS, FRESH = begin(PICK, range(20)), begin(PICK, range(20, 40))
MDP = SkillMdp(
    POINTS,
    SkillReward(PICK, REWARDS["Pick"], INTERFACE),
    Groundings(list(dict.fromkeys(one.grounding for one in STARTS))),
)
USELESS = AcquiredSkill(PICK, REWARDS["Pick"], towards(0, False, gain=-2.5), HORIZON)  # flees


def learner(first_round=0):
    return SkillLearner(SkillVecEnv(MDP, STARTS, 8, HORIZON, (1,), first_round), SAC, 1)


def success(policy):
    env = SkillVecEnv(MDP, FRESH, len(FRESH), HORIZON, (9,))
    for _ in range(HORIZON):
        env.step(policy.mean(env.observations))
    return env.succeeded.mean()


def actor(one):
    """The policy as it is now, not its average, which hides what updates do for a while."""
    sac = one._sac
    for name, value in sac.actor.state_dict().items():
        sac.averaged[name].copy_(value)
    return one.policy()


@pytest.mark.slow
@pytest.mark.training
def test_a_good_skill_is_destroyed_without_protection_and_not_with_it():
    worst = {}
    for settings in (UNPROTECTED, WarmStartSettings(), WARM):
        one = learner()
        one.begin_with(PICKING.policy, settings)
        assert success(actor(one)) >= 0.9
        found = []
        for _ in range(6):
            one.learn(1)
            found.append(success(actor(one)))
        worst[settings] = min(found)
    assert worst[UNPROTECTED] <= 0.5
    assert worst[WarmStartSettings()] >= 0.8
    assert worst[WARM] >= 0.9


@pytest.mark.training
@pytest.mark.parametrize("rounds", [1, *slow(3)])  # before the first update, and after it
def test_a_warm_start_that_is_resumed_ends_with_the_same_weights(tmp_path, rounds):
    whole = learner()
    whole.begin_with(PICKING.policy, WARM)
    save_episodes(tmp_path / "episodes", whole.learn(rounds))
    whole.save(tmp_path / "checkpoint.pt")
    whole.learn(3)
    resumed = learner(first_round=rounds)
    resumed.begin_with(PICKING.policy, WARM)
    episodes = [load_episodes(tmp_path / "episodes", POINTS.types_by_name)]
    resumed.resume(tmp_path / "checkpoint.pt", episodes)
    resumed.learn(3)
    own, other = (one._sac.policy.state_dict() for one in (whole, resumed))
    assert all(torch.equal(own[name], other[name]) for name in own)


@pytest.mark.training
def test_a_warm_start_without_protection_is_the_known_weights_and_nothing_else():
    """To the bit, so that a warm training of earlier versions can be made again."""
    learned = []
    for guided in (True, False):
        one = learner()  # which seeds torch
        one.begin_with(PICKING.policy, UNPROTECTED)
        if not guided:
            one._sac.guide = None
        one.learn(3)
        learned.append(one._sac.policy.state_dict() | {"entropy": one._sac.log_ent_coef})
    found, expected = learned
    assert all(torch.equal(found[name], expected[name]) for name in expected)


def test_the_known_skill_acts_in_its_share_of_the_environments_and_its_pull_fades():
    shares = [GuidedSac._guided(8, share).sum() for share in (0.0, 0.25, 0.75, 1.0)]
    assert shares == [0, 2, 6, 8]
    guide = Guide.of(PICKING.policy, replace(WARM, cloning=0.5))
    weights = [guide.cloning(steps) for steps in (0, 500, 1_000, 9_000)]
    assert weights == [0.5, 0.25, 0.0, 0.0]
    observed = MDP.observe(*_rows())
    acted = guide(torch.from_numpy(observed)).numpy()
    assert acted == pytest.approx(PICKING.policy.mean(observed), abs=1e-4)


def _rows():
    groundings = MDP.groundings
    states = np.stack([one.state.data for one in STARTS])
    return groundings.rows(states), np.array([groundings.number(o.grounding) for o in STARTS])


def test_impossible_settings_are_refused():
    for wrong in ({"acting": 1.5}, {"acting": -0.1}, {"entropy": 0.0}):
        with pytest.raises(InvalidParameterError, match="give a share from 0 to 1"):
            WarmStartSettings(**wrong)


def test_the_best_start_wins_the_nearer_one_of_equals_and_none_where_none_is_worth_it():
    near, far = (WarmStart(name, 0.5, PICKING.policy) for name in ("near", "far"))
    for successes, winner in (
        ((0.2, 0.6), far),
        ((0.6, 0.6), near),
        ((0.05, 0.0), None),
    ):
        tried = [TriedStart(s, rate) for s, rate in zip((near, far), successes, strict=True)]
        chosen = ChosenStart.among(tried, 0.1)
        assert chosen.start is winner
        assert chosen.tried == tuple(tried)


SHORT = AcquisitionSettings(
    SAC, rollouts=3, validation=3, segment_episodes=4, skill_steps=400, total_steps=400
)


def acquire(folder, known):
    source = TaskSource.of(POINTS, "train", 1, POINTS.acquisition.operators, REWARDS)
    workers, callback = SequentialWorkers(), UnwatchedCurriculum()
    library = Curriculum(source, SHORT, folder, workers, callback, known).run()
    return {skill.operator.name: skill.record["began_with"] for skill in library.skills}


@pytest.mark.training
def test_known_skills_are_tried_and_the_record_says_how_they_did(tmp_path):
    """Both do the same by their keys; only trials tell them apart."""
    begun = acquire(tmp_path / "both", {"a/useless": USELESS, "b/useful": PICKING})
    first, second = begun["Pick"]["tried"]
    assert (first["success"], second["success"]) == (0.0, 1.0)
    assert begun["Pick"]["skill"] == PICKING.folder_name
    assert begun["Pick"]["success"] == 1.0
    assert acquire(tmp_path / "both", {"a/useless": USELESS, "b/useful": PICKING}) == begun


@pytest.mark.training
def test_where_no_known_skill_is_worth_it_the_skill_is_learned_from_scratch(tmp_path):
    begun = acquire(tmp_path / "one", {"a/useless": USELESS})
    assert list(begun["Pick"]) == ["tried"]
    said = f"random weights (success at once: {USELESS.folder_name} 0.00)"
    assert beginning(begun["Pick"]) == said
    assert acquire(tmp_path / "none", {})["Pick"] == {}
    stored = {n: json.loads((tmp_path / n / "settings.json").read_text()) for n in ("one", "none")}
    assert "warm_start" in stored["one"]
    assert "warm_start" not in stored["none"]  # so folders of earlier versions can still be read


def study(*arguments):
    pytest.importorskip("matplotlib")
    command = ["study", "warm_start", "points", *arguments]
    return slap(*command)


@pytest.mark.slow
@pytest.mark.training
def test_the_study_counts_the_steps_of_both_and_is_read_again(tmp_path):
    library = write_library(tmp_path / "known", PICKING)
    settings = (
        "sac.net_arch=4", "sac.learning_starts=192", "segment_episodes=4", "rollouts=3",
        "warm_start.critic_updates=10",
    )  # fmt: skip
    arguments = [
        *("--from", library, "--seeds", 1, "--steps", 400, "--output", tmp_path / "out"),
        *(word for one in (*settings, "validation=3") for word in ("--set", one)),
    ]
    ran = study(*arguments)
    assert ran.exit_code == 0, ran.output
    path = tmp_path / "out" / "warm_start_points.json"
    found = json.loads(path.read_text())["found"]
    pick = next(one for one in found["comparisons"] if one["of"] == "Pick")
    assert pick["steps"]["warm"] == [0]  # the known skill does it at once
    assert min(pick["steps"]["scratch"]) > 0
    assert pick["ratio"] == 0.0
    assert set(found["trainings"]) == {"scratch 0", "warm 0"}
    assert "Pick" in (tmp_path / "out" / "warm_start_points.md").read_text()
    assert not list((tmp_path / "out").glob(".warm_start_points-*/"))
    before = path.read_text()
    assert study(*arguments).exit_code == 0
    assert json.loads(path.read_text())["found"] == json.loads(before)["found"]


NEVER, LATE, AT_ONCE = (
    (Point(0, first), Point(600, last)) for first, last in ((0.0, 0.7), (0.0, 0.9), (0.9, 0.5))
)


@pytest.mark.parametrize(
    ("scratch", "warm", "ratio", "is_bound"),
    [
        ((LATE, LATE), (LATE, AT_ONCE), 0.5, False),
        ((LATE, NEVER), (LATE, AT_ONCE), 0.5, True),  # it would have taken more steps
        ((NEVER, NEVER), (NEVER, AT_ONCE), None, True),  # and here, nobody knows
        ((AT_ONCE, AT_ONCE), (AT_ONCE, AT_ONCE), None, False),
    ],
)
def test_steps_compare_only_where_they_were_counted_to_the_end(scratch, warm, ratio, is_bound):
    found = StartComparison("Pick", scratch, warm).as_json()
    assert (found["ratio"], found["ratio_is_bound"]) == (ratio, is_bound)
    assert (found["ratio_interval"] is None) == (ratio is None)
    assert found["last"]["warm"] == [one[-1].success for one in warm]


def test_the_study_wants_a_library(tmp_path):
    ran = study("--output", tmp_path)
    assert ran.exit_code != 0
    assert "--from FOLDER" in " ".join(ran.stderr.split())
    ran = study("--from", tmp_path / "none", "--output", tmp_path)
    assert ran.exit_code != 0
    assert "no such folder" in " ".join(ran.stderr.split())
