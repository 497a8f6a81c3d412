# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Loading a bag as arrays."""

from __future__ import annotations

from pathlib import Path

from slap_ros.api.argument_kinds import checks_arguments
from slap_ros.api.left_out import warn_caller
from slap_ros.bags.episode_arrays import EpisodeArrays, episode_arrays
from slap_ros.bags.evaluate import read_runs
from slap_ros.errors import InvalidParameterError
from slap_ros.relational.articles import counted


@checks_arguments
def load_bag(
    path: Path | str, episode: int | None = None, namespace: str | None = None
) -> EpisodeArrays:
    """Load an episode of a bag as NumPy arrays with names.

    The bag may be one of :meth:`Run.bag <slap_ros.api.execution.Run.bag>`, of ``slap run
    --record``, or of ``ros2 bag record``. Each run in it is an episode. Of a damaged bag, a
    warning says what is missing.

    Args:
        path: Folder of the bag, or a single ``.mcap`` or ``.db3`` file, compressed or not.
        episode: Index of the episode, from 0; None for the only one.
        namespace: Namespace of the ensemble whose episodes are counted, such as ``/robot1``; None
            for all ensembles in the bag, one after the other.

    Returns:
        States, actions and atoms by step, each with the names of its columns; ``to_pandas()`` is
        one table of all, ``to_npz(path)`` one file.

    Raises:
        DamagedBagError: Nothing can be read, or there is no domain or no state in it.
        ForeignBagError: The bag is not of an ensemble, or of another version of one.
        InvalidParameterError: There is no such ensemble or episode, or more than one episode to
            choose from.
    """
    contents = read_runs(path, namespace)
    if contents.damage is not None:
        warn_caller(f"{path} is damaged: {contents.damage}")
    episodes = episode_arrays(contents)
    if episode is None and len(episodes) > 1:
        raise InvalidParameterError(f"{path} has {len(episodes)} episodes: say which, from 0")
    if not 0 <= (episode or 0) < len(episodes):
        there = counted(len(episodes), "episode")
        raise InvalidParameterError(f"{path} has {there}, and no episode {episode}")
    return episodes[episode or 0]
