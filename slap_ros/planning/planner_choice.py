# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The choice of a planner, as one word: ``lazy``, or ``anytime:within=1.25,effort=4``."""

from __future__ import annotations

from dataclasses import dataclass, field

from slap_ros.errors import InvalidParameterError
from slap_ros.planning.effort import Effort

ANYTIME = "anytime"
DEFAULT_PLANNER = ANYTIME
WITH_SHORTCUTS = (ANYTIME, "lazy", "exhaustive")  # planners that can use them
SETTINGS = ("within", "effort", "improve")  # of anytime


@dataclass(frozen=True)
class PlannerChoice:
    """A planner by name, and how much its plans may cost.

    Args:
        name: Name of the planner.
        effort: Effort of planning; ``anytime`` alone has a limit of it.
    """

    name: str
    effort: Effort = field(default_factory=Effort)

    @classmethod
    def parse(cls, text: str) -> PlannerChoice:
        """Read a choice; whether there is such a planner is seen where it is made.

        Raises:
            InvalidParameterError: Settings are not of the form ``anytime:within=1.25,effort=4``, or
                it is another planner, which has none.
        """
        name, colon, settings = text.partition(":")
        if not colon:
            return cls(name)
        if name != ANYTIME:
            raise InvalidParameterError(
                f"planner {text!r}: only {ANYTIME} has settings ({', '.join(SETTINGS)}); the "
                "others search until they have their plan"
            )
        given = dict(_setting(text, part) for part in settings.split(","))
        if unknown := sorted(given.keys() - set(SETTINGS)):
            raise InvalidParameterError(
                f"planner {text!r}: unknown setting {unknown[0]!r}; there are {', '.join(SETTINGS)}"
            )
        try:
            within, factor = float(given.get("within", 1.0)), int(given.get("effort", 1))
            improve = int(given["improve"]) if "improve" in given else None
        except ValueError as error:
            raise InvalidParameterError(f"planner {text!r}: {error}") from error
        return cls(name, Effort.times(factor, within, improve))


def with_settings(
    planner: str, within: float | None, effort: int | None, improve: int | None = None
) -> str:
    """The choice of a planner with settings that were given by themselves.

    Args:
        planner: Choice of the planner.
        within: Factor of the bound that is good enough; None for the usual one.
        effort: Factor of the usual effort; None for 1.
        improve: Options simulated per step of the robot while it moves; None for the usual number.

    Raises:
        InvalidParameterError: The planner has no such settings, or they make no sense.
    """
    given = dict(zip(SETTINGS, (within, effort, improve), strict=True))
    settings = ",".join(f"{name}={value}" for name, value in given.items() if value is not None)
    if not settings:
        return planner
    choice = f"{planner}{',' if ':' in planner else ':'}{settings}"
    PlannerChoice.parse(choice)
    return choice


def can_use_shortcuts(planner: str) -> bool:
    """Whether the planner of a choice can use shortcuts."""
    return PlannerChoice.parse(planner).name in WITH_SHORTCUTS


def _setting(text: str, part: str) -> tuple[str, str]:
    name, equals, value = (piece.strip() for piece in part.partition("="))
    if not (name and equals and value):
        raise InvalidParameterError(
            f"planner {text!r}: {part!r} is not of the form setting=value, as in "
            f"{ANYTIME}:within=1.25,effort=4"
        )
    return name, value
