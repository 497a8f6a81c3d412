# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Whatever a test starts ends with it, and with pytest, however that ends.

Processes inherit a mark in their environment, through every session and fork. When a test ends,
those with its mark are killed; when pytest ends, by SIGKILL too, a guard kills those with its own.
"""

import os
import signal
import subprocess
import sys
from pathlib import Path

RUN, TEST = "SLAP_ROS_TEST_RUN", "SLAP_ROS_TEST"
KEPT = b"multiprocessing.resource_tracker"  # one for the whole of pytest


def newest_pid():
    """The process id that was given last."""
    return int(Path("/proc/loadavg").read_text().split()[-1])


def marked(name, value, since=0):
    """The processes with a mark, this one aside; only those with ids above ``since``."""
    if newest_pid() < since:  # counting has begun again
        since = 0
    mark = f"{name}={value}".encode()
    found = []
    for folder in Path("/proc").glob("[0-9]*"):
        if int(folder.name) <= since:
            continue
        try:
            environment = (folder / "environ").read_bytes().split(b"\0")
            if mark in environment and KEPT not in (folder / "cmdline").read_bytes():
                found.append(int(folder.name))
        except OSError:
            continue  # it has ended, or is another user's
    return [pid for pid in found if pid != os.getpid()]


def kill_marked(name, value, since=0):
    """Kill them, and whatever they start meanwhile."""
    if newest_pid() == since:  # as after most tests
        return
    while pids := [pid for pid in marked(name, value, since) if not is_zombie(pid)]:
        for pid in pids:
            try:
                os.kill(pid, signal.SIGKILL)
            except ProcessLookupError:
                continue


def is_zombie(pid):
    """Whether a process has ended, and its parent has not asked."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] in "ZX"
    except OSError:
        return True


def start_guard():
    """Mark what this process starts from now on, and have it killed when this process ends."""
    os.environ[RUN] = f"{os.getpid()}"
    environment = {key: value for key, value in os.environ.items() if key != RUN}
    # It ends when the other end of the pipe is closed, which the kernel sees to.
    return subprocess.Popen(
        [sys.executable, __file__, os.environ[RUN]],
        stdin=subprocess.PIPE,
        env=environment,
        start_new_session=True,
    )


if __name__ == "__main__":
    sys.stdin.read()
    kill_marked(RUN, sys.argv[1])
