# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

import copy
from math import inf, nan
from pathlib import Path

import pytest

from slap_ros.bags import evaluate_bag
from slap_ros.bags.evaluate import AtomMismatch
from slap_ros.errors import ErrorCode, ForeignBagError, UnknownDomainError
from slap_ros.messages.interfaces import ATOMS, DOMAIN_INFO, PLAN
from support.truthful_run import Script, record, without


@pytest.mark.parametrize("seed", [7, 11, 23])
def test_the_numbers_are_those_of_what_happened(tmp_path: Path, seed: int) -> None:
    script = Script(seed)
    script.run(index=2)
    record(tmp_path / "bag", script.messages)
    evaluation = evaluate_bag(tmp_path / "bag")
    (run,) = evaluation.runs
    assert run.as_json() == {
        "domain": "obstacle2d",
        "preset": "fair",
        "seed": seed,
        "index": 2,
        "success": True,
        "plan_length": script.truth.plan_length,
        "shortcut_steps": 0,
        "planning_seconds": script.truth.planning_ns / 1e9,
        "replans": 0,
        "edges_rolled_out": script.truth.edges_rolled_out,
        "error_code": 0,
        "error_msg": "",
        "options": script.truth.options,
        "planner": "lazy",
        "library": "0123456789abcdef",
        "samples": 16,
        "bound": script.truth.bound,
        "unknown": {},
    }
    assert sum(option["steps"] for option in script.truth.options) == run.plan_length
    assert evaluation.mismatches == []
    assert evaluation.states == evaluation.compared == run.plan_length + 1
    assert evaluation.damage is None


def test_tampered_atoms_are_found(script: Script, tmp_path: Path) -> None:
    messages = copy.deepcopy(script.messages)
    fifth = next(m.message for m in messages if m.type_name == ATOMS and m.message.step == 5)
    gone = fifth.atoms.pop(0)
    fifth.atoms.append(copy.deepcopy(fifth.atoms[0]))
    fifth.atoms[-1].objects = ["nobody"]
    record(tmp_path / "bag", messages)
    assert evaluate_bag(tmp_path / "bag").mismatches == [
        AtomMismatch(
            episode=1,
            step=5,
            missing=(f"{gone.predicate}({', '.join(gone.objects)})",),
            extra=(f"{fifth.atoms[0].predicate}(nobody)",),
        )
    ]


@pytest.mark.parametrize("events", [True, False])
@pytest.mark.parametrize(
    ("recorded", "told"),
    [(1.0, 1.0), (1.1, 1.1), *((odd, None) for odd in (0.0, 0.5, -2.0, 1e308, inf, nan))],
)
def test_a_bound_is_what_the_plan_says_or_not_known(
    script: Script, tmp_path: Path, recorded: float, told: float | None, events: bool
) -> None:
    messages = copy.deepcopy(script.messages)
    next(m.message for m in messages if m.type_name == PLAN).bound = recorded
    kept = messages if events else without(messages, "/slap/plan_events")
    record(tmp_path / "bag", kept)
    (run,) = evaluate_bag(tmp_path / "bag").runs
    assert run.bound == told
    assert "bound" not in run.unknown  # the bag has all that the planner said


def test_a_run_that_the_recording_cuts_off(script: Script, tmp_path: Path) -> None:
    cut = next(
        i
        for i, m in enumerate(script.messages)
        if m.topic == "/slap/state" and m.message.step == 12
    )
    record(tmp_path / "bag", script.messages[: cut + 1])
    (run,) = evaluate_bag(tmp_path / "bag").runs
    assert run.error_code is ErrorCode.NODE_DIED
    assert "ends before" in run.error_msg
    assert not run.success
    assert run.plan_length == 12
    assert run.options[-1].outcome == "unfinished"
    assert sum(option.steps for option in run.options) == 12


def test_without_perception_nothing_is_compared(script: Script, tmp_path: Path) -> None:
    record(tmp_path / "bag", without(script.messages, "/slap/atoms"))
    evaluation = evaluate_bag(tmp_path / "bag")
    assert evaluation.compared == 0 < evaluation.states
    assert evaluation.runs[0].success is None
    assert "no atoms of step" in evaluation.runs[0].error_msg


def test_without_the_domain_only_metrics(script: Script, tmp_path: Path) -> None:
    record(tmp_path / "bag", without(script.messages, "/slap/domain"))
    evaluation = evaluate_bag(tmp_path / "bag")
    assert evaluation.compared == 0
    assert evaluation.runs[0].success


def test_another_domain_is_refused(script: Script, tmp_path: Path) -> None:
    messages = copy.deepcopy(script.messages)
    info = next(m.message for m in messages if m.type_name == DOMAIN_INFO)
    info.types[0].feature_names = ["y", "x"]
    record(tmp_path / "features", messages)
    with pytest.raises(ForeignBagError, match="version mismatch"):
        evaluate_bag(tmp_path / "features")
    info.name = "juggling"
    record(tmp_path / "name", messages)
    with pytest.raises(UnknownDomainError, match="juggling"):
        evaluate_bag(tmp_path / "name")
