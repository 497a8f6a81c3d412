# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Readers and writers of serialized samples."""

from __future__ import annotations

import ctypes as ct
import threading
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from cyclonedds._clayer import ddspy_take
from cyclonedds.core import DDSStatus, InstanceState, SampleState, ViewState
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader

from . import library
from .errors import InvalidHandle, PublishTimeoutError, RCLError

_ANY = SampleState.Any | ViewState.Any | InstanceState.Any
_CLOSED_CODES = (library.RETCODE_BAD_PARAMETER, library.RETCODE_ALREADY_DELETED)


@dataclass(frozen=True, slots=True)
class Sample:
    """A received sample: CDR bytes, header first, and where it is from."""

    data: bytes
    source_timestamp: int  # ns since the epoch
    publication_handle: int  # of the writer, known to this process only


class _Peers:
    """The matched endpoints of a reader or writer.

    The discovery data of each is asked for once: CycloneDDS's Python layer does not give back what
    DDS allocates for it (11.0.1), and whether a server is ready is asked many times a second.
    """

    def __init__(self, handles: Callable[[], Iterable[int]], data: Callable[[int], Any]) -> None:
        self._ask_handles, self._ask_data = handles, data
        self._known: dict[int, Any] = {}

    def handles(self) -> list[int]:
        now, known = list(self._ask_handles()), self._known
        self._known = {handle: known[handle] for handle in now if handle in known}
        return now

    def data(self, handle: int) -> Any:
        known = self._known.get(handle)
        if known is None and (known := self._ask_data(handle)) is not None:
            self._known[handle] = known
        return known


class Writer:
    """A DDS writer."""

    def __init__(self, entity: DataWriter, topic_name: str) -> None:
        self._entity = entity
        self._ref: int = entity._ref
        self.topic_name = topic_name
        self.gid: bytes = entity.guid.bytes
        self.closed = False
        self._peers = _Peers(entity.get_matched_subscriptions, entity.get_matched_subscription_data)
        entity.set_status_mask(DDSStatus.OfferedIncompatibleQos)

    @property
    def ref(self) -> int:
        """CycloneDDS's handle, for attaching to a wait set."""
        return self._ref

    def write(self, data: bytes) -> None:
        """Write serialized bytes.

        Raises:
            InvalidHandle: The writer or its context was shut down.
            PublishTimeoutError: The history is full and a reliable reader does not keep up.
            RCLError: Anything else CycloneDDS objects to.
        """
        if self.closed:
            raise InvalidHandle(f"{self.topic_name}: the writer is closed")
        code = library.write_sample(self._ref, data)
        if code >= 0:
            return
        if code == library.RETCODE_TIMEOUT:
            raise PublishTimeoutError(f"{self.topic_name}: a reliable reader does not keep up")
        if self.closed or code in _CLOSED_CODES:
            raise InvalidHandle(f"{self.topic_name}: the writer is closed (code {code})")
        raise RCLError(f"{self.topic_name}: writing {len(data)} bytes failed (code {code})")

    def matched_handles(self) -> list[int]:
        """Handles of the readers that receive from this writer."""
        return [] if self.closed else self._peers.handles()

    def matched(self, handle: int) -> Any:
        """The discovery data of a matched reader, or None where it has gone."""
        return self._peers.data(handle)

    def wait_for_acknowledgements(self, timeout_ns: int) -> bool:
        """Wait until every reliable reader has everything, or the time is up."""
        return bool(self._entity.wait_for_acks(timeout_ns))

    def take_incompatible_policy(self) -> int:
        """Policy of the latest reader refused for its QoS since last asked, 0 for none."""
        if self.closed:
            return 0
        status = self._entity.get_offered_incompatible_qos_status()
        return int(status.last_policy_id) if status.total_count_change > 0 else 0

    def close(self) -> None:
        """Delete the writer; closing twice is allowed."""
        if not self.closed:
            self.closed = True
            self._entity.__del__()


class Reader:
    """A DDS reader and the condition that says it has samples."""

    def __init__(self, entity: DataReader, topic_name: str) -> None:
        self._entity = entity
        self._ref: int = entity._ref
        self.topic_name = topic_name
        self.gid: bytes = entity.guid.bytes
        self.condition = library.dds_create_readcondition(self._ref, _ANY)
        self.closed = False
        self._peers = _Peers(entity.get_matched_publications, entity.get_matched_publication_data)
        entity.set_status_mask(DDSStatus.RequestedIncompatibleQos)

    @property
    def ref(self) -> int:
        """CycloneDDS's handle, for attaching to a wait set."""
        return self._ref

    def take(self) -> Sample | None:
        """The next sample, or None where there is none."""
        while not self.closed:
            taken = ddspy_take(self._ref, _ANY, 1)
            if isinstance(taken, int):
                if taken in (*_CLOSED_CODES, library.RETCODE_NO_DATA):
                    return None
                raise RCLError(f"{self.topic_name}: taking a sample failed (code {taken})")
            if not taken:
                return None
            data, info = taken[0]
            if info.valid_data:
                return Sample(data, info.source_timestamp, info.publication_handle)
        return None

    def matched_handles(self) -> list[int]:
        """Handles of the writers this reader receives from."""
        return [] if self.closed else self._peers.handles()

    def matched(self, handle: int) -> Any:
        """The discovery data of a matched writer, or None where it has gone."""
        return self._peers.data(handle)

    def take_incompatible_policy(self) -> int:
        """Policy of the latest writer refused for its QoS since last asked, 0 for none."""
        if self.closed:
            return 0
        status = self._entity.get_requested_incompatible_qos_status()
        return int(status.last_policy_id) if status.total_count_change > 0 else 0

    def close(self) -> None:
        """Delete the reader; closing twice is allowed."""
        if not self.closed:
            self.closed = True
            library.dds_delete(self.condition)
            self._entity.__del__()


class WaitSet:
    """Waits for readers to have samples, or for :meth:`wake`."""

    WAKE_TOKEN = 1

    def __init__(self, participant_ref: int) -> None:
        self._ref = library.dds_create_waitset(participant_ref)
        self._guard = library.dds_create_guardcondition(participant_ref)
        if self._ref < 0 or self._guard < 0:
            raise InvalidHandle("the context is shut down")
        self._attached: dict[int, int] = {}  # condition by token
        self._lock = threading.Lock()
        self._closed = False
        library.dds_waitset_attach(self._ref, self._guard, self.WAKE_TOKEN)

    @property
    def closed(self) -> bool:
        """Whether it was deleted."""
        return self._closed

    def attach(self, condition: int, token: int) -> None:
        """Report a condition under this token (any number above :attr:`WAKE_TOKEN`)."""
        library.dds_waitset_attach(self._ref, condition, token)
        self._attached[token] = condition

    def detach(self, token: int) -> None:
        """Report a token no more; unknown tokens are ignored."""
        condition = self._attached.pop(token, None)
        if condition is not None:
            library.dds_waitset_detach(self._ref, condition)

    def wait(self, timeout_ns: int) -> Sequence[int]:
        """Wait for a condition.

        Args:
            timeout_ns: At most this long.

        Returns:
            The tokens of the conditions that hold; :attr:`WAKE_TOKEN` is never among them.
        """
        size = len(self._attached) + 1
        triggered = (ct.c_void_p * size)()
        count = library.dds_waitset_wait(self._ref, triggered, size, timeout_ns)
        if count <= 0:
            return ()
        tokens = [token for token in triggered[: min(count, size)] if token is not None]
        if self.WAKE_TOKEN in tokens:
            library.dds_set_guardcondition(self._guard, False)
            tokens.remove(self.WAKE_TOKEN)
        return tokens

    def wake(self) -> None:
        """End the current, or else the next, :meth:`wait`; from any thread."""
        with self._lock:
            if not self._closed:
                library.dds_set_guardcondition(self._guard, True)

    def close(self) -> None:
        """Delete the wait set; closing twice is allowed."""
        with self._lock:
            if self._closed:
                return
            self._closed = True
        library.dds_delete(self._ref)
        library.dds_delete(self._guard)
