# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Messages that a node does not act on: counted, and logged, but not each of them."""

from __future__ import annotations

from collections import Counter
from time import monotonic

from rclpy.node import Node

KINDS = ("refused_domains", "refused_tasks", "refused_states", "refused_skills")
QUIET = 10.0  # s between two log lines of a kind: whoever sends nonsense may send a lot of it


class Refusals:
    """Counts what is refused, by kind: one of ``KINDS``."""

    def __init__(self, node: Node) -> None:
        """Log as ``node``."""
        self.counts: Counter[str] = Counter(dict.fromkeys(KINDS, 0))
        self._node = node
        self._logged_s: dict[str, float] = {}  # by kind

    def add(self, kind: str, reason: object) -> None:
        """Count a refusal; it is logged unless one of its kind just was.

        Args:
            kind: Kind of the refusal, as the diagnostics name it.
            reason: In words, or as an error.
        """
        self.counts[kind] += 1
        now_s = monotonic()
        if now_s - self._logged_s.get(kind, -QUIET) >= QUIET:
            self._logged_s[kind] = now_s
            told = f"{self.counts[kind]} {kind.replace('_', ' ')}"
            self._node.get_logger().warning(f"{reason} ({told})")
