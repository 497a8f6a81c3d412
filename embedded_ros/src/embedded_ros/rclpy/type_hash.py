# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The hash of an interface's definition (REP-2011)."""

from __future__ import annotations

from dataclasses import dataclass

SIZE = 32  # bytes of a SHA-256


@dataclass(slots=True)
class TypeHash:
    """A type hash; ``str`` gives it as ROS 2 writes it: ``RIHS01_`` and 64 digits."""

    version: int = -1
    value: bytes = bytes(SIZE)

    def __str__(self) -> str:
        if self.version <= 0 or len(self.value) != SIZE:
            return "INVALID"
        return f"RIHS{self.version:02}_{self.value.hex()}"
