# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A training that goes on for another goal: with its critics, its replay buffer and its rounds.

All groundings of a lifted operator share one replay buffer (LG-SAIL Alg. 1), those of earlier goals
as well. So a skill that is learned further does not forget what it was learned for before. Some
episodes begin in states in which earlier ones began, too.
"""

from __future__ import annotations

import shutil
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from slap_ros.acquisition.training.episodes import load_episodes
from slap_ros.acquisition.training.skill_env import Initiation
from slap_ros.acquisition.training.skill_training import episodes_path, rounds_in
from slap_ros.relational import State, Type


def continue_training(earlier: Path, folder: Path) -> None:
    """Let a folder go on with an earlier training, which stays as it is.

    Args:
        earlier: Folder of the training until now, whose rounds are over.
        folder: Folder of the training from now on; one that is there goes on already.
    """
    if folder.exists():
        return
    draft = folder.with_name(f".{folder.name}.draft")
    shutil.rmtree(draft, ignore_errors=True)
    shutil.copytree(earlier, draft)
    draft.rename(folder)


def earlier_starts(earlier: Path, types: Mapping[str, Type], most: int) -> list[Initiation]:
    """States in which episodes of an earlier training began, evenly from its whole length.

    Args:
        earlier: Folder of the training.
        types: Types of the domain, by name.
        most: Number of states at most.

    Returns:
        Different states.

    Raises:
        InvalidParameterError: The folder is damaged.
    """
    segments = sum(len(one.segments) for one in rounds_in(earlier))
    begun: dict[tuple[object, bytes], Initiation] = {}
    for number in range(segments):
        episodes = load_episodes(episodes_path(earlier, number), types)
        for which, states in zip(episodes.numbers, episodes.states, strict=True):
            grounding = episodes.groundings.groundings[which]
            data = states[0, : grounding.layout.size].copy()
            start = Initiation(State(grounding.layout, data), grounding.objects)
            begun.setdefault((grounding, data.tobytes()), start)
    different = list(begun.values())
    chosen = np.linspace(0, len(different) - 1, min(most, len(different))).round()
    return [different[int(i)] for i in chosen]
