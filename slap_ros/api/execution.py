# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Executing a plan in a world of its own, and what is kept of it."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory
from time import time_ns

from slap_ros.api.argument_kinds import checks_arguments
from slap_ros.api.planning import planner_for
from slap_ros.api.video import frame_size, write_video
from slap_ros.bags.run_recording import record_run
from slap_ros.core import Action, Domain, Task
from slap_ros.core.notebook import ShownInNotebooks
from slap_ros.planning.execution import MAX_REPLANS, EpisodeResult, ExecutedEdge, Executor
from slap_ros.planning.plan import Plan, PlanningResult
from slap_ros.planning.planner import Planner
from slap_ros.relational import State
from slap_ros.report import BagReport, read_report
from slap_ros.whole_numbers import require_whole


@dataclass(frozen=True, repr=False)
class Run(ShownInNotebooks):
    """A task that was executed, solved or not.

    Args:
        domain: Domain of the task.
        task: Task that was to be solved.
        episode: Record of the executed episode.
        began_ns: Time at which it began, ns since the epoch; the only thing in a bag that differs
            from one run of the same plan to the next.
    """

    domain: Domain
    task: Task
    episode: EpisodeResult
    began_ns: int = field(default_factory=time_ns, compare=False)

    @property
    def success(self) -> bool:
        """Whether the goal was reached."""
        return self.episode.success

    @property
    def steps(self) -> int:
        """Environment steps executed: the plan length that is measured."""
        return self.episode.plan_length

    @property
    def states(self) -> list[State]:
        """All states, the first the initial one."""
        return self.episode.states

    @property
    def actions(self) -> list[Action]:
        """All actions, one per environment step."""
        return self.episode.actions

    @property
    def edges(self) -> list[ExecutedEdge]:
        """What was executed, in order, of all plans."""
        return self.episode.edges

    @property
    def error(self) -> str:
        """Why the task was not solved; empty for a success."""
        return "" if self.success else self.episode.error.reason

    def __str__(self) -> str:
        """A line per edge that was executed, and how it ended."""
        lines = [
            f"{edge.steps:5d}  {edge.option}({', '.join(edge.objects)})"
            f"{'  (shortcut)' if edge.kind == 'shortcut' else ''}"
            f"{'' if edge.reached else '  (failed)'}"
            for edge in self.edges
        ]
        end = "solved" if self.success else f"not solved: {self.error}"
        return "\n".join([*lines, f"{self.steps:5d}  steps, {end}"])

    def bag(self, folder: Path | str) -> Path:
        """Write the run as a bag, as ``slap run --record`` does of the same plan.

        ``slap bag evaluate``, ``slap bag replay``, ``slap report`` and :func:`load_bag` read it.

        Args:
            folder: Folder of the bag, which must not exist.

        Returns:
            The folder.

        Raises:
            BagExistsError: There is something; it is left alone.
            StorageFullError: There is no room.
            OSError: There can be no folder.
        """
        record_run(folder, self.domain, self.task, self.episode, self.began_ns)
        return Path(folder)

    def video(self, path: Path | str, size: tuple[int, int] | None = None) -> Path:
        """Write an animation of all states.

        Args:
            path: File to write; it ends in ``.gif`` or ``.mp4``.
            size: Width and height, pixels, both even; None for the domain's own.

        Returns:
            The path.

        Raises:
            InvalidParameterError: The domain displays no bodies, the name has another ending, or
                the size cannot be.
            StorageFullError: It cannot be written.
        """
        pixels = None if size is None else frame_size(size)
        write_video(self.domain, self.states, Path(path), pixels)
        return Path(path)

    def report(self) -> BagReport:
        """What ``slap report`` shows of the run; a notebook shows its page."""
        with TemporaryDirectory(prefix="slap-") as folder:
            return read_report(self.bag(Path(folder) / f"{self.domain.name}-{self.task.seed}"))


@checks_arguments
def execute(
    domain: Domain,
    task: Task,
    plan: PlanningResult | Plan | None = None,
    *,
    max_replans: int = MAX_REPLANS,
) -> Run:
    """Execute a plan in a world of its own, watch it, and plan again where it diverges.

    Args:
        domain: Domain of the task.
        task: Task to solve; the world begins in its initial state.
        plan: Plan to execute, as :func:`plan` makes it; None to plan with what ships.
        max_replans: Largest number of plans that replace a diverged one.

    Returns:
        The run. A task that is not solved is no error: ``run.success`` and ``run.error`` say so.

    Raises:
        InvalidParameterError: ``max_replans`` is negative or no whole number.
        NoSkillsError: The domain has no skills yet.
        InvalidLibraryError: Without a plan: the library that ships cannot be used.
    """
    require_whole("max_replans", max_replans)
    first = plan if not isinstance(plan, Plan) else PlanningResult(plan, 0, 0, 0)
    space = domain.atom_space(task.initial_state)
    planner = first.planner if first is not None else planner_for(domain, task)
    executor = Executor(
        domain,
        planner or _LatePlanner(domain, task),
        domain.make_world(task.initial_state),
        space,
        space.mask(task.goal),
        task.step_limit,
        max_replans,
        begin_with=first,
    )
    began_ns = time_ns()
    return Run(domain, task, executor.run(), began_ns)


@dataclass
class _LatePlanner:
    """The planner for what replaces a plan that came without one, made once it is needed."""

    domain: Domain
    task: Task
    _made: Planner | None = None

    def plan(self, state: State, goal: int) -> PlanningResult:
        """See :class:`~slap_ros.planning.planner.Planner`."""
        self._made = self._made or planner_for(self.domain, self.task)
        return self._made.plan(state, goal)
