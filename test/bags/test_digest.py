# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

import copy
import subprocess
from pathlib import Path

import numpy as np

from slap_ros.bags import bag_digest
from slap_ros.messages.interfaces import DOMAIN_INFO, PLAN, STATE
from support.programs import environment, program
from support.truthful_run import Script, make, record, without

HERE = Path(__file__).parent


def record_in_a_process(path: Path, clock_ns: int) -> None:
    subprocess.run(
        [*program("truthful_run"), str(path), "7", str(clock_ns)],
        check=True,
        env=environment() | {"PYTHONHASHSEED": str(clock_ns % 100)},
    )


def test_runs_in_two_processes_have_one_digest(honest_bag: Path, tmp_path: Path) -> None:
    record_in_a_process(tmp_path / "one", 1_600_000_000_123_456_789)
    record_in_a_process(tmp_path / "two", 1_650_000_000_987_654_321)
    digests = {bag_digest(path) for path in (tmp_path / "one", tmp_path / "two", honest_bag)}
    assert len(digests) == 1
    assert len(digests.pop()) == 64


def test_a_changed_state_changes_it(script: Script, honest_bag: Path, tmp_path: Path) -> None:
    messages = copy.deepcopy(script.messages)
    state = next(m.message for m in messages if m.type_name == STATE and m.message.step == 9)
    state.objects[1].features.view(np.uint64)[0] ^= np.uint64(1)
    record(tmp_path / "bag", messages)
    assert bag_digest(tmp_path / "bag") != bag_digest(honest_bag)


def test_order_within_a_topic_counts_and_between_topics_does_not(
    script: Script, honest_bag: Path, tmp_path: Path
) -> None:
    by_topic = sorted(script.messages, key=lambda m: m.topic)
    record(tmp_path / "sorted", by_topic)
    assert bag_digest(tmp_path / "sorted") == bag_digest(honest_bag)
    record(tmp_path / "reversed", reversed(by_topic))
    assert bag_digest(tmp_path / "reversed") != bag_digest(honest_bag)


def test_a_setting_that_came_later_counts_where_it_changes_something(
    script: Script, honest_bag: Path, tmp_path: Path
) -> None:
    digests = []
    for value in ("(1, 1)", "(3, 3)"):
        messages = copy.deepcopy(script.messages)
        info = next(m.message for m in messages if m.type_name == DOMAIN_INFO)
        info.configuration = [make("diagnostic_msgs/msg/KeyValue", key="towers", value=value)]
        record(tmp_path / value, messages)
        digests.append(bag_digest(tmp_path / value))
    assert digests[0] == bag_digest(honest_bag)
    assert digests[1] != bag_digest(honest_bag)


def test_what_is_proven_of_a_plan_does_not_count(
    script: Script, honest_bag: Path, tmp_path: Path
) -> None:
    messages = copy.deepcopy(script.messages)
    plan = next(m.message for m in messages if m.type_name == PLAN)
    assert plan.bound == 1.0
    for bound in (0.0, 1.25):
        plan.bound = bound
        record(tmp_path / str(bound), messages)
        assert bag_digest(tmp_path / str(bound)) == bag_digest(honest_bag)


def test_diagnostics_do_not_count(script: Script, honest_bag: Path, tmp_path: Path) -> None:
    record(tmp_path / "bag", without(script.messages, "/diagnostics"))
    assert bag_digest(tmp_path / "bag") == bag_digest(honest_bag)
