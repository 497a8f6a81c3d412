# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a viewer gets of a live run, over a real WebSocket."""

from __future__ import annotations

import json
import re
import socket
import struct
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest

from slap_ros.domains import get_domain
from slap_ros.messages.decode import decode_state
from slap_ros.messages.events import PlanEventKind
from slap_ros.messages.typestore import definition, typestore

websocket = pytest.importorskip("websocket", reason="websocket-client is not installed")
pytest.importorskip("foxglove", reason="foxglove-sdk is not installed")

RUN = ["run", "obstacle2d", "--seed", "3", "--shortcuts", "none", "--in-process", "--live"]
RUN += ["--patience", "10"]  # for a loaded machine
MESSAGE = 1  # opcode of the protocol's binary frames that carry one
WAIT = 120.0  # s, far more than anything here takes


class Viewer:
    """Connects as Foxglove does, subscribes to everything and remembers what it gets."""

    def __init__(self, url: str) -> None:
        self._socket = websocket.create_connection(
            url, subprotocols=["foxglove.sdk.v1"], timeout=WAIT
        )
        self.channels: dict[str, dict[str, Any]] = {}  # by topic
        self.heard: dict[str, list[Any]] = {}  # by topic
        self._topics: dict[int, str] = {}  # by subscription

    def until(self, condition: Any) -> None:
        while not condition():
            opcode, data = self._socket.recv_data()
            if opcode == websocket.ABNF.OPCODE_TEXT:
                self._on_text(json.loads(data))
            elif opcode == websocket.ABNF.OPCODE_BINARY and data[0] == MESSAGE:
                subscription, _ = struct.unpack("<IQ", data[1:13])
                topic = self._topics[subscription]
                kind = self.channels[topic]["schemaName"]
                message = typestore().deserialize_cdr(data[13:], kind)
                self.heard.setdefault(topic, []).append(message)

    def _on_text(self, message: dict[str, Any]) -> None:
        if message["op"] != "advertise":
            return
        for channel in message["channels"]:
            self.channels[channel["topic"]] = channel
            self._topics[channel["id"]] = channel["topic"]
        subscriptions = [{"id": c["id"], "channelId": c["id"]} for c in message["channels"]]
        self._socket.send(json.dumps({"op": "subscribe", "subscriptions": subscriptions}))

    def close(self) -> None:
        self._socket.close()

    @property
    def ended(self) -> bool:
        events = [event.kind for event in self.heard.get("/slap/plan_events", ())]
        if PlanEventKind.SOLVED not in events:
            return False
        last = self.heard["/slap/plan_events"][-1].step
        topics = ("/slap/state", "/slap/atoms")
        return all(self.heard.get(t, [None])[-1].step == last for t in topics) and (
            len(self.heard.get("/slap/markers", ())) == len(self.heard["/slap/state"])
        )


@contextmanager
def live_run(*options: str) -> Iterator[tuple[subprocess.Popen[str], str]]:
    command = [sys.executable, "-m", "ensemble.cli", *RUN, *options]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as process:
        try:
            assert process.stderr is not None
            url = re.search(r"ws://127\.0\.0\.1:\d+", process.stderr.readline())
            assert url is not None
            yield process, url[0]
        finally:
            process.kill()


def test_a_viewer_gets_the_whole_run_as_ros_has_it(network: int) -> None:
    with live_run("--watched") as (process, url):
        viewer = Viewer(url)
        viewer.until(lambda: viewer.ended)
        late = Viewer(url)  # sees how things are, though nothing happens any more
        late.until(lambda: {"/slap/plan", "/slap/markers", "/tf"} <= late.heard.keys())
        viewer.close()
        late.close()
        assert process.wait(WAIT) == 0

    for topic, channel in viewer.channels.items():
        assert channel["encoding"] == "cdr", topic
        assert channel["schemaEncoding"] == "ros2msg", topic
        assert channel["schema"] == definition(channel["schemaName"]), topic
    assert {"/slap/state", "/slap/atoms", "/slap/plan", "/joint_states"} <= viewer.channels.keys()

    domain = get_domain("obstacle2d")
    task = domain.task(3)
    states = viewer.heard["/slap/state"]
    assert [message.step for message in states] == list(range(len(states)))
    assert decode_state(states[0], domain.types_by_name) == task.initial_state
    last = decode_state(states[-1], domain.types_by_name)
    holding = {(a.predicate, *a.objects) for a in viewer.heard["/slap/atoms"][-1].atoms}
    assert {(a.predicate.name, *(o.name for o in a.objects)) for a in task.goal} <= holding
    for marker, body in zip(
        viewer.heard["/slap/markers"][-1].markers, domain.display.bodies(last), strict=True
    ):
        at = marker.pose.position
        assert (marker.text, at.x, at.y, at.z) == (body.name, *body.position)
    frames = {transform.child_frame_id for transform in viewer.heard["/tf"][-1].transforms}
    assert frames == {body.name for body in domain.display.bodies(last)}
    assert late.heard["/slap/plan"][-1].edges == viewer.heard["/slap/plan"][-1].edges
    assert [e.name for e in late.heard["/slap/plan"][-1].edges][-1] == "PlaceInTarget"


@pytest.mark.slow
def test_nobody_need_watch(network: int) -> None:
    with live_run() as (process, _):
        assert process.wait(WAIT) == 0


def test_a_port_that_is_taken_is_refused_where_it_was_asked_for(network: int) -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = str(taken.getsockname()[1])
        code, said = slap("--live-port", port)
    assert code == 15
    assert f"port {port}" in said


@pytest.mark.slow
def test_what_is_missing_is_said_with_how_to_get_it(network: int) -> None:
    code, said = slap("--watched", without="foxglove")
    assert code == 15
    assert "pip install 'slap_ros[live]'" in said
    code, said = slap(without="foxglove")  # the terminal does without it
    assert code == 0
    assert "pip install 'slap_ros[live]'" in said


def slap(*options: str, without: str = "") -> tuple[int, str]:
    hide = f"import sys; sys.modules[{without!r}] = None; " if without else ""
    command = f"{hide}from ensemble.cli import main; main()"
    ran = subprocess.run(
        [sys.executable, "-c", command, *RUN, *options],
        capture_output=True,
        text=True,
        timeout=WAIT,
    )
    return ran.returncode, " ".join(ran.stderr.split())
