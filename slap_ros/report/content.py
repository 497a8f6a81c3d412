# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a report shows of a run, gathered from its bag alone."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from math import isfinite
from pathlib import Path

from slap_ros.bags.evaluate import BagEvaluation, EnsembleContents, evaluate, read_runs
from slap_ros.bags.recording import RecordedEpisode, Recording
from slap_ros.core import Domain
from slap_ros.core.notebook import ShownInNotebooks
from slap_ros.errors import InvalidDomainError
from slap_ros.evaluation.atom_names import describe
from slap_ros.evaluation.metrics import RunMetrics
from slap_ros.evaluation.run_trace import RunTrace
from slap_ros.messages.protocols import KeyValueMessage
from slap_ros.planning.plan import bound_as_text
from slap_ros.report.acquisitions import RecordedAcquisition, recorded_acquisitions
from slap_ros.report.atom_timeline import AtomTimeline, atom_timeline
from slap_ros.report.chain import PlanChain, chains
from slap_ros.report.proposals import RecordedProposal, recorded_proposals
from slap_ros.report.scene import RecordedScene, scene
from slap_ros.report.timeline import Incident, OptionSpan, incidents, spans
from slap_ros.report.traces import Series, robot_series

USUAL_PERIOD_S = 0.1  # of a control step, where the bag has none that could be
LONGEST_PERIOD_S = 10.0
PURE_PLANNING = "pure planning"


@dataclass(frozen=True)
class RunReport:
    """Everything that a page shows of one run."""

    bag: str  # name of the bag
    metrics: RunMetrics
    task: object  # equal for runs of the same task
    goal: str
    length: int  # steps that its drawings show, from its start
    spans: tuple[OptionSpan, ...]
    incidents: tuple[Incident, ...]
    chains: tuple[PlanChain, ...]
    atom_timeline: AtomTimeline
    series: tuple[Series, ...]
    scene: RecordedScene | None
    control_period_s: float
    configuration: dict[str, str]
    versions: dict[str, str]
    namespace: str = ""  # of its ensemble, where the bag has several

    @property
    def approach(self) -> str:
        """How it was planned."""
        if self.metrics.planner is None:
            return "a plan that was not recorded"
        if not self.metrics.planner:
            return "no plan"
        if not self.metrics.library:
            return PURE_PLANNING
        return "SLAP, 1 sample" if self.metrics.samples == 1 else "SLAP"

    @property
    def bound(self) -> str:
        """How far from the shortest the first plan is at most, in words; empty if not known."""
        bound = self.metrics.bound
        if bound is None:
            return ""
        if bound == 1.0:
            return "proven to be the shortest"
        return f"at most {bound_as_text(bound)} times the shortest"

    @property
    def replan_steps(self) -> tuple[int, ...]:
        """The steps at which plans were made in the place of one that diverged."""
        return tuple(one.step for one in self.chains if one.number > 0 and not one.improves)

    @property
    def improvements(self) -> tuple[PlanChain, ...]:
        """The plans that are a shorter rest of the one before, found while the robot moved."""
        return tuple(chain for chain in self.chains if chain.improves)


@dataclass(frozen=True, repr=False)
class BagReport(ShownInNotebooks):
    """Everything that a page shows of one bag."""

    name: str
    runs: tuple[RunReport, ...]
    evaluation: BagEvaluation
    proposals: tuple[RecordedProposal, ...]
    acquisitions: tuple[RecordedAcquisition, ...]
    unchecked: str  # why no atoms were compared with recomputed ones; empty where they were

    def __str__(self) -> str:
        """Name of the bag, and how many runs it has."""
        return f"{self.name}, {len(self.runs)} runs"


def read_report(path: Path | str, namespace: str | None = None) -> BagReport:
    """Gather what a page shows of a bag.

    A domain that cannot be imported here, as one without its simulator, costs only the second
    opinion on perception: all else is in the bag.

    Args:
        path: Folder of the bag, or a single file of it.
        namespace: Namespace of an ensemble; None for all ensembles.

    Raises:
        DamagedBagError: Nothing in it can be read.
        ForeignBagError: It is not of an ensemble, or of another version of one.
        InvalidParameterError: There is no such ensemble.
        UnknownDomainError: Its domain is not known here.
        InvalidStateError: It has a state that its domain cannot have.
    """
    reading = read_runs(path, namespace)
    opened = [_domain(ensemble.recording) for ensemble in reading.ensembles]
    domains = [domain for domain, _ in opened]
    unchecked = next((reason for _, reason in opened if reason), "")
    name = Path(path).resolve().name
    several = len(reading.bag.ensembles.namespaces) > 1
    runs = tuple(
        _report(name, ensemble, several, trace, domain)
        for ensemble, domain in zip(reading.ensembles, domains, strict=True)
        for trace in ensemble.log.traces()
    )
    events = [event for ensemble in reading.ensembles for event in ensemble.recording.acquisition]
    return BagReport(
        name,
        runs,
        evaluate(reading, domains),
        recorded_proposals(events),
        recorded_acquisitions(events),
        unchecked,
    )


def _domain(recording: Recording) -> tuple[Domain | None, str]:
    """The domain that was recorded, or why it is not at hand."""
    try:
        domain = recording.domain()
    except InvalidDomainError as error:
        return None, str(error)
    return domain, "" if domain is not None else "the recording does not name its domain"


def _report(
    name: str, ensemble: EnsembleContents, several: bool, trace: RunTrace, domain: Domain | None
) -> RunReport:
    """What there is of a run.

    Args:
        name: Name of the bag.
        ensemble: Ensemble that ran.
        several: Whether the bag has others.
        trace: Trace of the run.
        domain: Domain of the run; None if it is not at hand.
    """
    recording = ensemble.recording
    episode = recording.episodes.get(trace.episode, RecordedEpisode())
    info = recording.domain_info
    return RunReport(
        bag=name,
        metrics=trace.metrics,
        task=_task(episode, trace),
        goal=describe(trace.goal or ()),
        length=trace.last_step - trace.first_step,
        spans=spans(trace),
        incidents=incidents(trace),
        chains=chains(trace, episode),
        atom_timeline=atom_timeline(trace, episode),
        series=robot_series(trace, episode, recording, domain),
        scene=scene(trace, episode, recording, domain),
        control_period_s=_period(recording),
        configuration=_setting(episode, info.configuration if info is not None else ()),
        versions={v.key: v.value for v in info.versions} if info is not None else {},
        namespace=ensemble.namespace if several else "",
    )


def _task(episode: RecordedEpisode, trace: RunTrace) -> object:
    """Where a run began and what it was to reach; of an unknown start, equal to nothing else."""
    start = episode.states.get(trace.first_step)
    if start is None:
        return object()
    objects = tuple((o.name, o.type, tuple(map(float, o.features))) for o in start.objects)
    return objects, trace.goal


def _period(recording: Recording) -> float:
    period = recording.domain_info.control_period if recording.domain_info is not None else 0.0
    return period if isfinite(period) and 0.0 < period <= LONGEST_PERIOD_S else USUAL_PERIOD_S


def _setting(episode: RecordedEpisode, configuration: Iterable[KeyValueMessage]) -> dict[str, str]:
    settings = {entry.key: entry.value for entry in configuration}
    if episode.task is not None:
        settings["step limit"] = str(episode.task.step_limit)
    return settings
