# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Options that several commands have, and commands that take a dataclass of options."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import MISSING, Field, fields, is_dataclass
from functools import wraps
from inspect import Parameter, signature
from typing import Annotated, Any, TypeVar, get_args, get_origin, get_type_hints

import typer

from slap_ros.api.command_line import option_of
from slap_ros.api.command_options import (
    MAX_INDEX,
    MAX_SEED,
    CommandArgument,
    CommandOption,
    matching_domains,
)
from slap_ros.cli.console import console
from slap_ros.errors import InvalidParameterError

R = TypeVar("R")
DEFAULT_SEED = 0


def at_most(limit: float) -> Callable[[Any], Any]:
    """A check of an option whose upper end is so large that its help need not name it.

    Args:
        limit: Largest value.

    Returns:
        A callback of an option, which gives the value back.
    """

    def check(value: Any) -> Any:
        if value is not None and value > limit:
            raise typer.BadParameter(f"{value} is too large; {limit} at most")
        return value

    return check


DomainOrFile = Annotated[
    str,
    typer.Argument(
        help="Name of a domain (`slap domains` lists them), or a PDDL domain file.",
        autocompletion=matching_domains,
    ),
]
Json = Annotated[bool, typer.Option("--json", help="Print JSON on stdout.")]
Planner = Annotated[
    str,
    typer.Option(
        help="Planner: anytime (a plan soon, then better ones), lazy (the shortest), exhaustive "
        "(the paper's), ff (greedy best-first search, SLAP D.2) or astar (fewest operators; tries "
        "none in the model)."
    ),
]
Within = Annotated[
    float | None,
    typer.Option(
        help="With the planner anytime: how many times as long as the shortest a plan may be, as "
        "far as is proven. Planning ends with the first such plan. Default: 1.",
    ),
]
EffortFactor = Annotated[
    int | None,
    typer.Option(
        help="With the planner anytime: factor of the usual effort of planning, which is counted "
        "in roll-outs. With PDDL files: factor of all limits. Default: 1.",
    ),
]
NoImprove = Annotated[
    bool,
    typer.Option(
        "--no-improve",
        help="With the planner anytime: do not look for a shorter rest of a plan while the robot "
        "executes it.",
    ),
]
Seed = Annotated[
    int,
    typer.Option(min=0, callback=at_most(MAX_SEED), help="Seed from which tasks are sampled."),
]
ChosenSeed = Annotated[  # of the commands that say which one they took
    int | None,
    typer.Option(
        min=0,
        callback=at_most(MAX_SEED),
        show_default=str(DEFAULT_SEED),
        help="Seed from which tasks are sampled.",
    ),
]
Index = Annotated[
    int,
    typer.Option(
        min=0,
        callback=at_most(MAX_INDEX),
        help="Number of the task among the seed's tasks, from 0.",
    ),
]
Goal = Annotated[
    str | None,
    typer.Option(
        help="Goal instead of the task's own: a name that `slap domains DOMAIN` lists, or atoms "
        "such as '(and (On block2 target) (GripperEmpty robot))'."
    ),
]


def seed_or_default(seed: int | None) -> int:
    """The seed that an option states, or the default one."""
    return DEFAULT_SEED if seed is None else seed


def say_default_seed(seed: int | None) -> None:
    """Say which seed was taken where none was given."""
    if seed is None:
        console.print(f"seed {DEFAULT_SEED} (the default; --seed N for another task)")


def flat_options(command: Callable[..., R]) -> Callable[..., R]:
    """Let a command take dataclasses: each of their fields is an option of the command line.

    Typer reads the options of a command from its signature. So a dataclass states options once
    for several commands, with their defaults, and refuses in its ``__post_init__`` what cannot be.

    Args:
        command: Some of its parameters are annotated with a dataclass whose fields are annotated
            as Typer has it.

    Returns:
        The command with the fields of its dataclasses as keyword arguments.
    """
    groups: dict[str, Any] = {}
    parameters = []
    hints = get_type_hints(command, include_extras=True)
    for name, parameter in signature(command).parameters.items():
        if is_dataclass(hints[name]):
            groups[name] = hints[name]
            parameters += _parameters_of(hints[name])
        else:
            parameters.append(
                parameter.replace(annotation=_for_typer(hints[name]), kind=Parameter.KEYWORD_ONLY)
            )

    @wraps(command)
    def run(**given: Any) -> R:
        _require_usable(given)
        for name, kind in groups.items():
            given[name] = kind(**{field.name: given.pop(field.name) for field in fields(kind)})
        return command(**given)

    # Typer looks at both; what `wraps` has copied are those of the command.
    flat = signature(command).replace(parameters=parameters, return_annotation=hints["return"])
    run.__signature__ = flat  # type: ignore[attr-defined]
    run.__annotations__ = {one.name: one.annotation for one in parameters}
    return run


def _require_usable(given: Mapping[str, Any]) -> None:
    """Refuse numbers that no range of an option keeps out.

    NaN is neither too small nor too large, and what counts something often has no upper end.

    Raises:
        InvalidParameterError: Names the option.
    """
    for name, value in given.items():
        if isinstance(value, float) and not math.isfinite(value):
            raise InvalidParameterError(f"{option_of(name)} is {value}; give a number")
        if isinstance(value, int) and value > MAX_SEED:
            raise InvalidParameterError(
                f"{option_of(name)} is a number of {len(str(value))} digits; {MAX_SEED} at most"
            )


def _parameters_of(kind: Any) -> list[Parameter]:
    hints = get_type_hints(kind, include_extras=True)
    return [
        Parameter(
            field.name,
            Parameter.KEYWORD_ONLY,
            default=Parameter.empty if field.default is MISSING else field.default,
            annotation=_for_typer(hints[field.name]),
        )
        for field in _own_first(kind)
    ]


def _own_first(kind: Any) -> list[Field[Any]]:
    """Fields of a dataclass, those of a class before those of the classes that it extends."""
    bases = [base for base in kind.__bases__ if is_dataclass(base)]
    inherited = [field.name for base in bases for field in _own_first(base)]
    by_name = {field.name: field for field in fields(kind)}
    own = [name for name in by_name if name not in inherited]
    return [by_name[name] for name in (*own, *inherited)]


def _for_typer(hint: Any) -> Any:
    """The type of a parameter with its option as Typer has it."""
    if get_origin(hint) is not Annotated:
        return hint
    kind, *notes = get_args(hint)
    return Annotated[(kind, *map(_typer_note, notes))]


def _typer_note(note: Any) -> Any:
    if isinstance(note, CommandArgument):
        return typer.Argument(help=note.help, autocompletion=note.complete)
    if isinstance(note, CommandOption):
        return typer.Option(
            *([note.name] if note.name else []),
            help=note.help,
            min=note.least,
            max=note.most,
            metavar=note.metavar,
            callback=None if note.limit is None else at_most(note.limit),
        )
    return note
