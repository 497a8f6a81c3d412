# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The page that says what each round of growing has brought, in Markdown."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from slap_ros.api.growth import GrowthRequest, GrowthRound, TriedShortcut

_HEAD = (
    "| round | skills | task progress | steps for skills | plan of skills alone [steps] "
    "| plan with shortcuts [steps] | steps for shortcuts |\n"
    "|---|---|---|---|---|---|---|\n"
)


def growth_page(
    request: GrowthRequest, rounds: Sequence[GrowthRound], best: int, ended: str
) -> str:
    """The page of a growth: a table of its rounds, and what was tried in each.

    Args:
        request: What was to grow.
        rounds: Rounds, in order.
        best: Number of the round with the shortest plans, from 0.
        ended: Reason why there was no further round, in words; empty while it goes on.
    """
    domain, spent = request.domain, sum(one.steps for one in rounds)
    shortest = rounds[best]
    over = f"It ended since {ended}." if ended else "It goes on with the same command."
    saved = 1.0 - shortest.length / shortest.length_alone if shortest.length_alone else 0.0
    sections = "".join(_section(number, one) for number, one in enumerate(rounds))
    return (
        f"# What grew in {domain.name}, preset {domain.preset}\n\n"
        f"    {request.command}\n\n"
        f"{_HEAD}{''.join(_row(number, one) for number, one in enumerate(rounds))}\n"
        f"The best is round {best + 1}: plans of {shortest.length:.1f} steps, where its skills "
        f"alone take {shortest.length_alone:.1f} (saved: {saved:.0%}). Lengths are means over the "
        "validation tasks that have a plan; training never sees them. A round is better where more "
        "of them have one, and among equals where plans are shorter. `skills` and `shortcuts` are "
        f"the libraries of this round. {over} The rounds took {spent} of {request.steps} "
        f"environment steps.\n{sections}"
    )


def _row(number: int, one: GrowthRound) -> str:
    return (
        f"| {number + 1} | {', '.join(one.skills)} | {one.progress:.2f} | {one.skill_steps} "
        f"| {one.length_alone:.1f} | {one.length:.1f} | {one.shortcut_steps} |\n"
    )


def _section(number: int, one: GrowthRound) -> str:
    tried = "".join(f"- {_in_words(shortcut)}\n" for shortcut in one.tried)
    without = f" Validation tasks without a plan: {one.unsolved}." if one.unsolved else ""
    return (
        f"\n## Round {number + 1}\n\n"
        f"Skills {one.skills_digest}: {one.ended}.{without}\n\n"
        f"{tried or 'No shortcut was learned.'}"
    ).rstrip("\n") + "\n"


def _in_words(tried: TriedShortcut) -> str:
    after = "unsolved for a task" if tried.after is None else f"{tried.after:.1f} steps"
    kept = "" if tried.kept else "; not kept"
    begins = f"; begins with an approach: {_counted(tried.approaches)}" if tried.approaches else ""
    return f"{tried.name}: {tried.before:.1f} steps → {after}{kept}{begins}"


def _counted(approaches: Mapping[str, int]) -> str:
    """Approaches in words, with the number of demonstrations of each.

    Args:
        approaches: Number of demonstrations by the name of the approach, one at least.
    """
    (first, number), *others = approaches.items()
    whole = f"{first} ({number} of {sum(approaches.values())} demonstrations)"
    return ", ".join([whole, *(f"{name} ({number})" for name, number in others)])
