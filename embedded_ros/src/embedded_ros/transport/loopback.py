# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Listening to this host alone.

CycloneDDS sends over the interfaces that it is told to use, but listens on all that there are, and
no setting of its own changes that (11.0.1; its issues 1923 and 2090). Linux can be told to hand
over only what comes in over one of them.
"""

from __future__ import annotations

import os
import socket
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

INTERFACE = b"lo"
DESCRIPTORS = Path("/proc/self/fd")  # Linux's


@contextmanager
def loopback_only() -> Iterator[None]:
    """UDP sockets that are opened meanwhile on all interfaces hear, in the end, ``lo`` alone.

    Elsewhere than on Linux nothing is changed.
    """
    before = _listening()
    yield
    for descriptor in _listening() - before:
        with _duplicate(descriptor) as listener:
            try:
                listener.setsockopt(socket.SOL_SOCKET, socket.SO_BINDTODEVICE, INTERFACE)
            except PermissionError:
                warnings.warn(
                    "DDS listens on all interfaces: Linux before 5.7 lets only root restrict it; "
                    "close its ports in the firewall",
                    RuntimeWarning,
                    stacklevel=2,
                )


def _listening() -> set[int]:
    """Descriptors of the UDP sockets of this process that are bound to no interface."""
    if not DESCRIPTORS.is_dir():
        return set()
    return {int(name) for name in os.listdir(DESCRIPTORS) if _hears_everything(int(name))}


def _hears_everything(descriptor: int) -> bool:
    try:
        candidate = _duplicate(descriptor)
    except OSError:  # no socket, or closed by now
        return False
    with candidate:
        if (candidate.family, candidate.type) != (socket.AF_INET, socket.SOCK_DGRAM):
            return False
        address, port = candidate.getsockname()
        return bool(port) and address == "0.0.0.0"


def _duplicate(descriptor: int) -> socket.socket:
    """A socket of the same file: closing it leaves the descriptor open."""
    copy = os.dup(descriptor)
    try:
        return socket.socket(fileno=copy)
    except OSError:
        os.close(copy)
        raise
