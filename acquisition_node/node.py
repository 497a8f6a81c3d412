# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Proposes operators and rewards for the task of an episode, and acquires skills (LG-SAIL §4).

ROS Parameters:
    language_settings (string, ""): JSON file with model, server and sampling; see
        ``docs/language.md``. The key is the environment's OPENAI_API_KEY, never a parameter.
    model (string, ""), base_url (string, ""): instead of the settings' own, or of
        SLAP_LANGUAGE_MODEL and SLAP_LANGUAGE_BASE_URL.
    cassette (string, "live"): live, record:FILE, replay:FILE, or off.
    demonstrations (string, ""): bags for the proposer ``induced``, separated by blanks.
    output (string, "runs/skills"): folder for libraries of skills, and for what is learned for
        them. A goal has a folder of its own there, in which the same goal goes on.
    settings (string, "small"), changes (string, ""): how skills are learned, as ``slap acquire``
        has it; changes as ``rollouts=20 sac.gamma=0.9``.
    steps (int, 150000): environment steps that a goal of slap/acquire_skills may learn for at most.
    shortcut_settings (string, "ours_near"), shortcut_changes (string, ""): how shortcuts are
        learned, as ``slap grow`` has it.
    growth_steps (int, 1000000): environment steps that a goal of slap/grow_skills may learn for at
        most.
    jobs (int, 1): processes that learn.
    begin_with (string, ""): libraries that skills may begin with, separated by blanks.
    attempts (int, 40), tokens (int, 400000), seconds (double, 900.0): the most that one goal may
        spend on a language model.
    task_timeout (double, 10.0): seconds to wait for a task.
    domain (string, ""), preset (string, ""): imported at the start; empty: whichever the simulator
        announces.
    skills (string, ""): as perception_node's.
    libraries (string, "runs/skills"): folders below which a library that slap/skills names may lie,
        separated by ':'; others are refused.
    patience (double, 1.0): factor of all deadlines, for slow domains and machines.

Publishers:
    slap/acquisition_events (slap_msgs/AcquisitionEvent): questions' answers and what is wrong with
        them; plans that are carried out while skills are learned, and judgements of skills.
    slap/skills (slap_msgs/SkillLibrary): the newest library that was acquired; latched.
    diagnostics (diagnostic_msgs/DiagnosticArray): proposals and trainings asked for and made; 1 Hz.

Subscribers:
    slap/domain, slap/task: see ``ensemble.observation``.
    slap/skills: as all nodes do, to follow the domain with these skills.

Action servers:
    slap/propose_operators (slap_msgs/ProposeOperators): one proposal.
    slap/acquire_skills (slap_msgs/AcquireSkills): the skills that a goal takes. They are learned in
        a process of its own, which ends when the goal is canceled or the node ends.
    slap/grow_skills (slap_msgs/GrowSkills): skills, shortcuts over them, and again until plans get
        no shorter; in such a process as well.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Coroutine, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import partial
from time import monotonic
from typing import Any

from rclpy.action import ActionServer, CancelResponse
from rclpy.action.server import ServerGoalHandle
from rclpy.node import Node
from slap_msgs.action import AcquireSkills, GrowSkills, ProposeOperators

from acquisition_node.acquisition_publisher import AcquisitionPublisher
from acquisition_node.proposal_job import ProposalJob
from acquisition_node.skill_acquisition import SkillAcquisition
from acquisition_node.skill_growth import SkillGrowth
from acquisition_node.trainer import Trainer
from acquisition_node.trainer_goal import TrainerGoal
from acquisition_node.training_request import TrainingRequest, goal_in_words
from ensemble.acquisition_parameters import AcquisitionParameters
from ensemble.answering import error_to_answer
from ensemble.common_parameters import read_with_common
from ensemble.diagnostics import DiagnosticsPublisher
from ensemble.entry_point import run_node
from ensemble.episode_tracker import EpisodeTracker
from ensemble.futures import submit, wait_for_first, wait_until
from ensemble.interfaces import ACQUIRE_SKILLS, GROW_SKILLS, PROPOSE_OPERATORS
from ensemble.observation import Episode
from ensemble.patience import load_advice
from ensemble.refusals import Refusals
from slap_ros.errors import BusyError, EpisodeChangedError, NoTaskError, TaskCanceledError
from slap_ros.messages.decode import decode_goal

SKILLS_SUBJECT = "skills"  # of events about an acquisition as a whole
Answer = Callable[[ServerGoalHandle, Episode], Coroutine[None, None, Any]]
THREADS = 2  # a canceled proposal may still wait for its model while the next one begins


class AcquisitionNode(Node):
    """Makes proposals, and has the skills of their operators learned in a process of its own."""

    def __init__(self, **kwargs: Any) -> None:
        """Serve all actions; ``kwargs`` are the node's."""
        super().__init__("acquisition_node", **kwargs)
        self._settings, common = read_with_common(self, AcquisitionParameters)
        common.imported()
        self._timeout_s = self._settings.task_timeout * common.patience
        self._busy = False
        self._trainer: Trainer | None = None  # while skills are learned
        self._counts = Counter(asked=0, proposed=0, trainings=0, acquired=0)
        self._workers = ThreadPoolExecutor(THREADS, thread_name_prefix="proposing")
        refusals = Refusals(self)
        self._episodes = EpisodeTracker(self, lambda _: None, lambda *_: None, refusals, common)
        self._publisher = AcquisitionPublisher(self)
        self._actions = [
            ActionServer(
                self,
                served.type,
                served.name,
                execute,
                cancel_callback=lambda _: CancelResponse.ACCEPT,
            )
            for served, execute in (
                (PROPOSE_OPERATORS, self._execute_proposal),
                (ACQUIRE_SKILLS, self._execute_acquisition),
                (GROW_SKILLS, self._execute_growth),
            )
        ]
        DiagnosticsPublisher(self, lambda: {**self._counts, **refusals.counts})

    def destroy_node(self) -> None:
        """Stop the threads and the trainer as well."""
        self._workers.shutdown(wait=False, cancel_futures=True)
        if self._trainer is not None:
            self._trainer.stop()
        self._episodes.destroy()
        for server in self._actions:
            server.destroy()
        super().destroy_node()

    async def _execute_proposal(self, goal: ServerGoalHandle) -> ProposeOperators.Result:
        self._counts["asked"] += 1
        result = await self._execute(goal, self._propose, ProposeOperators)
        self._counts["proposed"] += result.success
        return result

    async def _execute_acquisition(self, goal: ServerGoalHandle) -> AcquireSkills.Result:
        return await self._execute_training(goal, self._acquire, AcquireSkills)

    async def _execute_growth(self, goal: ServerGoalHandle) -> GrowSkills.Result:
        return await self._execute_training(goal, self._grow, GrowSkills)

    async def _execute_training(self, goal: ServerGoalHandle, answer: Answer, kind: Any) -> Any:
        """Answer a goal by training; see :meth:`_execute`.

        Args:
            goal: What is asked for.
            answer: Makes the result.
            kind: Type of the goal's action.
        """
        self._counts["trainings"] += 1
        result = await self._execute(goal, answer, kind, SKILLS_SUBJECT)
        self._counts["acquired"] += result.success
        return result

    async def _execute(
        self,
        goal: ServerGoalHandle,
        answer: Answer,
        kind: Any,
        subject: str = "",
    ) -> Any:
        """Answer a goal, one at a time; errors are in the result, and in an event.

        Args:
            goal: What is asked for.
            answer: Makes the result.
            kind: Type of the goal's action.
            subject: Subject of the event after an error; empty for a proposal.

        Returns:
            The result of the goal's action.
        """
        try:
            result = await self._alone(goal, answer)
        except Exception as raised:
            error = error_to_answer(self, raised)
            self._publisher.failed(error, subject)
            result = kind.Result(error_code=int(error.code), error_msg=str(error))
        if result.success:
            goal.succeed()
        elif result.error_code == TaskCanceledError.code:
            goal.canceled()
        else:
            goal.abort()
        return result

    async def _alone(self, goal: ServerGoalHandle, answer: Answer) -> Any:
        if self._busy:
            raise BusyError("another proposal or training is under way; cancel it first")
        self._busy = True
        try:
            return await answer(goal, await self._episode(goal.request.episode))
        finally:
            self._busy = False

    async def _episode(self, number: int) -> Episode:
        """The episode that is asked for, once it is known."""
        deadline = monotonic() + self._timeout_s

        def known() -> bool:
            return self._episodes.current is not None and self._episodes.current.number >= number

        await wait_until(self, lambda: known() or monotonic() > deadline)
        episode = self._episodes.current
        if episode is None or not known():
            raise self._episodes.refusal or NoTaskError(
                f"no task within {self._timeout_s} s: is sim_node (or robot_bridge) running? "
                f"If so, {load_advice()}"
            )
        if number and number != episode.number:
            raise EpisodeChangedError(
                f"goal for episode {number}, but episode {episode.number} is under way"
            )
        return episode

    async def _propose(self, goal: ServerGoalHandle, episode: Episode) -> ProposeOperators.Result:
        asked = goal.request
        atoms = decode_goal(asked.goal, episode.space) or episode.task.goal
        proposal = ProposalJob(
            domain=episode.domain,
            task=replace(episode.task, goal=atoms),
            proposer=asked.proposer or "manual",
            rewarder=asked.rewarder or "none",
            settings=self._settings.within(asked.attempts, asked.tokens, asked.seconds),
        )
        self._publisher.started(episode.number)
        canceled = partial(getattr, goal, "is_cancel_requested")
        show = partial(self._publisher.entry, goal)
        job = submit(self._workers, partial(proposal.run, show, canceled))
        if not await wait_for_first(self, job, canceled):
            raise TaskCanceledError("the proposal was canceled")
        problem, made = job.result().result()
        self._publisher.finished(made.plan or ())
        return self._publisher.result(made, problem)

    async def _acquire(self, goal: ServerGoalHandle, episode: Episode) -> AcquireSkills.Result:
        arguments = self._training_request(goal, episode).arguments(self._settings)
        return await self._train(goal, episode, SkillAcquisition, arguments)

    async def _grow(self, goal: ServerGoalHandle, episode: Episode) -> GrowSkills.Result:
        arguments = self._training_request(goal, episode).growth_arguments(self._settings)
        return await self._train(goal, episode, SkillGrowth, arguments)

    def _training_request(self, goal: ServerGoalHandle, episode: Episode) -> TrainingRequest:
        """The training that a goal asks for.

        Args:
            goal: What is asked for.
            episode: Episode of the task.
        """
        asked, domain = goal.request, episode.domain
        atoms = decode_goal(asked.goal, episode.space) or episode.task.goal
        return TrainingRequest(
            domain=domain,
            goal=goal_in_words(domain, episode.task, atoms),
            proposer=asked.proposer,
            rewarder=asked.rewarder,
            steps=asked.step_budget,
            seed=asked.seed,
            kept=self._episodes.library_folder,
        )

    async def _train(
        self,
        goal: ServerGoalHandle,
        episode: Episode,
        kind: type[TrainerGoal],
        arguments: Sequence[str],
    ) -> Any:
        """Train in a process of its own until it ends or the goal is canceled.

        Args:
            goal: What is asked for.
            episode: Episode of the task.
            kind: Kind of the goal.
            arguments: Arguments of the goal's command, the folder of the results last.

        Returns:
            The result of the goal's action.

        Raises:
            TaskCanceledError: The goal was canceled.
            SlapError: Training failed.
        """
        self._trainer = trainer = Trainer(kind.command, arguments)
        self._publisher.started(episode.number)
        canceled = partial(getattr, goal, "is_cancel_requested")
        training = kind(goal, episode.domain, trainer, self._publisher)
        job = submit(self._workers, training.run)
        try:
            if await wait_for_first(self, job, canceled):
                return job.result().result()
            trainer.stop()
            await wait_until(self, job.done)
        finally:
            self._trainer = None
        raise TaskCanceledError(
            f"canceled; what was learned stays {kind.place} {arguments[-1]}, where the same goal "
            "goes on"
        )


def main() -> int:
    """Run the node."""
    return run_node("acquisition_node", AcquisitionNode)
