# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Interface types: definitions, message classes, CDR, type hashes."""

from .catalogue import Catalogue, catalogue
from .errors import InterfaceError, MessageFieldError, SerializationError, UnknownInterfaceError
from .interfaces import (
    Action,
    Message,
    Service,
    action_class,
    action_type_hash,
    message_class,
    message_type_hash,
    service_class,
    service_type_hash,
)

__all__ = [
    "Action",
    "Catalogue",
    "InterfaceError",
    "Message",
    "MessageFieldError",
    "SerializationError",
    "Service",
    "UnknownInterfaceError",
    "action_class",
    "action_type_hash",
    "catalogue",
    "message_class",
    "message_type_hash",
    "service_class",
    "service_type_hash",
]
