# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A run's bag is the one that an ensemble records, and can be loaded as arrays."""

import subprocess
import sys

import numpy as np
import pandas as pd
import pytest

import slap_ros
from slap_ros.bags import bag_digest, bag_info, evaluate_bag, replay_bag
from slap_ros.errors import BagExistsError, DamagedBagError, InvalidParameterError
from slap_ros.planning.plan import Plan
from slap_ros.report import read_report, render


def recorded(folder, *arguments):
    """A bag of ``slap run``, all nodes in one process."""
    command = [sys.executable, "-m", "ensemble.cli", "run", *arguments, "--in-process"]
    subprocess.run([*command, "--record", str(folder)], check=True, timeout=120)
    return folder


@pytest.mark.slow
def test_it_has_the_digest_of_the_ensembles_own(bag, network, tmp_path):
    by_nodes = recorded(tmp_path / "by_nodes", "obstacle2d", "--seed", "1")
    assert bag_digest(bag) == bag_digest(by_nodes)
    topics = [{topic.name for topic in bag_info(b).topics} for b in (bag, by_nodes)]
    assert topics[0] == topics[1] - {"/diagnostics"}  # which come by the clock, if a run lasts
    assert bag_info(bag).metadata == bag_info(by_nodes).metadata


def test_metrics_from_the_bag_are_those_of_the_run(bag, run, plan):
    found = evaluate_bag(bag)
    (metrics,) = found.runs
    assert (metrics.success, metrics.plan_length) == (run.success, run.steps)
    assert metrics.shortcut_steps == run.episode.shortcut_steps
    assert [option.steps for option in metrics.options] == [edge.steps for edge in run.edges]
    assert metrics.planning_seconds == pytest.approx(plan.seconds, abs=1e-6)
    assert metrics.edges_rolled_out == plan.edges_rolled_out
    assert metrics.bound == plan.bound == 1.0
    assert (metrics.seed, metrics.index) == (1, 0)
    assert not metrics.unknown
    assert not found.mismatches
    assert found.compared == run.steps + 1
    assert found.damage is None


def test_the_bag_replays_bit_for_bit_and_can_be_reported(bag, run):
    result = replay_bag(bag)
    assert result.identical
    assert result.compared == run.steps + 1
    page = render([read_report(bag)])
    assert f"solved in {run.steps} steps" in page


def test_a_bag_is_not_overwritten(run, bag):
    with pytest.raises(BagExistsError):
        run.bag(bag)


def test_a_replaced_plan_is_in_the_bag_as_well(domain, task, plan, tmp_path):
    wrong = Plan(plan.plan.edges[-1:])
    run = slap_ros.execute(domain, task, wrong)
    (metrics,) = evaluate_bag(run.bag(tmp_path / "replanned")).runs
    assert metrics.success
    assert metrics.replans == run.episode.replans == 1
    assert metrics.plan_length == run.steps

    given_up = slap_ros.execute(domain, task, wrong, max_replans=0)
    found = evaluate_bag(given_up.bag(tmp_path / "given_up"))
    assert not found.runs[0].success
    assert found.runs[0].error_msg == given_up.error
    assert found.damage is None


def test_arrays_have_names_for_all_their_columns(bag, run, domain, task):
    loaded = slap_ros.load_bag(bag)
    features = [
        f"{obj.name}.{feature.name}"
        for obj in task.initial_state.objects
        for feature in obj.type.features
    ]
    assert list(loaded.state_names) == features
    assert np.array_equal(loaded.states, np.stack([state.data for state in run.states]))
    assert loaded.actions.shape == (run.steps + 1, len(loaded.action_names))
    assert np.array_equal(loaded.actions[:-1], np.stack(run.actions))
    assert np.isnan(loaded.actions[-1]).all()
    space = domain.atom_space(task.initial_state)
    assert loaded.atoms.shape == (run.steps + 1, len(loaded.atom_names))
    for state, row in zip(run.states, loaded.atoms, strict=True):
        held = {str(atom) for atom in space.decode(space.abstract(state))}
        assert {n for n, holds in zip(loaded.atom_names, row, strict=True) if holds} == held
    assert loaded.goal == tuple(sorted(map(str, task.goal)))
    assert loaded.options.tolist() == [
        *(f"{e.option}({', '.join(e.objects)})" for e in run.edges for _ in range(e.steps)),
        "",
    ]
    period_ns = round(domain.execution.control_period_s * 1e9)
    assert set(np.diff(loaded.stamps_ns[1:])) == {period_ns}
    assert (loaded.domain, loaded.metrics.seed) == ("obstacle2d", 1)


def test_an_archive_of_numpy_gives_the_same_again(bag, tmp_path):
    loaded = slap_ros.load_bag(bag)
    path = loaded.to_npz(tmp_path / "run.npz")
    with np.load(path, allow_pickle=False) as archive:
        for name in ("states", "actions", "atoms", "state_names", "action_names", "atom_names"):
            stored, own = archive[f"episode_0/{name}"], getattr(loaded, name)
            assert np.array_equal(stored, own, equal_nan=name == "actions")
    with pytest.raises(InvalidParameterError, match="npz"):
        loaded.to_npz(tmp_path / "run.csv")
    with pytest.raises(InvalidParameterError, match="exists"):
        loaded.to_npz(path)


def test_a_table_has_a_row_per_state(bag, run):
    loaded = slap_ros.load_bag(bag)
    table = loaded.to_pandas()
    assert table.index.tolist() == list(range(run.steps + 1))
    column = loaded.states[:, loaded.state_names.index("robot.x")]
    assert table["robot.x"].tolist() == column.tolist()
    axis = f"action.{loaded.action_names[0]}"
    assert table[axis].isna().tolist() == [False] * run.steps + [True]
    assert table[list(loaded.goal)].iloc[-1].all()


def test_without_pandas_it_says_what_is_missing(bag, monkeypatch):
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(InvalidParameterError, match="pip install pandas"):
        slap_ros.load_bag(bag).to_pandas()


def test_what_is_no_bag_is_refused(tmp_path, bag):
    with pytest.raises(DamagedBagError):
        slap_ros.load_bag(tmp_path)
    with pytest.raises(InvalidParameterError, match="no episode 2"):
        slap_ros.load_bag(bag, episode=2)


def test_a_warning_names_the_line_that_called(tmp_path, bag):
    (whole,) = bag.glob("*.mcap")
    cut = tmp_path / whole.name
    cut.write_bytes(whole.read_bytes()[:-200])
    with pytest.warns(UserWarning, match="is damaged") as told:
        slap_ros.load_bag(cut)
    assert [warning.filename for warning in told] == [__file__]


def test_a_video_is_written(run, tmp_path):
    path = run.video(tmp_path / "run.gif", size=(160, 120))
    assert path.read_bytes()[:3] == b"GIF"
    with pytest.raises(InvalidParameterError, match="ends in"):
        run.video(tmp_path / "run.txt")


@pytest.mark.parametrize("size", [3, (160,), (161, 120), (160, 120.5), (0, 120), (9999, 120), "ab"])
def test_a_video_of_a_size_that_cannot_be_is_refused(run, tmp_path, size):
    with pytest.raises(InvalidParameterError, match="size must be two even numbers of pixels"):
        run.video(tmp_path / "run.gif", size=size)
    assert not list(tmp_path.iterdir())


def test_rows_of_trials_are_a_table():
    domain = slap_ros.make("obstacle2d")
    rows = slap_ros.evaluate(domain, None, tasks=2, seeds=1)
    table = pd.DataFrame(rows)
    assert table["approach"].tolist() == ["pure_planning"] * 2
    assert table["success"].all()
    assert table["plan_length"].tolist() == [row.plan_length for row in rows]
