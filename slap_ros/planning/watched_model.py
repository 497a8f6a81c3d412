# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A model that notes which given options a search tried where shortcuts had led."""

from __future__ import annotations

from collections.abc import Callable

from slap_ros.core import ActionSpace, World
from slap_ros.planning.model import Model, Rollout
from slap_ros.planning.options import Option, OptionKind, never
from slap_ros.relational import AtomSpace, State, Target


class WatchedModel(Model):
    """A model that notes each given option that is tried after a shortcut, and where.

    What follows such an option counts as after the shortcut, too.
    """

    def __init__(
        self,
        world: World,
        space: AtomSpace,
        actions: ActionSpace,
        is_canceled: Callable[[], bool] = never,
    ) -> None:
        """Begin with nothing noted.

        Args:
            world: World in which options are rolled out; nobody else may use it.
            space: Atoms of the task.
            actions: Actions of the robot.
            is_canceled: Whether nobody wants a plan any more.
        """
        super().__init__(world, space, actions, is_canceled)
        self._after: set[bytes] = set()  # keys of the states that shortcuts led to
        self._tried: dict[tuple[Option, bytes], tuple[Option, State]] = {}

    def roll_out(self, option: Option, state: State, target: Target) -> Rollout:
        """Execute an option, and note where it began if that is after a shortcut.

        Args:
            option: Option that is executed.
            state: State in which the option begins.
            target: Target that the option shall reach.

        Returns:
            The outcome, as :meth:`~slap_ros.planning.model.Model.roll_out` has it.
        """
        rollout = super().roll_out(option, state, target)
        given, after = option.kind is OptionKind.OPERATOR, state.key in self._after
        if given and after:
            self._tried.setdefault((option, state.key), (option, state))
        if rollout.reached and (after or not given):
            self._after.add(rollout.final.key)
        return rollout

    @property
    def tried_after_shortcuts(self) -> list[tuple[Option, State]]:
        """Each given option that was tried after a shortcut, and the state in which it began."""
        return list(self._tried.values())
