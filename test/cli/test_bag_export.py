# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``slap bag export``: a file that other tools read, or one clear line and no file."""

import shutil
import sys
from pathlib import Path

import numpy as np
import pytest

from slap_ros.bags import read_episodes
from support.slap_command import slap

BAG = Path(__file__).parent.parent / "bags" / "data" / "recorded_by_0.1.0"


def export(*arguments):
    return slap("bag", "export", *arguments)


@pytest.fixture
def no_pyarrow(monkeypatch):
    """As on a machine without it: Python finds no module of that name."""
    monkeypatch.setitem(sys.modules, "pyarrow", None)


def test_several_bags_become_one_file_without_pyarrow(tmp_path, no_pyarrow):
    output = tmp_path / "made" / "out.npz"
    ran = export(BAG, BAG, "--output", output)
    assert ran.exit_code == 0, ran.stderr
    assert ran.stdout == ""
    assert "episodes: 2, states: 28" in ran.stderr
    (episode,) = read_episodes(BAG)
    with np.load(output) as found:
        assert np.array_equal(found["episode_1/states"], episode.states)


@pytest.mark.parametrize("name", ["parquet", "lerobot"])
def test_without_pyarrow_the_extra_is_named(tmp_path, name, no_pyarrow):
    output = tmp_path / ("out.parquet" if name == "parquet" else "out")
    ran = export(BAG, "--output", output, "--format", name)
    assert ran.exit_code == 15
    assert "pip install 'slap_ros[export]'" in ran.stderr
    assert not any(tmp_path.iterdir())


def test_refusals_leave_nothing_behind(tmp_path):
    damaged = shutil.copytree(BAG, tmp_path / "damaged")
    (data,) = damaged.glob("*.mcap")
    data.write_bytes(data.read_bytes()[: data.stat().st_size // 2])
    (tmp_path / "there.csv").write_text("mine")
    before = sorted(tmp_path.iterdir())
    for bag, output, options, code, words in (
        (damaged, "out.csv", (), 90, "is damaged"),
        (tmp_path / "none", "out.csv", (), 90, "there is no bag"),
        (BAG, "there.csv", (), 15, "exists; choose another name"),
        (BAG, "out.h5", ("--format", "hdf5"), 15, "there is no format 'hdf5'"),
        (BAG, "out", (), 15, "name one of npz, csv, parquet, lerobot"),
        (BAG, "there.csv/out", ("--format", "lerobot"), 5, "there.csv"),
    ):
        ran = export(bag, "--output", tmp_path / output, *options)
        assert ran.exit_code == code, ran.stderr
        (line,) = ran.stderr.strip().splitlines()
        assert words in line
        assert sorted(tmp_path.iterdir()) == before
    assert (tmp_path / "there.csv").read_text() == "mine"
