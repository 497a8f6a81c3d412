# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Waits until a UDP port is open, or refused: ``knock.py HOST PORT open|refused``."""

import socket
import sys
import time

LIMIT = {"open": 60.0, "refused": 3.0}  # s, until it is said that it is not so

host, port, wanted = sys.argv[1], int(sys.argv[2]), sys.argv[3]
end = time.monotonic() + LIMIT[wanted]
found = ""
while found != wanted and time.monotonic() < end:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as door:
        door.settimeout(0.2)
        door.connect((host, port))
        door.send(b"knock")
        try:
            door.recv(1)
        except ConnectionRefusedError:  # the host says that nobody listens
            found = "refused"
            time.sleep(0.1)
        except TimeoutError:
            found = "open"
sys.exit(found != wanted)
