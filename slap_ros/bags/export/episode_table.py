# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Episodes as tables: a row per state, a column per number, with names that tell what it is."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from slap_ros.bags.episode_arrays import EpisodeArrays
from slap_ros.errors import InvalidParameterError

Columns = dict[str, NDArray[Any]]  # by name, all of the same length


def episode_columns(episode: EpisodeArrays) -> Columns:
    """The columns of an episode, a row per state.

    ``step``, ``stamp_ns``, the features of objects as ``block1.x``, the command that was taken as
    ``action.x``, the atoms as ``On(block1, target)``, then ``perceived``, ``reward``, ``option``
    and ``option_kind``. See :class:`EpisodeArrays`.

    Raises:
        InvalidParameterError: Two columns would have the same name.
    """
    columns: Columns = {}
    for name, column in _named_columns(episode):
        if name in columns:
            raise InvalidParameterError(
                f"two columns of {episode.domain} would be named {name}; export it as npz"
            )
        columns[name] = column
    return columns


def episode_tables(episodes: Iterable[EpisodeArrays]) -> list[Columns]:
    """The columns of each episode, preceded by those that tell the episodes apart.

    These are ``episode`` (from 0), ``bag``, ``domain``, ``preset``, ``seed``, ``index``, ``goal``
    and ``success``; what is not known is None.

    Raises:
        InvalidParameterError: Two columns would have the same name.
    """
    return [
        {name: _repeated(value, len(episode)) for name, value in _labels(number, episode)}
        | episode_columns(episode)
        for number, episode in enumerate(episodes)
    ]


def column_names(tables: Iterable[Columns]) -> list[str]:
    """The names of all columns that any of the tables has, in order of appearance."""
    return list(dict.fromkeys(name for table in tables for name in table))


def column_units(episodes: Iterable[EpisodeArrays]) -> Mapping[str, str]:
    """The units of those columns that have one, by name."""
    units = {"stamp_ns": "ns"}
    for episode in episodes:
        units |= zip(episode.state_names, episode.state_units, strict=True)
        units |= zip(_action_columns(episode), episode.action_units, strict=True)
    return units


def _labels(number: int, episode: EpisodeArrays) -> Iterator[tuple[str, Any]]:
    run = episode.metrics
    yield "episode", number
    yield "bag", episode.bag
    yield "domain", episode.domain
    yield "preset", episode.preset
    yield "seed", run.seed if run is not None else None
    yield "index", run.index if run is not None else None
    yield "goal", None if episode.goal is None else " & ".join(episode.goal)
    yield "success", run.success if run is not None else None


def _repeated(value: Any, rows: int) -> NDArray[Any]:
    return np.full(rows, value, dtype=object if value is None else None)


def _named_columns(episode: EpisodeArrays) -> Iterator[tuple[str, NDArray[Any]]]:
    yield "step", episode.steps
    yield "stamp_ns", episode.stamps_ns
    yield from zip(episode.state_names, episode.states.T, strict=True)
    yield from zip(_action_columns(episode), episode.actions.T, strict=True)
    yield from zip(episode.atom_names, episode.atoms.T, strict=True)
    yield "perceived", episode.perceived
    yield "reward", episode.rewards
    yield "option", episode.options
    yield "option_kind", episode.option_kinds


def _action_columns(episode: EpisodeArrays) -> Sequence[str]:
    return [f"action.{name}" for name in episode.action_names]
