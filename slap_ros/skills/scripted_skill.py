# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Scripts as skills, so that whatever plans, executes and records takes them like any others."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from slap_ros.core import Domain, Policy, Script
from slap_ros.errors import InvalidParameterError
from slap_ros.relational import Object, State

STEP_LIMIT = 500  # environment steps of one script, the way to its objects included


@dataclass(frozen=True)
class ScriptedSkill:
    """A script that knows all of the state, in the place of a skill.

    It shows that a task can be solved, and how; nothing is learned from its success.

    Args:
        name: Name of the operator that the script carries out.
        script: Script that makes the policy.
        step_limit: Environment steps after which the skill counts as failed.
    """

    name: str
    script: Script = field(repr=False)
    step_limit: int = STEP_LIMIT
    least_steps: int = 1  # a script tells nothing about its steps beforehand

    def lower_bound(self, state: State, objects: tuple[Object, ...]) -> int:
        """One environment step: never too high, since an option takes one at least."""
        del state, objects
        return self.least_steps

    def start(self, state: State, objects: tuple[Object, ...]) -> Policy:
        """The script's policy, from any state."""
        return self.script(state, objects)


def with_scripts(domain: Domain) -> Domain:
    """The domain with its hand-written operators, and with scripts for skills.

    Args:
        domain: Domain whose own operators and skills, if any, are left out.

    Raises:
        InvalidParameterError: It has none written by hand, or an operator has no script.
    """
    acquisition = domain.acquisition
    if acquisition is None or not acquisition.operators:
        raise InvalidParameterError(
            f"domain {domain.name} has no demonstrator: no operators and scripts were written by "
            "hand for it; leave its skills as they are"
        )
    names = [operator.name for operator in acquisition.operators]
    if missing := [name for name in names if name not in acquisition.scripts]:
        raise InvalidParameterError(
            f"the demonstrator of domain {domain.name} has no script for {', '.join(missing)}; "
            "add it to the domain's Acquisition.scripts"
        )
    limit = min(STEP_LIMIT, domain.step_limit)
    return replace(
        domain,
        operators=acquisition.operators,
        skills={name: ScriptedSkill(name, acquisition.scripts[name], limit) for name in names},
        static=domain.static_predicates,
    )
