# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The approaches that are compared: planning with given options alone, and with shortcuts."""

from __future__ import annotations

from dataclasses import dataclass

from slap_ros.core import Domain
from slap_ros.planning.planner import Planner, make_planner
from slap_ros.relational import State
from slap_ros.shortcuts.grounded_shortcuts import GroundedShortcuts
from slap_ros.shortcuts.sampling import DEFAULT, PAPER, Sampling
from slap_ros.shortcuts.shooting import exhaustive, unlearned
from slap_ros.shortcuts.shortcut import Shortcut
from slap_ros.shortcuts.shortcut_library import ShortcutLibrary


@dataclass(frozen=True)
class Approach:
    """A way to plan.

    Args:
        name: Name of the approach in reports and results.
        shortcuts: Shortcuts that may be used besides the given options.
        sampling: Settings of how shortcuts are tried out in the model.
    """

    name: str
    shortcuts: tuple[Shortcut, ...] = ()
    sampling: Sampling = DEFAULT

    def planner(self, name: str, domain: Domain, initial: State) -> Planner:
        """A planner that plans in this way.

        Args:
            name: Name of the planner, one of :data:`slap_ros.planning.planner.PLANNERS`.
            domain: Domain of the tasks.
            initial: State with the objects of the tasks.

        Returns:
            The planner, with a model of its own.

        Raises:
            InvalidParameterError: No planner of that name, or none that can use shortcuts.
        """
        if not self.shortcuts:
            return make_planner(name, domain, initial)
        grounded = GroundedShortcuts(domain, self.shortcuts, initial, self.sampling)
        return make_planner(name, domain, initial, grounded)


PURE_PLANNING = Approach("pure_planning")


def shooting(library: ShortcutLibrary, domain: Domain, sampling: Sampling) -> Approach:
    """Planning-time search alone, with as many rollouts as SLAP makes; nothing in it is learned.

    Args:
        library: Library whose shortcuts say between which abstract states to search.
        domain: Domain of the library.
        sampling: Settings of how SLAP tries shortcuts out in the model.

    Returns:
        The approach, with the library's signatures and none of its policies.
    """
    searched = tuple(unlearned(shortcut, domain) for shortcut in library.shortcuts)
    return Approach("shooting", searched, exhaustive(sampling))


def approaches(library: ShortcutLibrary | None, sampling: Sampling) -> tuple[Approach, ...]:
    """The approaches to compare: the baseline first, planning with all samples last."""
    if library is None:
        return (PURE_PLANNING,)
    return (
        PURE_PLANNING,
        Approach("slap_1_sample", library.shortcuts, PAPER),
        Approach("slap", library.shortcuts, sampling),
    )
