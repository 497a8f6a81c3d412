# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The arrays of a bag hold what was recorded, to the digit, and the commands that were taken."""

from __future__ import annotations

import copy
from pathlib import Path

import numpy as np
import pytest

from slap_ros.bags import read_bag
from slap_ros.bags.episode_arrays import episode_arrays, read_episodes
from slap_ros.bags.evaluate import read_runs
from slap_ros.domains import get_domain
from slap_ros.errors import DamagedBagError, ForeignBagError
from slap_ros.messages.decode import stamp_ns
from slap_ros.messages.interfaces import ATOMS, COMMAND, STATE
from support.truthful_run import Script, record, without

SHORTCUT_BAG = Path(__file__).parent / "data" / "recorded_by_0.1.0"


def recorded(script: Script, type_name: str):
    return [item.message for item in script.messages if item.type_name == type_name]


def test_states_stamps_and_atoms_are_the_recorded_ones(script: Script, honest_bag: Path) -> None:
    (episode,) = read_episodes(honest_bag)
    states = recorded(script, STATE)
    assert len(episode) == len(states) == script.truth.plan_length + 1
    assert episode.steps.tolist() == [state.step for state in states]
    assert episode.stamps_ns.tolist() == [stamp_ns(state.header) for state in states]
    for row, state in zip(episode.states, states, strict=True):
        assert row.tobytes() == np.concatenate([obj.features for obj in state.objects]).tobytes()
    for row, message in zip(episode.atoms, recorded(script, ATOMS), strict=True):
        texts = {f"{atom.predicate}({', '.join(atom.objects)})" for atom in message.atoms}
        assert {episode.atom_names[i] for i in np.flatnonzero(row)} == texts
    assert episode.perceived.all()


def test_names_and_units_are_the_domains(script: Script, honest_bag: Path) -> None:
    (episode,) = read_episodes(honest_bag)
    objects = recorded(script, STATE)[0].objects
    types = script.domain.types_by_name
    assert episode.state_names == tuple(
        f"{obj.name}.{feature.name}" for obj in objects for feature in types[obj.type].features
    )
    assert len(episode.state_units) == len(episode.state_names)
    assert episode.state_units[episode.state_names.index("block1.x")] == "m"
    assert episode.action_names == ("x", "y", "gripper")
    assert episode.action_units == ("m", "m", "1")
    assert (episode.domain, episode.preset, episode.goal) == (
        "obstacle2d",
        "fair",
        ("On(block1, target)",),
    )
    assert episode.control_period_s == script.domain.execution.control_period_s
    assert episode.metrics is not None
    assert episode.metrics.seed == 7


def test_actions_are_the_taken_commands_and_lead_from_state_to_state(
    script: Script, honest_bag: Path
) -> None:
    """Around them the bag has commands out of range, and commands that came too late."""
    (episode,) = read_episodes(honest_bag)
    assert len(recorded(script, COMMAND)) > len(episode)
    domain = get_domain("obstacle2d", "fair")
    world = domain.make_world(domain.task(7).initial_state)
    assert world.state.data.tobytes() == episode.states[0].tobytes()
    for action, after in zip(episode.actions[:-1], episode.states[1:], strict=True):
        assert world.step(action).data.tobytes() == after.tobytes()
    assert np.isnan(episode.actions[-1]).all()


def test_a_late_command_that_arrives_first_is_not_taken_for_the_taken_one(
    script: Script, honest_bag: Path, tmp_path: Path
) -> None:
    messages = copy.deepcopy(script.messages)
    answers = [i for i, m in enumerate(messages) if m.type_name == COMMAND and m.message.step == 4]
    taken, late = answers
    assert not np.array_equal(messages[taken].message.deltas, messages[late].message.deltas)
    messages[taken], messages[late] = messages[late], messages[taken]
    record(tmp_path / "bag", messages)
    (swapped,), (honest,) = read_episodes(tmp_path / "bag"), read_episodes(honest_bag)
    assert np.array_equal(swapped.actions, honest.actions, equal_nan=True)


def test_options_and_reward(script: Script, honest_bag: Path) -> None:
    (episode,) = read_episodes(honest_bag)
    expected = [
        f"{option['name']}({', '.join(option['objects'])})"
        for option in script.truth.options
        for _ in range(option["steps"])
    ]
    assert episode.options.tolist() == [*expected, ""]
    assert set(episode.option_kinds[:-1]) == {"operator"}
    assert episode.rewards.tolist() == [0.0] * (len(episode) - 2) + [1.0, 0.0]


def test_steps_of_a_shortcut_are_marked() -> None:
    (episode,) = read_episodes(SHORTCUT_BAG)
    assert episode.option_kinds.tolist() == ["operator"] * 9 + ["shortcut"] * 4 + [""]


def test_each_run_is_an_episode(tmp_path: Path) -> None:
    script = Script(seed=7)
    script.run()
    script.episode = 2
    script.run(index=1)
    record(tmp_path / "bag", script.messages)
    first, second = read_episodes(tmp_path / "bag")
    assert (first.number, second.number) == (1, 2)
    assert second.metrics is not None
    assert (second.metrics.seed, second.metrics.index) == (7, 1)
    assert second.steps[0] == 0
    assert not np.array_equal(first.states[0], second.states[0])


def test_an_episode_without_a_run_is_one_as_well(script: Script, tmp_path: Path) -> None:
    record(tmp_path / "bag", without(script.messages, "/slap/plan", "/slap/plan_events"))
    (episode,) = read_episodes(tmp_path / "bag")
    assert episode.metrics is None
    assert len(episode) == script.truth.plan_length + 1
    assert episode.goal == ("On(block1, target)",)
    assert set(episode.option_kinds[:-1]) == {"unknown"}
    assert episode.options[0].startswith(script.truth.options[0]["name"])


def test_atoms_that_were_not_recorded_are_found_again(
    script: Script, honest_bag: Path, tmp_path: Path
) -> None:
    messages = [
        m for m in script.messages if not (m.type_name == ATOMS and m.message.step in (3, 5))
    ]
    record(tmp_path / "bag", messages)
    (lacking,), (honest,) = read_episodes(tmp_path / "bag"), read_episodes(honest_bag)
    assert np.flatnonzero(~lacking.perceived).tolist() == [3, 5]
    assert np.array_equal(lacking.atoms, honest.atoms)


def test_without_the_task_the_plan_names_the_goal(script: Script, tmp_path: Path) -> None:
    record(tmp_path / "bag", without(script.messages, "/slap/task"))
    (episode,) = read_episodes(tmp_path / "bag")
    assert episode.goal == ("On(block1, target)",)
    planned = ("/slap/plan", "/slap/plan_events")
    record(tmp_path / "none", without(script.messages, "/slap/task", *planned))
    (episode,) = read_episodes(tmp_path / "none")
    assert episode.goal is None
    assert np.isnan(episode.rewards).all()


def test_a_damaged_bag_is_refused_and_can_be_read_as_far_as_it_goes(
    script: Script, honest_bag: Path, tmp_path: Path
) -> None:
    messages = [m for m in script.messages if not (m.type_name == STATE and m.message.step == 6)]
    record(tmp_path / "bag", messages)
    with pytest.raises(DamagedBagError, match="the first that of step 6"):
        read_episodes(tmp_path / "bag")
    (partial,) = episode_arrays(read_runs(tmp_path / "bag"))
    (honest,) = read_episodes(honest_bag)
    assert 6 not in partial.steps
    assert np.array_equal(partial.states, np.delete(honest.states, 6, axis=0))


def test_bags_without_domain_states_or_with_foreign_atoms_are_refused(
    script: Script, tmp_path: Path
) -> None:
    record(tmp_path / "domain", without(script.messages, "/slap/domain"))
    with pytest.raises(DamagedBagError, match="names its domain"):
        read_episodes(tmp_path / "domain")
    record(
        tmp_path / "states",
        without(script.messages, "/slap/state", "/slap/plan_events", "/slap/plan"),
    )
    with pytest.raises(DamagedBagError, match="no states"):
        read_episodes(tmp_path / "states")
    messages = copy.deepcopy(script.messages)
    next(m.message for m in messages if m.type_name == ATOMS).atoms[0].predicate = "Juggled"
    record(tmp_path / "atoms", messages)
    assert read_bag(tmp_path / "atoms").damage is None
    with pytest.raises(ForeignBagError, match=r"no atom Juggled\("):
        read_episodes(tmp_path / "atoms")
