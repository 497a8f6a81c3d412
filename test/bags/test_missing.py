# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A bag that lacks something says so, and no number of it is silently another one."""

from __future__ import annotations

import json
import random
import shutil
from pathlib import Path

import pytest
import yaml

from slap_ros.bags import bag_info, evaluate_bag, read_bag, replay_bag
from slap_ros.bags.rosbag2 import ROOT
from slap_ros.errors import ErrorCode
from slap_ros.messages.events import PlanEventKind, SkillEventKind
from slap_ros.messages.interfaces import ATOMS, PLAN, PLAN_EVENT, SKILL_EVENT, STATE, TASK
from slap_ros.report import read_report, render
from support.slap_command import slap
from support.truthful_run import Published, Script, record, without


def states(script: Script) -> list[Published]:
    return [item for item in script.messages if item.type_name == STATE]


def but(script: Script, lost: list[Published]) -> list[Published]:
    gone = {id(item) for item in lost}
    return [item for item in script.messages if id(item) not in gone]


def damages(path: Path) -> set[str | None]:
    """What each reader says."""
    return {
        bag_info(path).damage,
        evaluate_bag(path).damage,
        replay_bag(path).damage,
        read_report(path).evaluation.damage,
    }


@pytest.mark.parametrize("lost", ["five", "every other", "all"])
def test_states_that_are_missing_are_missed_and_change_no_length(
    script: Script, tmp_path: Path, lost: str
) -> None:
    inner = states(script)[1:]
    chosen = {
        "five": random.Random(3).sample(inner, 5),
        "every other": inner[::2],
        "all": states(script),
    }[lost]
    record(tmp_path / "bag", but(script, chosen))
    (run,) = evaluate_bag(tmp_path / "bag").runs
    assert run.plan_length == script.truth.plan_length
    assert [o.steps for o in run.options] == [o["steps"] for o in script.truth.options]
    (damage,) = damages(tmp_path / "bag")
    total = script.truth.plan_length + 1
    first = min(item.message.step for item in chosen)
    told = f"{len(chosen)} of {total} states are missing, the first that of step {first}"
    assert damage == (f"all {total} states are missing" if lost == "all" else told)


def test_the_command_says_so_and_ends_with_a_code(script: Script, tmp_path: Path) -> None:
    record(tmp_path / "bag", but(script, states(script)[3:5]))
    for command in ("info", "evaluate", "replay"):
        result = slap("bag", command, tmp_path / "bag", "--json")
        assert result.exit_code == ErrorCode.DAMAGED_BAG, command
        assert "2 of" in result.stderr, command
        assert "2 of" in json.loads(result.stdout)["damage"], command


KINDS = (PlanEventKind.PLANNED, PlanEventKind.EDGE_STARTED, PlanEventKind.EDGE_REACHED)


@pytest.mark.parametrize("kind", KINDS)
def test_a_plan_event_that_is_missing_is_missed(
    script: Script, tmp_path: Path, kind: PlanEventKind
) -> None:
    events = [m for m in script.messages if m.type_name == PLAN_EVENT and m.message.kind == kind]
    record(tmp_path / "bag", but(script, events[:1]))
    (run,) = evaluate_bag(tmp_path / "bag").runs
    assert run.plan_length == script.truth.plan_length
    (damage,) = damages(tmp_path / "bag")
    assert damage is not None
    assert "a plan event is missing between" in damage
    if kind is PlanEventKind.PLANNED:
        assert run.planning_seconds is run.edges_rolled_out is None
        assert run.unknown["planning_seconds"] == "an event of planning is missing"


def test_without_its_start_a_run_is_none_and_that_is_said(script: Script, tmp_path: Path) -> None:
    first = next(item for item in script.messages if item.type_name == PLAN_EVENT)
    record(tmp_path / "bag", but(script, [first]))
    assert evaluate_bag(tmp_path / "bag").runs == []
    (damage,) = damages(tmp_path / "bag")
    assert damage is not None
    assert damage.endswith("plan events belong to a run whose start is missing")


def test_without_the_plan_nobody_knows_what_was_a_shortcut(script: Script, tmp_path: Path) -> None:
    record(tmp_path / "bag", [item for item in script.messages if item.type_name != PLAN])
    (run,) = evaluate_bag(tmp_path / "bag").runs
    assert run.shortcut_steps is run.library is run.samples is run.bound is None
    assert {option.kind for option in run.options} == {"unknown"}
    assert damages(tmp_path / "bag") == {"1 of 1 plans are missing"}
    plain = run.as_json()
    of_plan = {"shortcut_steps", "planner", "library", "samples", "bound"}
    assert plain["unknown"].keys() == of_plan


def test_a_skill_event_that_is_missing_is_missed(script: Script, tmp_path: Path) -> None:
    ends = [
        item
        for item in script.messages
        if item.type_name == SKILL_EVENT and item.message.kind == SkillEventKind.REACHED
    ]
    record(tmp_path / "bag", but(script, ends[:1]))
    assert damages(tmp_path / "bag") == {"skill events of 1 executed options are missing"}


def test_without_the_task_its_seed_is_unknown_and_not_minus_one(
    script: Script, tmp_path: Path
) -> None:
    record(tmp_path / "bag", [item for item in script.messages if item.type_name != TASK])
    (run,) = evaluate_bag(tmp_path / "bag").runs
    assert run.seed is run.index is None


def test_without_perceived_atoms_nobody_knows_whether_it_was_solved(
    script: Script, tmp_path: Path
) -> None:
    record(tmp_path / "bag", [item for item in script.messages if item.type_name != ATOMS])
    (run,) = evaluate_bag(tmp_path / "bag").runs
    assert run.success is None
    assert run.unknown.keys() == {"success"}
    assert run.plan_length == script.truth.plan_length
    assert damages(tmp_path / "bag") == {"all perceived atoms are missing"}
    assert "not known whether solved" in render([read_report(tmp_path / "bag")])


def test_without_the_last_atoms_nobody_knows_either(script: Script, tmp_path: Path) -> None:
    last = script.truth.plan_length
    lost = [m for m in script.messages if m.type_name == ATOMS and m.message.step == last]
    record(tmp_path / "bag", but(script, lost))
    (run,) = evaluate_bag(tmp_path / "bag").runs
    assert run.success is None
    told = f"the perceived atoms of step {last}, the last, are missing"
    assert damages(tmp_path / "bag") == {told}


def test_perception_may_be_slower_than_the_world(script: Script, tmp_path: Path) -> None:
    lost = [m for m in script.messages if m.type_name == ATOMS and m.message.step in (2, 3, 5)]
    record(tmp_path / "bag", but(script, lost))
    (run,) = evaluate_bag(tmp_path / "bag").runs
    assert run.success
    assert damages(tmp_path / "bag") == {None}


def test_without_plan_events_there_was_a_run_all_the_same(script: Script, tmp_path: Path) -> None:
    record(tmp_path / "bag", [item for item in script.messages if item.type_name != PLAN_EVENT])
    (run,) = evaluate_bag(tmp_path / "bag").runs
    plain = run.as_json()
    assert {name for name, value in plain.items() if value is None} == plain["unknown"].keys()
    assert set(plain["unknown"].values()) == {"the plan events are missing"}
    assert {"success", "plan_length", "replans", "shortcut_steps"} <= plain["unknown"].keys()
    assert (run.seed, run.planner, run.preset) == (7, "lazy", "fair")
    assert [o.name for o in run.options] == [o["name"] for o in script.truth.options]
    assert damages(tmp_path / "bag") == {"the plan events of episode 1 are missing"}
    page = render([read_report(tmp_path / "bag")])
    assert "not known whether solved" in page and "unknown length" in page


def test_the_command_says_what_is_not_known(script: Script, tmp_path: Path) -> None:
    for lost in (ATOMS, PLAN_EVENT):
        path = tmp_path / lost.rpartition("/")[2]
        record(path, [item for item in script.messages if item.type_name != lost])
        told = slap("bag", "evaluate", path, "--json")
        assert told.exit_code == ErrorCode.DAMAGED_BAG
        assert json.loads(told.stdout)["success"] is None
        table = slap("bag", "evaluate", path)
        assert table.exit_code == ErrorCode.DAMAGED_BAG
        assert "not known whether solved" in table.stdout


def test_where_nothing_was_planned_nothing_is_missing(script: Script, tmp_path: Path) -> None:
    """Skills may have been asked for one by one."""
    record(tmp_path / "bag", without(script.messages, "/slap/plan", "/slap/plan_events"))
    assert evaluate_bag(tmp_path / "bag").runs == []
    assert damages(tmp_path / "bag") == {None}
    said = slap("bag", "evaluate", tmp_path / "bag")
    assert said.exit_code == 0 and "no run" in said.stdout


def test_without_skill_events_nobody_knows_what_shortcuts_took(
    script: Script, tmp_path: Path
) -> None:
    record(tmp_path / "bag", [item for item in script.messages if item.type_name != SKILL_EVENT])
    (run,) = evaluate_bag(tmp_path / "bag").runs
    assert run.shortcut_steps is None
    assert run.unknown["shortcut_steps"] == "skill events are missing"


def test_without_the_domain_its_preset_is_not_known(script: Script, tmp_path: Path) -> None:
    record(tmp_path / "bag", without(script.messages, "/slap/domain"))
    found = evaluate_bag(tmp_path / "bag")
    assert found.runs[0].preset is None and "preset" in found.runs[0].unknown
    assert found.damage == "nothing names its domain" == bag_info(tmp_path / "bag").damage


def test_a_replay_without_commands_is_none(script: Script, tmp_path: Path) -> None:
    record(tmp_path / "bag", without(script.messages, "/slap/command"))
    replayed = replay_bag(tmp_path / "bag")
    assert replayed.unreached == script.truth.plan_length
    assert replayed.damage == "the commands of episode 1 are missing"


def split(script: Script, folder: Path, parts: int = 3) -> Path:
    """The run as ``ros2 bag record`` splits it."""
    whole = folder / "whole"
    record(whole, script.messages)
    path = folder / "split"
    path.mkdir()
    size = len(script.messages) // parts + 1
    for number in range(parts):
        part = folder / f"part{number}"
        record(part, script.messages[number * size : (number + 1) * size])
        (part / f"part{number}_0.mcap").rename(path / f"split_{number}.mcap")
    text = yaml.safe_load((whole / "metadata.yaml").read_text())
    text[ROOT]["relative_file_paths"] = [f"split_{number}.mcap" for number in range(parts)]
    (path / "metadata.yaml").write_text(yaml.safe_dump(text))
    return path


def test_a_file_that_is_gone_is_missed(script: Script, tmp_path: Path) -> None:
    path = split(script, tmp_path)
    assert evaluate_bag(path).damage is None
    (path / "split_1.mcap").unlink()
    (run,) = evaluate_bag(path).runs
    assert run.plan_length == script.truth.plan_length
    assert damages(path) == {"split_1.mcap is missing, which metadata.yaml lists"}


def test_fewer_messages_than_promised_are_missed(script: Script, tmp_path: Path) -> None:
    record(tmp_path / "bag", script.messages)
    record(tmp_path / "less", without(script.messages, "/diagnostics"))
    (tmp_path / "less/less_0.mcap").replace(tmp_path / "bag/bag_0.mcap")
    count = sum(item.topic == "/diagnostics" for item in script.messages)
    told = f"/diagnostics has 0 messages, metadata.yaml says {count}"
    assert damages(tmp_path / "bag") == {told}


def test_the_same_recording_twice_in_a_folder_counts_once(script: Script, tmp_path: Path) -> None:
    record(tmp_path / "bag", script.messages)
    before = evaluate_bag(tmp_path / "bag").runs
    shutil.copy(tmp_path / "bag/bag_0.mcap", tmp_path / "bag/bag_1.mcap")
    assert evaluate_bag(tmp_path / "bag").runs == before
    assert damages(tmp_path / "bag") == {"bag_1.mcap is there, which metadata.yaml does not list"}
    text = tmp_path / "bag/metadata.yaml"  # listed as well, it is noticed all the same
    listed = yaml.safe_load(text.read_text())
    listed[ROOT]["relative_file_paths"].append("bag_1.mcap")
    for topic in listed[ROOT]["topics_with_message_count"]:
        topic["message_count"] *= 2
    text.write_text(yaml.safe_dump(listed))
    assert evaluate_bag(tmp_path / "bag").runs == before
    (damage,) = damages(tmp_path / "bag")
    assert damage is not None
    assert damage.endswith(" events are there twice")


def test_flipped_metadata_are_found_in_either_place(script: Script, tmp_path: Path) -> None:
    record(tmp_path / "bag", script.messages)
    data, text = tmp_path / "bag/bag_0.mcap", tmp_path / "bag/metadata.yaml"
    whole, told = data.read_bytes(), text.read_text()
    seed = whole.index(b"seed") + len(b"seed") + 4
    assert whole[seed : seed + 1] == b"7"
    data.write_bytes(whole[:seed] + b"3" + whole[seed + 1 :])
    (damage,) = damages(tmp_path / "bag")
    assert damage == "the metadata in bag_0.mcap do not fit their checksum"
    assert read_bag(data).damage == damage  # the file alone

    data.write_bytes(whole)
    text.write_text(told.replace("seed: '7'", "seed: '3'"))
    (damage,) = damages(tmp_path / "bag")
    assert damage == "seed is another in metadata.yaml than in the data file"


@pytest.mark.slow
def test_every_flip_of_a_bit_in_the_metadata_is_found(script: Script, tmp_path: Path) -> None:
    record(tmp_path / "bag", script.messages)
    data = tmp_path / "bag/bag_0.mcap"
    whole = data.read_bytes()
    begin = whole.index(b"slap_ros", whole.index(b"slap_ros") + 1)  # the record's name
    end = whole.index(b"dirty") + 5
    for position in range(begin, end):
        flipped = bytearray(whole)
        flipped[position] ^= 1 << position % 8
        data.write_bytes(bytes(flipped))
        assert bag_info(tmp_path / "bag").damage is not None, position
