# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A stranger on the network, as a process: ``python flood.py KIND RATE`` until it is killed.

It listens to an ensemble and publishes what does not belong there, RATE messages a second.
"""

import sys
from copy import deepcopy
from time import monotonic, sleep

import rclpy
from diagnostic_msgs.msg import KeyValue
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from slap_msgs.msg import RobotCommand, SkillLibrary

from ensemble.interfaces import ATOMS, COMMAND, DOMAIN, FAULT, SKILLS, STATE, TASK

HEARD = (DOMAIN, TASK, STATE, ATOMS)
PERIOD = 0.005  # s between two bursts


def changed(message, **fields):
    message = deepcopy(message)
    for name, value in fields.items():
        setattr(message, name, value)
    return message


def stamped(message, number):
    message.header.stamp.sec += 1 + number % 1000
    message.header.stamp.nanosec = number % 10**9
    return message


def not_finite(heard, number):
    state = changed(heard[STATE.name], step=heard[STATE.name].step + 1)
    state.objects[0].features[0] = float("nan")
    return stamped(state, number)


def preset(heard, number):
    return changed(heard[DOMAIN.name], preset=f"fair:nothing={number}")


def digest(heard, number):
    domain = deepcopy(heard[DOMAIN.name])
    domain.configuration = [KeyValue(key="skills_digest", value=f"{number:064d}")]
    return domain


def spoilt(heard, number):
    task = changed(heard[TASK.name], episode=2**20 + number)
    task.initial_state = deepcopy(task.initial_state)
    task.initial_state.objects[0].features.append(0.0)
    return task


def library(heard, number):
    return SkillLibrary(domain=heard[TASK.name].domain, folder="/tmp", digest=f"{number:064d}")


def large(heard, number):
    state = changed(heard[STATE.name], episode=2**20 + number, step=1)
    state.objects = list(state.objects) * 400
    return state


KINDS = {  # what is published, given what was heard and how many there were before
    "state of another episode": (
        STATE,
        lambda heard, n: stamped(changed(heard[STATE.name], episode=2**20 + n), n),
    ),
    "state of the next episode": (
        STATE,
        lambda heard, n: stamped(
            changed(heard[STATE.name], episode=heard[STATE.name].episode + 1, step=n % 50), n
        ),
    ),
    "state of a later step": (
        STATE,
        lambda heard, n: stamped(changed(heard[STATE.name], step=10**6 + n), n),
    ),
    "state of an earlier step": (
        STATE,
        lambda heard, n: stamped(changed(heard[STATE.name], step=0), n),
    ),
    "state that is not finite": (STATE, not_finite),
    "large states": (STATE, large),
    "atoms of another episode": (
        ATOMS,
        lambda heard, n: stamped(changed(heard[ATOMS.name], episode=2**20 + n), n),
    ),
    "atoms of a later step": (
        ATOMS,
        lambda heard, n: stamped(changed(heard[ATOMS.name], step=10**6 + n), n),
    ),
    "atoms without a state": (ATOMS, lambda heard, n: stamped(deepcopy(heard[ATOMS.name]), n)),
    "unknown domain": (DOMAIN, lambda heard, n: changed(heard[DOMAIN.name], name=f"moon{n}")),
    "unknown preset": (DOMAIN, preset),
    "unknown skills": (DOMAIN, digest),
    "another domain": (
        DOMAIN,
        lambda heard, n: stamped(
            changed(heard[DOMAIN.name], name="cluttered_drawer" if n % 2 else "obstacle_tower"), n
        ),
    ),
    "task of another domain": (
        TASK,
        lambda heard, n: changed(heard[TASK.name], domain=f"moon{n}", episode=2**20 + n),
    ),
    "task that cannot be": (TASK, spoilt),
    "stale commands": (COMMAND, lambda heard, n: RobotCommand(episode=1, step=0, deltas=[0.0] * 2)),
    "fault of another episode": (
        FAULT,
        lambda heard, n: FAULT.type(episode=2**20 + n, error_code=75),
    ),
    "skills": (SKILLS, library),
}


def main(kind, rate):
    rclpy.init()
    node = Node("stranger", namespace="/elsewhere")
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    heard = {}
    for topic in HEARD:
        node.create_subscription(
            topic.type,
            f"/{topic.name}",
            lambda m, name=topic.name: heard.__setitem__(name, m),
            topic.qos,
        )
    topic, made = KINDS[kind]
    publisher = node.create_publisher(topic.type, f"/{topic.name}", topic.qos)
    while len(heard) < len(HEARD):
        executor.spin_once(timeout_sec=0.1)
    began, number = monotonic(), 0
    sys.stdout.write("flooding\n")
    sys.stdout.flush()
    while True:
        for _ in HEARD:
            executor.spin_once(timeout_sec=0)
        due = (monotonic() - began) * rate
        while number < due:
            publisher.publish(made(heard, number))
            number += 1
        sleep(PERIOD)


if __name__ == "__main__":
    main(sys.argv[1], float(sys.argv[2]))
