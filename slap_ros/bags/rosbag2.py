# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""rosbag2's ``metadata.yaml`` and the quality of service that it records (version 9, Jazzy)."""

from __future__ import annotations

import os
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from slap_ros.files import parse_yaml, read_text
from slap_ros.messages.qos import offered_qos

VERSION = 9
ROS_DISTRO = "jazzy"
FILE_NAME = "metadata.yaml"
MAX_METADATA_BYTES = 4 * 2**20
ROOT = "rosbag2_bagfile_information"

EMPTY_START = 2**63 - 1  # ns, where rosbag2 lets a bag without messages begin
INFINITE = {"sec": 9223372036, "nsec": 854775807}  # rmw's duration without end


@dataclass
class TopicRecord:
    """A recorded topic."""

    name: str
    type_name: str
    type_hash: str  # REP-2011
    message_count: int = 0

    @property
    def qos(self) -> list[dict[str, Any]]:
        """What the publishers offered, so that ``ros2 bag play`` offers it too."""
        offered = offered_qos(self.name)
        return [
            {
                "history": "keep_last",
                "depth": offered.depth,
                "reliability": "reliable",
                "durability": "transient_local" if offered.transient_local else "volatile",
                "deadline": dict(INFINITE),
                "lifespan": dict(INFINITE),
                "liveliness": "automatic",
                "liveliness_lease_duration": dict(INFINITE),
                "avoid_ros_namespace_conventions": False,
            }
        ]

    @property
    def qos_yaml(self) -> str:
        """The same as a channel of an MCAP file carries it."""
        return to_yaml(self.qos).strip()


@dataclass
class Extent:
    """How many messages there are, and from when to when."""

    message_count: int = 0
    start_ns: int = EMPTY_START
    end_ns: int = 0

    def include(self, stamp_ns: int) -> None:
        """Count a message."""
        self.message_count += 1
        self.start_ns = min(self.start_ns, stamp_ns)
        self.end_ns = max(self.end_ns, stamp_ns)

    @property
    def duration_ns(self) -> int:
        """The time from the first message to the last."""
        return max(0, self.end_ns - self.start_ns)


def bag_information(
    file_name: str, topics: list[TopicRecord], extent: Extent, custom: Mapping[str, str]
) -> dict[str, Any]:
    """The content of ``metadata.yaml`` for a bag of one MCAP file.

    Args:
        file_name: Name of the MCAP file.
        topics: In the order of their channels.
        extent: Number of messages and the time from the first to the last.
        custom: What the run was made with.
    """
    when = {
        "starting_time": {"nanoseconds_since_epoch": extent.start_ns},
        "duration": {"nanoseconds": extent.duration_ns},
        "message_count": extent.message_count,
    }
    return {
        "version": VERSION,
        "storage_identifier": "mcap",
        "relative_file_paths": [file_name],
        **when,
        "topics_with_message_count": [
            {
                "topic_metadata": {
                    "name": topic.name,
                    "type": topic.type_name,
                    "serialization_format": "cdr",
                    "offered_qos_profiles": topic.qos,
                    "type_description_hash": topic.type_hash,
                },
                "message_count": topic.message_count,
            }
            for topic in topics
        ],
        "compression_format": "",
        "compression_mode": "",
        "files": [{"path": file_name, **when}],
        "custom_data": dict(custom),
        "ros_distro": ROS_DISTRO,
    }


def to_yaml(data: object) -> str:
    """YAML text, keys in the order given."""
    text: str = yaml.safe_dump(data, sort_keys=False, allow_unicode=True)
    return text


def write_metadata(folder: Path, information: Mapping[str, Any]) -> None:
    """Write a bag's ``metadata.yaml``: at every moment the old one or the new one is there.

    Raises:
        OSError: It cannot be written; the old one is untouched.
    """
    draft = folder / f".{FILE_NAME}.tmp"
    try:
        with draft.open("w", encoding="utf-8") as file:
            file.write(to_yaml({ROOT: dict(information)}))
            file.flush()
            os.fsync(file.fileno())
        draft.replace(folder / FILE_NAME)
    finally:  # after Ctrl-C too
        with suppress(OSError):
            draft.unlink(missing_ok=True)


def read_metadata(folder: Path) -> dict[str, Any]:
    """What a bag's ``metadata.yaml`` says.

    Raises:
        OSError: It is not there or cannot be read.
        ValueError: It is not such a file.
    """
    text = read_text(folder / FILE_NAME, MAX_METADATA_BYTES)
    content = parse_yaml(text)
    information = content.get(ROOT) if isinstance(content, dict) else None
    if not isinstance(information, dict):
        raise ValueError(f"it has no {ROOT}")
    return information
