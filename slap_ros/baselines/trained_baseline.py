# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Trained baselines on disk: a folder each, readable without torch, never a pickle.

::

    runs/baselines/obstacle2d-ppo/
      baseline.json          method, domain, preset, environment, how it was trained
      policy.safetensors     weights
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from safetensors.numpy import save

from slap_ros.core import Domain
from slap_ros.errors import InvalidLibraryError, InvalidStateError
from slap_ros.policies.library_files import (
    load_policy,
    policy_tensors,
    read_object,
    replace_folder,
    save_policy,
    write_object,
)
from slap_ros.policies.mlp_policy import MlpPolicy

FORMAT = 1
BASELINE, POLICY = "baseline.json", "policy.safetensors"
ENVIRONMENT = ("obs", "control", "reward")
MAX_NOISE = 10.0  # scale of the noise, against that of training


@dataclass(frozen=True)
class TrainedBaseline:
    """A policy for whole tasks, and how it was learned.

    Args:
        method: Name of the method.
        domain: Name of the domain.
        preset: Preset of the tasks that it was learned on.
        goal: Goal of these tasks, by name or as atoms; None for each task's own.
        environment: Arguments of the environment that it acts in, beside domain and preset.
        policy: Policy that was learned.
        noise: Scale of the noise that it acts with: 1 for that of training, 0 for none.
        record: Record of the training: figures by name.
    """

    method: str
    domain: str
    preset: str
    goal: str | None
    environment: Mapping[str, str]
    policy: MlpPolicy
    noise: float
    record: Mapping[str, Any] = field(default_factory=dict)

    @property
    def name(self) -> str:
        """What the rows of tables are called."""
        return self.method.replace("-", "_")

    @property
    def digest(self) -> str:
        """A hash of the policy's tensors, 16 hexadecimal digits.

        How they are run (the activation, whether actions are squashed) is the method's, and not in
        it: published results name SAC's and SOL's policies by this hash.
        """
        return sha256(save(policy_tensors(self.policy))).hexdigest()[:16]

    @property
    def features(self) -> int:
        """Number of features that the policy sees."""
        return int(self.policy.normalisation.mean.size)

    @property
    def actions(self) -> int:
        """Number of values in an action."""
        return int(self.policy.log_std.size)

    def act(self, observation: Any, rng: np.random.Generator) -> NDArray[np.float32]:
        """The action for an observation of the environment, from -1 to 1.

        Args:
            observation: Vector of features, or a dictionary of them.
            rng: Generator that draws the noise.
        """
        batch = in_a_row(observation)[None]
        action: NDArray[np.float32] = self.policy.sample(batch, rng, self.noise)[0].clip(-1.0, 1.0)
        return action

    def require_fit(self, features: int, actions: int) -> None:
        """Refuse an environment with other observations or actions.

        Args:
            features: Number of features in its observations.
            actions: Number of values in its actions.

        Raises:
            InvalidStateError: Says how many there are, and how many the baseline has.
        """
        if (features, actions) != (self.features, self.actions):
            raise InvalidStateError(
                f"{self.method} was learned on {self.features} features and {self.actions} "
                f"actions; here are {features} and {actions}"
            )


def in_a_row(observation: Any) -> NDArray[np.float32]:
    """An observation as one vector; the parts of a dictionary in the order of their names."""
    if isinstance(observation, Mapping):
        return np.concatenate([observation[name] for name in sorted(observation)])
    return np.asarray(observation, dtype=np.float32)


def save_baseline(path: Path, baseline: TrainedBaseline) -> None:
    """Write a baseline as a folder, in place of the one that may be there."""

    def write(folder: Path) -> None:
        stored = save_policy(folder / POLICY, baseline.policy)
        about = {
            "format": FORMAT,
            "method": baseline.method,
            "domain": baseline.domain,
            "preset": baseline.preset,
            "goal": baseline.goal,
            "environment": dict(baseline.environment),
            "noise": baseline.noise,
            "record": dict(baseline.record),
            **stored,
        }
        write_object(folder / BASELINE, about)

    replace_folder(path, write)


def load_baseline(path: Path, domain: Domain) -> TrainedBaseline:
    """Read a baseline.

    Raises:
        InvalidLibraryError: There is none, or it is damaged, of another domain, or of another
            format; the message names the file.
    """
    if not (path / BASELINE).is_file():
        raise InvalidLibraryError(
            f"{path}: no trained baseline; `slap baseline train METHOD {domain.name}` makes one"
        )
    about = read_object(path / BASELINE)
    if about.get("format") != FORMAT:
        raise InvalidLibraryError(
            f"{path / BASELINE}: format {about.get('format')!r}, this version of slap_ros reads "
            f"{FORMAT}; train again or use the version of slap_ros that made it"
        )
    if about.get("domain") != domain.name:
        raise InvalidLibraryError(
            f"{path}: a baseline of domain {about.get('domain')!r}, not of {domain.name!r}"
        )
    try:
        return _restored(about, load_policy(path / POLICY, about, BASELINE))
    except (LookupError, TypeError, ValueError, AttributeError) as error:
        raise InvalidLibraryError(f"{path / BASELINE}: damaged: {error!r}") from error


def _restored(about: Mapping[str, Any], policy: MlpPolicy) -> TrainedBaseline:
    """The baseline of a file's content; raises where it is not as it was written."""
    goal, noise = about["goal"], float(about["noise"])
    environment = {name: str(about["environment"][name]) for name in ENVIRONMENT}
    if not 0.0 <= noise <= MAX_NOISE:
        raise ValueError(f"its noise is {noise:.3g}")
    return TrainedBaseline(
        str(about["method"]),
        str(about["domain"]),
        str(about["preset"]),
        None if goal is None else str(goal),
        environment,
        policy,
        noise,
        dict(about["record"]),
    )
