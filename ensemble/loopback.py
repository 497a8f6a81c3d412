# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""DDS sockets that hear this host alone.

With ``ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST``, ``rmw_cyclonedds_cpp`` asks nobody else, but it
still listens on all interfaces, and answers a host that knows the address. To have it use ``lo``
alone would shut out other programs of this host as well, ``ros2 topic`` for instance: CycloneDDS
takes an address of another interface for one that cannot be reached from ``lo``. What this host
sends to its own addresses passes through ``lo`` whatever they are, so it is the kernel that is told
to hand over nothing else. (embedded_ros, which is not installed beside a ROS 2, uses ``lo`` alone
and binds its sockets to it.)
"""

from __future__ import annotations

import ctypes
import os
import socket
import struct
import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager

import psutil

INTERFACE = "lo"
ANY_ADDRESS = "0.0.0.0"  # noqa: S104  # looked for, not bound to
SO_ATTACH_FILTER = 26  # <asm-generic/socket.h>

LIBC = ctypes.CDLL(None, use_errno=True)


class _FilterProgram(ctypes.Structure):
    """``struct sock_fprog`` of <linux/filter.h>."""

    _fields_ = (("length", ctypes.c_ushort), ("instructions", ctypes.c_char_p))


@contextmanager
def loopback_only() -> Iterator[None]:
    """UDP sockets that are opened meanwhile on all interfaces hear, in the end, ``lo`` alone.

    Elsewhere than on Linux nothing is changed.
    """
    if sys.platform != "linux":
        yield
        return
    before = _open_to_all()
    yield
    for descriptor in _open_to_all() - before:
        _attach_filter(descriptor)


def _open_to_all() -> set[int]:
    connections = psutil.Process().net_connections("udp4")
    return {c.fd for c in connections if c.laddr and c.laddr.ip == ANY_ADDRESS}


def _attach_filter(descriptor: int) -> None:
    code = _instructions(socket.if_nametoindex(INTERFACE))
    program = _FilterProgram(len(code) // 8, code)
    size = ctypes.sizeof(program)
    level = socket.SOL_SOCKET
    if LIBC.setsockopt(descriptor, level, SO_ATTACH_FILTER, ctypes.byref(program), size) != 0:
        warnings.warn(
            f"DDS listens on all interfaces ({os.strerror(ctypes.get_errno())}): close its ports "
            "in the firewall",
            RuntimeWarning,
            stacklevel=2,
        )


def _instructions(interface: int) -> bytes:
    """Classic BPF: keep the whole packet if it came in over this interface, else nothing of it."""
    came_in_over = 0xFFFFF000 + 8  # SKF_AD_OFF + SKF_AD_IFINDEX
    load, jump_if_equal, leave = 0x20, 0x15, 0x06
    program = (
        (load, 0, 0, came_in_over),
        (jump_if_equal, 0, 1, interface),
        (leave, 0, 0, 0xFFFFFFFF),
        (leave, 0, 0, 0),
    )
    return b"".join(struct.pack("=HBBI", *instruction) for instruction in program)
