# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Which atoms held when, as perceived."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

from slap_ros.bags.recording import RecordedEpisode
from slap_ros.evaluation.run_trace import RunTrace
from slap_ros.report.chain import texts
from slap_ros.report.timeline import call

MAX_ROWS = 80  # more than anyone reads; those that change first are kept


@dataclass(frozen=True)
class AtomRow:
    """An atom that changed."""

    text: str
    intervals: tuple[tuple[int, int], ...]  # first and last step at which it held, from the start


@dataclass(frozen=True)
class AtomTimeline:
    """When each atom of a run held."""

    rows: tuple[AtomRow, ...]  # in the order in which they changed first
    hidden: int  # rows left out
    constant: tuple[str, ...]  # what held throughout


def atom_timeline(trace: RunTrace, episode: RecordedEpisode) -> AtomTimeline:
    """The atoms of a run over its steps; a step without perception continues the one before."""
    steps = sorted(s for s in episode.atoms if trace.first_step <= s <= trace.last_step)
    held = [episode.atoms[step] for step in steps]
    if not held:
        return AtomTimeline((), 0, ())
    always = frozenset.intersection(*held)
    changed_at: dict[tuple[str, tuple[str, ...]], int] = {}
    for (_, before), (step, after) in pairwise(zip(steps, held, strict=True)):
        for atom in sorted(before ^ after):
            changed_at.setdefault(atom, step)
    rows = []
    for name, objects in list(changed_at)[:MAX_ROWS]:
        holds = [(name, objects) in atoms for atoms in held]
        rows.append(AtomRow(call(name, objects), _intervals(steps, holds, trace)))
    return AtomTimeline(tuple(rows), len(changed_at) - len(rows), texts(always))


def _intervals(steps: list[int], holds: list[bool], trace: RunTrace) -> tuple[tuple[int, int], ...]:
    """Stretches of steps at which something holds, each until the step before it does not."""
    found: list[tuple[int, int]] = []
    since: int | None = None
    for step, is_true in zip([*steps, trace.last_step + 1], [*holds, False], strict=True):
        if is_true and since is None:
            since = step
        elif not is_true and since is not None:
            found.append((since - trace.first_step, step - 1 - trace.first_step))
            since = None
    return tuple(found)
