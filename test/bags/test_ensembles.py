# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Several ensembles in one recording: each has its own runs, whoever has the same episodes."""

from __future__ import annotations

import json
import random
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from slap_ros import load_bag
from slap_ros.bags import bag_info, evaluate_bag, read_bag, read_episodes, replay_bag
from slap_ros.bags.demonstrations import read_demonstrations
from slap_ros.errors import ErrorCode, InvalidParameterError
from slap_ros.messages.interfaces import STATE, TASK
from slap_ros.report import read_report, render
from slap_ros.robot.recorded_motion import read_recorded_motion
from support.slap_command import slap
from support.truthful_run import Published, Script, record, under

SEEDS = {"/": 7, "/fleet/robot1": 11, "/robot2": 23}


@pytest.fixture(scope="module")
def scripts() -> Mapping[str, Script]:
    """A run of each ensemble, all of them episode 1. Shared: not to be changed."""
    made = {name: Script(seed) for name, seed in SEEDS.items()}
    for script in made.values():
        script.run()
    return made


def merged(scripts: Mapping[str, Script], names: tuple[str, ...]) -> list[Published]:
    """The messages of several ensembles as one recorder receives them."""
    parts = [
        scripts[name].messages if name == "/" else under(name.strip("/"), scripts[name].messages)
        for name in names
    ]
    rng, mixed = random.Random(3), list[Published]()
    while parts := [part for part in parts if part]:
        chosen = rng.randrange(len(parts))
        mixed.append(parts[chosen][0])
        parts[chosen] = parts[chosen][1:]
    return mixed


@pytest.fixture(scope="module")
def fleet(scripts: Mapping[str, Script], tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("bags") / "fleet"
    record(path, merged(scripts, tuple(SEEDS)))
    return path


@pytest.fixture(scope="module")
def alone(
    scripts: Mapping[str, Script], tmp_path_factory: pytest.TempPathFactory
) -> Mapping[str, Path]:
    """Each ensemble in a bag of its own."""
    folder = tmp_path_factory.mktemp("alone")
    paths = {name: folder / f"seed{SEEDS[name]}" for name in SEEDS}
    for name, path in paths.items():
        record(path, scripts[name].messages)
    return paths


def test_numbers_are_those_of_each_ensemble(
    scripts: Mapping[str, Script], fleet: Path, alone: Mapping[str, Path]
) -> None:
    found = evaluate_bag(fleet)
    assert found.namespaces == tuple(SEEDS)
    assert found.damage is None and found.mismatches == [] and found.left_out == ()
    apart = [evaluate_bag(alone[name]) for name in SEEDS]
    assert found.runs == [run for one in apart for run in one.runs]
    assert [run.plan_length for run in found.runs] == [
        scripts[name].truth.plan_length for name in SEEDS
    ]
    assert found.compared == found.states == sum(one.states for one in apart)
    assert bag_info(fleet).ensembles == tuple(SEEDS)


@pytest.mark.parametrize("name", ["/robot2", "robot2/"])
def test_a_namespace_chooses_one(fleet: Path, alone: Mapping[str, Path], name: str) -> None:
    assert evaluate_bag(fleet, name) == evaluate_bag(alone["/robot2"])
    assert replay_bag(fleet, name) == replay_bag(alone["/robot2"])
    (episode,), (same,) = read_episodes(fleet, name), read_episodes(alone["/robot2"])
    assert np.array_equal(episode.states, same.states)
    assert (episode.namespace, same.namespace) == ("/robot2", "/")
    assert load_bag(fleet, namespace=name).about()["run"]["seed"] == SEEDS["/robot2"]


def test_all_of_them_are_replayed_exported_and_shown(
    fleet: Path, alone: Mapping[str, Path]
) -> None:
    replayed = replay_bag(fleet)
    assert replayed.identical and replayed.unreached == 0
    assert replayed.compared == sum(replay_bag(path).compared for path in alone.values())
    assert [episode.namespace for episode in read_episodes(fleet)] == list(SEEDS)
    domain = read_report(fleet)
    assert [run.namespace for run in domain.runs] == list(SEEDS)
    page = render([domain])
    assert all(f"pure planning, {name}" in page or "SLAP, " + name in page for name in SEEDS)


def test_demonstrations_are_those_of_all(scripts: Mapping[str, Script], fleet: Path) -> None:
    shown = read_demonstrations(read_bag(fleet), scripts["/"].domain)
    assert [len(one) for one in shown] == [scripts[n].truth.plan_length + 1 for n in SEEDS]


def test_commands_name_and_choose_ensembles(fleet: Path, tmp_path: Path) -> None:
    told = json.loads(slap("bag", "evaluate", fleet, "--json").stdout)
    assert {run["namespace"]: run["seed"] for run in told} == SEEDS
    one = ["--namespace", "/robot2"]
    chosen = slap("bag", "evaluate", fleet, "--json", *one)
    assert json.loads(chosen.stdout)["seed"] == SEEDS["/robot2"]
    table = slap("bag", "evaluate", fleet)
    assert "/robot2: obstacle2d" in table.stdout
    render_it = ("bag", "render", fleet, "--size", "64x48", "--output", tmp_path / "a.gif")
    refused = slap(*render_it)
    assert refused.exit_code == ErrorCode.INVALID_PARAMETER
    assert "choose with --namespace, of /, /fleet/robot1, /robot2" in refused.stderr
    assert slap(*render_it, *one).exit_code == 0
    page = slap("report", fleet, "--output", tmp_path / "page.html", *one)
    assert page.exit_code == 0
    nobody = slap("bag", "replay", fleet, "--namespace", "/robot3")
    assert nobody.exit_code == ErrorCode.INVALID_PARAMETER
    assert "only in /, /fleet/robot1, /robot2" in nobody.stderr


def test_a_robot_executes_only_the_one_that_was_chosen(fleet: Path) -> None:
    with pytest.raises(InvalidParameterError, match="choose with --namespace"):
        read_recorded_motion(fleet)
    with pytest.raises(InvalidParameterError, match="has no Panda"):
        read_recorded_motion(fleet, "/robot2")


def test_what_one_lacks_is_said_of_it_alone(scripts: Mapping[str, Script], tmp_path: Path) -> None:
    messages = [
        item
        for item in merged(scripts, ("/", "/robot2"))
        if not (item.topic == "/robot2/slap/state" and item.message.step in (3, 4))
    ]
    record(tmp_path / "bag", messages)
    damage = evaluate_bag(tmp_path / "bag").damage
    assert damage is not None and damage.startswith("/robot2: 2 of ")
    assert "/:" not in damage
    assert evaluate_bag(tmp_path / "bag", "/").damage is None


def renamed(messages: list[Published], names: Mapping[str, str]) -> list[Published]:
    return [replace(item, topic=names.get(item.topic, item.topic)) for item in messages]


def test_renamed_topics_belong_to_the_only_ensemble(
    script: Script, honest_bag: Path, tmp_path: Path
) -> None:
    names = {"/slap/state": "/sim/state", "/slap/task": "/sim/task", "/slap/plan_events": "/log"}
    record(tmp_path / "bag", renamed(script.messages, names))
    assert evaluate_bag(tmp_path / "bag") == evaluate_bag(honest_bag)


def test_a_copy_of_a_topic_is_left_out_and_named(
    script: Script, honest_bag: Path, tmp_path: Path
) -> None:
    """As topic_tools makes them, or somebody who publishes other numbers."""
    copies = [
        replace(item, topic="/slap/state_throttled", message=replace(item.message, step=900))
        for item in script.messages
        if item.type_name == STATE
    ]
    record(tmp_path / "bag", [*copies, *script.messages])
    found = evaluate_bag(tmp_path / "bag")
    assert found.left_out == ("/slap/state_throttled",)
    assert found.runs == evaluate_bag(honest_bag).runs
    assert found.states == evaluate_bag(honest_bag).states


def test_an_ensemble_whose_topics_were_all_renamed_is_one(
    scripts: Mapping[str, Script], alone: Mapping[str, Path], tmp_path: Path
) -> None:
    other = [
        replace(item, topic=item.topic.replace("/slap/", "/b_slap/"))
        for item in scripts["/robot2"].messages
    ]
    record(tmp_path / "bag", [*scripts["/"].messages, *other])
    found = evaluate_bag(tmp_path / "bag")
    assert found.namespaces == ("/", "/b_slap")
    assert found.runs == [r for name in ("/", "/robot2") for r in evaluate_bag(alone[name]).runs]


def test_a_renamed_topic_belongs_to_the_ensemble_around_it(
    scripts: Mapping[str, Script], alone: Mapping[str, Path], tmp_path: Path
) -> None:
    messages = renamed(
        merged(scripts, ("/fleet/robot1", "/robot2")),
        {"/robot2/slap/plan_events": "/robot2/log", "/fleet/robot1/slap/task": "/fleet/robot1/t"},
    )
    record(tmp_path / "bag", messages)
    found = evaluate_bag(tmp_path / "bag")
    names = ("/fleet/robot1", "/robot2")
    assert found.runs == [run for name in names for run in evaluate_bag(alone[name]).runs]
    assert found.left_out == ()


def test_two_ensembles_on_the_same_topics_are_noticed(
    scripts: Mapping[str, Script], tmp_path: Path
) -> None:
    """Nothing tells them apart, so that nothing is to be believed."""
    record(tmp_path / "bag", [*scripts["/"].messages, *scripts["/robot2"].messages])
    damage = evaluate_bag(tmp_path / "bag").damage
    assert damage is not None and "of the same episode and step" in damage


def test_a_simulator_that_was_started_again_with_other_objects_is_damage(
    scripts: Mapping[str, Script], tmp_path: Path
) -> None:
    """It begins with episode 1 again, and its task has an object less."""
    first = scripts["/"].messages
    second = [
        replace(item, message=replace(item.message, **{field: fewer(getattr(item.message, field))}))
        if (field := {STATE: "objects", TASK: "initial_state"}.get(item.type_name))
        else item
        for item in scripts["/"].messages
    ]
    record(tmp_path / "bag", [*first[: len(first) // 2], *second])
    found = evaluate_bag(tmp_path / "bag")
    assert found.damage is not None and "of a simulator that was started again" in found.damage
    assert 0 < found.states < len([item for item in first if item.type_name == STATE])
    assert not found.mismatches
    assert replay_bag(tmp_path / "bag").compared == found.states
    assert "started again" in render([read_report(tmp_path / "bag")])


def fewer(found: Any) -> Any:
    """A state, or the list of its objects, without the last one."""
    return found[:-1] if isinstance(found, list) else replace(found, objects=found.objects[:-1])
