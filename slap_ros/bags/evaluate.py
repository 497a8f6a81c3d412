# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Offline evaluation: the metrics of a bag's runs, and a check of what was perceived."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from slap_ros.bags.ensembles import ROOT
from slap_ros.bags.reader import Bag, read_bag
from slap_ros.bags.recording import RecordedEpisode, Recording, initial_state
from slap_ros.core import Domain
from slap_ros.evaluation.atom_names import AtomNames
from slap_ros.evaluation.metrics import RunMetrics
from slap_ros.evaluation.run_log import RunLog
from slap_ros.messages.decode import decode_state


@dataclass(frozen=True)
class AtomMismatch:
    """A state in which the recorded atoms are not those that the domain's classifiers find."""

    episode: int
    step: int
    missing: tuple[str, ...]  # atoms that hold and were not recorded
    extra: tuple[str, ...]  # atoms that were recorded and do not hold
    namespace: str = ROOT  # of the ensemble


@dataclass(frozen=True)
class BagEvaluation:
    """Metrics of a bag's runs, and how its atoms compare with recomputed ones."""

    runs: list[RunMetrics]
    mismatches: list[AtomMismatch]
    states: int  # distinct states recorded
    # Of them, those whose recorded atoms were compared with recomputed ones: what was perceived
    # with noise cannot be found again.
    compared: int
    damage: str | None  # where reading had to stop and why, or what is missing
    # The ensemble of each run, not compared: under another name a run is the same run.
    namespaces: tuple[str, ...] = field(default=(), compare=False)
    left_out: tuple[str, ...] = ()  # topics of slap_msgs that belong to no ensemble for certain


@dataclass(frozen=True)
class EnsembleContents:
    """The messages of one ensemble in a bag, sorted by run and by episode."""

    namespace: str
    log: RunLog
    recording: Recording

    def gaps(self) -> list[str]:
        """What is missing, in words; empty for a whole recording."""
        found = self.log.gaps()
        if strays := self.recording.not_finite:
            found.append(f"states that are not finite: {strays}, left out")
        if others := self.recording.contradicting:
            found.append(
                f"{others} states are other ones than those of the same episode and step: of "
                "another ensemble, or of a simulator that was started again; record them apart"
            )
        return found


@dataclass(frozen=True)
class BagContents:
    """A bag's messages, sorted by ensemble, by run and by episode."""

    bag: Bag
    ensembles: tuple[EnsembleContents, ...]  # those that were chosen

    @property
    def damage(self) -> str | None:
        """What cannot be read, or what is missing of the runs; None for a whole bag."""
        several = len(self.bag.ensembles.namespaces) > 1
        found = [
            f"{one.namespace}: {gap}" if several else gap
            for one in self.ensembles
            for gap in one.gaps()
        ]
        return self.bag.damage or "; ".join(found) or None


def read_runs(path: Path | str, namespace: str | None = None) -> BagContents:
    """Read a bag once, for everything that is to be known of its runs.

    Args:
        path: Folder of the bag, or a single file of it.
        namespace: Namespace of an ensemble; None for all ensembles.

    Raises:
        DamagedBagError: Nothing in it can be read.
        ForeignBagError: It is not of an ensemble, or of another version of one.
        InvalidParameterError: There is no such ensemble.
    """
    return read_contents(read_bag(path), namespace)


def read_contents(bag: Bag, namespace: str | None = None) -> BagContents:
    """Everything that is to be known of the runs in a bag that was opened.

    Args:
        bag: Bag to read.
        namespace: Namespace of an ensemble; None for all ensembles.

    Raises:
        InvalidParameterError: There is no such ensemble.
    """
    chosen = {
        name: EnsembleContents(name, RunLog(), Recording())
        for name in bag.ensembles.chosen(namespace)
    }
    for topic, type_name, _, message in bag:
        ensemble = chosen.get(bag.ensembles.of(topic, type_name) or "")
        if ensemble is not None:
            ensemble.log.add(type_name, message)
            ensemble.recording.add(type_name, message)
    return BagContents(bag, tuple(chosen.values()))


def evaluate_bag(path: Path | str, namespace: str | None = None) -> BagEvaluation:
    """Compute the metrics of every run in a bag and recompute the atoms of every state.

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
    return evaluate(reading, [one.recording.domain() for one in reading.ensembles])


def evaluate(reading: BagContents, domains: Sequence[Domain | None]) -> BagEvaluation:
    """Evaluate a bag that was read.

    Args:
        reading: What was read of it.
        domains: Domain of each of its ensembles; without it, no atoms are recomputed.

    Raises:
        InvalidStateError: It has a state that its domain cannot have.
    """
    each = list(zip(reading.ensembles, domains, strict=True))
    runs = [(one.namespace, run) for one in reading.ensembles for run in one.log.runs()]
    return BagEvaluation(
        runs=[run for _, run in runs],
        mismatches=[
            mismatch
            for one, domain in each
            if domain is not None
            for mismatch in _ensemble_mismatches(one, domain)
        ],
        states=sum(_count_states(one, exact=False) for one, _ in each),
        compared=sum(_count_states(one, exact=True) for one, domain in each if domain is not None),
        damage=reading.damage,
        namespaces=tuple(namespace for namespace, _ in runs),
        left_out=reading.bag.ensembles.left_out,
    )


def _count_states(ensemble: EnsembleContents, exact: bool) -> int:
    """How many states were recorded, or how many whose atoms can be found again."""
    return sum(
        len(episode.states.keys() & episode.exact if exact else episode.states)
        for episode in ensemble.recording.episodes.values()
    )


def _ensemble_mismatches(ensemble: EnsembleContents, domain: Domain) -> Iterator[AtomMismatch]:
    for number, episode in ensemble.recording.episodes.items():
        for mismatch in _mismatches(number, episode, domain):
            yield replace(mismatch, namespace=ensemble.namespace)


def _mismatches(number: int, episode: RecordedEpisode, domain: Domain) -> Iterator[AtomMismatch]:
    start = initial_state(episode, domain)
    if start is None:
        return
    space, types = domain.atom_space(start[1]), domain.types_by_name
    for step in sorted(episode.states.keys() & episode.exact):
        mask = space.abstract(decode_state(episode.states[step], types))
        holding = frozenset(
            (atom.predicate.name, tuple(obj.name for obj in atom.objects))
            for atom in space.decode(mask)
        )
        recorded = episode.atoms[step]
        if recorded != holding:
            yield AtomMismatch(number, step, _texts(holding - recorded), _texts(recorded - holding))


def _texts(atoms: AtomNames) -> tuple[str, ...]:
    return tuple(f"{predicate}({', '.join(objects)})" for predicate, objects in sorted(atoms))
