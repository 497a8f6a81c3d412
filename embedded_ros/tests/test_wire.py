# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The wire, read and written by CycloneDDS alone with types written by hand.

Nothing of embedded_ros is used on this side but the environment's configuration.
"""

# No postponed annotations here: IdlStruct reads them.
import os
import socket
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import psutil
import pytest
import rclpy
from cyclonedds.builtin import (
    BuiltinDataReader,
    BuiltinTopicDcpsParticipant,
    BuiltinTopicDcpsPublication,
    BuiltinTopicDcpsSubscription,
)
from cyclonedds.core import Policy, Qos
from cyclonedds.domain import Domain, DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.types import array, bounded_str, int64, sequence, uint8, uint64
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic

from conftest import Process, wait_until
from embedded_ros.transport import loopback

CONFIGURATION = (
    '<CycloneDDS><Domain><General><Interfaces><NetworkInterface name="lo"/></Interfaces>'
    "<AllowMulticast>false</AllowMulticast></General><Discovery>"
    "<ParticipantIndex>auto</ParticipantIndex>"
    "<MaxAutoParticipantIndex>32</MaxAutoParticipantIndex>"
    '<Peers><Peer address="localhost" PruneDelay="inf"/></Peers>'
    "</Discovery></Domain></CycloneDDS>"
)
STRING_HASH = "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18"


@dataclass
class String_(IdlStruct, typename="std_msgs.msg.dds_.String_"):
    data_: str


@dataclass
class AddTwoInts_Request_(IdlStruct, typename="example_interfaces.srv.dds_.AddTwoInts_Request_"):
    guid_: uint64
    seq_: int64
    a_: int64
    b_: int64


@dataclass
class AddTwoInts_Response_(IdlStruct, typename="example_interfaces.srv.dds_.AddTwoInts_Response_"):
    guid_: uint64
    seq_: int64
    sum_: int64


@dataclass
class Gid_(IdlStruct, typename="rmw_dds_common.msg.dds_.Gid_"):
    data_: array[uint8, 16]


@dataclass
class NodeEntitiesInfo_(IdlStruct, typename="rmw_dds_common.msg.dds_.NodeEntitiesInfo_"):
    node_namespace_: bounded_str[256]
    node_name_: bounded_str[256]
    reader_gid_seq_: sequence[Gid_]
    writer_gid_seq_: sequence[Gid_]


@dataclass
class ParticipantEntitiesInfo_(
    IdlStruct, typename="rmw_dds_common.msg.dds_.ParticipantEntitiesInfo_"
):
    gid_: Gid_
    node_entities_info_seq_: sequence[NodeEntitiesInfo_]


RELIABLE = Qos(
    Policy.Reliability.Reliable(10**8),
    Policy.History.KeepLast(10),
    Policy.Durability.Volatile,
    Policy.DataRepresentation(use_cdrv0_representation=True),
)
LATCHED = Qos(
    Policy.Reliability.Reliable(10**8),
    Policy.History.KeepLast(10),
    Policy.Durability.TransientLocal,
    Policy.DataRepresentation(use_cdrv0_representation=True),
)


@pytest.fixture
def participant(domain: int) -> Iterator[DomainParticipant]:
    configured = Domain(domain, CONFIGURATION)
    participant = DomainParticipant(domain)
    yield participant
    participant.__del__()
    configured.__del__()


def first_answer(writer: DataWriter, question: Any, reader: DataReader) -> Any:
    """What is received after a question, which may be answered several times."""
    assert wait_until(lambda: bool(writer.get_matched_subscriptions()))
    assert wait_until(lambda: bool(reader.get_matched_publications()))
    taken: list[Any] = []

    def answered() -> bool:
        # Asked again, as the other side may not have discovered our reader yet.
        writer.write(question)
        time.sleep(0.05)
        taken.extend(reader.take(10))
        return bool(taken)

    assert wait_until(answered), "nothing received"
    return taken[0]


def endpoint_on(participant: DomainParticipant, kind: Any, topic: str) -> Any:
    """The other process's only endpoint on a topic, as soon as it is discovered."""
    reader = BuiltinDataReader(participant, kind)
    found: list[Any] = []

    def discovered() -> bool:
        found.extend(sample for sample in reader.take(1000) if sample.topic_name == topic)
        return bool(found)

    assert wait_until(discovered), topic
    return found[0]


def user_data(endpoint: Any) -> dict[str, str]:
    pairs = bytes(endpoint.qos[Policy.Userdata].data).decode().split(";")
    return dict(pair.split("=") for pair in pairs if pair)


def test_strings_cross_in_both_directions(
    participant: DomainParticipant, run: Callable[..., Process]
) -> None:
    process = run("echo")
    reader = DataReader(participant, Topic(participant, "rt/out", String_), RELIABLE)
    writer = DataWriter(participant, Topic(participant, "rt/in", String_), RELIABLE)
    process.wait_for_line("ready")
    assert first_answer(writer, String_("probe"), reader) == String_("probe")
    for text in ("", "a", "grüße", "x" * 5000):
        writer.write(String_(text))
        assert wait_until(lambda text=text: String_(text) in reader.take(10)), text[:10]


def test_a_service_answers_with_the_request_header(
    participant: DomainParticipant, run: Callable[..., Process]
) -> None:
    process = run("adder")
    replies = DataReader(
        participant, Topic(participant, "rr/addReply", AddTwoInts_Response_), RELIABLE
    )
    requests = DataWriter(
        participant, Topic(participant, "rq/addRequest", AddTwoInts_Request_), RELIABLE
    )
    process.wait_for_line("ready")
    request = AddTwoInts_Request_(guid_=2**63 + 7, seq_=41, a_=-5, b_=7)
    response = AddTwoInts_Response_(guid_=2**63 + 7, seq_=41, sum_=2)
    assert first_answer(requests, request, replies) == response


def test_nodes_and_their_endpoints_are_announced(
    participant: DomainParticipant, run: Callable[..., Process]
) -> None:
    run("echo", "--ros-args", "-r", "__ns:=/slap").wait_for_line("ready")
    reader = DataReader(
        participant, Topic(participant, "ros_discovery_info", ParticipantEntitiesInfo_), LATCHED
    )
    out = endpoint_on(participant, BuiltinTopicDcpsPublication, "rt/slap/out")
    nodes: list[Any] = []

    def announced() -> bool:
        for info in reader.take(10):
            nodes[:] = info.node_entities_info_seq_
        writers = [list(gid.data_) for node in nodes for gid in node.writer_gid_seq_]
        return list(out.key.bytes) in writers

    assert wait_until(announced)
    assert [(n.node_namespace_, n.node_name_) for n in nodes] == [("/slap", "echo")]
    assert out.type_name == "std_msgs::msg::dds_::String_"
    assert user_data(out) == {"typehash": STRING_HASH}


def test_both_ends_of_a_service_are_tied_together(
    participant: DomainParticipant, run: Callable[..., Process]
) -> None:
    run("adder").wait_for_line("ready")
    reply = user_data(endpoint_on(participant, BuiltinTopicDcpsPublication, "rr/addReply"))
    request = user_data(endpoint_on(participant, BuiltinTopicDcpsSubscription, "rq/addRequest"))
    assert reply["serviceid"] == request["serviceid"]
    assert len(reply["serviceid"].split(".")) == 16
    assert reply["typehash"] != request["typehash"]


def test_a_lease_of_four_seconds_is_announced(
    participant: DomainParticipant, run: Callable[..., Process]
) -> None:
    """After which a killed process is taken for gone."""
    run("echo")
    reader = BuiltinDataReader(participant, BuiltinTopicDcpsParticipant)
    others: list[Any] = []

    def discovered() -> bool:
        others.extend(found for found in reader.take(10) if found.key != participant.guid)
        return bool(others)

    assert wait_until(discovered)
    assert others[0].qos[Policy.Liveliness] == Policy.Liveliness.Automatic(4 * 10**9)


@pytest.mark.skipif(not hasattr(socket, "SO_BINDTODEVICE"), reason="Linux alone can do that")
@pytest.mark.parametrize(("reach", "interface"), [("", "lo"), ("OFF", "lo"), ("SUBNET", "")])
def test_other_hosts_are_not_listened_to_unless_asked_for(
    domain: int, monkeypatch: pytest.MonkeyPatch, reach: str, interface: str
) -> None:
    monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", reach)
    before = {connection.fd for connection in psutil.Process().net_connections("udp")}
    rclpy.init(args=[], domain_id=domain)
    rclpy.create_node("listener")
    heard_on = set()
    for connection in psutil.Process().net_connections("udp"):
        if connection.fd not in before and connection.laddr.ip == "0.0.0.0":
            with socket.socket(fileno=os.dup(connection.fd)) as listener:
                name = listener.getsockopt(socket.SOL_SOCKET, socket.SO_BINDTODEVICE, 16)
                heard_on.add(name.rstrip(b"\0").decode())
    rclpy.shutdown()
    assert heard_on == {interface}


@pytest.mark.skipif(not hasattr(socket, "SO_BINDTODEVICE"), reason="Linux alone can do that")
def test_where_other_hosts_cannot_be_kept_out_that_is_said(
    domain: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(loopback, "INTERFACE", b"none")
    rclpy.init(args=[], domain_id=domain)
    with pytest.warns(RuntimeWarning, match=r"all interfaces \(No such device"):
        rclpy.create_node("listener")
    rclpy.shutdown()


def test_no_multicast_by_default(domain: int, run: Callable[..., Process]) -> None:
    process = run("echo")
    process.wait_for_line("ready")
    ports = {c.laddr.port for c in psutil.Process(process.pid).net_connections("udp") if c.laddr}
    multicast_port = 7400 + 250 * domain  # of discovery, by the RTPS specification
    assert ports
    assert multicast_port not in ports
