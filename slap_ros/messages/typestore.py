# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The message definitions of slap_msgs, and the typestore that (de)serialises them without ROS.

Apart from the names of types, since nodes that record nothing need no rosbags.
"""

from __future__ import annotations

from functools import lru_cache
from importlib.util import find_spec
from pathlib import Path

from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from slap_ros.messages.interfaces import PACKAGE


@lru_cache(maxsize=1)
def message_texts() -> dict[str, str]:
    """The text of every ``.msg`` file, by type name such as ``slap_msgs/msg/Task``."""
    return {
        f"{PACKAGE}/msg/{file.stem}": file.read_text(encoding="utf-8")
        for file in sorted(_folder().glob("*.msg"))
    }


def _folder() -> Path:
    """Where the ``.msg`` files are.

    ``importlib.resources`` would find them too, but fails on Python 3.11 for a package without
    ``__init__.py`` in an editable install, where one of its locations is not a folder.
    """
    spec = find_spec("msg_schemas")
    for location in (spec.submodule_search_locations or ()) if spec is not None else ():
        if (folder := Path(location, "msg")).is_dir():
            return folder
    raise ModuleNotFoundError("no module msg_schemas: install slap_ros, or run from its folder")


@lru_cache(maxsize=1)
def typestore() -> Typestore:
    """All message types of ROS 2 Jazzy that rosbags knows, and those of slap_msgs."""
    store = get_typestore(Stores.ROS2_JAZZY)
    for name, text in message_texts().items():
        store.register(get_types_from_msg(text, name))
    return store


@lru_cache(maxsize=256)
def definition(type_name: str) -> str:
    """The definition of a type with those of the types in it, as bags carry it (``ros2msg``)."""
    text, _ = typestore().generate_msgdef(type_name, ros_version=2)
    return text
