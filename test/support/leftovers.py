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
import time
from pathlib import Path

RUN, TEST = "SLAP_ROS_TEST_RUN", "SLAP_ROS_TEST"
KEPT = b"multiprocessing.resource_tracker"  # one for the whole of pytest
STARTING_S = 1.0  # after which what has no environment is taken to have been given none
KERNEL_THREAD = 0x00200000  # PF_KTHREAD in Linux' sched.h


def newest_pid():
    """The process id that was given last."""
    return int(Path("/proc/loadavg").read_text().split()[-1])


def marked(name, value, since=0):
    """The processes with a mark, this one aside; only those with ids above ``since``."""
    if newest_pid() < since:  # counting has begun again
        since = 0
    mark = f"{name}={value}".encode()
    running = [int(folder.name) for folder in Path("/proc").glob("[0-9]*")]
    deadline = time.monotonic() + STARTING_S
    return [
        pid
        for pid in running
        if pid > since and pid != os.getpid() and mark in _environment(pid, deadline)
    ]


def _environment(pid, deadline):
    """What a process was given; nothing for one that has ended, or is another user's."""
    folder = Path(f"/proc/{pid}")
    try:
        # Whoever started it is told before the kernel shows what it was given.
        while not (given := (folder / "environ").read_bytes()):
            if is_zombie(pid) or _is_kernels(pid) or time.monotonic() > deadline:
                return []
        return [] if KEPT in (folder / "cmdline").read_bytes() else given.split(b"\0")
    except OSError:
        return []


def _is_kernels(pid):
    return bool(int(_status(pid)[6]) & KERNEL_THREAD)


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
        return _status(pid)[0] in "ZX"
    except OSError:
        return True


def _status(pid):
    """What ``/proc/PID/stat`` says from the state on, behind a name with any characters in it."""
    return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()


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
