# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Baselines: what they learn from, what is kept of them, and how they are put beside planning."""

import json
import shutil
import sys

import numpy as np
import pytest
import torch
from gymnasium import spaces
from typer.testing import CliRunner

from ensemble.cli.application import app
from slap_ros.api.baselines import train_baseline
from slap_ros.baselines.hindsight_buffer import HindsightBuffer
from slap_ros.baselines.option_rollouts import OptionRolloutBuffer
from slap_ros.baselines.sac import REPLAY
from slap_ros.baselines.trained_baseline import load_baseline
from slap_ros.baselines.training_envs import joined_envs, separate_envs
from slap_ros.baselines.trials import try_baseline
from slap_ros.domains import get_domain
from slap_ros.environments.registration import make_task_env
from slap_ros.errors import ErrorCode, InvalidLibraryError, InvalidParameterError, NoSkillsError
from support.marks import slow

SHORT = {"n_envs": 2, "n_steps": 32, "batch_size": 32, "n_epochs": 1, "validation": 1}

EVALUATE = ["evaluate", "obstacle2d", "--preset", "paper", "--seeds", "1", "--shortcuts", "none"]
IMPOSSIBLE = "(and (On block1 table) (On block1 target))"


@pytest.fixture(scope="module")
def domain():
    return get_domain("obstacle2d", "paper")


@pytest.fixture(scope="module")
def trained(tmp_path_factory, domain):
    folder = tmp_path_factory.mktemp("baselines") / "ppo"
    train_baseline("ppo", domain, folder, steps=256, changes=SHORT)
    return folder


def slap(*arguments):
    result = CliRunner().invoke(app, list(map(str, arguments)))
    return result.exit_code, result.stdout, " ".join(result.stderr.split())


# -- what they learn from -------------------------------------------------------------------------


def test_tasks_stepped_together_are_those_stepped_one_by_one():
    """Of three different sets of objects, and over the ends of episodes."""
    joined, separate = (
        make(lambda: make_task_env("obstacle2d", "fair"), 7, 5)
        for make in (joined_envs, separate_envs)
    )
    one, other = joined.make(), separate.make()
    assert np.array_equal(one.reset(), other.reset())
    rng = np.random.default_rng(0)
    for _ in range(120):
        actions = rng.uniform(-1.0, 1.0, (5, 3)).astype(np.float32)
        seen, rewards, dones, infos = one.step(actions)
        same, rewarded, ended, told = other.step(actions)
        assert np.array_equal(seen, same)
        assert np.array_equal(rewards, rewarded)
        assert np.array_equal(dones, ended)
        for i in np.flatnonzero(dones):
            for key in ("terminal_observation", "TimeLimit.truncated"):
                assert np.array_equal(infos[i][key], told[i][key])
    assert joined.tally.steps == separate.tally.steps == 600
    assert joined.tally.episodes == separate.tally.episodes >= 10


class Goals:
    """Stands for the environments, of which the buffer asks rewards alone."""

    def env_method(self, name, achieved, desired, infos, indices):
        return [np.where((achieved >= desired).all(axis=-1), 0.0, -1.0)]


def test_hindsight_gives_goals_that_are_still_to_be_achieved_and_end_there():
    space = spaces.Dict(
        {
            name: spaces.Box(0.0, 1.0, (3,), np.float32)
            for name in ("achieved_goal", "desired_goal", "observation")
        }
    )
    buffer = HindsightBuffer(100, space, spaces.Box(-1.0, 1.0, (1,)), Goals(), device="cpu")
    np.random.seed(0)  # noqa: NPY002 -- stable-baselines3 samples with it
    atoms = np.array([[1, 0, 0], [1, 0, 0], [1, 1, 0], [1, 1, 0]], dtype=np.float32)
    wanted = np.array([0, 0, 1], dtype=np.float32)
    for step in range(3):
        now, after = (
            {"achieved_goal": a, "desired_goal": wanted, "observation": a}
            for a in atoms[step : step + 2]
        )
        buffer.add(
            now,
            after,
            np.zeros((1, 1)),
            np.array([-1.0]),
            np.array([step == 2]),
            [{"TimeLimit.truncated": step == 2}],
        )
    sampled = buffer.sample(500)
    goals, begun = (
        sampled.observations["desired_goal"].numpy(),
        sampled.observations["achieved_goal"].numpy(),
    )
    assert {tuple(goal) for goal in goals} == {(0, 0, 1), (0, 1, 0)}  # its own, and what was gained
    assert not (begun >= goals).all(axis=-1).any()  # none of length 0
    assert torch.equal(sampled.dones, (sampled.rewards == 0.0).float())
    assert 0 < sampled.dones.sum() < 500


def test_what_follows_a_long_action_is_discounted_by_its_steps():
    buffer = OptionRolloutBuffer(
        2,
        spaces.Box(0, 1, (1,)),
        spaces.Box(-1, 1, (1,)),
        "cpu",
        1.0,
        0.9,
        1,
        durations=lambda: [7],
    )
    zero = np.zeros((1, 1), np.float32)
    for first in (1.0, 0.0):
        buffer.add(zero, zero, np.zeros(1), np.array([first]), torch.zeros(1), torch.zeros(1))
    buffer.compute_returns_and_advantage(torch.tensor([[1.0]]), np.array([False]))
    assert buffer.returns[:, 0] == pytest.approx([0.9**14, 0.9**7])


# -- training -------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "method", ["ppo", "hierarchical", *slow("sac", "curriculum", "sac-her", "sol")]
)
def test_an_interrupted_training_goes_on(tmp_path, domain, method):
    changes = {"n_envs": 2, "batch_size": 8, "validation": 1}
    replays = method in ("sac", "curriculum", "sac-her")
    changes |= {"learning_starts": 102} if replays else {"n_steps": 16}

    def stop(progress):
        if progress.steps >= 120 and not (tmp_path / "stopped").exists():
            (tmp_path / "stopped").touch()
            raise KeyboardInterrupt

    given = {"steps": 200, "changes": changes, "report": stop}
    with pytest.raises(KeyboardInterrupt):
        train_baseline(method, domain, tmp_path / "x", **given)
    before = torch.load(tmp_path / "x-training" / "checkpoint.pt", weights_only=True)["steps"]
    record = train_baseline(method, domain, tmp_path / "x", **given).record
    assert 120 <= before < 200 <= record["environment_steps"] < 300
    steps = [point[0] for point in record["success_curve"]]
    assert steps == sorted(set(steps))  # what was done twice is there once
    assert steps[0] < before < steps[-1] == record["environment_steps"]
    with pytest.raises(InvalidParameterError, match="other settings"):
        train_baseline(method, domain, tmp_path / "x", **given, seed=1)
    if replays:
        assert np.load(tmp_path / "x-training" / REPLAY)["rewards"].size >= 100
    (tmp_path / "x-training" / "checkpoint.pt").write_bytes(b"PK damaged")
    with pytest.raises(InvalidParameterError, match=r"checkpoint\.pt: damaged"):
        train_baseline(method, domain, tmp_path / "x", **given)
    (tmp_path / "x-training" / "settings.json").unlink()
    with pytest.raises(InvalidParameterError, match=r"no settings\.json that says of which"):
        train_baseline(method, domain, tmp_path / "x", **given, seed=1)


@pytest.mark.timeout(180)  # trains twice, with an interruption each time
def test_primitives_are_learned_to_the_same_bytes_after_an_interruption(tmp_path, monkeypatch):
    monkeypatch.setattr("slap_ros.baselines.progress_curve.TIMES", 1)
    changes = {"n_envs": 2, "learning_starts": 2, "gradient_steps": 1, "batch_size": 8}
    changes |= {"net_arch": (16,), "validation": 1}
    domain, stored = get_domain("stack_at_target"), []

    def stop(progress):
        if progress.steps >= 300 and not (folder / "stopped").exists():
            (folder / "stopped").touch()
            raise KeyboardInterrupt

    given = {"goal": "(Holding cube0)", "steps": 600, "changes": changes, "report": stop}
    for folder in (tmp_path / "one", tmp_path / "other"):
        folder.mkdir()
        with pytest.raises(KeyboardInterrupt):
            train_baseline("maple", domain, folder / "x", **given)
        kept = np.load(folder / "x-training" / REPLAY)["actions"]
        train_baseline("maple", domain, folder / "x", **given)
        after = np.load(folder / "x-training" / REPLAY)["actions"]
        assert 2 <= len(kept) < len(after)
        assert np.array_equal(after[: len(kept)], kept)
        stored.append((folder / "x" / "policy.safetensors").read_bytes())
    assert stored[0] == stored[1]
    found = load_baseline(folder / "x", domain)
    assert (found.actions, found.environment["control"]) == (30, "primitives")
    (folder / "x-training" / REPLAY).write_bytes(b"PK damaged")
    with pytest.raises(InvalidParameterError, match=r"replay\.npz: damaged"):
        train_baseline("maple", domain, folder / "x", **given)
    with pytest.raises(NoSkillsError, match="obstacle2d has no primitives"):
        train_baseline("maple", get_domain("obstacle2d"), tmp_path / "none")


@pytest.mark.slow
@pytest.mark.parametrize("name", ["stack_at_target", "peg_in_hole", "stow_hammer"])
def test_a_bench_has_stages_that_a_learner_is_rewarded_for(tmp_path, monkeypatch, name):
    """LG-SAIL's flat baseline: one policy, which observes all objects and the goal."""
    monkeypatch.setattr("slap_ros.baselines.progress_curve.TIMES", 1)  # of 1,000 steps each
    changes = {"n_envs": 1, "learning_starts": 16, "batch_size": 8, "validation": 1}
    domain = get_domain(name)
    trained = train_baseline(
        "sac", domain, tmp_path / "x", goal="training", steps=40, changes=changes
    )
    assert trained.environment == {"obs": "dict", "control": "joints", "reward": "stages"}
    assert trained.record["environment_steps"] == 40
    assert trained.record["task_progress"] == [(0, 0.0), (40, 0.0)]
    assert trained.actions == 5
    assert load_baseline(tmp_path / "x", domain).goal == "training"


def test_the_same_seed_learns_the_same_weights(tmp_path, domain, trained):
    again = train_baseline("ppo", domain, tmp_path / "again", steps=256, changes=SHORT)
    first = load_baseline(trained, domain)
    for one, other in zip(first.policy.layers, again.policy.layers, strict=True):
        assert all(np.array_equal(*pair) for pair in zip(one, other, strict=True))
    other = train_baseline("ppo", domain, tmp_path / "other", steps=256, changes=SHORT, seed=1)
    assert not np.array_equal(first.policy.layers[0][0], other.policy.layers[0][0])


def test_validation_has_the_tasks_that_there_is_room_for(tmp_path):
    """Goals are numbered over the objects of one task, and others have more bystanders or fewer."""
    changes = {"n_envs": 2, "learning_starts": 16, "batch_size": 8, "validation": 3}
    varied = get_domain("obstacle2d", "fair")
    counts = {len(varied.task(1_000_000, 2**31 + k).initial_state.objects) for k in range(3)}
    assert len(counts) > 1
    made = train_baseline("sac", varied, tmp_path / "sac", steps=32, changes=changes)
    assert made.record["task_progress"][0][0] == 0


# -- trying ---------------------------------------------------------------------------------------


def test_an_evaluation_has_a_row_for_a_baseline(tmp_path, trained):
    file = tmp_path / "evaluation.json"
    code, said, _ = slap(
        *EVALUATE, "--tasks", 2, "--json", "--against", trained, "--output", file,
    )  # fmt: skip
    assert code == 0
    rows = json.loads(said)["approaches"]
    assert [row["approach"] for row in rows] == ["pure_planning", "ppo"]
    written = json.loads(file.read_text())
    assert written["against"]["ppo"]["environment_steps"] >= 256
    trials = written["approaches"][1]["trials"]
    assert [(t["success"], t["plan_length"]) for t in trials] == [(False, 50)] * 2
    assert trials[0]["error_code"] == ErrorCode.STEP_LIMIT


def test_what_cannot_be_used_is_named_and_the_rest_is_computed(tmp_path, trained):
    shutil.copytree(trained, tmp_path / "damaged")
    weights = tmp_path / "damaged" / "policy.safetensors"
    weights.write_bytes(weights.read_bytes()[:-4] + b"\1\1\1\1")
    code, said, complaints = slap(
        *EVALUATE, "--tasks", 1, "--json", "--against", tmp_path / "damaged",
        "--against", tmp_path / "nowhere", "--against", trained,
    )  # fmt: skip
    assert code == ErrorCode.INVALID_LIBRARY
    assert "policy.safetensors: damaged" in complaints
    assert "nowhere: no trained baseline; `slap baseline train METHOD obstacle2d`" in complaints
    assert [row["approach"] for row in json.loads(said)["approaches"]] == ["pure_planning", "ppo"]


def test_what_cannot_be_used_is_named_before_planning_begins(tmp_path):
    _, _, complaints = slap(
        *EVALUATE, "--tasks", 1, "--goal", IMPOSSIBLE, "--against", tmp_path / "nowhere"
    )
    assert 0 < complaints.index("nowhere: no trained baseline") < complaints.index("not solved: ")


CODE = """
class Holding:
    environment = {"control": "skills"}
    def predict(self, observation):
        return 0, None

make = Holding
class Nothing: pass

class Failing(Holding):
    def predict(self, observation):
        return 1 / 0
class Leaving(Holding):
    def predict(self, observation):
        raise SystemExit(0)
class Silent(Holding):
    def predict(self, observation):
        return None
class Misfit(Holding):
    environment = {}
    def predict(self, observation):
        return [[0.0, 0.0, 0.0]]
class Elsewhere(Holding):
    environment = {"foo": 1}
class Unseen(Holding):
    environment = {"obs": "foo"}
"""
COMPLAINTS = {
    "Failing": "predict failed: ZeroDivisionError('division by zero'), in my_policies.py, line 12",
    "Leaving": "predict failed: SystemExit(0), in my_policies.py, line 15",
    "Silent": "predict gave None, which is no action",
    "Misfit": "an action is 3 finite numbers from -1 to 1, not array([[0., 0., 0.]])",
    "Elsewhere": "its environment is {'foo': 1}; it may be a mapping of obs, control, reward",
    "Unseen": "unknown obs 'foo'",
}


def test_anybodys_policy_is_named_by_its_function(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "my_policies.py").write_text(CODE)
    sources = ("my_policies:make", "my_policies:Nothing", "nowhere:make")
    against = [part for source in sources for part in ("--against", source)]
    code, said, complaints = slap(*EVALUATE, "--tasks", 1, "--json", *against)
    rows = json.loads(said)["approaches"]
    assert [row["approach"] for row in rows] == ["pure_planning", "my_policies:make"]
    assert (code, rows[1]["at_step_limit"]) == (ErrorCode.INVALID_LIBRARY, 1)
    assert "my_policies:Nothing: Nothing has no predict(observation)" in complaints
    assert "nowhere:make: cannot be made: ModuleNotFoundError" in complaints


def test_a_policy_that_gives_no_action_is_refused_and_not_counted_as_failing(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.delitem(sys.modules, "my_policies", raising=False)
    (tmp_path / "my_policies.py").write_text(CODE)
    against = [part for name in COMPLAINTS for part in ("--against", f"my_policies:{name}")]
    code, said, complaints = slap(*EVALUATE, "--tasks", 1, "--json", *against)
    assert code == ErrorCode.INVALID_LIBRARY
    assert [row["approach"] for row in json.loads(said)["approaches"]] == ["pure_planning"]
    for name, complaint in COMPLAINTS.items():
        assert f"my_policies:{name}: {complaint}" in complaints


def test_a_baseline_of_another_domain_is_refused(trained):
    with pytest.raises(InvalidLibraryError, match="of domain 'obstacle2d', not of 'stow_hammer'"):
        load_baseline(trained, get_domain("stow_hammer"))


def test_more_objects_than_a_policy_has_room_for_count_as_failed(trained, domain):
    trial = try_baseline(load_baseline(trained, domain), "fair:bystanders=2", None, 0, 0)
    assert (trial.success, trial.error_code) == (False, ErrorCode.INVALID_STATE)
    assert "observations have room for 2" in trial.reason


@pytest.mark.parametrize(
    ("arguments", "code", "words"),
    [
        (("dreamer", "obstacle2d"), 2, "there are ppo, sac, curriculum, maple"),
        (("ppo", "moon"), ErrorCode.UNKNOWN_DOMAIN, "moon"),
        (("ppo", "obstacle2d", "--settings", "best"), 15, "there are ours, paper"),
        (("ppo", "obstacle2d", "--set", "tau=1"), 15, "unknown setting 'tau'; there are n_envs"),
        (("ppo", "obstacle2d", "--goal", "nirvana"), ErrorCode.UNKNOWN_GOAL, "nirvana"),
    ],
)
def test_what_there_is_not_is_refused(tmp_path, arguments, code, words):
    found, _, said = slap("baseline", "train", *arguments, "--output", tmp_path / "x")
    assert found == code
    assert words in said.replace("│ ", "").replace(" │", "")
    assert not list(tmp_path.iterdir())


def test_methods_are_listed():
    code, said, _ = slap("baseline", "list", "--json")
    assert code == 0
    assert list(json.loads(said)) == [
        *("ppo", "sac", "curriculum", "maple", "sac-her", "hierarchical", "sol")
    ]
