# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A service whose responses are sent when they are known, not when the callback returns.

A result is asked for long before it is there, and waiting for it must not hold the callback
group up.
"""

from __future__ import annotations

import inspect
from typing import Any

from embedded_ros.transport.endpoints import Sample
from embedded_ros.types.cdr import deserialize

from ..service import PREFIX_SIZE, RequestHeader, Service


class DeferredService(Service[Any]):
    """Calls back with request and header; :meth:`send_response` is up to the callback."""

    async def _answer(self, sample: Sample) -> None:
        request = deserialize(sample.data, self.srv_type.Request.ros_type, PREFIX_SIZE)
        header = RequestHeader(sample.data[:PREFIX_SIZE], sample.publication_handle)
        outcome = self.callback(request, header)
        if inspect.isawaitable(outcome):
            await outcome
