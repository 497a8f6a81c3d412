# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Whether there is anything to learn: constant and random policies from where skills begin.

A skill that a policy without eyes does as well is none. Starts are those of demonstrations, after
the approach; what happens there within the skill's horizon is judged by the operator's effects.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np

from slap_ros.api.command_options import CommandOption, DomainName, Jobs, Preset
from slap_ros.api.left_out import Tell
from slap_ros.api.library_descriptions import describe_skills
from slap_ros.api.opening import open_chosen
from slap_ros.core import Action, ActionSpace, Domain
from slap_ros.drawing.palette import MUTED
from slap_ros.errors import InvalidParameterError, SlapError
from slap_ros.evaluation.statistics import SuccessRate
from slap_ros.relational import GroundOperator, State, ground_operators
from slap_ros.skills.demonstrator import Demonstration, demonstrate
from slap_ros.skills.domain_choice import DomainChoice, open_domain
from slap_ros.skills.skill import LearnedSkill
from slap_ros.studies.figures import LINES
from slap_ros.studies.job_runner import JobRunner
from slap_ros.studies.lg_sail.domain_choices import with_demonstrator
from slap_ros.studies.options import FRESH_SEED, RESULTS, FreshSeed, Output
from slap_ros.studies.results import MarkdownTable, StudyReport
from slap_ros.studies.row_figures import name_rows, plot_interval
from slap_ros.studies.study import PreparedStudy, Study

if TYPE_CHECKING:
    from matplotlib.figure import Figure

ALLOWED = 0.10  # of starts, above which an operator's skill is called vacuous
APPROACH_LIMIT = 300  # environment steps of an approach
BATCH = 20  # tasks that are demonstrated before it is asked whether there are enough starts
MOST_TASKS = 5  # as many times the wanted starts, of tasks, until there are enough
RANDOM = 7_000_000  # tells the random numbers of policies from those of tasks
MEASURED = """\
Each start is a state in which the demonstrator was about to begin an operator; the domain's
approach has then moved to where a skill begins. From there, each policy acts for the horizon of a
learned skill ({horizon} environment steps): *nothing* is the action of zeros, *open* and *close*
command the gripper and move nothing, *down* lowers the hand as fast as it can, *random* draws every
axis uniformly in each step. A policy succeeds if, at the start or after any step, all atoms of the
operator's EFF+ hold and none of its EFF-. So any moment of success counts here; a skill has to end
in one. The table has the share of starts; the data has Wilson's 95 % interval. An operator is
vacuous if a policy succeeds in more than {allowed:.0%} of starts. An approach that did not arrive
within {limit} steps, or after which the operator's preconditions no longer held, is not a start;
such approaches are counted."""
LEARNED = "learned"
JUDGED = """

*learned* is the policy of the skill in the library {digest}, judged in the same way from the same
starts."""

Blind = Callable[[np.random.Generator], Action]  # a policy that sees nothing
Tried = Callable[[np.random.Generator, State], Action]


@dataclass(frozen=True)
class PolicySuccess:
    """How often a policy did what an operator says."""

    policy: str
    successes: int
    starts: int

    @property
    def succeeded(self) -> SuccessRate:
        """Share of the starts."""
        return SuccessRate(self.successes, self.starts)

    def as_json(self) -> dict[str, Any]:
        """The counts with their interval."""
        return {
            **asdict(self),
            "rate": self.succeeded.share,
            "interval": asdict(self.succeeded.interval),
        }


@dataclass(frozen=True)
class OperatorVacuity:
    """All policies from all starts of an operator.

    Args:
        operator: Name of the operator.
        starts: Number of starts.
        lost: Number of approaches that did not lead to a start.
        policies: Success of the policies that see nothing.
        learned: Success of the skill of a library, if it is to be judged and there is one.
    """

    operator: str
    starts: int
    lost: int
    policies: tuple[PolicySuccess, ...]
    learned: PolicySuccess | None = None

    @property
    def vacuous(self) -> bool:
        """Whether a policy that sees nothing succeeds too often."""
        return any(policy.succeeded.share > ALLOWED for policy in self.policies)

    def as_json(self) -> dict[str, Any]:
        """Counts and rates of every policy."""
        return {
            "operator": self.operator,
            "starts": self.starts,
            "lost": self.lost,
            "vacuous": self.vacuous,
            "policies": [policy.as_json() for policy in self.policies],
            **({LEARNED: self.learned.as_json()} if self.learned else {}),
        }

    def as_row(self) -> list[str]:
        """Row of a table, without what was learned."""
        rates = [f"{policy.succeeded.share:.1%}" for policy in self.policies]
        verdict = "**vacuous**" if self.vacuous else "no"
        return [self.operator, str(self.starts), str(self.lost), *rates, verdict]


def study(
    choice: DomainChoice,
    wanted: int,
    seed: int,
    runner: JobRunner,
    learned: DomainChoice | None = None,
) -> StudyReport:
    """Let policies without eyes act where skills begin.

    Args:
        choice: Domain with its demonstrator for skills.
        wanted: Number of starts of each operator.
        seed: Seed of the tasks that are demonstrated.
        runner: Runner of the jobs.
        learned: Domain with a library of skills, which are judged from the same starts.

    Returns:
        The report.

    Raises:
        InvalidParameterError: The domain has no demonstrator, or none of its tasks has a start; or
            the library has no skill for any operator that is demonstrated.
    """
    domain = open_domain(choice)
    judged = _judged(learned, domain)
    starts, lost = _gather(domain, choice, wanted, seed, runner)
    jobs = {
        f"policies {name} {i}": (choice, i, start, learned if name in judged else None)
        for name, found in starts.items()
        for i, start in enumerate(found)
    }
    results = runner.run(f"{choice.name}: policies", try_policies, dict, jobs)
    found = []
    for name, own in starts.items():
        outcomes = [results[f"policies {name} {i}"] for i in range(len(own))]
        policies = tuple(
            PolicySuccess(policy, sum(o[policy] is not None for o in outcomes), len(own))
            for policy in blind_policies(domain.action_space)
        )
        skill = None
        if name in judged:
            successes = sum(o[LEARNED] is not None for o in outcomes)
            skill = PolicySuccess(LEARNED, successes, len(own))
        found.append(OperatorVacuity(name, len(own), lost.get(name, 0), policies, skill))
    never = [operator.name for operator in domain.operators if operator.name not in starts]
    return _report(choice, _horizon(domain), found, never, learned)


def _judged(learned: DomainChoice | None, domain: Domain) -> tuple[str, ...]:
    """The operators whose learned skills are judged: those that are demonstrated.

    Args:
        learned: Domain with a library of skills; None without one.
        domain: Domain with its demonstrator for skills.

    Raises:
        InvalidParameterError: There are none.
    """
    if learned is None:
        return ()
    acquired = open_domain(learned)
    names = tuple(o.name for o in acquired.operators if o in domain.operators)
    if not names:
        raise InvalidParameterError(
            f"{learned.skills} has skills for {', '.join(acquired.skills) or 'nothing'}, and none "
            f"for an operator of {domain.name}'s demonstrator, which leads to where skills begin"
        )
    return names


def _report(
    choice: DomainChoice,
    horizon: int,
    found: Sequence[OperatorVacuity],
    never: Sequence[str],
    learned: DomainChoice | None,
) -> StudyReport:
    """The report of what was found.

    Args:
        choice: Chosen domain.
        horizon: Largest number of environment steps of a skill.
        found: Success of the policies, one entry per operator.
        never: Names of operators without a start.
        learned: The domain with the library whose skills were judged, if there is one.

    Raises:
        InvalidParameterError: Nothing was.
    """
    if not found:
        raise InvalidParameterError(
            f"no operator of {choice.name} began in any demonstration; see `slap study "
            "demonstrations`"
        )
    names = [policy.policy for policy in found[0].policies]
    measured = MEASURED.format(horizon=horizon, allowed=ALLOWED, limit=APPROACH_LIMIT)
    rows = [one.as_row() for one in found]
    columns = ["operator", "starts", "approaches lost", *names, "vacuous"]
    if learned is not None:
        measured += JUDGED.format(digest=learned.digest)
        columns.append(LEARNED)
        for row, one in zip(rows, found, strict=True):
            row.append(f"{one.learned.succeeded.share:.1%}" if one.learned else "none")
    if never:
        measured += f"\n\nNo demonstration of this preset had a start of {', '.join(never)}."
    return StudyReport(
        study="vacuity",
        source="",
        title=f"Is there anything to learn: {choice.name}",
        measured=measured,
        table=MarkdownTable(columns, rows),
        found={
            "horizon": horizon,
            "operators": [one.as_json() for one in found],
            **({"without_starts": list(never)} if never else {}),
        },
        draw=lambda figure: draw(figure, found),
        size=(7.6, 1.4 + 0.4 * len(found)),
    )


def _horizon(domain: Domain) -> int:
    if domain.acquisition is None:
        raise InvalidParameterError(f"no skills are to be acquired in domain {domain.name}")
    return domain.acquisition.horizon


# -- starts ----------------------------------------------------------------------------------------


def _gather(
    domain: Domain,
    choice: DomainChoice,
    wanted: int,
    seed: int,
    runner: JobRunner,
) -> tuple[dict[str, list[Any]], dict[str, int]]:
    """Starts by operator, in the order of tasks; and how many approaches led to none.

    Args:
        domain: Opened domain, with its demonstrator for skills.
        choice: Choice of the same domain, for other processes.
        wanted: Number of starts of each operator.
        seed: Seed of the tasks.
        runner: Runner of the jobs.
    """
    goals = list(domain.goals) or [""]
    starts: dict[str, list[Any]] = {}
    lost: dict[str, int] = {}
    done = 0
    while done < MOST_TASKS * wanted:
        tasks = range(done, done + min(BATCH, wanted))
        jobs = {f"starts {i}": (choice, goals[i % len(goals)], seed, i) for i in tasks}
        title = f"{choice.name}: demonstrations from task {done} on"
        for found in runner.run(title, gather_starts, list, jobs).values():
            for start in found:
                own = starts.setdefault(start["operator"], [])
                if start["state"] is None:
                    lost[start["operator"]] = lost.get(start["operator"], 0) + 1
                elif len(own) < wanted:
                    own.append(start)
        done = tasks.stop
        if starts and all(len(own) >= wanted for own in starts.values()):
            break
    ordered = [op.name for op in domain.operators if starts.get(op.name)]
    return {name: starts[name] for name in ordered}, lost


def gather_starts(choice: DomainChoice, goal: str, seed: int, index: int) -> list[Any]:
    """The starts that one demonstration gives.

    Args:
        choice: Domain with its demonstrator for skills.
        goal: Name of the goal; empty for the task's own.
        seed: Seed of the task.
        index: Index of the task.

    Returns:
        For each option that was begun: task, operator, objects, and the state after the approach as
        numbers; None where the approach did not lead to a start.
    """
    domain = open_domain(choice)
    task = domain.task(seed, index, goal or None)
    shown = demonstrate(domain, task)
    found = []
    for operator, state in _begun(domain, shown):
        start = _approached(domain, shown, operator, state)
        found.append(
            {
                "task": [goal, seed, index],
                "operator": operator.operator.name,
                "objects": [obj.name for obj in operator.objects],
                "state": None if start is None else start.data.tolist(),
            }
        )
    return found


def _begun(domain: Domain, shown: Demonstration) -> Iterator[tuple[GroundOperator, State]]:
    """Each option that was begun, and the state in which it was."""
    grounds = {
        (ground.operator.name, tuple(obj.name for obj in ground.objects)): ground
        for ground in ground_operators(domain.operators, shown.space)
    }
    step = 0
    for edge in shown.episode.edges:
        yield grounds[edge.option, edge.objects], shown.episode.states[step]
        step += edge.steps


def _approached(
    domain: Domain, shown: Demonstration, operator: GroundOperator, state: State
) -> State | None:
    """The state after the approach; None where it does not arrive, or spoils the preconditions."""
    if domain.acquisition is None:
        return None
    world = domain.make_world(state)
    try:
        policy = domain.acquisition.approach(state, operator.objects)
        for _ in range(APPROACH_LIMIT):
            action = policy(world.state)
            if action is None:
                arrived = world.state
                return arrived if operator.applicable(shown.space.abstract(arrived)) else None
            world.step(action)
    except SlapError:  # refused from there: that is no start
        return None
    return None


# -- policies --------------------------------------------------------------------------------------


def blind_policies(actions: ActionSpace) -> dict[str, Blind]:
    """Policies that see nothing, by name; those that the action space has axes for."""
    policies: dict[str, Blind] = {"nothing": lambda _: actions.hold}
    if actions.gripper is not None:
        displacements = np.zeros(len(actions.displacement_indices))
        opened = actions.join(displacements, actions.gripper.opens)
        closed = actions.join(displacements, actions.gripper.closes)
        policies |= {"open": lambda _: opened, "close": lambda _: closed}
    names = [axis.name for axis in actions.axes]
    if "z" in names:
        down = actions.hold
        down[names.index("z")] = actions.low[names.index("z")]
        policies["down"] = lambda _: down
    policies["random"] = lambda rng: rng.uniform(actions.low, actions.high)
    return policies


def try_policies(
    choice: DomainChoice, number: int, start: dict[str, Any], learned: DomainChoice | None = None
) -> dict[str, int | None]:
    """Let every policy act from a start.

    Args:
        choice: Domain with its demonstrator for skills.
        number: Number of the start among its operator's; it also seeds the random policy.
        start: Start, as :func:`gather_starts` gives it.
        learned: Domain with a library that has a skill for the start's operator. Its policy is
            tried too, without the approach, which was made already.

    Returns:
        By policy, the steps after which it first succeeded; None where it did not.
    """
    domain = open_domain(choice)
    goal, seed, index = start["task"]
    layout = domain.task(seed, index, goal or None).initial_state.layout
    state = State(layout, np.array(start["state"]))
    space = domain.atom_space(state)
    (operator,) = [
        ground
        for ground in ground_operators(domain.operators, space)
        if ground.operator.name == start["operator"]
        and [obj.name for obj in ground.objects] == start["objects"]
    ]

    def succeeded(now: State) -> bool:
        abstract = space.abstract(now)
        return (
            abstract & operator.add_effects == operator.add_effects
            and not abstract & operator.delete_effects
        )

    world = domain.make_world(state)
    outcomes: dict[str, int | None] = {}
    policies = {name: _tried(one) for name, one in blind_policies(domain.action_space).items()}
    if learned is not None:
        policies[LEARNED] = _learned(open_domain(learned), operator)
    for name, policy in policies.items():
        rng = np.random.default_rng([RANDOM, seed, index, number])
        world.reset(state)
        outcomes[name] = None
        for step in range(_horizon(domain) + 1):
            if succeeded(world.state):
                outcomes[name] = step
                break
            if step < _horizon(domain):
                world.step(policy(rng, world.state))
    return outcomes


def _tried(blind: Blind) -> Tried:
    return lambda rng, _: blind(rng)


def _learned(domain: Domain, operator: GroundOperator) -> Tried:
    skill = domain.skills[operator.operator.name]
    assert isinstance(skill, LearnedSkill)
    act = skill.act(operator.objects)
    return lambda _, state: act(state)


def draw(figure: Figure, found: Sequence[OperatorVacuity]) -> None:
    """Draw each policy's share of starts, by operator, and what is allowed."""
    axes = figure.subplots()
    names = [policy.policy for policy in found[0].policies]
    for number, name in enumerate(names):
        places = [i + 0.14 * (number - (len(names) - 1) / 2) for i in range(len(found))]
        policies = [one.policies[number] for one in found]
        axes.plot(
            [100 * policy.succeeded.share for policy in policies],
            places,
            "o",
            color=LINES[number],
            markersize=4,
            label=name,
        )
        for place, policy in zip(places, policies, strict=True):
            plot_interval(axes, place, policy.succeeded.interval, LINES[number])
    judged = [(i, one.learned) for i, one in enumerate(found) if one.learned is not None]
    for number, (place, skill) in enumerate(judged):
        label = LEARNED if number == 0 else None
        axes.plot(100 * skill.succeeded.share, place, "*", color=MUTED, markersize=9, label=label)
        plot_interval(axes, place, skill.succeeded.interval)
    axes.axvline(100 * ALLOWED, color=MUTED, linestyle="--", linewidth=1)
    name_rows(axes, [one.operator for one in found])
    widest = max(20.0, *(105 * p.succeeded.interval.high for one in found for p in one.policies))
    axes.set_xlim(-1, 105.0 if judged else widest)
    which = "policy" if judged else "blind policy"
    axes.set_xlabel(f"starts from which a {which} succeeds [%], with 95 % interval")
    figure.legend(loc="outside upper center", ncols=len(names) + bool(judged))


@dataclass(frozen=True, kw_only=True)
class VacuityOptions:
    """Options of this study."""

    domain: DomainName
    starts: Annotated[int, CommandOption("Number of start states per operator.", least=1)] = 200
    seed: FreshSeed = FRESH_SEED
    preset: Preset = None
    skills: Annotated[
        Path | None,
        CommandOption("Folder that `slap acquire` made. Its skills are judged as well."),
    ] = None
    jobs: Jobs = 1
    output: Output = RESULTS


def prepare(options: VacuityOptions, tell: Tell) -> PreparedStudy:
    """Open the domain with its demonstrator, and with the skills to be judged."""
    choice = with_demonstrator(options.domain, options.preset)
    starts, seed, skills = options.starts, options.seed, options.skills
    settings: dict[str, Any] = {"preset": choice.preset, "starts": starts, "seed": seed}
    given, learned = {}, None
    if skills is not None:
        acquired = open_chosen(DomainChoice(options.domain, choice.preset, str(skills)), tell)
        learned = DomainChoice.of(acquired, str(skills))
        settings["skills"] = describe_skills(acquired)
        given["skills"] = skills
    return PreparedStudy(
        settings, lambda runner: study(choice, starts, seed, runner, learned), given
    )


STUDY = Study(
    "vacuity",
    help="Whether there is anything to learn: success of blind policies from where skills begin.",
    example="slap study vacuity stow_hammer",
    options=VacuityOptions,
    prepare=prepare,
)
