# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a bag tells of skills and shortcuts: whole, broken off, with impossible numbers, earlier."""

import math
from dataclasses import astuple, dataclass
from typing import Any

from slap_ros.messages.events import AcquisitionEventKind as Kind
from slap_ros.messages.interfaces import ACQUISITION_EVENT
from slap_ros.messages.typestore import typestore
from slap_ros.report.acquisitions import recorded_acquisitions
from slap_ros.report.proposals import recorded_proposals

EMPTY: dict[str, Any] = {"error_msg": "", "subject": "", "plan": [], "complaints": []}


def event(kind, **fields):
    """An event as rosbags has it, of the fields that are read."""
    made = typestore().types[ACQUISITION_EVENT]
    names = [name for name, _ in typestore().fielddefs[ACQUISITION_EVENT][1]]
    defaults = EMPTY | {"operators": [], "digest": "", "success": [], "iteration": 0}
    values = dict.fromkeys(names, 0) | defaults | {"answer": "", "kind": kind} | fields
    return made(**values)


def rollout(iteration, failed, progress, *reasons):
    return event(
        Kind.ROLLED_OUT, iteration=iteration, subject=failed, progress=progress, complaints=reasons
    )


def judged(skill, *success):
    return event(Kind.JUDGED, subject=skill, success=success, segment_steps=100)


BEGUN = [
    event(Kind.STARTED),
    event(Kind.FINISHED, operators=["Pick(?a)"]),
    rollout(0, "Pick", 0.25, "effect not reached", "Holding(a)"),
    rollout(0, "Pick", 0.75, "effect not reached", "Holding(a)"),
    judged("Pick", 0.0, 0.5, 0.75),
]


def test_iterations_and_curves_of_several_rounds():
    events = [*BEGUN, rollout(1, "", 1.0), judged("Pick", 0.75, 1.0)]
    (whole,) = recorded_acquisitions([*events, event(Kind.ACQUIRED, digest="abc")])
    assert (whole.outcome, whole.digest, whole.operators) == (
        "skills acquired",
        "abc",
        ("Pick(?a)",),
    )
    first, second = whole.iterations
    assert (first.progress, first.rollouts) == (0.5, 2)
    assert first.failures == (("Pick", 2, "effect not reached: Holding(a)"),)
    assert (second.progress, second.failures) == (1.0, ())
    (curve,) = whole.curves
    assert curve.steps == (0, 100, 200, 200, 300)
    assert curve.success == (0.0, 0.5, 0.75, 0.75, 1.0)
    assert [one.outcome for one in recorded_proposals(events)] == ["accepted"]


def test_what_breaks_off_or_fails_is_shown_up_to_there():
    failed = event(Kind.FAILED, subject="skills", error_msg="killed")
    for end, outcome in (([], "not ended"), ([failed], "failed")):
        (broken,) = recorded_acquisitions([*BEGUN, *end])
        assert (broken.outcome, len(broken.curves)) == (outcome, 1)
        assert [one.outcome for one in recorded_proposals([*BEGUN, *end])] == ["accepted"]
    rejected = [event(Kind.STARTED), failed]  # no operators, so nothing was learned
    assert recorded_acquisitions(rejected) == ()
    assert [one.reason for one in recorded_proposals(rejected)] == ["killed"]


def validated(shortcut, *lengths, kept=False):
    return event(Kind.VALIDATED, subject=shortcut, lengths=lengths, kept=kept)


def test_shortcuts_over_the_skills_are_shown_whether_kept_or_not():
    tried = [
        validated("Push", 120.0, 90.0, kept=True),
        validated("Throw", 90.0),  # with it, a task had no plan
        validated("Slide", math.inf, math.nan),
    ]
    events = [*BEGUN, *tried, event(Kind.ACQUIRED)]
    (grown,) = recorded_acquisitions(events)
    assert [astuple(one) for one in grown.shortcuts] == [
        ("Push", 120.0, 90.0, True),
        ("Throw", 90.0, None, False),
        ("Slide", None, None, False),
    ]
    assert [one.outcome for one in recorded_proposals(events)] == ["accepted"]
    (gone_on,) = recorded_acquisitions(tried)  # the skills were learned before
    assert (gone_on.outcome, len(gone_on.shortcuts), gone_on.curves) == ("not ended", 3, ())


def test_numbers_that_cannot_be_are_drawn_as_some_that_can():
    (odd,) = recorded_acquisitions([judged("Pick", math.nan, 7.0, -math.inf), judged("Put")])
    (curve,) = odd.curves
    assert curve.success == (0.0, 1.0, 0.0)
    (still,) = recorded_acquisitions([judged("Pick", 1.0)])
    assert still.curves[0].points == "0.0000,0.000"


@dataclass
class EarlierEvent:
    """As bags have it that were recorded before skills were acquired."""

    kind: int
    error_msg: str = ""
    subject: str = ""


def test_earlier_bags_are_read():
    assert recorded_acquisitions([EarlierEvent(kind) for kind in range(6)]) == ()
