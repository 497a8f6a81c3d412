# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A bag that version 0.1.0 recorded is read by this one as it was read then.

It is of ``slap run obstacle2d --seed 4``, which uses a shortcut. Beside it lie the numbers that
version 0.1.0 computed from it.
"""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path

from slap_ros.bags import evaluate_bag, read_bag, replay_bag
from slap_ros.bags.digest import _canonical, bag_digest
from slap_ros.messages.interfaces import PLAN
from slap_ros.report import read_report, render
from support.truthful_run import make

DATA = Path(__file__).parent / "data"
BAG = DATA / "recorded_by_0.1.0"
THEN = json.loads((DATA / "recorded_by_0.1.0.json").read_text(encoding="utf-8"))
DIGEST = "96c502880599be98ba8ddeb69888cf15ec9f7ed838820c006331629aedafceeb"  # as 0.1.0 computes it


def test_its_numbers_are_what_they_were() -> None:
    found = evaluate_bag(BAG)
    (run,) = found.runs
    now = run.as_json() | {
        "states_compared": found.compared,
        "atom_mismatches": len(found.mismatches),
    }
    assert {key: now[key] for key in THEN} == THEN
    assert run.bound is None  # planners said nothing of it then
    assert not run.unknown


def test_its_commands_lead_to_the_same_states() -> None:
    replayed = replay_bag(BAG)
    assert replayed.identical, asdict(replayed)
    assert replayed.compared == THEN["plan_length"] + 1


def test_its_digest_is_what_it_was() -> None:
    assert bag_digest(BAG) == DIGEST


def test_its_report_shows_the_plan_and_the_shortcut() -> None:
    report = read_report(BAG)
    (run,) = report.runs
    assert [span.option.name for span in run.spans] == [o["name"] for o in THEN["options"]]
    assert [edge.is_shortcut for edge in run.chains[0].edges] == [False, True]
    assert run.scene is not None
    assert f"solved in {THEN['plan_length']} steps" in render([report])


def test_fields_that_came_later_change_no_digest_while_they_are_empty() -> None:
    (plan,) = (message for _, kind, _, message in read_bag(BAG) if kind == PLAN)
    old = plan.edges[0]
    values = {name: getattr(old, name) for name in old.__dataclass_fields__}
    assert not set(values) & {"others_may_appear", "forbidden_atoms"}
    new = make(old.__msgtype__, **values, others_may_appear=False, forbidden_atoms=[])
    assert list(_canonical(new)) == list(_canonical(old))
    new.others_may_appear = True
    assert list(_canonical(new)) != list(_canonical(old))
