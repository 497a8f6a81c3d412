# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Writes messages and says how many it has written, until something stops it.

``python -m support.counting_writer FOLDER [FILE_SIZE_LIMIT_BYTES]``
"""

from __future__ import annotations

import os
import resource
import sys
from itertools import count

from slap_ros.bags import BagWriter
from slap_ros.errors import StorageFullError
from slap_ros.messages.typestore import typestore

STRING = "std_msgs/msg/String"
STATE = "slap_msgs/msg/ObjectCentricState"


def cdr(number: int) -> bytes:
    """A state whose frame is long and tells its number."""
    types = typestore().types
    stamp = types["builtin_interfaces/msg/Time"](sec=number, nanosec=0)
    header = types["std_msgs/msg/Header"](stamp=stamp, frame_id=f"{number} " * 200)
    state = types[STATE](header=header, episode=1, step=number, objects=[])
    return bytes(typestore().serialize_cdr(state, STATE))


def main() -> int:
    writer = BagWriter(sys.argv[1], {"seed": "3"})
    if len(sys.argv) > 2:
        resource.setrlimit(resource.RLIMIT_FSIZE, (int(sys.argv[2]), resource.RLIM_INFINITY))
    for number in count():
        try:
            writer.write("/slap/state", STATE, number, cdr(number))
        except StorageFullError as error:
            sys.stderr.write(f"{error}\n")
            return int(error.code)
        os.write(1, b"%d\n" % (number + 1))
    return 0


if __name__ == "__main__":
    sys.exit(main())
