# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Episodes as a data set of LeRobot, layout v3.0 (https://huggingface.co/docs/lerobot).

A frame is a state together with the command that was taken in it. So the last state of an episode,
which no command follows, is no frame.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from slap_ros.bags.episode_arrays import EpisodeArrays
from slap_ros.bags.export.lerobot_feature import LeRobotFeature
from slap_ros.errors import InvalidParameterError
from slap_ros.files import pretty_json

if TYPE_CHECKING:
    import pyarrow

VERSION = "v3.0"
CHUNK_SIZE = 1000  # files of a folder at most; there is one
DATA_MB, VIDEO_MB = 100, 200  # of a file, when LeRobot adds episodes
DATA = "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet"
EPISODES = "meta/episodes/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet"
FIRST_FILE = {"chunk_index": 0, "file_index": 0}
ABOUT = "meta/slap_ros.json"  # what LeRobot has no place for


Features = Mapping[str, LeRobotFeature]


def write_lerobot(path: Path, episodes: Sequence[EpisodeArrays]) -> None:
    """Write a data set; numbers are rounded to float32, as is usual there.

    Args:
        path: Name of its folder.
        episodes: What to write; those in which no command was taken are left out.

    Raises:
        InvalidParameterError: The episodes differ in their objects or in their period, none has a
            command, or a command is missing on the way.
        OSError: It cannot be written.
    """
    moving = [episode for episode in episodes if len(episode) > 1]
    _require_alike(moving)
    tasks = list(dict.fromkeys(_task(episode) for episode in moving))
    features = _features(moving, tasks)
    bounds = np.cumsum([0, *(len(episode) - 1 for episode in moving)]).tolist()
    frames = {name: feature.column() for name, feature in features.items()}
    _write_table(path / DATA.format(**FIRST_FILE), frames)
    _write_table(path / EPISODES.format(**FIRST_FILE), _episode_rows(moving, features, bounds))
    _write_tasks(path / "meta/tasks.parquet", tasks)
    _write_json(path / "meta/info.json", _info(moving, tasks, features))
    statistics = {n: one.statistics() for n, one in features.items() if one.dtype != "string"}
    _write_json(path / "meta/stats.json", statistics)
    _write_json(path / ABOUT, [episode.about() for episode in moving])


def _require_alike(episodes: Sequence[EpisodeArrays]) -> None:
    if not episodes:
        raise InvalidParameterError("no command was recorded, so there is no frame for LeRobot")
    first = episodes[0]
    for number, episode in enumerate(episodes):
        if episode.domain != first.domain or episode.control_period_s != first.control_period_s:
            raise InvalidParameterError(
                f"a LeRobot data set is of one domain and one period, not of {first.domain} "
                f"({first.control_period_s} s) and {episode.domain} ({episode.control_period_s} s)"
            )
        if (episode.state_names, episode.atom_names) != (first.state_names, first.atom_names):
            raise InvalidParameterError(
                f"the episodes 0 and {number} have different objects, and LeRobot wants the same "
                "numbers in every frame; export them apart, or as npz, csv or parquet"
            )
        if np.isnan(episode.actions[:-1]).any():
            row = int(np.argmax(np.isnan(episode.actions).any(axis=1)))
            raise InvalidParameterError(
                f"episode {number}: no command was recorded that leads on from step "
                f"{episode.steps[row]}, and every frame of LeRobot has one"
            )


def _task(episode: EpisodeArrays) -> str:
    """What was to be done, in words: LeRobot's policies read it."""
    return " and ".join(episode.goal) if episode.goal else episode.domain


def _features(episodes: Sequence[EpisodeArrays], tasks: Sequence[str]) -> Features:
    """The features of all frames, by name."""
    first = episodes[0]
    lengths = [len(episode) - 1 for episode in episodes]
    features = _observations(episodes)
    frame = np.concatenate([np.arange(length) for length in lengths])
    last = np.concatenate([np.arange(length) == length - 1 for length in lengths])
    task = [tasks.index(_task(episode)) for episode in episodes]
    single = {
        "next.reward": ("float32", np.concatenate([_rewards(e) for e in episodes])),
        "next.done": ("bool", last),
        "next.success": ("bool", np.concatenate([_reached(e) for e in episodes])),
        "option": ("string", np.concatenate([e.options[:-1] for e in episodes])),
        "timestamp": ("float32", frame * first.control_period_s),
        "frame_index": ("int64", frame),
        "episode_index": ("int64", np.repeat(np.arange(len(episodes)), lengths)),
        "index": ("int64", np.arange(len(frame))),
        "task_index": ("int64", np.repeat(task, lengths)),
    }
    actions = np.concatenate([episode.actions[:-1] for episode in episodes])
    features["action"] = LeRobotFeature("float32", first.action_names, actions)
    if first.atom_names:
        atoms = np.concatenate([episode.atoms[:-1] for episode in episodes])
        features["atoms"] = LeRobotFeature("bool", first.atom_names, atoms)
    return features | {n: LeRobotFeature(kind, None, v) for n, (kind, v) in single.items()}


def _observations(episodes: Sequence[EpisodeArrays]) -> dict[str, LeRobotFeature]:
    """What is seen of the robot, and of everything else, as far as there are both."""
    robot = episodes[0].of_robot
    parts = {"observation.state": robot, "observation.environment_state": ~robot}
    if not robot.any():  # the domain does not say what is the robot
        parts = {"observation.state": ~robot}
    states = np.concatenate([episode.states[:-1] for episode in episodes])
    names = np.array(episodes[0].state_names)
    return {
        name: LeRobotFeature("float32", tuple(names[part].tolist()), states[:, part])
        for name, part in parts.items()
        if part.any()
    }


def _rewards(episode: EpisodeArrays) -> NDArray[np.float64]:
    """The reward of each frame; 0 where no goal is known, as statistics must be numbers."""
    return np.nan_to_num(episode.rewards[:-1])


def _reached(episode: EpisodeArrays) -> NDArray[np.bool_]:
    """Whether the goal holds in the state that follows each frame."""
    if episode.goal is None:
        return np.zeros(len(episode) - 1, dtype=bool)
    columns = [episode.atom_names.index(atom) for atom in episode.goal]
    holds: NDArray[np.bool_] = np.all(episode.atoms[1:, columns], axis=1)
    return holds


def _episode_rows(
    episodes: Sequence[EpisodeArrays], features: Features, bounds: Sequence[int]
) -> dict[str, list[Any]]:
    """Where each episode lies, and the statistics of its features."""
    rows: dict[str, list[Any]] = {
        "episode_index": list(range(len(episodes))),
        "tasks": [[_task(episode)] for episode in episodes],
        "length": [len(episode) - 1 for episode in episodes],
        "data/chunk_index": [0] * len(episodes),
        "data/file_index": [0] * len(episodes),
        "dataset_from_index": list(bounds[:-1]),
        "dataset_to_index": list(bounds[1:]),
        "meta/episodes/chunk_index": [0] * len(episodes),
        "meta/episodes/file_index": [0] * len(episodes),
    }
    for name, feature in features.items():
        if feature.dtype != "string":
            for start, end in pairwise(bounds):
                for statistic, values in feature.rows(start, end).statistics().items():
                    rows.setdefault(f"stats/{name}/{statistic}", []).append(values)
    return rows


def _info(
    episodes: Sequence[EpisodeArrays], tasks: Sequence[str], features: Features
) -> dict[str, Any]:
    rate = 1.0 / episodes[0].control_period_s
    return {
        "codebase_version": VERSION,
        "robot_type": episodes[0].domain,
        "total_episodes": len(episodes),
        "total_frames": sum(len(episode) - 1 for episode in episodes),
        "total_tasks": len(tasks),
        "chunks_size": CHUNK_SIZE,
        "data_files_size_in_mb": DATA_MB,
        "video_files_size_in_mb": VIDEO_MB,
        "fps": round(rate) if abs(rate - round(rate)) < 1e-9 else rate,
        "splits": {"train": f"0:{len(episodes)}"},
        "data_path": DATA,
        "video_path": None,
        "features": {name: feature.as_json() for name, feature in features.items()},
    }


def _write_tasks(path: Path, tasks: Sequence[str]) -> None:
    """The tasks with their numbers, so that pandas finds the texts in the index."""
    import pyarrow

    numbers = {"name": "task_index", "field_name": "task_index", "pandas_type": "int64"}
    texts = {"name": "task", "field_name": "task", "pandas_type": "unicode"}
    index = {
        "index_columns": ["task"],
        "column_indexes": [],
        "columns": [
            numbers | {"numpy_type": "int64", "metadata": None},
            texts | {"numpy_type": "object", "metadata": None},
        ],
        "pandas_version": "2.0.0",
    }
    table = pyarrow.table({"task_index": range(len(tasks)), "task": list(tasks)})
    _write_arrow(path, table.replace_schema_metadata({"pandas": json.dumps(index)}))


def _write_table(path: Path, columns: Mapping[str, Any]) -> None:
    import pyarrow

    _write_arrow(path, pyarrow.table(dict(columns)))


def _write_arrow(path: Path, table: pyarrow.Table) -> None:
    from pyarrow import parquet

    path.parent.mkdir(parents=True, exist_ok=True)
    parquet.write_table(table, path)


def _write_json(path: Path, value: Any) -> None:
    path.write_text(pretty_json(value) + "\n", encoding="utf-8")
