# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A bag's digest: equal for equal runs, whenever, wherever and by whatever revision made."""

from __future__ import annotations

import hashlib
import struct
from collections.abc import Iterator
from dataclasses import fields, is_dataclass
from pathlib import Path

import numpy as np

from slap_ros.bags.definitions import ADDED
from slap_ros.bags.reader import read_bag
from slap_ros.errors import DamagedBagError
from slap_ros.messages.interfaces import DOMAIN_INFO, PLAN

EXCLUDED_TYPES = (  # they tell of the machine or repeat the states for the eye
    "diagnostic_msgs/msg/DiagnosticArray",
    "rcl_interfaces/msg/Log",
    "rcl_interfaces/msg/ParameterEvent",
    "tf2_msgs/msg/TFMessage",
    "visualization_msgs/msg/Marker",
    "visualization_msgs/msg/MarkerArray",
)
EXCLUDED_FIELDS = {
    "std_msgs/msg/Header": ("stamp",),
    DOMAIN_INFO: ("versions",),
    PLAN: ("bound",),  # what was proven of the plan, which changes nothing that happened
}
# Settings of domains that earlier bags do not have, at the values that change nothing.
ADDED_SETTINGS = (("towers", "(1, 1)"),)


def bag_digest(path: Path | str) -> str:
    """SHA-256 over what happened: the messages of each topic in order, topics by name.

    When messages were sent and received does not count, nor do software versions, bounds of plans,
    diagnostics, logs, transforms and markers, nor types that cannot be deserialised. A field that
    older bags do not have counts where it is not empty, and a setting where it changes something,
    so that the same run has the digest that it always had.

    Returns:
        64 hexadecimal digits.

    Raises:
        DamagedBagError: Part of it cannot be read; a digest of the rest would mean nothing.
        ForeignBagError: It is not of an ensemble, or of another version of one.
    """
    bag = read_bag(path)
    topics: dict[str, hashlib._Hash] = {}
    for topic, type_name, _, message in bag:
        if type_name not in EXCLUDED_TYPES:
            digest = topics.setdefault(topic, hashlib.sha256())
            for part in _canonical(message):
                digest.update(part)
    if bag.damage is not None:
        raise DamagedBagError(f"no digest of a damaged bag: {bag.damage}")
    whole = hashlib.sha256()
    for topic in sorted(topics):
        for part in _canonical([topic, topics[topic].hexdigest()]):
            whole.update(part)
    return whole.hexdigest()


def _canonical(value: object) -> Iterator[bytes]:
    """Bytes that differ wherever values do. Lengths go first, so that parts cannot run together."""
    if isinstance(value, str):
        text = value.encode()
        yield struct.pack("<cQ", b"s", len(text)) + text
    elif isinstance(value, float):
        yield struct.pack("<cd", b"f", value)
    elif isinstance(value, int):  # bool too
        yield b"i%d;" % value
    elif isinstance(value, np.ndarray):
        array = np.ascontiguousarray(value, dtype=value.dtype.newbyteorder("<"))
        yield f"a{array.dtype.str},{array.size};".encode() + array.tobytes()
    elif isinstance(value, list):
        yield struct.pack("<cQ", b"l", len(value))
        for item in value:
            yield from _canonical(item)
    elif is_dataclass(value):
        type_name = str(getattr(value, "__msgtype__", ""))  # all classes of rosbags have it
        yield from _canonical(type_name)
        excluded, added = EXCLUDED_FIELDS.get(type_name, ()), ADDED.get(type_name, ())
        for field in fields(value):
            part = getattr(value, field.name)
            if (type_name, field.name) == (DOMAIN_INFO, "configuration"):
                part = [pair for pair in part if (pair.key, pair.value) not in ADDED_SETTINGS]
            if field.name in added and (not part or field.name.isupper()):
                continue  # a constant is the same in all messages, whether they use it or not
            if field.name not in excluded:
                yield from _canonical(part)
    else:
        raise TypeError(f"rosbags gave a message a {type(value).__name__}")
