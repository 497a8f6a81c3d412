# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The wire, read and written by CycloneDDS alone with types written by hand.

Nothing of embedded_ros is used on this side but the environment's configuration.
"""

# No postponed annotations here: IdlStruct reads them.
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import psutil
import pytest
from cyclonedds.builtin import (
    BuiltinDataReader,
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


def read_first(reader: DataReader) -> Any:
    taken: list[Any] = []
    assert wait_until(lambda: bool(taken.extend(reader.take(1)) or taken)), "nothing received"
    return taken[0]


def endpoints(participant: DomainParticipant, topic: Any) -> list[Any]:
    reader = BuiltinDataReader(participant, topic)
    time.sleep(0.1)
    return [s for s in reader.read(1000) if s.topic_name]


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
    assert wait_until(lambda: bool(writer.get_matched_subscriptions()))
    assert wait_until(lambda: bool(reader.get_matched_publications()))
    for text in ("", "a", "grüße", "x" * 5000):
        writer.write(String_(text))
        assert read_first(reader) == String_(text)


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
    assert wait_until(lambda: bool(requests.get_matched_subscriptions()))
    assert wait_until(lambda: bool(replies.get_matched_publications()))
    requests.write(AddTwoInts_Request_(guid_=2**63 + 7, seq_=41, a_=-5, b_=7))
    assert read_first(replies) == AddTwoInts_Response_(guid_=2**63 + 7, seq_=41, sum_=2)


def test_nodes_and_their_endpoints_are_announced(
    participant: DomainParticipant, run: Callable[..., Process]
) -> None:
    run("echo", "--ros-args", "-r", "__ns:=/slap").wait_for_line("ready")
    reader = DataReader(
        participant, Topic(participant, "ros_discovery_info", ParticipantEntitiesInfo_), LATCHED
    )
    nodes: list[Any] = []

    def announced() -> bool:
        for info in reader.take(10):
            nodes[:] = info.node_entities_info_seq_
        return any(len(node.writer_gid_seq_) > 2 for node in nodes)

    assert wait_until(announced)
    assert [(n.node_namespace_, n.node_name_) for n in nodes] == [("/slap", "echo")]
    writers = endpoints(participant, BuiltinTopicDcpsPublication)
    out = next(w for w in writers if w.topic_name == "rt/slap/out")
    assert out.type_name == "std_msgs::msg::dds_::String_"
    assert list(out.key.bytes) in [list(gid.data_) for gid in nodes[0].writer_gid_seq_]
    assert user_data(out) == {"typehash": STRING_HASH}


def test_both_ends_of_a_service_are_tied_together(
    participant: DomainParticipant, run: Callable[..., Process]
) -> None:
    run("adder").wait_for_line("ready")
    assert wait_until(
        lambda: any(
            w.topic_name == "rr/addReply"
            for w in endpoints(participant, BuiltinTopicDcpsPublication)
        )
    )
    writers = endpoints(participant, BuiltinTopicDcpsPublication)
    readers = endpoints(participant, BuiltinTopicDcpsSubscription)
    reply = user_data(next(w for w in writers if w.topic_name == "rr/addReply"))
    request = user_data(next(r for r in readers if r.topic_name == "rq/addRequest"))
    assert reply["serviceid"] == request["serviceid"]
    assert len(reply["serviceid"].split(".")) == 16
    assert reply["typehash"] != request["typehash"]


def test_no_multicast_by_default(domain: int, run: Callable[..., Process]) -> None:
    process = run("echo")
    process.wait_for_line("ready")
    ports = {c.laddr.port for c in psutil.Process(process.pid).net_connections("udp") if c.laddr}
    multicast_port = 7400 + 250 * domain  # of discovery, by the RTPS specification
    assert ports
    assert multicast_port not in ports
