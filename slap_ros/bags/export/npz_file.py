# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Episodes as one numpy archive: every array by name, with the names of its columns."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from slap_ros.bags.episode_arrays import EpisodeArrays

ARRAYS = (  # of an episode, under its own names
    "steps",
    "stamps_ns",
    "states",
    "state_names",
    "state_units",
    "of_robot",
    "actions",
    "action_names",
    "action_units",
    "atoms",
    "atom_names",
    "perceived",
    "rewards",
    "options",
    "option_kinds",
)


def write_npz(path: Path, episodes: Sequence[EpisodeArrays]) -> None:
    """Write a numpy archive.

    Its arrays are ``episode_0/states`` and so on, as :class:`EpisodeArrays` has them. The array
    ``about`` is a JSON text: a list of what else there is to say of each episode.

    Args:
        path: Name of the file, whatever its ending.
        episodes: What to write.

    Raises:
        OSError: It cannot be written.
    """
    arrays: dict[str, NDArray[Any]] = {
        "about": np.array(json.dumps([episode.about() for episode in episodes], allow_nan=False))
    }
    for number, episode in enumerate(episodes):
        arrays |= {f"episode_{number}/{name}": array for name, array in _arrays(episode).items()}
    with path.open("wb") as file:  # numpy would add its ending to a name
        np.savez_compressed(file, **arrays)  # type: ignore[arg-type]


def _arrays(episode: EpisodeArrays) -> Mapping[str, NDArray[Any]]:
    return {name: np.asarray(getattr(episode, name)) for name in ARRAYS}
