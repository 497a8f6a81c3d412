# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What runs for days must not grow."""

from __future__ import annotations

import ctypes
import gc
from collections.abc import Callable

import psutil
import pytest
from rclpy.node import Node
from std_msgs.msg import String

from conftest import Process, wait_until

ASKED = 2000  # times
KIB = 1024
# Four participants of CycloneDDS's own, announced 500 times a second each instead of every few
# seconds: hours of being idle in a few seconds.
ANNOUNCER = """
import os
import sys
from cyclonedds.domain import Domain, DomainParticipant

number = int(os.environ["ROS_DOMAIN_ID"])
domain = Domain(
    number,
    '<CycloneDDS><Domain><General><Interfaces><NetworkInterface name="lo"/></Interfaces>'
    "<AllowMulticast>false</AllowMulticast></General><Discovery>"
    "<SPDPInterval>2 ms</SPDPInterval><ParticipantIndex>auto</ParticipantIndex>"
    '<Peers><Peer address="localhost" PruneDelay="inf"/></Peers>'
    "</Discovery></Domain></CycloneDDS>",
)
participants = [DomainParticipant(number) for _ in range(4)]
print("ready", flush=True)
sys.stdin.read()
"""
ANNOUNCED_S = 6.0
BOUND = 768 * KIB  # bytes; with buffers of 1 MiB it were more than twice that


class Allocated(ctypes.Structure):
    """glibc's ``struct mallinfo2``."""

    _fields_ = (
        ("_", ctypes.c_size_t * 4),
        ("hblkhd", ctypes.c_size_t),  # bytes mapped
        ("__", ctypes.c_size_t * 2),
        ("uordblks", ctypes.c_size_t),  # bytes in use
        ("___", ctypes.c_size_t * 2),
    )


def allocated() -> int:
    """Bytes that C code has allocated and not freed."""
    gc.collect()
    libc = ctypes.CDLL(None)
    libc.mallinfo2.restype = Allocated
    found = libc.mallinfo2()
    return int(found.uordblks + found.hblkhd)


@pytest.mark.skipif(not hasattr(ctypes.CDLL(None), "mallinfo2"), reason="no glibc of 2021 or later")
def test_asking_about_publishers_again_and_again_allocates_nothing(node: Node) -> None:
    node.create_publisher(String, "topic", 10)
    for _ in range(ASKED // 10):
        node.get_publishers_info_by_topic("topic")
    before = allocated()
    for _ in range(ASKED):
        node.get_publishers_info_by_topic("topic")
    assert allocated() - before < 10 * ASKED  # bytes; 97 a time before they were kept


def test_endpoints_that_have_gone_are_forgotten(node: Node) -> None:
    for _ in range(3):
        publisher = node.create_publisher(String, "topic", 10)
        assert len(node.get_publishers_info_by_topic("topic")) == 1
        node.destroy_publisher(publisher)
    assert node.get_publishers_info_by_topic("topic") == []
    assert node.context.participant.graph._publications._qos == {}


def test_an_idle_process_does_not_grow_by_what_others_announce(run: Callable[..., Process]) -> None:
    idle = run("echo")
    idle.wait_for_line("ready")
    resident = psutil.Process(idle.pid).memory_info
    before = resident().rss
    run(code=ANNOUNCER).wait_for_line("ready")
    assert not wait_until(lambda: resident().rss - before > BOUND, ANNOUNCED_S)
