# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""One goal after another with one library: what later goals cost, what is forgotten (Fig. 5)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import fmean
from typing import TYPE_CHECKING, Annotated, Any

from slap_ros.api.command_options import CommandOption, DomainName, Jobs
from slap_ros.api.left_out import Tell
from slap_ros.api.sequence_step import SequenceStep
from slap_ros.domains import get_domain
from slap_ros.errors import InvalidLibraryError, InvalidParameterError
from slap_ros.evaluation.summary import Spread, format_spread
from slap_ros.learning.work_folder import DECODING_ERRORS
from slap_ros.policies.shipped_models import shipped_with_siblings
from slap_ros.skills.skill_library import read_library_record
from slap_ros.studies.figures import LINES
from slap_ros.studies.options import RESULTS, Output
from slap_ros.studies.results import Data, MarkdownTable, StudyReport
from slap_ros.studies.study import PaperFigure, PreparedStudy, Study

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MEASURED = """\
Skills are acquired for one goal after another. A library is carried on: skills that carry out the
next goal are used as they are, and learned further where they fail, with critics and replay buffer.
Beside it are sequences in which each goal is learned from scratch, where such were run. *Steps to
.8* are those after which three judgements in a row, of which it is the first, had .8 of the goal's
tasks solved, as the paper counts them; at the end of a goal, where nothing is learned any more,
fewer suffice. A judgement is made after every segment of a skill's training (2,000 steps by
default): the product of the success of the plan's skills, from states that plans come to. Between
rounds of training, and at the end, whole plans are carried out instead. *All steps* go on until
enough tasks are solved three judgements in a row (the setting `solved`, .8 by default), the last of
whole plans, until nothing fails, or until the budget is spent. Steps are of all skills together,
the mean ± sample standard deviation over sequences, where there are several; a cell has a ≥ where a
sequence never came to .8 at a goal, and its whole length counts. A sequence that has not come to
its last goal counts as far as it came. *Solved* is the share of tasks, which training never sees,
whose stages were all done right after the goal was learned. For all goals before, it is given as it
is now, and as it was right after each of these was learned. Earlier goals that are not done any
more after a goal may be learned again, once each (`--relearn`). The steps of that are counted with
this goal's, up to .8 and in all, and success is then as it is after that. Judgements and trials are
not counted as steps."""
SEQUENCES = "runs/sequences"
CARRIED, RELEARNED, SCRATCH = "carried on", "carried on, relearned", "from scratch"


@dataclass(frozen=True)
class GoalOfSequence:
    """A goal, over all sequences of one kind.

    Args:
        goal: Name of the goal, or its atoms.
        level_steps: Environment steps of each sequence until enough of its tasks were solved, and
            for earlier goals that were learned again after it.
        reached: Number of sequences that came there.
        steps: Environment steps that each sequence learned for it and for these.
        solved: Share of its tasks that were solved right after it was learned, of each sequence.
        kept: Mean of that over all goals before it, of each sequence; empty for the first.
        before: Mean of what that was right after each of these goals was learned.
    """

    goal: str
    level_steps: tuple[int, ...]
    reached: int
    steps: tuple[int, ...]
    solved: tuple[float, ...]
    kept: tuple[float, ...]
    before: tuple[float, ...]


def goals_of(sequences: Sequence[Sequence[SequenceStep]]) -> list[GoalOfSequence]:
    """The goals of sequences that have the same ones, in their order; some may not have come far.

    Args:
        sequences: What came of the goals of each sequence.
    """
    found = []
    for number in range(max(map(len, sequences), default=0)):
        so_far = [sequence[: number + 1] for sequence in sequences if len(sequence) > number]
        own = [steps[-1] for steps in so_far]
        kept = [
            fmean(steps[-1].solved[one.goal] for one in steps[:-1]) for steps in so_far if number
        ]
        before = [fmean(one.solved[one.goal] for one in steps[:-1]) for steps in so_far if number]
        found.append(
            GoalOfSequence(
                own[0].goal,
                tuple(one.steps_to_level + sum(one.again.values()) for one in own),
                sum(one.reached for one in own),
                tuple(one.steps + sum(one.again.values()) for one in own),
                tuple(one.solved[one.goal] for one in own),
                tuple(kept),
                tuple(before),
            )
        )
    return found


def later_share(goals: Sequence[GoalOfSequence]) -> float | None:
    """Mean steps to .8 of all goals after the first, over those of the first."""
    if len(goals) < 2 or not sum(goals[0].level_steps):
        return None
    later = fmean(fmean(goal.level_steps) for goal in goals[1:])
    return later / fmean(goals[0].level_steps)


def kept_share(goals: Sequence[GoalOfSequence]) -> float | None:
    """Mean success on all goals before the last, over what it was as each was learned."""
    before = fmean(goals[-1].before) if goals and goals[-1].before else 0.0
    return fmean(goals[-1].kept) / before if before else None


def study(domain: str, kinds: Mapping[str, Sequence[Sequence[SequenceStep]]]) -> StudyReport:
    """Compare the costs of goals in sequences of both kinds.

    Args:
        domain: Name of the domain.
        kinds: Sequences that carry a library on, those in which earlier goals are learned again,
            and those from scratch; all have the same goals.

    Returns:
        The report.
    """
    goals = {kind: goals_of(sequences) for kind, sequences in kinds.items()}
    return StudyReport(
        study="sequence",
        source="LG-SAIL Fig. 5",
        title=f"One goal after another: {domain}",
        measured=MEASURED,
        table=MarkdownTable(
            (
                "library",
                "goal",
                "sequences",
                "steps to .8",
                "all steps",
                "solved",
                "of goals before",
                "as these were learned",
            ),
            [_row(kind, goal) for kind, of_kind in goals.items() for goal in of_kind],
        ),
        found={
            "later_over_first": {kind: later_share(of_kind) for kind, of_kind in goals.items()},
            "kept_over_before": {kind: kept_share(of_kind) for kind, of_kind in goals.items()},
            "sequences": {
                kind: [[step.as_json() for step in steps] for steps in sequences]
                for kind, sequences in kinds.items()
            },
        },
        draw=lambda figure: draw(figure, goals),
        size=(7.0, 3.2),
    )


def _row(kind: str, goal: GoalOfSequence) -> list[str]:
    return [
        kind,
        goal.goal,
        str(len(goal.steps)),
        ("" if goal.reached == len(goal.steps) else "≥ ") + _spread(goal.level_steps, 0),
        _spread(goal.steps, 0),
        _spread(goal.solved, 2),
        _spread(goal.kept, 2),
        _spread(goal.before, 2),
    ]


def _spread(values: Sequence[float], digits: int) -> str:
    """Mean ± sample standard deviation; one value as it is, and a dash where there are none."""
    if len(values) == 1:
        return f"{values[0]:.{digits}f}"
    return format_spread(Spread.of(values) if values else None, digits)


def draw(figure: Figure, kinds: Mapping[str, Sequence[GoalOfSequence]]) -> None:
    """Draw the steps to .8 of each goal, every sequence a dot, and their means as a line."""
    axes = figure.subplots()
    for colour, (kind, goals) in zip(LINES, kinds.items(), strict=False):
        places = range(1, len(goals) + 1)
        means = [fmean(goal.level_steps) for goal in goals]
        axes.plot(places, means, color=colour, linewidth=1.2, label=kind)
        for place, goal in zip(places, goals, strict=True):
            axes.plot([place] * len(goal.steps), goal.level_steps, ".", color=colour)
    axes.set_xlabel("goal, in the order of the sequence")
    axes.set_ylabel("environment steps to .8 of success")
    axes.legend(loc="upper right")


def _summary(found: Data) -> str:
    shares, kept = found["later_over_first"], found["kept_over_before"]
    said = [
        f"{kind}: {share:.2f} of the first goal's steps for each later one"
        + (f", {kept[kind]:.2f} of the success kept" if kind != SCRATCH and kept[kind] else "")
        + _missed(found["sequences"][kind])
        for kind, share in shares.items()
        if share is not None
    ]
    return "; ".join(said) or "nothing was learned for the first goal"


def _missed(sequences: Sequence[Sequence[Data]]) -> str:
    """The goals at which a sequence never came to .8, whose steps are too few for that."""
    steps = [step for sequence in sequences for step in sequence if not step["reached"]]
    missed = sorted({step["goal"] for step in steps})
    return f", never .8 of {', '.join(missed)}" if missed else ""


@dataclass(frozen=True, kw_only=True)
class SequenceStudyOptions:
    """Options of this study."""

    domain: DomainName
    library: Annotated[
        list[Path] | None,
        CommandOption(
            "Folder that `slap acquire-sequence` made, one per seed, with --scratch or without. "
            f"May be repeated. Default: all in {SEQUENCES}/DOMAIN*, or else those that ship.",
            metavar="FOLDER",
        ),
    ] = None
    jobs: Jobs = 1
    output: Output = RESULTS


def prepare(options: SequenceStudyOptions, tell: Tell) -> PreparedStudy:
    """Read every sequence; one that cannot be used is left out, and said.

    Raises:
        InvalidParameterError: None can be used, or they have other goals.
    """
    domain = get_domain(options.domain)
    folders = (
        options.library or _in_runs(domain.name) or shipped_with_siblings("skills", domain.name)
    )
    kinds: dict[str, list[tuple[SequenceStep, ...]]] = {CARRIED: [], RELEARNED: [], SCRATCH: []}
    for folder in folders:
        try:
            kind, steps = read_sequence(folder, domain.name)
        except InvalidLibraryError as error:
            tell(f"a sequence is left out: {error}")
            continue
        kinds[kind].append(steps)
    sequences = [steps for of_kind in kinds.values() for steps in of_kind]
    goals = [[step.goal for step in steps] for steps in sequences]
    if not sequences:
        raise InvalidParameterError(
            f"no sequence of {domain.name} is left; `slap acquire-sequence {domain.name}` makes one"
        )
    if any(one != max(goals, key=len)[: len(one)] for one in goals):
        raise InvalidParameterError("these sequences have different goals; compare others")
    known = {kind: of_kind for kind, of_kind in kinds.items() if of_kind}
    counts = {kind: [len(steps) for steps in of_kind] for kind, of_kind in known.items()}
    return PreparedStudy(
        {"trainings": len(sequences), "goals_of_each_sequence": counts},
        lambda _: study(domain.name, known),
        {
            "library": [folder.as_posix() for folder in folders] if options.library else None,
            "trainings": None,
        },
    )


def read_sequence(folder: Path, domain: str) -> tuple[str, tuple[SequenceStep, ...]]:
    """The kind of a sequence, and what came of each of its goals.

    Args:
        folder: Folder of the sequence's last library.
        domain: Name of the domain that it must be of.

    Raises:
        InvalidLibraryError: There is no library, it is another domain's, or no sequence made it.
    """
    about = read_library_record(folder)
    if about["domain"] != domain:
        raise InvalidLibraryError(f"{folder}: of domain {about['domain']!r}, not of {domain!r}")
    try:
        sequence: Any = about["sequence"]
        steps = tuple(map(SequenceStep.from_json, sequence["goals"]))
        for number, step in enumerate(steps):
            if any(goal.goal not in step.solved for goal in steps[: number + 1]):
                raise ValueError(f"after {step.goal}, not all goals were tried")
        if not steps:
            raise ValueError("it has no goals")
        again = RELEARNED if sequence.get("relearn") else CARRIED
        return SCRATCH if sequence["scratch"] else again, steps
    except DECODING_ERRORS as error:
        raise InvalidLibraryError(
            f"{folder}: no sequence made it, or it is damaged ({error!r}); `slap "
            f"acquire-sequence {domain}` makes one"
        ) from error


def _in_runs(domain: str) -> list[Path]:
    """The sequences of a domain in the folder in which they are by default."""
    found = [*Path(SEQUENCES).glob(f"{domain}*"), *Path(SEQUENCES).glob(f"{domain}*/*")]
    return sorted(path for path in found if (path / "library.json").exists())


STUDY = Study(
    "sequence",
    help="LG-SAIL Fig. 5: environment steps of one goal after another, and what is forgotten.",
    example="slap study sequence groceries",
    options=SequenceStudyOptions,
    prepare=prepare,
    summary=_summary,
    figures=(
        PaperFigure(
            "LG-SAIL Fig. 5", "a sequence of tasks", ("groceries", "bowls"), {"": "curves"}
        ),
    ),
)
