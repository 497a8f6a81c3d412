# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""ROS 2's command line, and processes that leave nothing behind."""

import os
import re
import signal
import subprocess
from contextlib import contextmanager

LIMIT = 100  # s, far more than anything here takes
ANSWER_LIMIT = 30  # s, far more than a parameter takes on a busy machine


def ros2(*arguments, limit=LIMIT, **environment):
    """What ``ros2 …`` wrote; it must succeed."""
    done = subprocess.run(
        ["ros2", *map(str, arguments)],
        env=os.environ | environment,
        capture_output=True,
        text=True,
        timeout=limit,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def wait_for_task(**environment):
    """Return once a simulator has published its task."""
    latched = ["--qos-durability", "transient_local", "--qos-reliability", "reliable"]
    ros2("topic", "echo", "--once", *latched, "/slap/task", "slap_msgs/msg/Task", **environment)


def parameter(node, name):
    """The value of a node's parameter, as ROS 2 words it.

    A node may answer before it has found who asks. Such an answer is lost, and ``ros2 param`` waits
    for it for ever, so that it asks anew, as a person would.
    """
    ask = ("param", "get", f"/{node}", name, "--hide-type")
    try:
        return ros2(*ask, limit=ANSWER_LIMIT).strip()
    except subprocess.TimeoutExpired:
        return ros2(*ask).strip()


def solve():
    """The plan length of the task that ``ros2 action send_goal`` has solved."""
    kind = "slap_msgs/action/SolveTask"
    told = ros2("action", "send_goal", "--feedback", "/slap/solve_task", kind, "{max_replans: 5}")
    assert "success: true" in told, told
    assert "Goal finished with status: SUCCEEDED" in told
    return int(re.search(r"plan_length: (\d+)", told)[1])


@contextmanager
def started(command, output, **environment):
    """A process, which Ctrl-C ends quietly; what it writes goes to a file.

    Whatever it started is gone with it, also when a test fails.
    """
    with output.open("w") as file:
        process = subprocess.Popen(
            [*map(str, command)],
            env=os.environ | environment,
            stdout=file,
            stderr=subprocess.STDOUT,
            start_new_session=True,
        )
    try:
        yield process
        process.send_signal(signal.SIGINT)
        process.wait(LIMIT)
    finally:
        if process.poll() is None:
            os.killpg(process.pid, signal.SIGKILL)
            process.wait()
    assert "Traceback" not in output.read_text(), output.read_text()
