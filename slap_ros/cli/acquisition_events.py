# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What happens while skills are acquired, as lines of JSON for whoever started the command."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from slap_ros.acquisition.curriculum.plan_rollout import PlanRollout
from slap_ros.acquisition.proposals.attempt_log import Entry
from slap_ros.acquisition.proposals.proposal import Proposal
from slap_ros.acquisition.training.skill_training import Round
from slap_ros.cli.console import print_json
from slap_ros.skills.skill_library import SkillLibrary


@dataclass(frozen=True)
class AcquisitionEvents:
    """Prints events on stdout.

    Args:
        segment_steps: Environment steps between two judgements; None: nothing is printed.
    """

    segment_steps: int | None

    def attempted(self, entry: Entry) -> None:
        """A line of the attempt log: an answer of a model, or a verdict."""
        if entry["event"] != "failure":  # which ends the command
            self._print(entry["event"], {k: v for k, v in entry.items() if k != "event"})

    def proposed(self, proposal: Proposal) -> None:
        """Operators and rewards are there."""
        texts = [
            f"{operator}: PRE {_atoms(operator.preconditions)}; EFF- "
            f"{_atoms(operator.delete_effects)}; EFF+ {_atoms(operator.add_effects)}; R "
            f"{' + '.join(map(str, proposal.rewards[operator.name].terms))}"
            for operator in proposal.operators
        ]
        self._print("proposed", {"operators": texts, "plan": list(proposal.plan or ())})

    def on_progress(self, what: str, done: int, total: int) -> None:
        """So many jobs of a kind are done.

        Args:
            what: The step, in words.
            done: Jobs done so far; 0 as the step begins.
            total: Jobs of the step.
        """
        self._print("progress", {"phase": what, "done": done, "total": total})

    def on_rollouts(self, iteration: int, rollouts: Sequence[PlanRollout]) -> None:
        """Plans were carried out; one event each."""
        for rollout in rollouts:
            failed = rollout.failure
            data = {
                "iteration": iteration,
                "task": rollout.task,
                "progress": rollout.progress,
                "plan": list(rollout.plan),
                "failed": failed.operator if failed else "",
                "reasons": [failed.end, *failed.atoms] if failed else [],
            }
            unplanned = [rollout.unplanned] if rollout.unplanned else []
            self._print("rollout", {**data, "reasons": data["reasons"] or unplanned})

    def on_judged(self, iteration: int, skill: str, outcome: Round) -> None:
        """A skill was trained for a round.

        Args:
            iteration: From 0.
            skill: The operator's name.
            outcome: How it went.
        """
        data = {
            "iteration": iteration,
            "skill": skill,
            "success": [outcome.initial, *outcome.segments],
            "best": outcome.success,
            "segment_steps": self.segment_steps,
        }
        self._print("judged", data)

    def acquired(self, folder: Path, library: SkillLibrary) -> None:
        """The library is saved: the last event."""
        record = library.record
        data = {
            "library": str(folder.resolve()),
            "digest": library.digest,
            "skills": [skill.operator.name for skill in library.skills],
            "progress": record["progress_on_fresh_tasks"],
            "steps": record["steps"],
            "ended": record["ended"],
            "left": record["left"],
        }
        self._print("acquired", data)

    def _print(self, event: str, data: dict[str, Any]) -> None:
        if self.segment_steps is not None:
            print_json({"event": event, **data})


def _atoms(atoms: frozenset[Any]) -> str:
    return ", ".join(sorted(map(str, atoms))) or "-"
