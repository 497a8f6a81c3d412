# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Shortcuts of an earlier training: options like any other in a later one."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from slap_ros.domains import get_domain
from slap_ros.errors import InvalidParameterError
from slap_ros.learning.task_distribution import TaskDistribution
from slap_ros.learning.workers import SequentialWorkers
from slap_ros.shortcuts.demonstrations import NoisyRepetitions, demonstrate, demonstrated
from slap_ros.shortcuts.exploration_settings import ExplorationSettings
from slap_ros.shortcuts.explorer import Explorer
from slap_ros.shortcuts.kept_shortcuts import KeptShortcuts
from slap_ros.shortcuts.named_settings import CHAINS, training_settings
from slap_ros.shortcuts.observation_encoder import ObservationEncoder
from slap_ros.shortcuts.shortcut_library import load_library
from slap_ros.shortcuts.starts import find_start, restore_starts
from slap_ros.shortcuts.straightening import Straightener
from slap_ros.shortcuts.training import Training
from slap_ros.skills.domain_choice import DomainChoice

SEED, TASK = 1_000_000, 10_000  # of a task for training
FEW = ExplorationSettings(tasks=1, rollouts=1, length=1, nodes=1, straightened=10, along_plan=True)


@pytest.fixture(scope="module")
def tower():
    return get_domain("obstacle_tower")


@pytest.fixture(scope="module")
def kept(tower):
    return KeptShortcuts(load_library(Path("models/shortcuts/obstacle_tower"), tower).shortcuts)


@pytest.fixture(scope="module")
def candidates(tower, kept):
    rng = np.random.default_rng(0)
    return Explorer.of_task(tower, SEED, 0, FEW, rng, kept).explore().candidates


def test_a_slap_and_a_skill_show_a_shortcut_together(kept, candidates):
    (slap,) = kept.shortcuts
    (found,) = [one for one in candidates if slap.name in one.replaced]
    assert found.replaced == (slap.name, "PlaceInTarget")
    assert found.operator_path == ("Pick",)
    assert found.plan_steps < 50  # the plan is one with the slap
    assert 0 < found.expected_saving < found.plan_steps


@pytest.fixture(scope="module")
def start(tower, kept, candidates):
    (found,) = [one for one in candidates if one.replaced[-1] == "PlaceInTarget"]
    about = found.signature, found.operator_path, {"Pick": 17.0}
    return find_start(tower, SEED, TASK, *about, kept=kept), found.signature


@pytest.fixture(scope="module")
def shown(tower, kept, start):
    return demonstrate(tower, *start, 40, np.random.default_rng(0), kept).shown


def test_it_is_demonstrated_from_where_the_slap_begins(tower, start, shown):
    assert 0 < len(shown.actions) < shown.replaced
    without = demonstrate(tower, *start, 40, np.random.default_rng(0)).shown
    assert without is None or without.replaced > 1.5 * shown.replaced  # block by block


def test_what_noise_has_added_is_taken_back(tower, start, shown):
    record, signature = start
    (where,) = restore_starts(tower, [record])
    encoder = ObservationEncoder(tower, where.space, signature, where.change)
    straightener = Straightener(tower, encoder, where.state)
    actions = np.array(shown.actions)
    silent = straightener.come_back(actions, np.zeros((len(actions), straightener.displacements)))
    assert silent.actions == pytest.approx(actions)
    noise = np.zeros((len(actions), straightener.displacements))
    noise[0] = -0.1 * np.sign(actions[0, : straightener.displacements])  # once, within the limits
    disturbed = straightener.come_back(actions, noise)
    assert disturbed.actions[1] != pytest.approx(actions[1])
    assert np.abs(disturbed.actions).max() <= 1.0
    joints = encoder.robot_columns[: straightener.displacements]
    off = [
        np.abs(after.data[joints] - before.data[joints]).max()
        for after, before in zip(disturbed.states, silent.states, strict=False)
    ]
    assert off[1] > 0.0
    assert off[-1] < 0.5 * off[1]  # joints that are at full speed get back later


def test_disturbed_demonstrations_are_learned_from_as_well(tower, start, shown):
    _, signature = start
    once = demonstrated(tower, signature, [shown])
    again = demonstrated(tower, signature, [shown], NoisyRepetitions(3, 0.1, seed=1))
    assert len(again.actions) > len(once.actions)
    assert again.shortest == once.shortest
    same = demonstrated(tower, signature, [shown], NoisyRepetitions(3, 0.1, seed=1))
    assert np.array_equal(same.actions, again.actions)
    twice = demonstrated(tower, signature, [shown, shown], NoisyRepetitions(3, 0.1, seed=1))
    second = twice.actions[len(again.actions) :]  # of the same length, with other noise
    assert not np.array_equal(second, again.actions[: len(second)])


def test_a_library_has_what_is_kept_and_a_work_folder_is_for_that_alone(tmp_path):
    domain = get_domain("obstacle2d")
    (first, second, *_) = load_library(Path("models/shortcuts/obstacle2d"), domain).shortcuts
    base = training_settings(CHAINS, domain)
    nothing = replace(FEW, straightened=0)
    settings = replace(base, exploration=nothing, validation=4, shortcuts=1)
    tasks = TaskDistribution(DomainChoice("obstacle2d", "fair"), 5)

    def train(kept):
        workers, silent = SequentialWorkers(), Silent()
        return Training(tasks, settings, tmp_path / "work", workers, silent, kept).run()

    library = train((first,))
    assert library.shortcuts == (first,)
    assert library.record["kept"] == {"digest": library.digest, "shortcuts": [first.name]}
    validation = library.record["validation"]
    assert validation["slap"] <= validation["pure_planning"]
    assert library.record["environment_steps"]["learning"] == 0  # of this training
    for others in ((second,), (first, second), ()):
        with pytest.raises(InvalidParameterError, match="other settings"):
            train(others)


@pytest.mark.parametrize(
    "name", ["obstacle2d", "obstacle_tower", "cluttered_drawer", "cleanup_table"]
)
def test_shipped_chains_are_beside_the_shortcuts_that_they_were_learned_over(name):
    domain = get_domain(name)
    library = load_library(Path(f"models/chains/{name}/shortcuts"), domain)
    kept = load_library(Path(f"models/shortcuts/{name}"), domain)
    assert not library.refused
    assert library.record["kept"]["digest"] == kept.digest
    names = {shortcut.name for shortcut in library.shortcuts}
    assert {shortcut.name for shortcut in kept.shortcuts} < names


class Silent:
    """Receives the events of a training."""

    def on_progress(self, what, done, total):
        pass

    def on_left_out(self, use, index, reason):
        pass

    def on_ranked(self, ranked):
        pass

    def on_learning(self, name, folder, total_steps):
        pass

    def on_validated(self, name, before, after, kept):
        pass
