# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Listening to this host alone.

CycloneDDS sends over the interfaces that it is told to use, but listens on all that there are, and
no setting of its own changes that (11.0.1; its issues 1923 and 2090). Linux can be told to hand
over only what comes in over one of them.
"""

from __future__ import annotations

import ctypes as ct
import os
import re
import socket
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

INTERFACE = b"lo"
DESCRIPTORS = Path("/proc/self/fd")  # Linux's
UDP = Path("/proc/self/net/udp")
# A row of that: its number, the local address in hexadecimal, and the tenth column, the inode.
EVERYWHERE = re.compile(r"^ *\d+: 00000000:[0-9A-F]{4}(?: +\S+){7} +(\d+)", re.MULTILINE)

_libc = ct.CDLL(None, use_errno=True)


@contextmanager
def loopback_only() -> Iterator[None]:
    """UDP sockets that are opened meanwhile on all interfaces hear, in the end, ``lo`` alone.

    Elsewhere than on Linux nothing is changed.
    """
    before = _listening()
    yield
    for descriptor in _listening() - before:
        _bind(descriptor)


def _bind(descriptor: int) -> None:
    # By way of C: Python's socket objects change the mode of what they are made from.
    option = socket.SO_BINDTODEVICE
    if _libc.setsockopt(descriptor, socket.SOL_SOCKET, option, INTERFACE, len(INTERFACE)) != 0:
        warnings.warn(
            f"DDS listens on all interfaces ({os.strerror(ct.get_errno())}; Linux before 5.7 lets "
            "only root restrict that): close its ports in the firewall",
            RuntimeWarning,
            stacklevel=2,
        )


def _listening() -> set[int]:
    """Descriptors of the UDP sockets of this process that are bound to no interface's address."""
    if not UDP.exists():
        return set()
    names = {f"socket:[{inode}]" for inode in EVERYWHERE.findall(UDP.read_text())}
    return {int(path.name) for path in DESCRIPTORS.iterdir() if _target(path) in names}


def _target(path: Path) -> str:
    try:
        return os.readlink(path)
    except FileNotFoundError:  # closed by now
        return ""
