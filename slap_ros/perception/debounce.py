# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Atoms that do not flicker."""

from __future__ import annotations

from collections import deque
from functools import reduce
from operator import and_


class Debouncer:
    """Lets an atom change only once it was perceived as changed several times in a row."""

    def __init__(self, times: int) -> None:
        """``times``: how often; with 1, at once."""
        self._seen: deque[int] = deque(maxlen=times)
        self._times = times
        self._known: int | None = None

    def add(self, abstract: int) -> int:
        """Take an abstract state as perceived; the one without flicker. The first one is taken."""
        if self._known is None:
            self._known = abstract
        self._seen.append(abstract)
        if len(self._seen) == self._times:
            self._known ^= reduce(and_, (seen ^ self._known for seen in self._seen))
        return self._known
