# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A simulator of points, the acquisition node, and whoever asks it to acquire skills."""

from contextlib import contextmanager
from dataclasses import replace

from rclpy.action import ActionClient
from rclpy.node import Node
from slap_msgs.action import AcquireSkills, GrowSkills
from slap_msgs.msg import AcquisitionEvent, SkillLibrary

from ensemble.interfaces import (
    ACQUIRE_SKILLS,
    ACQUISITION_EVENTS,
    GROW_SKILLS,
    RESET_TASK,
    SKILLS,
    SOLVE_TASK,
)
from ensemble.launcher import InProcessLauncher, ProcessLauncher
from ensemble.nodes import RunSettings, node_parameters
from ensemble.spinner import temporary_node
from slap_ros.skills.domain_choice import DomainChoice

ALONE = ("acquisition_node", "planner_node")
LIMIT = 120.0  # s
GROWTH_LIMIT = 400.0  # s, for two rounds, each of which starts processes that import torch
# Both skills of `points` are learned with these in seconds.
LEARNED = (
    "sac.net_arch=32,32 sac.batch_size=64 sac.learning_rate=0.002 sac.gamma=0.9 sac.tau=0.02 "
    "sac.learning_starts=192 rollouts=12 validation=12 judged=24 segment_episodes=4 "
    "skill_steps=4000"
)
# Nothing is learned with these, and that takes a few seconds in several judgements.
BRIEF = {
    "changes": (
        "sac.net_arch=8,8 sac.batch_size=16 sac.learning_starts=96 rollouts=2 validation=2 "
        "judged=4 segment_episodes=2 skill_steps=1200"
    ),
    "steps": 2400,
}
SETTINGS = RunSettings(DomainChoice("points", "two"), 3, 0, "lazy", None, patience=5.0)


class Asker(Node):
    """Asks for skills, and notes what it is told."""

    def __init__(self) -> None:
        super().__init__("asker")
        self.client = ActionClient(self, ACQUIRE_SKILLS.type, ACQUIRE_SKILLS.name)
        self.grower = ActionClient(self, GROW_SKILLS.type, GROW_SKILLS.name)
        self.solver = ActionClient(self, SOLVE_TASK.type, SOLVE_TASK.name)
        self.reset = self.create_client(RESET_TASK.type, RESET_TASK.name)
        self.events: list[AcquisitionEvent] = []
        self.libraries: list[SkillLibrary] = []
        self.feedback: list[AcquireSkills.Feedback | GrowSkills.Feedback] = []
        for topic, kept in ((ACQUISITION_EVENTS, self.events), (SKILLS, self.libraries)):
            self.create_subscription(topic.type, topic.name, kept.append, topic.qos)


@contextmanager
def asking(record=None, names=("sim_node", "acquisition_node"), settings=SETTINGS, **parameters):
    """The nodes that are named, the recorder where there is a bag, and whoever asks them.

    Those that a test may kill are processes; the others share the process of whoever asks.

    Yields:
        Who asks, what spins it, and the processes' launcher.
    """
    every = node_parameters(replace(settings, record=record, acquisition=parameters))
    every |= {"acquisition_node": parameters | {"libraries": parameters.get("output", "")}}
    names = (*names, *(("recorder_node",) if record else ()))
    alone = {name: every[name] for name in names if name in ALONE}
    beside = {name: every[name] for name in names if name not in ALONE}
    with (
        ProcessLauncher(alone) as launcher,
        temporary_node(Asker) as (asker, spinner),
        InProcessLauncher(beside, spinner.executor),
    ):
        for client in (asker.client, asker.grower):
            assert spinner.spin_until(client.server_is_ready, LIMIT)
        yield asker, spinner, launcher


def send(asker, spinner, **goal):
    """The handle of a goal that was accepted."""
    return accepted(asker, spinner, asker.client, AcquireSkills.Goal(**goal))


def send_growth(asker, spinner, **goal):
    """The handle of a goal to grow skills and shortcuts."""
    return accepted(asker, spinner, asker.grower, GrowSkills.Goal(**goal))


def accepted(asker, spinner, client, goal):
    """The handle of a goal of some action."""
    sent = client.send_goal_async(goal, lambda m: asker.feedback.append(m.feedback))
    assert spinner.spin_until(sent.done, LIMIT)
    return sent.result()


def acquire(asker, spinner, **goal):
    """The result of a goal."""
    return result_of(spinner, send(asker, spinner, **goal))


def grow(asker, spinner, **goal):
    """The result of a goal to grow skills and shortcuts."""
    return result_of(spinner, send_growth(asker, spinner, **goal), GROWTH_LIMIT)


def result_of(spinner, handle, limit=LIMIT):
    """What comes of a goal that was accepted."""
    result = handle.get_result_async()
    assert spinner.spin_until(result.done, limit)
    return result.result().result


def planner_parameters(output):
    """Of a planner that is started again, given where skills are acquired."""
    return node_parameters(SETTINGS)["planner_node"] | {"libraries": str(output)}


def begin_again(asker, spinner):
    """The number of a new episode."""
    answer = asker.reset.call_async(RESET_TASK.type.Request(seed=4))
    assert spinner.spin_until(answer.done, LIMIT)
    assert not answer.result().error_code, answer.result().error_msg
    return answer.result().episode


def solve(asker, spinner, episode):
    """What comes of an episode's task."""
    assert spinner.spin_until(asker.solver.server_is_ready, LIMIT)
    sent = asker.solver.send_goal_async(SOLVE_TASK.type.Goal(episode=episode, max_replans=5))
    assert spinner.spin_until(sent.done, LIMIT)
    result = sent.result().get_result_async()
    assert spinner.spin_until(result.done, LIMIT)
    return result.result().result
