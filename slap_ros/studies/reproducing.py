# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Which command makes which table or figure of the papers, and what comes of it.

``docs/reproducing.md`` has these tables; :mod:`slap_ros.studies.readme` writes them from the data.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Any

from slap_ros.files import parse_json, read_text
from slap_ros.studies.results import Data, MarkdownTable

SLAP_DOMAINS = ("obstacle2d", "obstacle_tower", "cluttered_drawer", "cleanup_table")
NOT_RUN, NOT_MEASURED = "not run", "not measured"
# Minutes of one core, as measured on the machine that made the published figures.
MINUTES: Mapping[str, int] = {
    "replanning_stow_hammer": 6,
    "replanning_peg_in_hole": 3,
}
TRAINING_MINUTES: Mapping[str, int] = {
    "obstacle2d": 3,
    "obstacle_tower": 104,
    "cluttered_drawer": 40,
    "cleanup_table": 20,
}
# What was measured where it is not planning.
MOST_OF_THE_TIME: Mapping[str, str] = {
    "ablation": "learning",
    "planning_ablation": "attempts",
}
PLANS = 25  # of a language model


@dataclass(frozen=True)
class PaperFigure:
    """A table or figure of a paper.

    Args:
        source: Paper and number of the figure or table.
        shows: Subject of the figure or table.
        study: Name of the study, as in ``slap study``, that makes it; empty where there is none.
        domains: Domains for which the paper has it.
        found: Figures of the paper, by domain; those of all domains under an empty name.
        not_run: Reason why there is no data, where there is none.
    """

    source: str
    shows: str
    study: str = ""
    domains: Sequence[str] = ()
    found: Mapping[str, str] = field(default_factory=dict)
    not_run: str = ""


def _figure_not_made(
    source: str, shows: str, found: str, not_run: str, study: str = ""
) -> PaperFigure:
    """A figure that was made for no domain, with the paper's and why there is none here."""
    return PaperFigure(source, shows, study, found={"": found}, not_run=not_run)


PAPER_FIGURES = (
    PaperFigure(
        "SLAP Table 1",
        "success and plan length",
        "table1",
        SLAP_DOMAINS,
        {
            "obstacle2d": "100%; 25.9 → 17.6 steps",
            "obstacle_tower": "100%; 245.8 → 79.2 steps",
            "cluttered_drawer": "100%; 352.1 → 165.8 steps",
            "cleanup_table": "100%; 431.8 → 115.2 steps",
        },
    ),
    _figure_not_made(
        "SLAP Table 1",
        "other learners: PPO, SAC+HER, hierarchical RL, SOL",
        "0%; hierarchical RL and SOL 100% in Obstacle 2D, 25.3 and 24.9 steps",
        "none of them is part of this project",
    ),
    PaperFigure(
        "SLAP Table 2, §4.2",
        "pruning by random rollouts",
        "pruning",
        SLAP_DOMAINS,
        {"": "K/N up to 25%: 167 to 202 steps; from 30% on: 333 to 349"},
    ),
    PaperFigure(
        "SLAP Table 3",
        "other algorithms that learn shortcuts",
        domains=("cleanup_table",),
        found={"": "PPO 113.7, SAC 160.2, SAC+HER 131.0 steps; pure planning 446"},
        not_run="only PPO learns shortcuts here",
    ),
    PaperFigure(
        "SLAP Table 4",
        "seconds of planning",
        "planning_time",
        SLAP_DOMAINS,
        {
            "obstacle_tower": "18.4 → 15.2 s",
            "cluttered_drawer": "65 → 275 s",
            "cleanup_table": "34 → 201 s",
        },
    ),
    PaperFigure(
        "SLAP Tables 5 and 6, D.3, D.4",
        "predicates and perception that err",
        "perception",
        SLAP_DOMAINS,
        {
            "cluttered_drawer": "thresholds in [w/2, w]: 54 → 92%, in [w, 2w]: 63 → 0%",
            "obstacle_tower": "stochastic: 84 → 92%; top block hidden: 2 → 78%",
        },
    ),
    _figure_not_made(
        "SLAP Tables 7 and 8",
        "another physics than in planning",
        "65 → 78%, trained again 86%",
        "no study perturbs the world without the planner's model",
    ),
    PaperFigure(
        "SLAP Fig. 4",
        "success and length while shortcuts are learned",
        "dynamics",
        SLAP_DOMAINS,
        {"": "curves"},
    ),
    PaperFigure(
        "SLAP Fig. 5",
        "other obstacles, distractors, mass, friction",
        "generalisation",
        SLAP_DOMAINS,
        {"": "bars"},
    ),
    _figure_not_made(
        "SLAP Fig. 6",
        "independent policies against one for all",
        "independent policies are better",
        "this project has independent policies only",
    ),
    PaperFigure(
        "SLAP Fig. 9",
        "15 other goals",
        "goals",
        SLAP_DOMAINS,
        {"": "bars"},
    ),
    PaperFigure(
        "LG-SAIL Table 1",
        "task progress with acquired skills",
        "acquisition",
        ("stow_hammer", "peg_in_hole", "stack_at_target", "make_coffee"),
        {
            "stow_hammer": "training 0.96, test1 0.91, test2 0.71",
            "peg_in_hole": "training 0.92, test1 0.59, test2 0.93",
            "stack_at_target": "1.00",
        },
    ),
    _figure_not_made(
        "LG-SAIL Table 2",
        "operators and plans of a language model",
        "operators 61%, with search 100% overall, 1.64 attempts",
        "needs a language model",
        "planning_ablation",
    ),
    _figure_not_made(
        "LG-SAIL Table 3, Fig. 7",
        "rewards of a language model",
        "20 → 92% with the metrics' source",
        "needs a language model",
        "reward_ablation",
    ),
    _figure_not_made(
        "LG-SAIL Tables 5 and 6",
        "operators of other language models",
        "operators 79 to 98%",
        "needs language models",
        "models",
    ),
    _figure_not_made(
        "LG-SAIL Table 7",
        "imitation with and without planning",
        "Stack 1.00, Peg 0.95, Peg goal 2 0.90",
        "this project has no learning by imitation",
    ),
    _figure_not_made(
        "LG-SAIL Fig. 4",
        "learning curves beside other learners",
        "curves",
        "none of these learners is part of this project",
    ),
    _figure_not_made(
        "LG-SAIL Fig. 5", "a sequence of tasks", "curves", "no sequence of ten tasks was trained"
    ),
    _figure_not_made(
        "LG-SAIL Fig. 6",
        "skills of another domain to begin with",
        "curves",
        "no trainings with and without them were compared",
    ),
    _figure_not_made(
        "LG-SAIL Fig. 8", "a real robot", "0.8 and 1.0 of 10 trials", "no robot was available"
    ),
)


@dataclass(frozen=True)
class PublishedFigure:
    """Data of a study as it is published.

    Args:
        name: Name of its files, without their endings.
        data: Content of its JSON file.
    """

    name: str
    data: Data

    @property
    def link(self) -> str:
        """Link to the figure's page, from a page of the documentation."""
        return f"[{self.data['domain']}](results/{self.name}.md)"

    @property
    def command(self) -> str:
        """Command that makes the figure again."""
        return f"`{self.data['command']}`"

    @property
    def found(self) -> str:
        """Main numbers of the figure, in a few words."""
        summarise = SUMMARIES.get(self.data["study"])
        return summarise(self.data["found"]) if summarise else "-"

    @property
    def trials(self) -> str:
        """Number of seeds × tasks, and of what else there are several."""
        data = self.data
        if "trainings" in data:
            number = data["trainings"]
            trained = len(number) if isinstance(number, list) else number
            seeds = f"{data['seeds']} × " if "seeds" in data else ""
            tasks = f", {seeds}{data['tasks']} tasks" if "tasks" in data else ""
            return f"{trained} training{'s' if trained != 1 else ''}{tasks}"
        if "starts" in data:
            return f"{data['starts']} starts"
        if "plans" in data:
            few = f" of {PLANS}" if data["plans"] < PLANS else ""
            return f"{data['plans']}{few} plans"
        counted = f"{data.get('seeds', 1)} × {data['tasks']}"
        if data["study"] == "replanning":
            return f"{counted}, {data['others']} × {data['tasks']} of other libraries"
        libraries = len(data.get("libraries", ())) or _libraries_of_skills(data)
        return f"{counted} × {libraries} trained" if libraries else counted

    @property
    def core_seconds(self) -> tuple[float | None, str]:
        """Time of one core, s, and what of it was measured; None where nothing was."""
        if "cpu_seconds" in self.data:
            return float(self.data["cpu_seconds"]), ""
        if self.name in MINUTES:
            return 60.0 * MINUTES[self.name], ""
        seconds = sum(_seconds(self.data["found"]))
        what = MOST_OF_THE_TIME.get(self.data["study"], "planning")
        return seconds or None, f" of {what} alone"

    @property
    def core_hours(self) -> str:
        """Time of one core, as a table has it."""
        seconds, what = self.core_seconds
        return NOT_MEASURED if seconds is None else f"{seconds / 3600:.2f}{what}"


def _seconds(found: Any) -> Iterator[float]:
    """Seconds of planning in all trials, of learning in all trainings, of all plans of a model."""
    if isinstance(found, Mapping):
        for key, value in found.items():
            if key in ("planning_seconds", "cpu_seconds") and isinstance(value, float):
                yield value
            else:
                yield from _seconds(value)
    elif isinstance(found, list):
        for value in found:
            yield from _seconds(value)


def published(results: Path) -> dict[str, PublishedFigure]:
    """Every figure of a folder that a study makes, by name; benchmarks make others."""
    found = {path.stem: parse_json(read_text(path)) for path in sorted(results.glob("*.json"))}
    return {
        name: PublishedFigure(name, data)
        for name, data in found.items()
        if str(data.get("command", "")).startswith("slap study ")
    }


def paper_table(results: Path) -> MarkdownTable:
    """A row for each figure of a paper and domain, those without data as well."""
    known = published(results)
    columns = (
        "figure",
        "shows",
        "domain",
        "command",
        "ours",
        "the paper's",
        "seeds × tasks",
        "core-hours",
    )
    return MarkdownTable(columns, [row for one in PAPER_FIGURES for row in _rows_of(one, known)])


def other_table(results: Path) -> MarkdownTable:
    """A row for each figure that no paper has."""
    of_papers = {one.study for one in PAPER_FIGURES}
    rows = [
        [one.data["study"], one.link, one.command, one.trials, one.core_hours]
        for one in published(results).values()
        if one.data["study"] not in of_papers
    ]
    return MarkdownTable(("study", "domain", "command", "seeds × tasks", "core-hours"), rows)


def _rows_of(figure: PaperFigure, known: Mapping[str, PublishedFigure]) -> Iterator[list[str]]:
    about = [figure.source, figure.shows]
    others = [
        one.data["domain"]
        for one in known.values()
        if one.data["study"] == figure.study and one.data["domain"] not in figure.domains
    ]
    for domain in (*figure.domains, *others) or ("",):
        papers = figure.found.get(domain, figure.found.get("", ""))
        one = known.get(f"{figure.study}_{domain}")
        if one is not None:
            rest = [one.link, one.command, one.found, papers, one.trials, one.core_hours]
        else:
            command = f"`slap study {figure.study} {domain or 'DOMAIN'}`" if figure.study else ""
            reason = f"{NOT_RUN}: {figure.not_run}" if figure.not_run else NOT_RUN
            rest = [domain, command, reason, papers, "", ""]
        yield [*about, *rest]
        about = ["", ""]


# -- the main figures of each study ---------------------------------------------------------------


def _steps(length: Mapping[str, float] | None) -> str:
    return "-" if length is None else f"{length['mean']:.1f}"


def _of_table1(found: Data) -> str:
    parts = []
    for preset in dict.fromkeys(row["preset"] for row in found["rows"]):
        rows = {row["approach"]: row for row in found["rows"] if row["preset"] == preset}
        pure, one, every = rows["pure_planning"], rows["slap_1_sample"], rows["slap"]
        parts.append(
            f"`{preset}`: {every['success_rate']:.0%}; {_steps(pure['plan_length'])} → "
            f"{_steps(one['plan_length'])} steps (1 sample), {_steps(every['plan_length'])} (all)"
        )
    return "; ".join(parts)


def _of_goals(found: Data) -> str:
    pure, slap = found["approaches"][0], found["approaches"][-1]
    steps = f"{_steps(pure['plan_length'])} → {_steps(slap['plan_length'])} steps"
    return f"{slap['success_rate']:.0%}; {steps}, {len(found['goals'])} goals in all"


def _of_pruning(found: Data) -> str:
    least = found["thresholds"][0]
    kept = f"{least['remaining_percent']['mean']:.1f}% of candidates kept with K = {least['k']}"
    if "plan_length" not in least:
        return kept
    steps = [f"{_steps(least['plan_length'])} steps"]
    for before, one in pairwise(found["thresholds"]):
        if one["plan_length"] != before["plan_length"]:
            share = 100 * one["k_over_n"]
            steps.append(f"from K/N = {share:.2g}% on {_steps(one['plan_length'])}")
    return f"{kept}; {', '.join(steps)}"


def _of_planning_time(found: Data) -> str:
    most = {cost["approach"]: cost for cost in found["costs"]}
    pure, slap = (most[name]["planning_seconds"]["mean"] for name in ("pure_planning", "slap"))
    return f"{pure:.2f} → {slap:.2f} s with {most['slap']['value']} {found['setting']}"


def _of_generalisation(found: Data) -> str:
    slap = [one["approaches"][-1] for one in found["conditions"]]
    lengths = [one["relative_length"] for one in slap if one["relative_length"] is not None]
    least = min(one["success_rate"] for one in slap)
    success = f"success {least:.0%}" + (" or more" if least < 1.0 else "")
    return (
        f"relative length {min(lengths):.2f} to {max(lengths):.2f}, {success}, "
        f"in {len(slap)} conditions"
    )


def _of_perception(found: Data) -> str:
    least = {}
    for name in ("pure_planning", "slap"):
        rates = [one["success_rate"] for one in found["levels"] if one["approach"] == name]
        least[name] = f"{min(rates):.0%}"
    return f"success at worst {least['pure_planning']} → {least['slap']}"


def _of_dynamics(found: Data) -> str:
    ends = [one["moments"][-1] for one in found["shortcuts"]]
    each = ", ".join(f"{end['success_mean']:.0%} in {end['length_mean']:.1f} steps" for end in ends)
    if "plans" not in found:
        return each
    first, last = (_steps(found["plans"][i]["plan_length"]) for i in (0, -1))
    return f"{each}; plans of {first} → {last} steps"


def _libraries_of_skills(data: Data) -> int:
    """How many there are behind each goal of the study of task progress; 0 for other studies."""
    if data["study"] != "acquisition":
        return 0
    goals = data["found"]["goals"]
    return sum(len(one["libraries"]) for one in goals if one["goal"] == goals[0]["goal"])


def _of_acquisition(found: Data) -> str:
    return ", ".join(
        f"{one['goal']}{_origin(one)} {one['progress']['mean']:.2f}" for one in found["goals"]
    )


def _of_planning_ablation(found: Data) -> str:
    return "; ".join(
        f"{one['model']}, {one['variant']}: operators {_percent(one['operators'])}, "
        f"overall {_percent(one['overall'])}"
        for one in found["tallies"]
    )


def _percent(counts: Sequence[int]) -> str:
    good, every = counts
    return f"{good / every:.0%}"


def _origin(goal: Data) -> str:
    origin = {goal.get("proposer", "manual"), goal.get("rewarder", "manual")}
    return "" if origin == {"manual"} else f" ({goal['proposer']}, {goal['rewarder']})"


SUMMARIES: Mapping[str, Callable[[Data], str]] = {
    "table1": _of_table1,
    "goals": _of_goals,
    "pruning": _of_pruning,
    "planning_time": _of_planning_time,
    "generalisation": _of_generalisation,
    "perception": _of_perception,
    "dynamics": _of_dynamics,
    "acquisition": _of_acquisition,
    "planning_ablation": _of_planning_ablation,
}
