# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Services between processes."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable

import pytest
import rclpy
from example_interfaces.srv import AddTwoInts
from rclpy._dds_qos import to_policies
from rclpy.node import Node
from rclpy.qos import qos_profile_services_default
from rclpy.service import PREFIX_SIZE, REQUEST_HEADER
from std_srvs.srv import Trigger

from conftest import TIMEOUT_S, Process, complete, spin_until, wait_until
from embedded_ros.transport import names
from embedded_ros.transport.endpoints import Sample
from embedded_ros.types.cdr import HEADER, deserialize, serialize

Run = Callable[..., Process]


def test_requests_are_answered(node: Node, run: Run) -> None:
    run("adder")
    client = node.create_client(AddTwoInts, "add")
    assert client.wait_for_service(TIMEOUT_S)
    futures = [client.call_async(AddTwoInts.Request(a=i, b=1)) for i in range(10)]
    assert [complete(node, future).sum for future in futures] == list(range(1, 11))


def test_two_clients_get_their_own_answers(node: Node, run: Run) -> None:
    run("adder")
    first, second = (node.create_client(AddTwoInts, "add") for _ in range(2))
    assert first.wait_for_service(TIMEOUT_S)
    assert second.wait_for_service(TIMEOUT_S)
    one = first.call_async(AddTwoInts.Request(a=1, b=1))
    two = second.call_async(AddTwoInts.Request(a=2, b=2))
    assert (complete(node, one).sum, complete(node, two).sum) == (2, 4)


def test_blocking_calls_work_from_another_thread(node: Node, run: Run) -> None:
    run("adder")
    client = node.create_client(AddTwoInts, "add")
    assert client.wait_for_service(TIMEOUT_S)
    answers: list[int] = []
    caller = threading.Thread(
        target=lambda: answers.append(client.call(AddTwoInts.Request(a=3, b=4)).sum)
    )
    caller.start()
    assert spin_until(node, lambda: bool(answers))
    caller.join()
    assert answers == [7]


def test_a_client_whose_reader_is_discovered_late_is_answered(node: Node, run: Run) -> None:
    run("adder")
    participant, policies = node._participant, to_policies(qos_profile_services_default)
    tag = participant._service_tag("clientid")
    kind = AddTwoInts.Request.ros_type.removesuffix("_Request")
    writer = participant.create_writer(
        names.request_topic("/add"), f"{kind}_Request", policies, tag
    )
    assert wait_until(lambda: bool(writer.matched_handles()))
    prefix = HEADER + REQUEST_HEADER.pack(7, 1)
    writer.write(serialize(AddTwoInts.Request(a=2, b=3), prefix))
    time.sleep(0.5)  # s; where nothing gets lost, it is some milliseconds
    reader = participant.create_reader(names.reply_topic("/add"), f"{kind}_Response", policies, tag)
    samples: list[Sample] = []

    def answered() -> bool:
        if (sample := reader.take()) is not None:
            samples.append(sample)
        return bool(samples)

    assert wait_until(answered)
    answer = deserialize(samples[0].data, AddTwoInts.Response.ros_type, PREFIX_SIZE)
    assert answer.sum == 5


def test_a_call_nobody_answers_times_out(node: Node) -> None:
    client = node.create_client(Trigger, "nobody")
    assert not client.wait_for_service(0.05)
    with pytest.raises(TimeoutError, match=r"/nobody: no response within 0\.05 s"):
        client.call(Trigger.Request(), timeout_sec=0.05)


def test_a_removed_request_stays_pending(node: Node, run: Run) -> None:
    run("adder")
    client = node.create_client(AddTwoInts, "add")
    assert client.wait_for_service(TIMEOUT_S)
    removed = client.call_async(AddTwoInts.Request(a=1, b=1))
    client.remove_pending_request(removed)
    complete(node, client.call_async(AddTwoInts.Request(a=1, b=2)))
    assert not removed.done()


def test_an_exception_in_a_service_ends_spin(node: Node) -> None:
    def fail(request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        raise KeyError("broken")

    node.create_service(Trigger, "fail", fail)
    client = node.create_client(Trigger, "fail")
    assert client.wait_for_service(TIMEOUT_S)
    client.call_async(Trigger.Request())
    with pytest.raises(KeyError, match="broken"):
        spin_until(node, lambda: False)


def test_a_wrong_response_is_refused(node: Node) -> None:
    node.create_service(Trigger, "wrong", lambda request, response: True)
    client = node.create_client(Trigger, "wrong")
    assert client.wait_for_service(TIMEOUT_S)
    client.call_async(Trigger.Request())
    with pytest.raises(TypeError, match="/wrong: expected std_srvs/srv/Trigger_Response, got bool"):
        spin_until(node, lambda: False)
    with pytest.raises(TypeError, match="expected std_srvs/srv/Trigger_Request"):
        client.call_async(Trigger.Response())


def test_a_destroyed_server_is_not_ready_any_more(node: Node) -> None:
    service = node.create_service(Trigger, "short", lambda request, response: response)
    client = node.create_client(Trigger, "short")
    assert client.wait_for_service(TIMEOUT_S)
    node.destroy_service(service)
    assert not client.service_is_ready()


def test_a_service_may_await_another(node: Node, run: Run) -> None:
    run("adder")
    group = rclpy.callback_groups.ReentrantCallbackGroup()
    inner = node.create_client(AddTwoInts, "add", callback_group=group)
    assert inner.wait_for_service(TIMEOUT_S)

    async def twice(
        request: AddTwoInts.Request, response: AddTwoInts.Response
    ) -> AddTwoInts.Response:
        first = await inner.call_async(request)
        second = await inner.call_async(AddTwoInts.Request(a=first.sum, b=first.sum))
        response.sum = second.sum
        return response

    node.create_service(AddTwoInts, "twice", twice, callback_group=group)
    outer = node.create_client(AddTwoInts, "twice")
    assert outer.wait_for_service(TIMEOUT_S)
    assert complete(node, outer.call_async(AddTwoInts.Request(a=1, b=2))).sum == 6
