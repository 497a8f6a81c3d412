# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Anybody's policy in an evaluation, by ``module:factory``: code of the person who names it."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from importlib import import_module
from pathlib import Path
from traceback import extract_tb
from types import MappingProxyType
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from slap_ros.errors import InvalidLibraryError

# Arguments of the environment, unless the policy has others as its attribute ``environment``.
USUAL: Mapping[str, str] = MappingProxyType(
    {"obs": "state", "control": "joints", "reward": "sparse"}
)


class PredictingPolicy(Protocol):
    """What a factory returns: a model of stable-baselines3, or anything like it."""

    def predict(self, observation: Any) -> Any:
        """The action for an observation of the environment, or a tuple that begins with it."""
        ...


@dataclass(frozen=True)
class ImportedPolicy:
    """A policy that a function of a module returns, made in each process that uses it.

    Args:
        source: Module and function, as ``module:factory``.
        domain: Name of the domain.
        preset: Preset of the tasks.
        environment: Arguments of the environment that it acts in, beside domain and preset.
    """

    source: str
    domain: str
    preset: str
    environment: Mapping[str, str]

    @classmethod
    def of(cls, source: str, domain: str, preset: str) -> ImportedPolicy:
        """The policy of a source, imported from here or from what is installed.

        Args:
            source: Module and function, as ``module:factory``.
            domain: Name of the domain.
            preset: Preset of the tasks.

        Raises:
            InvalidLibraryError: There is no such function, or what it returns has no ``predict``.
        """
        chosen = getattr(_made(source), "environment", {})
        if not isinstance(chosen, Mapping) or not chosen.keys() <= USUAL.keys():
            raise InvalidLibraryError(
                f"{source}: its environment is {chosen!r}; it may be a mapping of "
                f"{', '.join(USUAL)}"
            )
        return cls(source, domain, preset, {**USUAL, **chosen})

    @property
    def name(self) -> str:
        """What the rows of tables are called."""
        return self.source

    def act(self, observation: Any, rng: np.random.Generator) -> Any:
        """The action for an observation; see :class:`PredictingPolicy`.

        Raises:
            InvalidLibraryError: The policy fails, or gives something else than numbers.
        """
        del rng
        try:
            answer = _made(self.source).predict(observation)
        except (Exception, SystemExit) as error:  # code of others may raise anything
            at = extract_tb(error.__traceback__)[-1]
            raise InvalidLibraryError(
                f"{self.source}: predict failed: {error!r}, in {Path(at.filename).name}, line "
                f"{at.lineno}"
            ) from error
        action = answer[0] if isinstance(answer, tuple) else answer
        try:
            return _as_action(action)
        except (TypeError, ValueError) as error:
            raise InvalidLibraryError(
                f"{self.source}: predict gave {action!r:.80}, which is no action"
            ) from error

    def require_fit(self, features: int, actions: int) -> None:
        """Nothing is known of it before it acts; an action that does not fit is refused then."""


def _as_action(action: Any) -> NDArray[np.float64] | int:
    """Numbers of an action, or the number of a skill."""
    numbers = np.asarray(action)
    return int(numbers) if numbers.ndim == 0 else numbers.astype(np.float64)


@lru_cache(maxsize=8)
def _made(source: str) -> PredictingPolicy:
    """What the function returns; the folder that a command runs in is searched first."""
    module, _, name = source.partition(":")
    here = str(Path.cwd())
    if here not in sys.path:
        sys.path.insert(0, here)
    try:
        policy = getattr(import_module(module), name)()
    except Exception as error:  # code of others may raise anything
        raise InvalidLibraryError(
            f"{source}: cannot be made: {type(error).__name__}: {error}"
        ) from error
    if not callable(getattr(policy, "predict", None)):
        raise InvalidLibraryError(f"{source}: {type(policy).__name__} has no predict(observation)")
    made: PredictingPolicy = policy
    return made
