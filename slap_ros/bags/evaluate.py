# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Offline evaluation: the metrics of a bag's runs, and a check of what was perceived."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

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


@dataclass(frozen=True)
class BagContents:
    """A bag's messages, sorted by run and by episode."""

    bag: Bag
    log: RunLog
    recording: Recording

    @property
    def damage(self) -> str | None:
        """What cannot be read, or what is missing of the runs; None for a whole bag."""
        found = self.log.gaps()
        if strays := self.recording.not_finite:
            found.append(f"states that are not finite: {strays}, left out")
        return self.bag.damage or "; ".join(found) or None


def read_runs(path: Path | str) -> BagContents:
    """Read a bag once, for everything that is to be known of its runs.

    Raises:
        DamagedBagError: Nothing in it can be read.
        ForeignBagError: It is not of an ensemble, or of another version of one.
    """
    return read_contents(read_bag(path))


def read_contents(bag: Bag) -> BagContents:
    """Everything that is to be known of the runs in a bag that was opened."""
    reading = BagContents(bag, RunLog(), Recording())
    for _, type_name, _, message in reading.bag:
        reading.log.add(type_name, message)
        reading.recording.add(type_name, message)
    return reading


def evaluate_bag(path: Path | str) -> BagEvaluation:
    """Compute the metrics of every run in a bag and recompute the atoms of every state.

    Raises:
        DamagedBagError: Nothing in it can be read.
        ForeignBagError: It is not of an ensemble, or of another version of one.
        UnknownDomainError: Its domain is not known here.
        InvalidStateError: It has a state that its domain cannot have.
    """
    reading = read_runs(path)
    return evaluate(reading, reading.recording.domain())


def evaluate(reading: BagContents, domain: Domain | None) -> BagEvaluation:
    """Evaluate a bag that was read; without its domain, no atoms are recomputed.

    Raises:
        InvalidStateError: It has a state that its domain cannot have.
    """
    episodes = reading.recording.episodes
    perceived = [(e, s) for e, episode in episodes.items() for s in episode.states]
    comparable = [(e, s) for e, s in perceived if s in episodes[e].exact]
    return BagEvaluation(
        runs=reading.log.runs(),
        mismatches=[
            mismatch
            for number, episode in episodes.items()
            if domain is not None
            for mismatch in _mismatches(number, episode, domain)
        ],
        states=len(perceived),
        compared=len(comparable) if domain is not None else 0,
        damage=reading.damage,
    )


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
