# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Lifted operators on the terminal."""

from __future__ import annotations

from slap_ros.cli.console import print_result
from slap_ros.relational import LiftedOperator, RewardTemplate


def print_operator(operator: LiftedOperator, reward: RewardTemplate | None) -> None:
    """Print an operator's preconditions and effects, and its reward if it has one.

    ``--operators`` reads what this prints.
    """
    print_result(operator.signature)
    different = [f"{one} != {other}" for one, other in operator.inequalities]
    for label, atoms, more in (
        ("PRE", operator.preconditions, different),
        ("EFF-", operator.delete_effects, []),
        ("EFF+", operator.add_effects, []),
    ):
        print_result(f"  {label:5}{', '.join([*sorted(map(str, atoms)), *more]) or '-'}")
    if reward is not None:
        print_result(f"  {'R':5}{' + '.join(map(str, reward.terms))}")
