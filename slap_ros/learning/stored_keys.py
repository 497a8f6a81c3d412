# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Names of fields in files: libraries and work folders keep the keys of their first version.

A field may be renamed in the code; what was written before must still be read, and is written the
same way again. So every field whose key differs from its name is listed here, by class.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from typing import Any

KEYS: Mapping[str, Mapping[str, str]] = {
    "CandidateGroup": {"operator_path": "origin", "relative_saving": "promise"},
    "ExplorationResult": {"candidates": "finds", "pairs": "candidates"},
    "ExplorationSettings": {"action_repeat": "hold"},
    "PpoSettings": {
        "n_envs": "environments",
        "n_steps": "rollout_steps",
        "n_epochs": "epochs",
        "gamma": "discount",
        "ent_coef": "entropy",
        "log_std_init": "log_std",
        "net_arch": "hidden",
    },
    "Progress": {"failure": "lost"},
    "Rewards": {"success": "done", "failure": "lost", "gamma": "discount"},
    "SacSettings": {
        "n_envs": "environments",
        "net_arch": "hidden",
        "critic_net_arch": "critic_hidden",
        "train_freq": "steps_per_update",
        "gamma": "discount",
        "ent_coef": "entropy_weight",
        "learning_starts": "random_steps",
        "buffer_size": "capacity",
    },
    "Sampling": {"batch": "crowd", "alternatives": "ends"},
    "ShortcutCandidate": {"operator_path": "origin", "expected_saving": "promise"},
    "TrainingSettings": {"polish_rewards": "careful"},
}


def to_json(value: Any) -> Any:
    """Dataclasses as dictionaries under their stored keys, and what is in them likewise."""
    if hasattr(value, "as_json"):
        return value.as_json()
    if isinstance(value, Mapping):
        return {name: to_json(item) for name, item in value.items()}
    if isinstance(value, tuple | list):
        return [to_json(item) for item in value]
    return stored(value) if is_dataclass(value) else value


def stored(instance: Any) -> dict[str, Any]:
    """The fields of a dataclass instance under their stored keys, in the order of the fields."""
    keys = KEYS.get(type(instance).__name__, {})
    return {
        keys.get(field.name, field.name): to_json(getattr(instance, field.name))
        for field in fields(instance)
    }


def field_name(cls: type, key: str) -> str:
    """The field that a key stands for; a field's own name stands for itself."""
    keys = KEYS.get(cls.__name__, {})
    if key in {field.name for field in fields(cls)}:
        return key
    return next((name for name, stored_key in keys.items() if stored_key == key), key)


def restored(cls: type, data: Mapping[str, Any]) -> dict[str, Any]:
    """Stored values under the names of a dataclass's fields; unknown keys stay as they are."""
    names = {key: name for name, key in KEYS.get(cls.__name__, {}).items()}
    return {names.get(key, key): value for key, value in data.items()}
