# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Whole episodes of a skill as states and actions, in memory and on disk.

States are kept, not what was observed or paid in them: both can be computed again when a reward
changes, and for any grounding.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from safetensors import SafetensorError
from safetensors.numpy import load, save

from slap_ros.files import parse_json, read_bytes, write_whole
from slap_ros.learning.work_folder import damaged
from slap_ros.relational import Layout, Object, Type
from slap_ros.relational.state import Array
from slap_ros.skills.groundings import Grounding, Groundings, Indices

ABOUT = "groundings"  # name of a tensor of the file whose bytes are JSON
MAX_EPISODE_BYTES = 2**30


@dataclass(frozen=True)
class Episodes:
    """The states and actions of e whole episodes of a skill.

    Args:
        states: States, shape (e, steps + 1, width), rows as in
            :class:`~slap_ros.skills.groundings.Groundings`.
        actions: Actions of the policy, from -1 to 1, shape (e, steps, actions).
        numbers: Number of the grounding of each episode, shape (e,).
        groundings: Groundings to which the numbers belong.
    """

    states: Array
    actions: NDArray[np.float32]
    numbers: Indices
    groundings: Groundings

    @property
    def transitions(self) -> int:
        """Environment steps, all episodes together."""
        count, steps, _ = self.actions.shape
        return int(count * steps)


def save_episodes(path: Path, episodes: Episodes) -> None:
    """Write episodes to a file. One that is there stays whole until the new one is."""
    about = json.dumps(_groundings_data(episodes.groundings)).encode()
    content = save(
        {
            "states": np.ascontiguousarray(episodes.states),
            "actions": np.ascontiguousarray(episodes.actions),
            "numbers": episodes.numbers.astype(np.int64),
            ABOUT: np.frombuffer(about, dtype=np.uint8),
        }
    )
    write_whole(path, content)


def load_episodes(path: Path, types: Mapping[str, Type]) -> Episodes:
    """Read what :func:`save_episodes` wrote.

    Args:
        path: Path of the file.
        types: Types of the domain, by name.

    Returns:
        The episodes.

    Raises:
        InvalidParameterError: The file is damaged, or of another domain.
    """
    try:
        tensors = load(read_bytes(path, MAX_EPISODE_BYTES))
        groundings = _groundings(parse_json(tensors[ABOUT].tobytes()), types)
        episodes = Episodes(
            tensors["states"], tensors["actions"], tensors["numbers"].astype(np.intp), groundings
        )
        _require_fit(episodes)
        return episodes
    except (OSError, SafetensorError, LookupError, TypeError, ValueError) as error:
        raise damaged(path, error, "remove its folder to learn this skill again") from error


def _require_fit(episodes: Episodes) -> None:
    """Raise ``ValueError`` where the parts of episodes do not fit together."""
    count, steps, _ = episodes.actions.shape
    if episodes.states.shape != (count, steps + 1, episodes.groundings.width):
        raise ValueError(f"states of shape {episodes.states.shape}")
    known = len(episodes.groundings.groundings)
    if episodes.numbers.shape != (count,) or not (episodes.numbers >= 0).all():
        raise ValueError(f"numbers of shape {episodes.numbers.shape}")
    if (episodes.numbers >= known).any() or not np.isfinite(episodes.states).all():
        raise ValueError("numbers of groundings that are not there, or states that are not finite")


def _groundings_data(groundings: Groundings) -> dict[str, object]:
    layouts = list(dict.fromkeys(grounding.layout for grounding in groundings.groundings))
    return {
        "layouts": [[(obj.name, obj.type.name) for obj in layout.objects] for layout in layouts],
        "groundings": [
            [layouts.index(grounding.layout), [obj.name for obj in grounding.objects]]
            for grounding in groundings.groundings
        ],
    }


def _groundings(data: Any, types: Mapping[str, Type]) -> Groundings:
    layouts = [
        Layout.of(tuple(Object(str(name), types[kind]) for name, kind in objects))
        for objects in data["layouts"]
    ]
    found = []
    for number, names in data["groundings"]:
        layout = layouts[int(number)]
        found.append(Grounding(layout, tuple(layout.by_name[name] for name in names)))
    return Groundings(found)
