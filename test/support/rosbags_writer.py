# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Bags as the library ``rosbags`` writes them, which is not ours."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path

from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer

from slap_ros.messages.typestore import definition, typestore
from support.truthful_run import Published


def write_with_rosbags(
    path: Path,
    messages: Iterable[Published],
    storage: StoragePlugin,
    compression: CompressionMode = CompressionMode.NONE,
    text: Callable[[str], str] = definition,
) -> None:
    """Write a bag.

    Args:
        path: Folder of the bag, which must not exist.
        messages: Messages in the order in which they are written.
        storage: Storage plug-in.
        compression: What is compressed.
        text: Definition of a type of messages, as the bag has it.
    """
    writer = Writer(path, version=9, storage_plugin=storage)
    writer.set_compression(compression, CompressionFormat.ZSTD)
    with writer:
        write_messages(writer, messages, text)


def write_messages(
    writer: Writer, messages: Iterable[Published], text: Callable[[str], str] = definition
) -> None:
    """Write messages to a bag that is open; ``text`` as :func:`write_with_rosbags` has it."""
    connections = {}
    for item in messages:
        if item.topic not in connections:
            connections[item.topic] = writer.add_connection(
                item.topic,
                item.type_name,
                msgdef=text(item.type_name),
                rihs01=typestore().hash_rihs01(item.type_name),
            )
        writer.write(connections[item.topic], item.stamp_ns, item.cdr)
