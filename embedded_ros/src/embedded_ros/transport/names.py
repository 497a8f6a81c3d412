# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""ROS names and types as DDS topic and type names, and back."""

from __future__ import annotations

import re

_DDS_TYPE = re.compile(r"(?P<package>\w+)::(?P<kind>msg|srv|action)::dds_::(?P<name>\w+)_")


def topic(name: str) -> str:
    """The DDS topic of a ROS topic."""
    return f"rt{name}"


def request_topic(service: str) -> str:
    """The DDS topic of a service's requests."""
    return f"rq{service}Request"


def reply_topic(service: str) -> str:
    """The DDS topic of a service's responses."""
    return f"rr{service}Reply"


def dds_type(full_name: str) -> str:
    """The DDS type name of a ROS type."""
    package, kind, name = full_name.split("/")
    return f"{package}::{kind}::dds_::{name}_"


def ros_type(dds_name: str) -> str | None:
    """The ROS type of a DDS type name, or None where it is not ROS's."""
    match = _DDS_TYPE.fullmatch(dds_name)
    return f"{match['package']}/{match['kind']}/{match['name']}" if match else None


def ros_topic(dds_name: str) -> str | None:
    """The ROS topic of a DDS topic, or None where it is not a ROS topic's."""
    return dds_name[2:] if dds_name.startswith("rt/") else None


def ros_service(dds_name: str) -> str | None:
    """The ROS service of a DDS topic, or None where it carries no service."""
    if dds_name.startswith("rq/") and dds_name.endswith("Request"):
        return dds_name[2 : -len("Request")]
    if dds_name.startswith("rr/") and dds_name.endswith("Reply"):
        return dds_name[2 : -len("Reply")]
    return None


def service_type(ros_message_type: str) -> str:
    """``pkg/srv/Name`` of ``pkg/srv/Name_Request`` or ``pkg/srv/Name_Response``."""
    return ros_message_type.removesuffix("_Request").removesuffix("_Response")
