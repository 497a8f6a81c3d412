# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Episode arrays: the runs of a bag as numpy arrays, with the names of what they hold.

Each run of a bag is an episode of its own, also where one follows another without a reset. What was
recorded between a reset and the next, and has no run, is an episode as well.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from slap_ros.bags.ensembles import ROOT
from slap_ros.bags.evaluate import BagContents, EnsembleContents, read_runs
from slap_ros.bags.reader import Bag
from slap_ros.bags.recording import RecordedEpisode, initial_state
from slap_ros.bags.taken_commands import taken_commands
from slap_ros.core import Action, Domain
from slap_ros.errors import (
    DamagedBagError,
    ForeignBagError,
    InvalidParameterError,
    InvalidStateError,
)
from slap_ros.evaluation.atom_names import AtomNames, atom_names
from slap_ros.evaluation.executed_options import ExecutedOption
from slap_ros.evaluation.metrics import UNKNOWN, RunMetrics
from slap_ros.evaluation.run_trace import RunTrace
from slap_ros.messages.decode import decode_state, stamp_ns
from slap_ros.relational import State
from slap_ros.relational.state import Array

if TYPE_CHECKING:
    from pandas import DataFrame


@dataclass(frozen=True, eq=False, repr=False)
class EpisodeArrays:
    """An episode of a bag: a row per recorded state, with what was done in that state.

    Args:
        bag: Name of the bag's folder or file.
        metadata: What the run was made with, as the bag states it.
        number: Number of the reset that the episode followed, from 1; several runs may share it.
        domain: Name of the domain.
        preset: Preset of the domain.
        control_period_s: Time that one step stands for, s.
        goal: Atoms of the goal, sorted; None where it was not recorded.
        metrics: Metrics of the run; None where nothing was planned.
        state_names: Name of each column of ``states``, as ``block1.x``.
        state_units: Unit of each column of ``states``; ``1`` for a pure number.
        of_robot: Whether each column of ``states`` is of the robot itself, shape (features,).
        action_names: Name of each column of ``actions``.
        action_units: Unit of each column of ``actions``.
        atom_names: Name of each column of ``atoms``, as ``On(block1, target)``.
        steps: Environment steps since the reset, shape (n,).
        stamps_ns: When each state was published, ns since the epoch, shape (n,).
        states: Features of all objects, shape (n, features).
        actions: Command that was taken in each state, shape (n, axes); NaN where there was none,
            as in the last.
        atoms: Whether each atom was perceived in each state, shape (n, atoms).
        perceived: Whether the atoms of a row were recorded, shape (n,); elsewhere they are those
            that the domain's predicates find in the state.
        rewards: Sparse reward of each command, shape (n,): 1 where it leads from a state without
            the goal to one with the goal, else 0; NaN where the goal was not recorded.
        options: Option under execution in each state, as ``Pick(robot, block1, table)``, shape
            (n,); empty where there was none.
        option_kinds: Kind of that option, shape (n,): operator, shortcut or unknown.
        namespace: Namespace of the ensemble; ``/`` for one without.
    """

    bag: str
    metadata: Mapping[str, str]
    number: int
    domain: str
    preset: str
    control_period_s: float
    goal: tuple[str, ...] | None
    metrics: RunMetrics | None
    state_names: tuple[str, ...]
    state_units: tuple[str, ...]
    of_robot: NDArray[np.bool_]
    action_names: tuple[str, ...]
    action_units: tuple[str, ...]
    atom_names: tuple[str, ...]
    steps: NDArray[np.int64]
    stamps_ns: NDArray[np.int64]
    states: Array
    actions: Array
    atoms: NDArray[np.bool_]
    perceived: NDArray[np.bool_]
    rewards: Array
    options: NDArray[np.str_]
    option_kinds: NDArray[np.str_]
    namespace: str = ROOT

    def __len__(self) -> int:
        """The number of rows."""
        return len(self.steps)

    def about(self) -> dict[str, Any]:
        """What there is to say of the episode beside its arrays, as JSON has it."""
        return {
            "bag": self.bag,
            "namespace": self.namespace,
            "number": self.number,
            "domain": self.domain,
            "preset": self.preset,
            "control_period_s": self.control_period_s,
            "goal": None if self.goal is None else list(self.goal),
            "run": None if self.metrics is None else self.metrics.as_json(),
            "metadata": dict(self.metadata),
        }

    def to_npz(self, path: Path | str) -> Path:
        """Write everything as one NumPy file, as ``slap bag export --format npz`` does.

        Args:
            path: File to write, which ends in ``.npz`` and must not exist.

        Returns:
            The path.

        Raises:
            InvalidParameterError: The name has another ending, or there is something.
            StorageFullError: It cannot be written; nothing is left behind.
        """
        # What exports episodes imports this file.
        from slap_ros.bags.export import choose_format, export_episodes, require_exportable

        file = Path(path)
        npz = choose_format("npz", file)
        require_exportable(npz, file)
        export_episodes([self], file, npz)
        return file

    def to_pandas(self) -> DataFrame:
        """A table with a row per state, named by step: features, actions, atoms, option, reward.

        The columns are those of ``slap bag export --format csv``.

        Raises:
            InvalidParameterError: Pandas is not installed.
        """
        from slap_ros.bags.export.episode_table import episode_columns

        try:
            from pandas import DataFrame
        except ImportError as error:
            raise InvalidParameterError(
                "to_pandas needs pandas, which is not installed: pip install pandas; "
                "to_npz does without"
            ) from error
        return DataFrame(episode_columns(self)).set_index("step")

    def __repr__(self) -> str:
        return (
            f"EpisodeArrays({self.domain}, {len(self)} states of {len(self.state_names)} features, "
            f"{len(self.action_names)} axes, {len(self.atom_names)} atoms)"
        )


def read_episodes(path: Path | str, namespace: str | None = None) -> list[EpisodeArrays]:
    """The episodes of a whole bag, in order.

    Args:
        path: Folder of the bag, or a single ``.mcap`` or ``.db3`` file, compressed or not.
        namespace: Namespace of an ensemble; None for all ensembles, one after the other.

    Raises:
        DamagedBagError: Part of it cannot be read or is missing, or it has no states.
        ForeignBagError: It is not of an ensemble, or of another version of one.
        InvalidParameterError: There is no such ensemble.
        UnknownDomainError: Its domain is not known here.
        InvalidStateError: It has a state that its domain or its task cannot have.
    """
    contents = read_runs(path, namespace)
    if contents.damage is not None:
        raise DamagedBagError(f"{path} is damaged: {contents.damage}")
    return episode_arrays(contents)


def episode_arrays(contents: BagContents) -> list[EpisodeArrays]:
    """The episodes of a bag that was read, in order; of a damaged one, as far as they are there.

    Args:
        contents: What was read of it, by :func:`slap_ros.bags.evaluate.read_runs`.

    Raises:
        DamagedBagError: It breaks off before it names its domain, or has no states.
        ForeignBagError: Its domain has other types, features or atoms here.
        UnknownDomainError: Its domain is not known here.
        InvalidStateError: It has a state that its domain or its task cannot have.
    """
    found = [one for part in contents.ensembles for one in _ensemble_arrays(contents.bag, part)]
    if not found:
        raise DamagedBagError(f"{contents.bag.path} has no states")
    return found


def _ensemble_arrays(bag: Bag, ensemble: EnsembleContents) -> Iterator[EpisodeArrays]:
    domain = ensemble.recording.domain()
    if domain is None:
        raise DamagedBagError(f"{bag.path} breaks off before it names its domain")
    traces = ensemble.log.traces()
    for number, episode in sorted(ensemble.recording.episodes.items()):
        own = [trace for trace in traces if trace.episode == number]
        parts = [_run_part(trace, episode) for trace in own]
        parts = parts or [_whole_part(ensemble.log.executed_in(number), episode)]
        if any(part.steps for part in parts):
            reader = _EpisodeReader(bag, ensemble.namespace, domain, number, episode)
            yield from (reader.arrays(part) for part in parts if part.steps)


@dataclass(frozen=True)
class _Part:
    """The steps of a recorded episode that become an episode of their own."""

    steps: tuple[int, ...]  # of the recorded states, ascending
    goal: AtomNames | None
    metrics: RunMetrics | None
    options: tuple[_Span, ...]


@dataclass(frozen=True)
class _Span:
    """The steps in which an option was executed."""

    first: int
    end: int  # the step of the state that it ended in
    option: str
    kind: str


def _run_part(trace: RunTrace, episode: RecordedEpisode) -> _Part:
    spans = (
        _Span(start, start + option.steps, _text(option.name, option.objects), option.kind)
        for start, option in zip(trace.starts, trace.metrics.options, strict=True)
    )
    steps = (step for step in sorted(episode.states) if trace.first_step <= step <= trace.last_step)
    return _Part(tuple(steps), trace.goal, trace.metrics, tuple(spans))


def _whole_part(executed: Iterable[ExecutedOption], episode: RecordedEpisode) -> _Part:
    steps = tuple(sorted(episode.states))
    spans = (
        _Span(
            option.start.step,
            option.end.step if option.end is not None else steps[-1],
            _text(option.start.skill, option.start.objects),
            UNKNOWN,
        )
        for option in executed
        if steps
    )
    goal = atom_names(episode.task.goal) if episode.task is not None else None
    return _Part(steps, goal, None, tuple(spans))


class _EpisodeReader:
    """Makes the arrays of a recorded episode, whose states all have the same objects."""

    def __init__(
        self, bag: Bag, namespace: str, domain: Domain, number: int, episode: RecordedEpisode
    ) -> None:
        start = initial_state(episode, domain)
        if start is None:  # no part of it has states
            raise DamagedBagError(f"episode {number} has no states")
        self._bag, self._namespace, self._domain = bag, namespace, domain
        self._number, self._episode = number, episode
        self._space = domain.atom_space(start[1])
        self._columns = {
            (atom.predicate.name, tuple(obj.name for obj in atom.objects)): column
            for column, atom in enumerate(self._space.atoms)
        }

    def arrays(self, part: _Part) -> EpisodeArrays:
        """The arrays of some of its steps."""
        domain, layout = self._domain, self._space.layout
        states = {step: self._state(step) for step in part.steps}
        features = [(obj, feature) for obj in layout.objects for feature in obj.type.features]
        atoms, perceived = self._atoms(states)
        options, kinds = _options(part)
        return EpisodeArrays(
            bag=self._bag.path.name,
            metadata=self._bag.metadata,
            number=self._number,
            domain=domain.name,
            preset=domain.preset,
            control_period_s=domain.execution.control_period_s,
            goal=None if part.goal is None else tuple(sorted(_text(*atom) for atom in part.goal)),
            metrics=part.metrics,
            state_names=tuple(f"{obj.name}.{feature.name}" for obj, feature in features),
            state_units=tuple(feature.unit for _, feature in features),
            of_robot=np.array([obj.type in domain.robot_types for obj, _ in features]),
            action_names=tuple(axis.name for axis in domain.action_space.axes),
            action_units=tuple(axis.unit for axis in domain.action_space.axes),
            atom_names=tuple(_text(*names) for names in self._columns),
            steps=np.array(part.steps, dtype=np.int64),
            stamps_ns=np.array([self._stamp_ns(step) for step in part.steps], dtype=np.int64),
            states=np.array([state.data for state in states.values()]),
            actions=self._actions(states),
            atoms=atoms,
            perceived=perceived,
            rewards=self._rewards(part.goal, atoms),
            options=options,
            option_kinds=kinds,
            namespace=self._namespace,
        )

    def _state(self, step: int) -> State:
        state = decode_state(self._episode.states[step], self._domain.types_by_name)
        if state.layout != self._space.layout:
            raise InvalidStateError(
                f"episode {self._number}: the state of step {step} has other objects than the task"
            )
        return state

    def _stamp_ns(self, step: int) -> int:
        return stamp_ns(self._episode.states[step].header)

    def _actions(self, states: Mapping[int, State]) -> Array:
        taken: dict[int, Action] = taken_commands(self._domain, states, self._episode.commands)
        missing = np.full(len(self._domain.action_space.axes), np.nan)
        return np.array([taken.get(step, missing) for step in states])

    def _atoms(self, states: Mapping[int, State]) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
        """The atoms of each state, and whether they were recorded."""
        perceived = np.array([step in self._episode.atoms for step in states])
        rows = [self._atoms_of(step, state) for step, state in states.items()]
        return np.array(rows, dtype=bool), perceived

    def _atoms_of(self, step: int, state: State) -> NDArray[np.bool_]:
        if step not in self._episode.atoms:
            return self._space.truth(state)
        row = np.zeros(len(self._columns), dtype=bool)
        row[self._numbers(self._episode.atoms[step])] = True
        return row

    def _numbers(self, atoms: AtomNames) -> list[int]:
        """The columns of atoms."""
        if strange := sorted(_text(*atom) for atom in atoms - self._columns.keys()):
            raise ForeignBagError(
                f"episode {self._number}: {self._domain.name} has no atom {strange[0]} here; read "
                "the bag with the version of slap_ros that wrote it"
            )
        return [self._columns[atom] for atom in atoms]

    def _rewards(self, goal: AtomNames | None, atoms: NDArray[np.bool_]) -> Array:
        if goal is None:
            return np.full(len(atoms), np.nan)
        reached: NDArray[np.bool_] = np.all(atoms[:, self._numbers(goal)], axis=1)
        rewards = np.zeros(len(atoms))
        rewards[:-1] = reached[1:] & ~reached[:-1]
        return rewards


def _options(part: _Part) -> tuple[NDArray[np.str_], NDArray[np.str_]]:
    """The option under execution in each state, and its kind."""
    steps = np.array(part.steps)
    names, kinds = np.full(len(steps), "", object), np.full(len(steps), "", object)
    for span in part.options:
        during = (span.first <= steps) & (steps < span.end)
        names[during], kinds[during] = span.option, span.kind
    return names.astype(str), kinds.astype(str)


def _text(name: str, objects: Iterable[str]) -> str:
    """An atom or option for people: ``On(block1, target)``."""
    return f"{name}({', '.join(objects)})"
