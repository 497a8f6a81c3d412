# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What can go wrong on the wire."""

from __future__ import annotations


class TransportError(RuntimeError):
    """CycloneDDS refused an operation; the message says which, on what, and why."""


class TransportClosedError(TransportError):
    """An endpoint was used after it, or its context, was shut down."""


class PublishTimeoutError(TransportError):
    """A reliable writer with a full history was blocked longer than it may block."""
