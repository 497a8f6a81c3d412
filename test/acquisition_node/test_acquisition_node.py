# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Proposals over the network: made, complained about, canceled, recorded, and without a key."""

from __future__ import annotations

import json
from contextlib import contextmanager
from html import unescape

import pytest
from rclpy.action import ActionClient
from rclpy.node import Node
from slap_msgs.action import ProposeOperators
from slap_msgs.msg import AcquisitionEvent, GroundAtom

from ensemble.interfaces import ACQUISITION_EVENTS, CLOSE_BAG, PROPOSE_OPERATORS
from ensemble.launcher import InProcessLauncher, ProcessLauncher
from ensemble.nodes import RunSettings, node_parameters
from ensemble.spinner import temporary_node
from slap_ros.bags.reader import read_bag
from slap_ros.domains import get_domain
from slap_ros.errors import ErrorCode
from slap_ros.messages.interfaces import ACQUISITION_EVENT
from slap_ros.relational.pddl import parse_domain
from slap_ros.report.content import read_report
from slap_ros.report.page import render
from slap_ros.skills.domain_choice import DomainChoice
from support.model_answers import decomposition_json, operator_json
from support.scripted_server import Step, serving

LIMIT = 120.0  # s
MANY = 100  # messages of feedback
KEY = "sk-this-is-nobodys-key"
DOMAIN = get_domain("obstacle2d")
SCRIPT = {
    "decomposition": [Step(decomposition_json(DOMAIN.operators))],
    **{f"operator {op.name}": [Step(operator_json(op))] for op in DOMAIN.operators},
}


class Asker(Node):
    """Asks for proposals, and notes what it is told."""

    def __init__(self) -> None:
        super().__init__("asker")
        self.client = ActionClient(self, PROPOSE_OPERATORS.type, PROPOSE_OPERATORS.name)
        self.events: list[AcquisitionEvent] = []
        self.feedback: list[ProposeOperators.Feedback] = []
        # A goal's own callback does not hear what its result overtakes.
        self.hearing = self.create_subscription(
            PROPOSE_OPERATORS.type.Impl.FeedbackMessage,
            f"{PROPOSE_OPERATORS.name}/_action/feedback",
            lambda m: self.feedback.append(m.feedback),
            MANY,
        )
        topic = ACQUISITION_EVENTS
        self.create_subscription(topic.type, topic.name, self.events.append, topic.qos)


@pytest.fixture(autouse=True)
def _no_settings_of_this_machine(monkeypatch):
    for name in ("SLAP_LANGUAGE_BASE_URL", "SLAP_LANGUAGE_MODEL", "HTTP_PROXY", "ALL_PROXY"):
        monkeypatch.delenv(name, raising=False)
        monkeypatch.delenv(name.lower(), raising=False)
    monkeypatch.setenv("OPENAI_API_KEY", KEY)


@contextmanager
def asking(record=None, **parameters):
    """A simulator, the acquisition node and whoever asks it."""
    settings = RunSettings(DomainChoice("obstacle2d", "fair"), 3, 0, "lazy", record)
    every = node_parameters(settings)
    beside = {name: every[name] for name in ("sim_node", "recorder_node") if name in every}
    with (
        ProcessLauncher({"acquisition_node": parameters}),
        temporary_node(Asker) as (asker, spinner),
        InProcessLauncher(beside, spinner.executor),
    ):
        assert spinner.spin_until(asker.client.server_is_ready, LIMIT)
        assert spinner.spin_until(lambda: asker.hearing.get_publisher_count() > 0, LIMIT)
        yield asker, spinner


def send(asker, spinner, **goal):
    """The handle of a goal that was accepted."""
    request = ProposeOperators.Goal(**goal)
    sent = asker.client.send_goal_async(request)
    assert spinner.spin_until(sent.done, LIMIT)
    return sent.result()


def close_bag(asker, spinner):
    """Wait until the recorder has read whatever was sent."""
    closing = asker.create_client(CLOSE_BAG.type, CLOSE_BAG.name)
    assert spinner.spin_until(closing.service_is_ready, LIMIT)
    closed = closing.call_async(CLOSE_BAG.type.Request())
    assert spinner.spin_until(closed.done, LIMIT)


def propose(asker, spinner, **goal):
    """The result of a goal."""
    result = send(asker, spinner, **goal).get_result_async()
    assert spinner.spin_until(result.done, LIMIT)
    return result.result().result


@pytest.mark.slow
def test_what_people_wrote_needs_no_model(network):
    with asking() as (asker, spinner):
        result = propose(asker, spinner)
        assert result.success, result.error_msg
        proposed = parse_domain(result.operators_pddl, "the result")
        assert {op.name for op in proposed.operators} == {op.name for op in DOMAIN.operators}
        assert len(result.plan) > 0
        assert json.loads(result.provenance)["proposer"] == "manual"
        wrong = propose(asker, spinner, proposer="oracle")
        assert wrong.error_code == ErrorCode.INVALID_PARAMETER
        assert "there are manual, induced, language" in wrong.error_msg
        unknown = GroundAtom(predicate="Shiny", objects=["block1"])
        assert propose(asker, spinner, goal=[unknown]).error_code == ErrorCode.UNKNOWN_PREDICATE
        assert propose(asker, spinner, episode=7).error_code == ErrorCode.NO_TASK
        assert propose(asker, spinner).success  # after all of that


def test_a_model_is_asked_and_told_what_is_wrong(network, tmp_path):
    first = DOMAIN.operators[0].name
    wrong = json.loads(SCRIPT[f"operator {first}"][0].text)
    wrong["preconditions"][0]["predicate"] = "Shiny"
    cut = Step("<script>alert(1)</script>" + SCRIPT["decomposition"][0].text[:20])
    script = SCRIPT | {
        "decomposition": [cut, *SCRIPT["decomposition"]],
        f"operator {first}": [Step(json.dumps(wrong)), *SCRIPT[f"operator {first}"]],
    }
    bag = tmp_path / "bag"
    with serving(script) as server:
        with asking(bag, base_url=server.url, model="scripted") as (asker, spinner):
            result = propose(asker, spinner, proposer="language")
            assert result.success, result.error_msg
            assert spinner.spin_until(lambda: len(asker.events) >= len(script) + 5, LIMIT)
            answers = sum(event.kind == AcquisitionEvent.ANSWERED for event in asker.events)
            assert spinner.spin_until(lambda: len(asker.feedback) > answers, LIMIT)
            close_bag(asker, spinner)
        sent = {name.lower(): value for name, value in server.headers[0].items()}
        assert sent["authorization"] == f"Bearer {KEY}"
    kinds = [event.kind for event in asker.events]
    assert kinds[0] == AcquisitionEvent.STARTED
    assert kinds[-2:] == [AcquisitionEvent.VERIFIED, AcquisitionEvent.FINISHED]
    answered = [e for e in asker.events if e.kind == AcquisitionEvent.ANSWERED]
    judged = [list(event.error_classes) for event in answered]
    assert judged[:3] == [["syntax"], [], ["unknown_predicate"]]
    assert len(asker.feedback) == len(answered) + 1  # and the planner's verdict
    assert asker.feedback[0].complaint != ""
    assert list(asker.events[-1].plan) == list(result.plan)
    provenance = json.loads(result.provenance)
    assert provenance["model"] == "scripted"
    assert set(provenance["requests"]) <= {event.request for event in answered}
    recorded = [m for m in read_bag(bag) if m.type_name == ACQUISITION_EVENT]
    assert [m.message.kind for m in recorded] == kinds
    page = render([read_report(bag)])
    assert "proposal 1: accepted" in page
    assert answered[2].complaints[0].split("'")[0] in unescape(page)
    assert "&lt;script&gt;alert(1)" in page
    assert "<script>alert(1)" not in page
    said = [str(asker.events), page, result.provenance, *(p.read_bytes() for p in bag.iterdir())]
    assert not any(KEY in (s if isinstance(s, str) else s.decode("latin1")) for s in said)


def test_canceling_ends_the_wait(network):
    script = SCRIPT | {"decomposition": [Step(SCRIPT["decomposition"][0].text, stall_s=2 * LIMIT)]}
    with serving(script) as server, asking(base_url=server.url, model="m") as (asker, spinner):
        handle = send(asker, spinner, proposer="language")
        assert spinner.spin_until(lambda: server.asked("decomposition") == 1, LIMIT)
        busy = propose(asker, spinner)
        assert busy.error_code == ErrorCode.BUSY
        handle.cancel_goal_async()
        result = handle.get_result_async()
        assert spinner.spin_until(result.done, LIMIT)
        assert result.result().result.error_code == ErrorCode.GOAL_CANCELED
        assert propose(asker, spinner).success


@pytest.mark.slow
def test_a_budget_is_kept_and_a_missing_model_is_said(network):
    with serving(SCRIPT) as server, asking(base_url=server.url, model="m") as (asker, spinner):
        result = propose(asker, spinner, proposer="language", attempts=1)
        assert result.error_code == ErrorCode.PROPOSAL_REJECTED
        assert len(server.requests) == 1
    with asking(cassette="off") as (asker, spinner):
        assert propose(asker, spinner, proposer="language").error_code == ErrorCode.LANGUAGE_OFF
