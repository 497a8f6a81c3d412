# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Libraries of learned skills on disk: a folder per skill, readable without torch, never a pickle.

::

    models/skills/stow_hammer/
      library.json             format, domain, preset, goal, command, settings, steps, progress
      Open-1f3a90c2/           name and digest of the lifted operator
        skill.json             operator, reward, key, horizon, checksum, record
        policy.safetensors     weights

What is damaged is not used: a skill that cannot be read is refused with a reason, and the rest of
the library is used without it. A library of another domain or of a newer format is refused as a
whole.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from hashlib import sha256
from pathlib import Path
from typing import Any

from safetensors.numpy import save

from slap_ros.core import Domain
from slap_ros.errors import InvalidDomainError, InvalidLibraryError, InvalidRewardError
from slap_ros.policies.action_map import ActionMap
from slap_ros.policies.library_files import (
    SKILL,
    load_policy,
    policy_tensors,
    read_about,
    read_members,
    read_object,
    record_of,
    save_policy,
    write_library,
    write_object,
)
from slap_ros.policies.mlp_policy import MlpPolicy
from slap_ros.relational import LiftedOperator, RewardTemplate
from slap_ros.skills.observations import SIZE
from slap_ros.skills.operator_json import operator_data, read_operator, read_template, template_data
from slap_ros.skills.reward import check_template
from slap_ros.skills.skill import LearnedSkill
from slap_ros.skills.skill_signature import signature_of

FORMAT = 1
POLICY = "policy.safetensors"
MAX_HORIZON = 10_000  # environment steps


def operator_digest(operator: LiftedOperator) -> str:
    """Eight hexadecimal digits that tell lifted operators apart."""
    return sha256(json.dumps(operator_data(operator)).encode()).hexdigest()[:8]


def skill_folder_name(operator: LiftedOperator) -> str:
    """The name of the folder of an operator's skill: the operator's name and digest."""
    return f"{operator.name}-{operator_digest(operator)}"


@dataclass(frozen=True)
class AcquiredSkill:
    """A skill that was learned for an operator, and how it was learned.

    Args:
        operator: Operator that the skill carries out.
        template: Template of the dense part of the skill's reward.
        policy: Policy that was learned.
        horizon: Environment steps of the policy at most.
        record: Record of the training, figures by name: success, vacuity, steps, seed, what it
            began from.
    """

    operator: LiftedOperator
    template: RewardTemplate
    policy: MlpPolicy
    horizon: int
    record: Mapping[str, Any] = field(default_factory=dict, compare=False)

    @property
    def folder_name(self) -> str:
        """The name of the skill's folder: the operator's name and digest."""
        return skill_folder_name(self.operator)

    def in_domain(self, domain: Domain) -> LearnedSkill:
        """The skill, to be executed."""
        return LearnedSkill(self.operator, self.policy, domain, self.horizon)


@dataclass(frozen=True)
class SkillLibrary:
    """Skills of a domain.

    Args:
        domain: Name of the domain.
        skills: Skills that could be read, in order of their folders.
        record: Record of how the library was made: preset, goal, command, settings, progress.
        refused: Errors that say why the other skills were not read.
    """

    domain: str
    skills: tuple[AcquiredSkill, ...] = ()
    record: Mapping[str, Any] = field(default_factory=dict)
    refused: tuple[InvalidLibraryError, ...] = ()

    @property
    def digest(self) -> str:
        """A hash of what was learned, 16 hexadecimal digits; empty where that is nothing."""
        if not self.skills:
            return ""
        whole = sha256()
        for skill in self.skills:
            policy = skill.policy
            run_as = f"{skill.folder_name} {skill.horizon} {policy.activation} {policy.squashed}"
            whole.update(run_as.encode() + save(policy_tensors(policy)))
        return whole.hexdigest()[:16]


def save_skill_library(path: Path, library: SkillLibrary) -> None:
    """Write a library as a folder, in place of the one that may be there."""
    about = {"format": FORMAT, "domain": library.domain, **library.record}
    skills = {skill.folder_name: skill for skill in library.skills}
    write_library(path, about, skills, save_skill)


def load_skill_library(path: Path, domain: Domain) -> SkillLibrary:
    """Read a library.

    Raises:
        InvalidLibraryError: There is none, or it is damaged as a whole, newer than this version,
            another domain's, or one of shortcuts.
    """
    about = read_library_record(path)
    if about["domain"] != domain.name:
        raise InvalidLibraryError(
            f"{path}: skills of domain {about['domain']!r}, not of {domain.name!r}"
        )
    skills, refused = read_members(path, lambda folder: load_skill(folder, domain))
    return SkillLibrary(domain.name, skills, record_of(about), refused)


def read_library_record(path: Path) -> dict[str, Any]:
    """Read the facts about a library, without its skills.

    Raises:
        InvalidLibraryError: There is none, or it is damaged, newer than this version, or a library
            of shortcuts.
    """
    return read_about(path, SKILL, FORMAT, "slap acquire DOMAIN", "acquire the skills again")


# -- one skill ------------------------------------------------------------------------------------


def save_skill(folder: Path, skill: AcquiredSkill) -> None:
    """Write one skill into a folder, which is made where there is none."""
    folder.mkdir(parents=True, exist_ok=True)
    stored = save_policy(folder / POLICY, skill.policy)
    write_object(
        folder / SKILL,
        {
            "operator": operator_data(skill.operator),
            "reward": template_data(skill.template),
            "key": signature_of(skill.operator).as_json(),
            "horizon": skill.horizon,
            "record": dict(skill.record),
            **stored,
        },
    )


def load_skill(folder: Path, domain: Domain) -> AcquiredSkill:
    """Read one skill.

    Args:
        folder: Folder of the skill, named after it where it is part of a library.
        domain: Domain whose types, predicates and metrics the skill uses.

    Raises:
        InvalidLibraryError: It is damaged, or of another domain.
    """
    about = read_object(folder / SKILL)
    try:
        operator = read_operator(about["operator"], domain)
        template = read_template(about["reward"], operator, domain)
        check_template(template, operator)
        horizon, record = int(about["horizon"]), dict(about["record"])
        if not 1 <= horizon <= MAX_HORIZON:
            raise ValueError(f"its horizon is {horizon:.3g} steps")
    except (InvalidDomainError, InvalidRewardError) as error:
        raise InvalidLibraryError(f"{folder / SKILL}: does not fit together: {error}") from error
    except (LookupError, TypeError, ValueError, AttributeError, OverflowError) as error:
        raise InvalidLibraryError(
            f"{folder / SKILL}: damaged, or of another domain than {domain.name}: {error!r}"
        ) from error
    policy = load_policy(folder / POLICY, about, SKILL)
    skill = AcquiredSkill(operator, template, policy, horizon, record)
    _require_fit(skill, folder, domain)
    return skill


def _require_fit(skill: AcquiredSkill, folder: Path, domain: Domain) -> None:
    """Refuse a renamed skill, and a policy of other observations or actions."""
    if folder.name not in (skill.folder_name, skill.operator.name):
        raise InvalidLibraryError(
            f"{folder}: the operator inside is {skill.folder_name}; the folder was renamed or the "
            "file changed"
        )
    size, actions = skill.policy.normalisation.mean.size, skill.policy.log_std.size
    expected = ActionMap(domain, gripper=True).size
    if (size, actions) != (SIZE, expected):
        raise InvalidLibraryError(
            f"{folder}: the policy observes {size} features and has {actions} actions, skills of "
            f"{domain.name} have {SIZE} and {expected}: learned with another version of slap_ros, "
            "acquire it again"
        )
