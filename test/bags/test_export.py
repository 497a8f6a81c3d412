# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Exported numbers are the recorded ones, as each format's own readers find them."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import pyarrow.parquet
import pytest

from slap_ros.bags import EpisodeArrays, read_episodes
from slap_ros.bags.export import choose_format, export_episodes, require_exportable
from slap_ros.errors import InvalidParameterError, StorageFullError
from support.truthful_run import Script, record

OTHER_INDEX = 2  # of a task of the same seed with fewer blocks


@pytest.fixture(scope="module")
def two_runs(tmp_path_factory: pytest.TempPathFactory) -> list[EpisodeArrays]:
    """Two episodes of one bag, with the same objects. Shared: not to be changed."""
    script = Script(seed=7)
    script.run()
    script.episode = 2
    script.run()
    path = tmp_path_factory.mktemp("export") / "two"
    record(path, script.messages)
    return read_episodes(path)


@pytest.fixture(scope="module")
def other_objects(tmp_path_factory: pytest.TempPathFactory) -> EpisodeArrays:
    """An episode with fewer blocks. Shared: not to be changed."""
    script = Script(seed=7)
    script.run(index=OTHER_INDEX)
    path = tmp_path_factory.mktemp("export") / "other"
    record(path, script.messages)
    (episode,) = read_episodes(path)
    return episode


def export(episodes: list[EpisodeArrays], output: Path, name: str) -> Path:
    form = choose_format(name, output)
    require_exportable(form, output)
    export_episodes(episodes, output, form)
    assert [path.name for path in output.parent.iterdir()] == [output.name]  # no draft is left
    return output


def test_npz_has_every_array_and_all_names(two_runs: list[EpisodeArrays], tmp_path: Path) -> None:
    path = export(two_runs, tmp_path / "out.npz", "npz")
    with np.load(path, allow_pickle=False) as found:
        assert json.loads(str(found["about"])) == [episode.about() for episode in two_runs]
        for number, episode in enumerate(two_runs):
            for name in ("steps", "stamps_ns", "states", "actions", "atoms", "rewards"):
                array = found[f"episode_{number}/{name}"]
                assert array.dtype == getattr(episode, name).dtype
                assert array.tobytes() == getattr(episode, name).tobytes()
            for name in ("state_names", "state_units", "action_names", "atom_names", "options"):
                assert found[f"episode_{number}/{name}"].tolist() == list(getattr(episode, name))


def test_about_tells_goal_seed_and_versions(two_runs: list[EpisodeArrays]) -> None:
    about = json.loads(json.dumps(two_runs[1].about(), allow_nan=False))
    assert about["goal"] == ["On(block1, target)"]
    assert about["number"] == 2
    assert about["run"]["seed"] == 7
    assert about["metadata"]["revision"] == "0123456789ab-dirty"
    assert about["bag"] == "two"


def test_csv_reads_back_to_the_last_bit(two_runs: list[EpisodeArrays], tmp_path: Path) -> None:
    path = export(two_runs, tmp_path / "out.csv", "csv")
    with path.open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == sum(len(episode) for episode in two_runs)
    for number, episode in enumerate(two_runs):
        own = [row for row in rows if row["episode"] == str(number)]
        assert [int(row["step"]) for row in own] == episode.steps.tolist()
        assert [int(row["stamp_ns"]) for row in own] == episode.stamps_ns.tolist()
        for column, name in enumerate(episode.state_names):
            assert [float(row[name]) for row in own] == episode.states[:, column].tolist()
        for column, name in enumerate(episode.action_names):
            texts = [row[f"action.{name}"] for row in own]
            assert [float(text) for text in texts[:-1]] == episode.actions[:-1, column].tolist()
            assert texts[-1] == ""
        for column, name in enumerate(episode.atom_names):
            assert [row[name] for row in own] == [str(t) for t in episode.atoms[:, column]]
        assert [row["option"] for row in own] == episode.options.tolist()
        assert {row["seed"] for row in own} == {"7"}
        assert {row["goal"] for row in own} == {"On(block1, target)"}


def test_parquet_has_types_units_and_metadata(
    two_runs: list[EpisodeArrays], tmp_path: Path
) -> None:
    table = pyarrow.parquet.read_table(export(two_runs, tmp_path / "out.parquet", "parquet"))
    assert table.num_rows == sum(len(episode) for episode in two_runs)
    first = two_runs[0]
    for column, name in enumerate(first.state_names):
        found = table[name].to_numpy()[: len(first)]
        assert found.tobytes() == np.ascontiguousarray(first.states[:, column]).tobytes()
    atoms = np.column_stack([table[name].to_numpy() for name in first.atom_names])
    assert np.array_equal(atoms, np.concatenate([episode.atoms for episode in two_runs]))
    assert pyarrow.types.is_boolean(table.schema.field("On(block1, target)").type)
    assert table.schema.field("block1.x").metadata == {b"unit": b"m"}
    assert table.schema.field("action.x").metadata == {b"unit": b"m"}
    about = json.loads(table.schema.metadata[b"slap_ros"])
    assert about == [episode.about() for episode in two_runs]


def test_what_an_episode_has_not_is_null(
    two_runs: list[EpisodeArrays], other_objects: EpisodeArrays, tmp_path: Path
) -> None:
    path = export([two_runs[0], other_objects], tmp_path / "out.parquet", "parquet")
    table = pyarrow.parquet.read_table(path)
    (name, *_) = set(two_runs[0].state_names) - set(other_objects.state_names)
    nulls = table[name].is_null().to_pylist()
    assert nulls == [False] * len(two_runs[0]) + [True] * len(other_objects)


def lerobot_columns(path: Path) -> dict[str, np.ndarray]:
    table = pyarrow.parquet.read_table(path / "data/chunk-000/file-000.parquet")
    return {name: np.array(table[name].to_pylist()) for name in table.column_names}


def test_lerobot_frames_are_states_with_their_commands(
    two_runs: list[EpisodeArrays], tmp_path: Path
) -> None:
    frames = lerobot_columns(export(two_runs, tmp_path / "set", "lerobot"))
    robot = two_runs[0].of_robot
    states = np.concatenate([episode.states[:-1] for episode in two_runs]).astype(np.float32)
    assert np.array_equal(frames["observation.state"], states[:, robot])
    assert np.array_equal(frames["observation.environment_state"], states[:, ~robot])
    actions = np.concatenate([episode.actions[:-1] for episode in two_runs]).astype(np.float32)
    assert np.array_equal(frames["action"], actions)
    lengths = [len(episode) - 1 for episode in two_runs]
    assert frames["index"].tolist() == list(range(sum(lengths)))
    assert frames["episode_index"].tolist() == [0] * lengths[0] + [1] * lengths[1]
    ends = np.cumsum(lengths) - 1
    for name in ("next.done", "next.success", "next.reward"):
        assert np.flatnonzero(frames[name]).tolist() == ends.tolist()
    assert np.allclose(frames["timestamp"], frames["frame_index"] * two_runs[0].control_period_s)
    assert frames["option"].tolist() == [o for e in two_runs for o in e.options[:-1]]


def test_lerobot_layout_is_that_of_version_3(two_runs: list[EpisodeArrays], tmp_path: Path) -> None:
    """What LeRobot's own reader goes by: files, dtypes, shapes, bounds, tasks, statistics."""
    path = export(two_runs, tmp_path / "set", "lerobot")
    info = json.loads((path / "meta/info.json").read_text())
    assert info["codebase_version"] == "v3.0"
    assert info["fps"] == 10
    assert (info["total_episodes"], info["total_tasks"]) == (2, 1)
    data = path / info["data_path"].format(chunk_index=0, file_index=0)
    schema = pyarrow.parquet.read_schema(data)
    assert set(info["features"]) == set(schema.names)
    types = {"float32": "float", "int64": "int64", "bool": "bool", "string": "string"}
    for name, feature in info["features"].items():
        (size,) = feature["shape"]
        assert feature["names"] is None or len(feature["names"]) == size
        kind = schema.field(name).type
        if size > 1:
            assert kind.list_size == size
            kind = kind.value_type
        assert str(kind) == types[feature["dtype"]], name
    episodes = pyarrow.parquet.read_table(path / "meta/episodes/chunk-000/file-000.parquet")
    lengths = [len(episode) - 1 for episode in two_runs]
    assert episodes["length"].to_pylist() == lengths
    assert episodes["dataset_from_index"].to_pylist() == [0, lengths[0]]
    assert episodes["dataset_to_index"].to_pylist() == [lengths[0], sum(lengths)]
    assert episodes["tasks"].to_pylist() == [["On(block1, target)"]] * 2
    assert info["total_frames"] == sum(lengths) == pyarrow.parquet.read_table(data).num_rows
    tasks = pyarrow.parquet.read_table(path / "meta/tasks.parquet")
    assert tasks.to_pydict() == {"task_index": [0], "task": ["On(block1, target)"]}
    assert json.loads(tasks.schema.metadata[b"pandas"])["index_columns"] == ["task"]


def test_lerobot_statistics_are_those_of_the_frames(
    two_runs: list[EpisodeArrays], tmp_path: Path
) -> None:
    path = export(two_runs, tmp_path / "set", "lerobot")
    frames = lerobot_columns(path)
    whole = json.loads((path / "meta/stats.json").read_text())
    assert set(whole) == set(frames) - {"option"}
    rows = pyarrow.parquet.read_table(path / "meta/episodes/chunk-000/file-000.parquet")
    second = frames["episode_index"] == 1
    for name, statistics in whole.items():
        values = frames[name].reshape(len(second), -1).astype(float)
        assert statistics["count"] == [len(values)]
        assert np.allclose(statistics["min"], values.min(axis=0))
        assert np.allclose(statistics["mean"], values.mean(axis=0))
        assert np.allclose(statistics["std"], values.std(axis=0))
        assert np.allclose(statistics["q50"], np.median(values, axis=0))
        own = rows[f"stats/{name}/max"].to_pylist()[1]
        assert np.allclose(own, values[second].max(axis=0))


def test_lerobot_refuses_other_objects_and_missing_commands(
    two_runs: list[EpisodeArrays], other_objects: EpisodeArrays, script: Script, tmp_path: Path
) -> None:
    def refuses(episodes: list[EpisodeArrays], words: str) -> None:
        with pytest.raises(InvalidParameterError, match=words):
            export_episodes(episodes, tmp_path / "set", choose_format("lerobot", tmp_path / "set"))
        assert list(tmp_path.iterdir()) == [tmp_path / "bag"]

    lost = [m for m in script.messages if m.topic != "/slap/command" or m.message.step != 5]
    record(tmp_path / "bag", lost)
    refuses(read_episodes(tmp_path / "bag"), "leads on from step 5")
    refuses([two_runs[0], other_objects], "different objects")


def test_outputs_that_cannot_be_are_refused(tmp_path: Path) -> None:
    for name, output, words in (
        ("hdf5", "out.h5", "no format 'hdf5'; name one of npz, csv, parquet, lerobot"),
        (None, "out", "does not tell a format"),
        ("csv", "out.npz", "ends in .csv"),
    ):
        with pytest.raises(InvalidParameterError, match=words):
            choose_format(name, tmp_path / output)
    assert choose_format(None, tmp_path / "out.parquet").name == "parquet"
    for there in (tmp_path / "there.csv", tmp_path / "there"):
        there.mkdir() if there.suffix == "" else there.write_text("mine")
        form = choose_format("csv" if there.suffix else "lerobot", there)
        with pytest.raises(InvalidParameterError, match="exists; choose another"):
            require_exportable(form, there)
    assert (tmp_path / "there.csv").read_text() == "mine"


def test_what_appears_meanwhile_is_left_alone(
    two_runs: list[EpisodeArrays], tmp_path: Path
) -> None:
    (tmp_path / "out.csv").write_text("mine")
    form = choose_format("csv", tmp_path / "out.csv")
    with pytest.raises(StorageFullError, match="exists"):
        export_episodes(two_runs, tmp_path / "out.csv", form)
    assert [path.read_text() for path in tmp_path.iterdir()] == ["mine"]
