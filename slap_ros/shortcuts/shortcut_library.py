# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Shortcut libraries on disk: a folder per shortcut, readable without torch, never a pickle.

::

    models/shortcuts/obstacle_tower/
      library.json               format, domain, preset, versions, the command that made it
      NothingOn_On-8fbd5384/
        shortcut.json            signature, shortest success, training record
        policy.safetensors       weights and normalisation

What is damaged is not used: a shortcut that cannot be read is refused with a reason, and the rest
of the library is used without it. A library of another domain or of a newer format is refused as
a whole.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from hashlib import sha256
from pathlib import Path
from typing import Any

from safetensors.numpy import save

from slap_ros.core import Domain
from slap_ros.errors import InvalidLibraryError
from slap_ros.files import write_whole
from slap_ros.policies.library_files import (
    ABOUT,
    SHORTCUT,
    load_policy,
    object_text,
    policy_tensors,
    read_about,
    read_members,
    read_object,
    record_of,
    run_as,
    save_policy,
    write_library,
    write_object,
)
from slap_ros.policies.mlp_policy import MlpPolicy
from slap_ros.relational import State
from slap_ros.shortcuts.observation_layout import observation_layout
from slap_ros.shortcuts.shortcut import Shortcut
from slap_ros.shortcuts.shortcut_actions import make_action_map
from slap_ros.shortcuts.signature import Signature

FORMAT = 1
MAX_SHORTEST = 1_000_000  # environment steps; attempts are a multiple of them long
POLICY = "policy.safetensors"
CHECKED = "checked"  # key of a record: other skills over which the shortcuts were found to hold

Record = Mapping[str, Any]


@dataclass(frozen=True)
class ShortcutLibrary:
    """Shortcuts of a domain.

    Args:
        domain: Name of the domain.
        shortcuts: Shortcuts that could be read, in order of their names.
        record: Record of how the library was made.
        refused: Errors that say why the other shortcuts were not read.
    """

    domain: str
    shortcuts: tuple[Shortcut, ...] = ()
    record: Record = field(default_factory=dict)
    refused: tuple[InvalidLibraryError, ...] = ()

    @property
    def digest(self) -> str:
        """A hash of what was learned, 16 hexadecimal digits; empty where that is nothing."""
        if not self.shortcuts:
            return ""
        whole = sha256()
        for shortcut in self.shortcuts:
            policy = _learned(shortcut)
            run = f" {policy.activation} {policy.squashed}" if run_as(policy) else ""
            whole.update(f"{shortcut.name}{run}".encode() + save(policy_tensors(policy)))
        return whole.hexdigest()[:16]

    @property
    def skills_digest(self) -> str:
        """The digest of the skills that it was learned over; empty where none were acquired."""
        skills = self.record.get("skills")
        return str(skills.get("digest", "")) if isinstance(skills, Mapping) else ""

    def usable_over(self, skills_digest: str) -> bool:
        """Whether it was learned over these skills, or was found to hold over them.

        What was found counts for the shortcuts that were checked, and for no others.

        Args:
            skills_digest: Digest of acquired skills; empty for a domain's own.
        """
        return skills_digest == self.skills_digest or any(
            check.get("skills_digest") == skills_digest and check.get("library") == self.digest
            for check in self._checks
        )

    @property
    def _checks(self) -> list[Mapping[str, Any]]:
        checks = self.record.get(CHECKED)
        if not isinstance(checks, list):
            return []
        return [check for check in checks if isinstance(check, Mapping)]

    def checked(self, found: Mapping[str, Any]) -> ShortcutLibrary:
        """The library, whose record says what a check found.

        Args:
            found: Findings of the check: ``skills_digest`` and ``library``, the digest of the
                shortcuts that hold over these skills, and how that was found.
        """
        others = [c for c in self._checks if c.get("skills_digest") != found["skills_digest"]]
        return replace(self, record={**self.record, CHECKED: [*others, dict(found)]})


def save_library(path: Path, library: ShortcutLibrary) -> None:
    """Write a library as a folder, in place of the one that may be there."""
    shortcuts = {shortcut.name: shortcut for shortcut in library.shortcuts}
    write_library(path, _about(library), shortcuts, save_shortcut)


def save_library_record(path: Path, library: ShortcutLibrary) -> None:
    """Write the record of a library that is there; its shortcuts stay as they are.

    Raises:
        OSError: It cannot be written; the old record is untouched.
    """
    write_whole(path / ABOUT, object_text(_about(library)))


def _about(library: ShortcutLibrary) -> dict[str, Any]:
    return {"format": FORMAT, "domain": library.domain, **library.record}


def load_library(path: Path, domain: Domain) -> ShortcutLibrary:
    """Read a library.

    Raises:
        InvalidLibraryError: There is none, or it is damaged as a whole, newer than this version,
            another domain's, or one of skills.
    """
    about = read_about(path, SHORTCUT, FORMAT, f"slap train {domain.name}", "train again")
    if about["domain"] != domain.name:
        raise InvalidLibraryError(
            f"{path}: a library of domain {about['domain']!r}, not of {domain.name!r}"
        )

    state = domain.task(0).initial_state

    def load(folder: Path) -> Shortcut:
        shortcut = load_shortcut(folder)
        _require_fit(shortcut, folder, domain, state)
        return shortcut

    shortcuts, refused = read_members(path, load)
    return ShortcutLibrary(domain.name, shortcuts, record_of(about), refused)


def _require_fit(shortcut: Shortcut, folder: Path, domain: Domain, state: State) -> None:
    """Refuse a policy whose observations or actions are not those of the domain in a state."""
    layout = observation_layout(domain, shortcut.signature, state)
    size = _learned(shortcut).normalisation.mean.size
    if layout is not None and layout.size != size:
        raise InvalidLibraryError(
            f"{folder}: the policy has {size} observed features, {domain.name} has {layout.size}: "
            "learned with another version of slap_ros; train again"
        )
    actions = make_action_map(domain, shortcut.signature).size
    commanded = _learned(shortcut).log_std.size
    if commanded != actions:
        raise InvalidLibraryError(
            f"{folder}: the policy has {commanded} actions, shortcuts of this "
            f"kind in {domain.name} have {actions}"
        )


def _learned(shortcut: Shortcut) -> MlpPolicy:
    """The policy of a shortcut, which libraries have only if it was learned."""
    if not isinstance(shortcut.policy, MlpPolicy):
        raise InvalidLibraryError(f"{shortcut.name} has no learned policy that could be stored")
    return shortcut.policy


# -- one shortcut ---------------------------------------------------------------------------------


def save_shortcut(folder: Path, shortcut: Shortcut) -> None:
    """Write one shortcut into a folder, which is made where there is none."""
    folder.mkdir(parents=True, exist_ok=True)
    stored = save_policy(folder / POLICY, _learned(shortcut))
    write_object(
        folder / SHORTCUT,
        {
            "signature": shortcut.signature.as_json(),
            "shortest": shortcut.shortest,
            **({"horizon": shortcut.horizon} if shortcut.horizon > 1 else {}),
            "record": dict(shortcut.record),
            **stored,
        },
    )


def load_shortcut(folder: Path) -> Shortcut:
    """Read one shortcut.

    Raises:
        InvalidLibraryError: It is damaged.
    """
    about = read_object(folder / SHORTCUT)
    try:
        signature = Signature.from_json(about["signature"])
        shortest, record = int(about["shortest"]), dict(about["record"])
        horizon = int(about.get("horizon", 1))
        if not 1 <= shortest <= MAX_SHORTEST:
            raise ValueError(f"its shortest success has {shortest:.3g} steps")
        if not 1 <= horizon <= MAX_SHORTEST:
            raise ValueError(f"it is tried out for {horizon:.3g} steps")
    except (LookupError, TypeError, ValueError, OverflowError) as error:
        raise InvalidLibraryError(f"{folder / SHORTCUT}: damaged: {error!r}") from error
    if signature.name != folder.name:
        raise InvalidLibraryError(
            f"{folder}: the signature inside is that of {signature.name}; the folder was renamed "
            "or the file changed"
        )
    policy = load_policy(folder / POLICY, about, SHORTCUT)
    return Shortcut(signature, policy, shortest, record, horizon)
