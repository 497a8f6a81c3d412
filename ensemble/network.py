# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Joining the network: nodes on this host only, unless the environment is set otherwise."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from pathlib import Path
from typing import Any, TypeVar

import rclpy
from rclpy._rclpy_pybind11 import RCLError, UnknownROSArgsError
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.parameter import Parameter

from ensemble.loopback import loopback_only
from slap_ros.doctor import settings
from slap_ros.errors import InvalidParameterError

DISCOVERY_RANGE = settings.RANGE
CYCLONE = "rmw_cyclonedds_cpp"
OPENER = "_slap_ros_opener"  # hidden, as its name begins with an underscore
OPENER_OPTIONS = {
    "use_global_arguments": False,  # which would rename it
    "enable_rosout": False,
    "start_parameter_services": False,
    "parameter_overrides": [Parameter("start_type_description_service", value=False)],
}

N = TypeVar("N", bound=Node)


def join_network(**options: Any) -> None:
    """``rclpy.init``, so that a robot takes no commands from elsewhere by accident.

    By default Jazzy discovers nodes on the whole subnet. To have that, set the variable
    ``ROS_AUTOMATIC_DISCOVERY_RANGE``.

    Args:
        options: Those of ``rclpy.init``.

    Raises:
        InvalidParameterError: An environment variable, such as ROS_DOMAIN_ID, or a ROS argument is
            wrong. Nothing is initialised then.
    """
    # rcl finds some of it out with the first node only, and takes some of it for something else.
    for fault in settings.impossible():
        raise InvalidParameterError(f"{fault.found}. {fault.advice}")
    os.environ.setdefault(DISCOVERY_RANGE, "LOCALHOST")
    try:
        rclpy.init(**options)
    except (RCLError, UnknownROSArgsError) as error:
        rclpy.try_shutdown()
        raise InvalidParameterError(str(error)) from error


def start_node(make: Callable[[], N], **options: Any) -> N:
    """Join the network with a node, and say once how terminals find it at once.

    Args:
        make: Makes the node.
        options: Those of ``rclpy.init``.

    Raises:
        InvalidParameterError: As :func:`join_network` and :func:`first_node`.
    """
    has_range = DISCOVERY_RANGE in os.environ
    join_network(**options)
    node = first_node(make)
    if not (has_range or is_embedded()):
        sys.stderr.write(f"{settings.RANGE_HINT}\n")
    return node


def first_node(make: Callable[[], N]) -> N:
    """Make the node with which a process comes onto the network.

    Raises:
        InvalidParameterError: DDS cannot do what the environment asks for.
    """
    with _opened():
        return make()


def is_embedded() -> bool:
    """Whether rclpy is embedded_ros's rather than that of a sourced ROS 2."""
    return Path(rclpy.__file__).parent.parent.name == "embedded_ros"


@contextmanager
def _opened() -> Iterator[None]:
    """DDS with its sockets open, as long as one node at least is made meanwhile.

    It opens them with a context's first node. What that is does not matter, so it is one that is
    made at once: ours may take seconds, in which the sockets would be open to all.
    """
    try:
        with loopback_only() if _has_to_be_bound() else nullcontext():
            opener = rclpy.create_node(OPENER, **OPENER_OPTIONS)
    except RCLError as error:
        if not rclpy.ok():  # a signal came meanwhile, which shut the context down
            raise ExternalShutdownException from error
        raise InvalidParameterError(
            f"DDS cannot be started here: {error}. What it wrote above says more; `slap doctor` "
            f"looks at {settings.URI} and the other variables"
        ) from error
    try:
        yield
    finally:
        opener.destroy_node()


def _has_to_be_bound() -> bool:
    """Whether it is our business to keep other hosts out."""
    if is_embedded() or settings.is_open_to_others() or os.environ.get(settings.URI):
        return False
    middleware = rclpy.get_rmw_implementation_identifier()
    if middleware != CYCLONE:
        sys.stderr.write(
            f"{middleware}: whom LOCALHOST keeps out is its own business, which slap_ros has not "
            f"tried; with {CYCLONE} it is nobody but this host\n"
        )
        return False
    return True
