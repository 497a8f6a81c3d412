# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The MDP of a shortcut (SLAP §4.2) for any learner, as shortcuts of our own are learned in it."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from slap_ros.core import Domain
from slap_ros.environments.mdp_env import MdpEnv
from slap_ros.errors import InvalidLibraryError, InvalidParameterError
from slap_ros.learning.vec_env import VecEnv, VecEnvStep
from slap_ros.learning.work_folder import WorkFolder
from slap_ros.shortcuts.exploration_result import ExplorationResult
from slap_ros.shortcuts.named_settings import training_settings
from slap_ros.shortcuts.shipped import chosen_library
from slap_ros.shortcuts.shortcut_vec_env import ShortcutVecEnv
from slap_ros.shortcuts.signature import Signature
from slap_ros.shortcuts.starts import Start, find_start, restore_starts
from slap_ros.skills.domain_choice import DomainChoice, open_domain

EXPLORED = "explored"  # what a work folder has of its candidates


class ShortcutEnv(MdpEnv[Start]):
    """Episodes of one shortcut: they end at its target, where it is lost, or at the horizon."""

    def __init__(
        self,
        domain: str,
        preset: str = "",
        *,
        shortcut: str = "",
        shortcuts: str = "",
        settings: str = "ours",
        beyond: bool = False,
    ) -> None:
        """Choose a shortcut, and look for where it begins.

        Args:
            domain: Name of the domain.
            preset: Preset, maybe with settings, as ``fair:obstacles=4``; empty for the first.
            shortcut: Name of the shortcut, or how it begins; empty for the first.
            shortcuts: Folder of a library, or work folder of a training, whose candidates count;
                empty for the library that ships.
            settings: Name of the training settings with the rewards and the horizon.
            beyond: Whether the shortcut leads to states that operators alone do not reach.

        Raises:
            InvalidParameterError: There is no such preset, shortcut or library.
            InvalidLibraryError: The library cannot be used.
            InvalidStateError: It begins in none of many tasks.
        """
        self.domain = open_domain(DomainChoice(domain, preset))
        chosen = training_settings(settings, self.domain)
        self._rewards, self._horizon = chosen.rewards_in(0), chosen.horizon
        self.signature = _named(shortcut, signatures(self.domain, shortcuts), domain)
        self._beyond = beyond
        self._open: dict[object, ShortcutVecEnv] = {}
        super().__init__(self.signature.name)

    def _find(self, seed: int, index: int) -> Start | None:
        record = find_start(self.domain, seed, index, self.signature, None, {}, beyond=self._beyond)
        return None if record is None else restore_starts(self.domain, [record])[0]

    def _begin(self, start: Start) -> VecEnv:
        """The environment over the start's objects, whose world is kept."""
        key = (start.space.layout.objects, start.space.static_truth, start.change)
        if key not in self._open:
            rng = np.random.default_rng(0)  # draws nothing: there is one start
            self._open[key] = ShortcutVecEnv(
                self.domain, self.signature, [start], 1, self._horizon, self._rewards, rng
            )
        self._open[key].begin(start)
        return self._open[key]

    def _success(self, step: VecEnvStep) -> bool:
        return bool(step.success[0])


def signatures(domain: Domain, shortcuts: str) -> dict[str, Signature]:
    """The signatures of a library, or of the candidates in a work folder, by name.

    Args:
        domain: Domain of the shortcuts.
        shortcuts: Folder of either; empty for the library that ships.

    Raises:
        InvalidLibraryError: It cannot be used.
        InvalidParameterError: What is in the work folder is damaged.
    """
    if shortcuts and (Path(shortcuts) / f"{EXPLORED}.json").exists():
        explored = WorkFolder(Path(shortcuts)).cached(
            EXPLORED, list, lambda data: [ExplorationResult.from_json(one) for one in data]
        )
        found = [candidate.signature for result in explored for candidate in result.candidates]
    else:
        library = chosen_library(shortcuts, domain)
        found = [] if library is None else [one.signature for one in library.shortcuts]
        if library is not None and not found:
            reasons = "; ".join(map(str, library.refused)) or "it has none"
            raise InvalidLibraryError(f"{shortcuts}: no shortcut of it can be used: {reasons}")
    return {signature.name: signature for signature in found}


def _named(shortcut: str, known: dict[str, Signature], domain: str) -> Signature:
    """The signature of a name, or of the one name that begins so.

    Raises:
        InvalidParameterError: There is none, or several.
    """
    if not known:
        raise InvalidParameterError(
            f"no shortcuts ship for {domain}: give shortcuts, a folder that `slap train {domain}` "
            "made"
        )
    if not shortcut:
        return next(iter(known.values()))
    named = [known[shortcut]] if shortcut in known else []
    named = named or [one for name, one in known.items() if name.startswith(shortcut)]
    if len(named) != 1:
        what = "unknown" if not named else "several"
        raise InvalidParameterError(f"{what} shortcut {shortcut!r}; there are {', '.join(known)}")
    return named[0]
