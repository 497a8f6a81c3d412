# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""One run from start to end: bring the ensemble up, have the task solved, close the bag."""

from __future__ import annotations

from collections.abc import Collection
from contextlib import nullcontext
from dataclasses import dataclass, replace
from time import monotonic
from typing import Any

from rclpy.executors import Executor
from rclpy.task import Future

from ensemble.client import OnMessage, RunClient
from ensemble.interfaces import Topic
from ensemble.launcher import InProcessLauncher, NodeLauncher, NodeParameters, ProcessLauncher
from ensemble.node_process import ForkServer
from ensemble.nodes import RunSettings, node_parameters
from ensemble.patience import load_advice
from ensemble.skill_request import SkillRequest, SkillRequester
from ensemble.spinner import Spinner, temporary_node
from slap_ros.errors import (
    AlreadyRunningError,
    ErrorCode,
    NodeDiedError,
    NotReadyError,
    RunTimeoutError,
    SlapError,
    error_from,
)
from slap_ros.evaluation.metrics import RunMetrics
from slap_ros.relational import GroundAtom

DISCOVERY = 0.3  # s, after which nodes that are there already are known
READY_TIMEOUT = 30.0  # s, for all nodes to come up
IMPORTS = 10  # as many times as long as here an import may take: all nodes import at once
CANCEL_TIMEOUT = 5.0  # s, for the robot to hold after a cancel
LOG_TIMEOUT = 5.0  # s, for the last messages of a run to arrive
CLOSE_TIMEOUT = 10.0  # s, for the recorder to finish


@dataclass(frozen=True)
class RunRequest:
    """What to solve, and how long to try."""

    settings: RunSettings
    goal: Collection[GroundAtom] = ()  # empty: the task's own
    step_limit: int = 0  # environment steps; 0: the task's own
    max_replans: int = 5
    timeout_s: float = 600.0  # whatever the patience
    import_s: float = 0.0  # s that importing the domain took, which every node does as well
    in_process: bool = False
    shown: Collection[Topic] = ()  # to be followed as well, for the eye
    skills: SkillRequest | None = None  # what is learned where the run lacks it; None: it fails


def run(request: RunRequest, on_message: OnMessage) -> RunMetrics:
    """Run an ensemble until its task is solved or is not.

    Args:
        request: What to run.
        on_message: Called for every message of the run.

    Returns:
        The metrics, from the messages of the run; failures are in their error code.

    Raises:
        InvalidParameterError: An environment variable, such as ROS_DOMAIN_ID, is wrong.
        AlreadyRunningError: Another ensemble would be disturbed.
        NotReadyError: The nodes did not come up.
        NodeDiedError: A node ended before the run began.
        SlapError: The planner refused the task; the code says why.
        KeyboardInterrupt: After the robot holds and the bag is closed.
    """
    nodes = node_parameters(request.settings)
    with (
        # What nodes need is imported while others are looked for.
        nullcontext() if request.in_process else ForkServer(nodes) as server,
        temporary_node(lambda: RunClient(on_message, request.shown)) as (client, spinner),
    ):
        _require_alone(client, spinner)
        with _launcher(nodes, server, spinner.executor) as launcher:
            return _drive(request, client, spinner, launcher)


def _launcher(nodes: NodeParameters, server: ForkServer | None, executor: Executor) -> NodeLauncher:
    return ProcessLauncher(nodes, server) if server else InProcessLauncher(nodes, executor)


def _require_alone(client: RunClient, spinner: Spinner) -> None:
    if spinner.spin_until(lambda: bool(client.other_nodes()), DISCOVERY):
        found = ", ".join(sorted(client.other_nodes()))
        raise AlreadyRunningError(
            f"{found} already run on this network: stop them, or set another ROS_DOMAIN_ID for "
            "this run"
        )


def _drive(
    request: RunRequest, client: RunClient, spinner: Spinner, launcher: NodeLauncher
) -> RunMetrics:
    spinner.check = launcher.check
    recording = request.settings.record is not None
    ready_s = READY_TIMEOUT + IMPORTS * request.import_s
    ready_s = min(ready_s * request.settings.patience, request.timeout_s)
    requester = SkillRequester(client, spinner, request.settings.patience)

    def ready() -> bool:
        return client.ready(recording) and (request.skills is None or requester.ready())

    if not spinner.spin_until(ready, ready_s):
        raise NotReadyError(
            f"the ensemble did not come up within {ready_s:.3g} s; try `slap doctor`; or "
            f"{load_advice()}"
        )
    failure: SlapError | None = None
    try:
        _solve_with_skills(request, client, spinner, requester)
    except SlapError as error:
        failure = error
    finally:
        requester.destroy()
        if recording:
            failure = _close_bag(client, spinner, launcher, request.settings.patience) or failure
    runs = client.log.runs()
    if not runs:
        raise failure or NotReadyError("the planner ended the run without an event")
    if failure is None:
        return runs[-1]
    return replace(runs[-1], error_code=failure.code, error_msg=str(failure))


def _solve_with_skills(
    request: RunRequest, client: RunClient, spinner: Spinner, requester: SkillRequester
) -> None:
    """Solve the task; where skills or shortcuts are lacking, have them learned, and try it again.

    Args:
        request: What to run.
        client: Follows it.
        spinner: Spins the client.
        requester: Asks for skills.

    Raises:
        SlapError: Why it is not solved, where that is not in the log.
    """
    end = monotonic() + request.timeout_s
    failure: SlapError | None = None
    try:
        _solve(request, client, spinner, end)
    except SlapError as error:
        failure = error
    runs = client.log.runs()
    code = failure.code if failure is not None else runs[-1].error_code if runs else ErrorCode.NONE
    if request.skills is None or not request.skills.answers(code):
        if failure is not None:
            raise failure
        return
    learned = requester.learn(request.skills, request.goal, end - monotonic())
    _solve(request, client, spinner, end, requester.begin_again(learned.digest))


def _solve(
    request: RunRequest, client: RunClient, spinner: Spinner, end: float, episode: int = 0
) -> None:
    """Solve the task of an episode, and wait for all that tells of it.

    Args:
        request: What to run.
        client: Follows it.
        spinner: Spins the client.
        end: When to give up, s.
        episode: Number of the episode; 0 for the current one.

    Raises:
        SlapError: Why it is not solved, where that is not in the log.
    """
    before = len(client.log.runs())
    sent = client.send(request.goal, request.step_limit, request.max_replans, episode)
    try:
        if not spinner.spin_until(sent.done, end - monotonic()):
            raise RunTimeoutError(f"the planner did not answer within {request.timeout_s} s")
        result = sent.result().get_result_async()
        if not spinner.spin_until(result.done, end - monotonic()):
            raise RunTimeoutError(f"the task was not done within {request.timeout_s} s")
    except (KeyboardInterrupt, RunTimeoutError):
        _cancel(sent, spinner, request.settings.patience)
        raise
    outcome = result.result().result
    complete = spinner.spin_until(
        lambda: len(client.log.runs()) > before and client.log.complete,
        LOG_TIMEOUT * request.settings.patience,
    )
    if not complete and outcome.error_code:
        raise error_from(outcome.error_code, outcome.error_msg)


def _cancel(sent: Future, spinner: Spinner, patience: float) -> None:
    """Make the robot hold."""
    limit_s = CANCEL_TIMEOUT * patience
    if sent.done():
        canceled: Any = sent.result().cancel_goal_async()
        if spinner.spin_until(canceled.done, limit_s):  # else the planner is away
            ended = sent.result().get_result_async()
            spinner.spin_until(ended.done, limit_s)


def _close_bag(
    client: RunClient, spinner: Spinner, launcher: NodeLauncher, patience: float
) -> SlapError | None:
    """Have the bag finished; the error where the recorder is gone."""
    limit_s = CLOSE_TIMEOUT * patience
    spinner.check = lambda: launcher.require("recorder_node")  # who else is gone is known by now
    closed = client.close_bag()
    try:
        if not spinner.spin_until(closed.done, limit_s):
            return RunTimeoutError(
                f"the recorder did not finish its bag within {limit_s} s; {load_advice()}"
            )
    except NodeDiedError as error:
        return error
    return None
