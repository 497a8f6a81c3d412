# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A domain has training settings of its own, and tasks without a plan end no training."""

from dataclasses import replace

import pytest

from slap_ros.core import Learning
from slap_ros.domains import get_domain
from slap_ros.errors import ErrorCode, InvalidDomainError, InvalidParameterError, UnsolvableError
from slap_ros.learning.setting_changes import changed, parse_changes, setting_names
from slap_ros.learning.task_distribution import TaskDistribution
from slap_ros.learning.workers import SequentialWorkers
from slap_ros.shortcuts.cloning_settings import ShortcutCloningSettings
from slap_ros.shortcuts.named_settings import GENERAL, training_settings
from slap_ros.shortcuts.sac_settings import ShortcutSacSettings
from slap_ros.shortcuts.settings import OURS, TrainingSettings
from slap_ros.shortcuts.stopping import Stopping
from slap_ros.shortcuts.training import Training
from slap_ros.skills.domain_choice import DomainChoice
from support import patchy
from support.slap_command import slap

PATCHY = patchy.make("some")
WRONG = [
    "nonsense",
    "rollouts=16",
    "exploration=16",
    "exploration.rollouts.more=16",
    "exploration.rollouts=",
    "exploration.rollouts=16.0",
    "exploration.rollouts=1e3",
    "exploration.rollouts=0",
    "exploration.rollouts=-1",
    "exploration.rollouts=1" + 400 * "0",
    "exploration.rollouts=true",
    "exploration.rollouts=none",
    "rewards.step=nan",
    "rewards.step=inf",
    "rewards.step=1e400",
    "rewards.step=none",
    "ppo.gamma=1",
    "ppo.learning_rate=0",
    "ppo.anneal=1",
    "ppo.anneal=yes",
    "ppo.net_arch=64,x",
    "ppo.net_arch=0",
    "ppo=none",
    "polish=all",
    "__class__=1",
    "ppo.parts=3",
    "random_goals=-0.1",
    "random_goals=1.1",
]


@pytest.mark.parametrize("text", WRONG)
def test_what_no_setting_can_be_is_refused(text):
    with pytest.raises(InvalidParameterError):
        changed(OURS, parse_changes([text], TrainingSettings))


def test_a_wrong_name_lists_the_right_ones_on_the_command_line():
    run = slap("train", "obstacle2d", "--set", "exploration.rolouts=16")
    assert run.exit_code == ErrorCode.INVALID_PARAMETER
    for name in setting_names(TrainingSettings):
        assert name in run.stderr


@pytest.mark.parametrize("name", list(setting_names(TrainingSettings)))
def test_every_setting_can_be_set_to_what_it_is(name):
    """By text, so that nothing of a type that text cannot give is forgotten."""
    every = {
        "stopping": Stopping(),
        "sac": ShortcutSacSettings(),
        "cloning": ShortcutCloningSettings(),
    }
    settings = replace(OURS, polish_rewards=OURS.rewards, **every)
    value = settings
    for part in name.split("."):
        value = getattr(value, part)
    if setting_names(TrainingSettings)[name] is type(None):
        assert changed(settings, parse_changes([f"{name}=none"], TrainingSettings)) != settings
        return
    text = {
        bool: str(value).lower(),
        tuple: ",".join(map(str, value if type(value) is tuple else ())),
    }
    change = parse_changes([f"{name}={text.get(type(value), value)}"], TrainingSettings)
    assert changed(settings, change) == settings
    assert type(change[name]) is type(value)


def test_a_setting_that_is_given_twice_is_refused():
    with pytest.raises(InvalidParameterError, match="twice"):
        parse_changes(["horizon=3", "horizon=4"], TrainingSettings)


def test_a_part_that_is_left_out_comes_back_with_its_settings():
    off = changed(OURS, {"polish": None})
    assert off.polish is None
    assert changed(off, {"polish.n_epochs": 3}).polish.n_epochs == 3


def test_recorded_commands_may_have_the_names_of_stored_files():
    old = ["ppo.hidden=8", "polish.environments=4", "rewards.discount=0.9", "exploration.hold=2"]
    new = ["ppo.net_arch=8", "polish.n_envs=4", "rewards.gamma=0.9", "exploration.action_repeat=2"]
    assert parse_changes(old, TrainingSettings) == parse_changes(new, TrainingSettings)
    with pytest.raises(InvalidParameterError, match=r"'ppo\.gamma' is given twice"):
        parse_changes(["ppo.gamma=0.9", "ppo.discount=0.9"], TrainingSettings)


def test_a_domains_own_settings_are_used_and_changed():
    assert training_settings("ours", PATCHY) == replace(
        OURS, exploration=replace(OURS.exploration, rollouts=32), polish=None, shortcuts=0
    )
    assert training_settings("paper", PATCHY) == GENERAL["paper"]
    assert training_settings("quick", PATCHY).ppo.net_arch == (8,)
    several = training_settings("ours_several", PATCHY)
    assert several.exploration == replace(OURS.exploration, tasks=24, rollouts=32)
    assert (several.polish, several.shortcuts, several.random_goals) == (None, 8, 0.5)
    short = training_settings("ours_short", PATCHY)
    assert replace(short, stopping=None) == training_settings("ours", PATCHY) != short
    with pytest.raises(
        InvalidParameterError, match="ours_near, ours_chains, ours_kept_chains, subg"
    ):
        training_settings("slow", PATCHY)


@pytest.mark.parametrize(
    "value", [{"horizn": 3}, {"horizon": "3"}, {"horizon": True}, {"ppo": None}]
)
def test_a_domain_whose_settings_cannot_be_is_named(value):
    learning = Learning(PATCHY.learning.interface, settings={"ours": value})
    with pytest.raises(InvalidDomainError, match=r"domain patchy, Learning\.settings"):
        training_settings("ours", replace(PATCHY, learning=learning))


@pytest.mark.parametrize("steps", [2, 3, 1000, 450_001])
def test_steps_are_those_of_all_stages(steps):
    for settings in (OURS, replace(OURS, polish=None), training_settings("ours", PATCHY)):
        given = settings.with_total_steps(steps)
        assert given.total_steps == steps
        assert all(stage.total_steps > 0 for stage in given.stages)
    with pytest.raises(InvalidParameterError, match="2 stages cannot share 1 steps"):
        OURS.with_total_steps(1)


@pytest.mark.parametrize(
    ("learner", "most"),
    [
        ({"ppo": replace(OURS.ppo, total_steps=60_000), "polish": None}, 60_416),  # 59 rollouts
        ({"ppo": replace(OURS.ppo, total_steps=61_440), "polish": None}, 61_440),
        ({"sac": ShortcutSacSettings(total_steps=1_001)}, 1_008),
        ({"ppo": replace(OURS.ppo, total_steps=1), "polish": OURS.ppo, "attempts": 3}, 253_952),
    ],
)
def test_a_stage_takes_whole_rollouts_and_the_first_may_be_tried_again(learner, most):
    assert replace(OURS, **learner).steps_per_shortcut == most


def test_steps_that_contradict_themselves_are_refused():
    both = ["--steps", "10", "--set", "ppo.total_steps=10"]
    run = slap("train", "obstacle2d", *both)
    assert run.exit_code == ErrorCode.INVALID_PARAMETER
    assert "give one" in run.stderr


class Listener:
    """Keeps what was left out."""

    def __init__(self):
        self.left_out = []

    def on_left_out(self, use, index, reason):
        self.left_out.append((use, index, reason))

    def on_progress(self, what, done, total):
        pass

    def on_ranked(self, ranked):
        self.ranked = ranked


def train(folder, preset, listener):
    settings = changed(
        training_settings("ours", get_domain("patchy")), {"validation": 6, "exploration.tasks": 4}
    )
    distribution = TaskDistribution(DomainChoice("patchy", preset), 0)
    return Training(distribution, settings, folder, SequentialWorkers(), listener).run()


def test_tasks_without_a_plan_are_named_and_left_out(install, tmp_path):
    install({"patchy": "support.patchy:make"})
    listener = Listener()
    library = train(tmp_path / "work", "some", listener)
    uses = [use for use, _, _ in listener.left_out]
    assert 0 < uses.count("validation") < 6
    assert 0 < uses.count("exploration") < 4
    assert all(reason for _, _, reason in listener.left_out)
    assert listener.ranked
    length = library.record["validation"]["pure_planning"]
    assert 20 < length < 60
    again = Listener()
    assert (
        train(tmp_path / "work", "some", again).record["validation"] == library.record["validation"]
    )
    assert [one for one in listener.left_out if one[0] == "validation"] == again.left_out


def test_without_any_plan_training_ends_before_exploring(install, tmp_path):
    """What was seen: infinite lengths, every candidate skipped, and a traceback at the end."""
    install({"patchy": "support.patchy:make"})
    with pytest.raises(UnsolvableError, match="none of 6 tasks for validation has a plan"):
        train(tmp_path / "work", "none", Listener())
    assert not (tmp_path / "work" / "explored.json").exists()
