# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The paper's figures: their numbers are those of experiments, their files are made again alike."""

import json
import shlex
import xml.etree.ElementTree as ET
from dataclasses import replace
from itertools import product
from pathlib import Path

import numpy as np
import pytest

from ensemble.cli.application import COMMANDS
from slap_ros.domains import get_domain
from slap_ros.errors import InvalidParameterError
from slap_ros.evaluation.approaches import approaches
from slap_ros.evaluation.experiment import Experiment
from slap_ros.files import pretty_json
from slap_ros.learning.task_distribution import TaskDistribution
from slap_ros.planning.graph_planner import GraphPlanner
from slap_ros.shortcuts import jobs
from slap_ros.shortcuts.exploration_result import ExplorationResult
from slap_ros.shortcuts.named_settings import training_settings
from slap_ros.shortcuts.sampling import Sampling
from slap_ros.shortcuts.shortcut_library import load_library, save_shortcut
from slap_ros.shortcuts.work_folder import ShortcutWorkFolder
from slap_ros.skills.domain_choice import DomainChoice
from slap_ros.studies.job_runner import JobRunner
from slap_ros.studies.reproducing import published
from slap_ros.studies.results import Provenance
from slap_ros.studies.slap import perception, pruning
from slap_ros.studies.slap.trainings import TrainingFolder, read_curve
from slap_ros.studies.slap.variations import Variation, offered, parse_variation
from slap_ros.studies.study_log import StudyLog
from support.slap_command import slap
from support.study_helpers import without_seconds

PUBLISHED = Path(__file__).parent.parent.parent / "docs" / "results"
LIBRARY = Path(__file__).parent.parent / "shortcuts" / "data" / "obstacle2d"
DOMAIN = get_domain("obstacle2d")
SAMPLES = 2
PLANNING = ["--first-seed", 0, "--shortcuts", LIBRARY, "--samples", SAMPLES]
ALONE = ["--shortcuts", "none"]  # learning curves alone


def study(folder, *arguments):
    """Make a study; its data."""
    name, domain, *_ = arguments
    result = slap("study", *arguments, "--output", folder)
    assert result.exit_code == 0, result.stderr
    return json.loads((folder / f"{name}_{domain}.json").read_text())


def refusal(*arguments):
    """How a study is refused: exit code and message."""
    result = slap("study", *arguments)
    return result.exit_code, " ".join(result.stderr.split())


def compared(preset="fair"):
    """The domain, and each approach by name."""
    domain = get_domain("obstacle2d", preset)
    chosen = approaches(load_library(LIBRARY, domain), Sampling(samples=SAMPLES))
    return domain, {approach.name: approach for approach in chosen}


# -- generalisation -------------------------------------------------------------------------------


@pytest.mark.slow
def test_generalisation_has_the_numbers_of_the_experiments(tmp_path):
    data = study(tmp_path, "generalisation", "obstacle2d", "--tasks", 2, "--seeds", 2, *PLANNING)
    conditions = {one["preset"]: one for one in data["found"]["conditions"]}
    assert list(conditions) == ["fair", *(f"fair:bystanders={count}" for count in (0, 1, 2))]
    for preset in ("fair", "fair:bystanders=2"):
        domain, by_name = compared(preset)
        experiment = Experiment(domain, 2, 2)
        rows = conditions[preset]["approaches"]
        assert [row["approach"] for row in rows] == ["pure_planning", "slap"]
        for row in rows:
            episodes = [experiment.run(*which, by_name[row["approach"]]) for which in experiment]
            lengths = [episode.plan_length for episode in episodes]
            assert [trial["plan_length"] for trial in row["trials"]] == lengths
            assert row["plan_length"]["mean"] == pytest.approx(np.mean(lengths))
            assert row["plan_length"]["sd"] == pytest.approx(np.std(lengths, ddof=1))
            assert row["success_rate"] == np.mean([episode.success for episode in episodes])
            pure = sum(trial["plan_length"] for trial in rows[0]["trials"])
            assert row["relative_length"] == pytest.approx(sum(lengths) / pure)
    assert conditions["fair"]["approaches"][-1]["relative_length"] < 1.0


def test_a_task_without_a_plan_counts_as_failed_and_is_told_of(tmp_path, monkeypatch):
    *others, _max_nodes = GraphPlanner.__init__.__defaults__
    monkeypatch.setattr(GraphPlanner.__init__, "__defaults__", (*others, 9))
    arguments = ["generalisation", "obstacle2d", "--tasks", 1, "--seeds", 3, *PLANNING]
    arguments += ["--vary", "bystanders=0,1", "--output", tmp_path]
    result = slap("study", *arguments)
    assert result.exit_code == 0, result.stderr
    assert "slap: seed 0, task 0 not solved: more than 9 abstract states" in result.stderr
    data = json.loads((tmp_path / "generalisation_obstacle2d.json").read_text())
    few, more = data["found"]["conditions"][1:]
    assert [row["success_rate"] for row in few["approaches"]] == [1.0, 1.0]
    assert [row["success_rate"] for row in more["approaches"]] == [0.0, 0.0]
    assert more["approaches"][0]["plan_length"] == {"mean": None, "sd": None}
    assert (
        "| bystanders 1 | SLAP | 0% | - | - |"
        in (tmp_path / "generalisation_obstacle2d.md").read_text()
    )


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--preset", "hard"], "unknown preset 'hard'; there are fair, paper"),
        (["--vary", "obstacles=1,2"], "unknown setting 'obstacles'; there are grasp_reach"),
        (["--preset", "fair:mass=2"], "unknown setting 'mass'"),
        (["--preset", "paper"], "preset paper of obstacle2d has none of the settings obstacles"),
        (["--vary", "bystanders"], "is not of the form setting=value"),
        (["--shortcuts", "none"], "give a shortcut library with --shortcuts"),
    ],
)
@pytest.mark.parametrize("name", ["generalisation", "planning_time"])
def test_what_the_domain_does_not_have_is_refused(tmp_path, name, arguments, words):
    code, message = refusal(name, "obstacle2d", *arguments, "--output", tmp_path)
    assert code == InvalidParameterError.code
    assert words in message
    assert not list(tmp_path.iterdir())


def test_a_variation_takes_the_place_of_the_setting_in_the_preset():
    assert parse_variation("mass = 1.0, 2..3") == Variation("mass", ("1.0", "2..3"))
    varied = parse_variation("mass=1,2").preset("fair:mass=5,obstacles=3", "2")
    assert varied == "fair:mass=2,obstacles=3"
    tower = get_domain("obstacle_tower")
    assert [one.setting for one in offered(tower)] == [
        "obstacles", "distractors", "mass", "friction",
    ]  # fmt: skip


# -- goals ----------------------------------------------------------------------------------------


@pytest.mark.slow
def test_shortcuts_help_with_other_goals_and_never_harm(tmp_path):
    data = study(tmp_path, "goals", "obstacle2d", "--goals", 10, "--seeds", 2, *PLANNING)
    goals = data["found"]["goals"]
    assert [(one["seed"], one["index"]) for one in goals] == [(0, 0)] * 10 + [(1, 0)] * 10
    pairs = [(one["pure_planning"]["plan_length"], one["slap"]["plan_length"]) for one in goals]
    assert all(slap <= pure for pure, slap in pairs)
    pure, slap = data["found"]["approaches"]
    assert slap["plan_length"]["mean"] < pure["plan_length"]["mean"]
    assert pure["plan_length"]["mean"] == pytest.approx(np.mean([pure for pure, _ in pairs]))


# -- planning time --------------------------------------------------------------------------------


@pytest.mark.slow
def test_planning_time_tells_of_the_graph_and_of_what_was_rolled_out(tmp_path):
    data = study(tmp_path, "planning_time", "obstacle2d", "--tasks", 2, "--seeds", 1, *PLANNING)
    costs = data["found"]["costs"]
    names = ["pure_planning", "slap_1_sample", "slap"]
    assert [(one["value"], one["approach"]) for one in costs] == list(product("012", names))
    for cost in costs[-3:]:
        domain, by_name = compared("fair:bystanders=2")
        for row in cost["tasks"]:
            task = domain.task(row["seed"], row["index"])
            planner = by_name[cost["approach"]].planner("lazy", domain, task.initial_state)
            goal = domain.atom_space(task.initial_state).mask(task.goal)
            result = planner.plan(task.initial_state, goal)
            assert row["graph_nodes"] == result.graph_nodes
            assert row["graph_edges"] == result.graph_edges
            assert row["edges_rolled_out"] == result.edges_rolled_out
            assert row["predicted_steps"] == result.plan.predicted_steps
            assert row["seconds"] > 0.0
    pure, _, slap = costs[-3:]
    assert pure["graph_nodes"] == slap["graph_nodes"]
    assert pure["graph_edges"]["mean"] < slap["graph_edges"]["mean"]


# -- trainings ------------------------------------------------------------------------------------


def line(stage, steps, success=0.5, length=9.0):
    return {"stage": stage, "steps": steps, "success": success, "length": length, "seconds": 1.0}


@pytest.fixture
def training(tmp_path):
    """The work folder of a training of two stages, interrupted and resumed in the second."""
    folder = tmp_path / "training"
    kept = ShortcutWorkFolder(folder / "Clear_On-e41568a9")
    for entry in (
        line(0, 100, 0.0, float("nan")), line(0, 200), line(1, 100), line(1, 200, 0.6),
        line(1, 150, 0.7), line(1, 250, 0.8, 7.0),
    ):  # fmt: skip
        kept.append(entry)
    how = training_settings("ours", get_domain("obstacle2d"))
    settings = {"place": {"domain": "obstacle2d", "preset": "fair", "seed": 3}, **how.as_json()}
    (folder / "settings.json").write_text(json.dumps(settings))
    (shortcut,) = load_library(LIBRARY, DOMAIN).shortcuts
    save_shortcut(kept.shortcut, replace(shortcut, record={"environment_steps": 450}))
    save_shortcut(kept.snapshot(300), shortcut)
    weights, bias = shortcut.policy.layers[-1]
    away = replace(shortcut.policy, layers=(*shortcut.policy.layers[:-1], (-weights, -bias)))
    save_shortcut(kept.snapshot(100), replace(shortcut, policy=away))
    kept.finished.touch()
    return folder


def progress_of(folder):
    (path,) = folder.glob("*/progress.jsonl")
    return path


def test_stages_follow_one_another_and_what_was_done_twice_counts_once(training):
    curve = read_curve(progress_of(training))
    assert [point.steps for point in curve.points] == [100, 200, 300, 350, 450]
    assert [point.success for point in curve.points] == [0.0, 0.5, 0.5, 0.7, 0.8]
    assert curve.points[0].length is None
    assert curve.stages == (200,)


def test_a_line_that_is_being_written_is_left_out(training):
    before = read_curve(progress_of(training))
    with progress_of(training).open("a") as file:
        file.write('{"stage": 1, "st')
    assert read_curve(progress_of(training)) == before


def test_trainings_with_several_seeds_are_averaged(tmp_path, training):
    other = tmp_path / "other"
    kept = ShortcutWorkFolder(other / "Clear_On-e41568a9")
    kept.append(line(0, 100, 0.2, 11.0))
    kept.append(line(0, 200, 0.9, 5.0))
    (other / "settings.json").write_bytes((training / "settings.json").read_bytes())
    data = study(tmp_path, "dynamics", "obstacle2d", "--work", training, "--work", other, *ALONE)
    (learned,) = data["found"]["shortcuts"]
    assert learned["trainings"] == 2
    first, second = learned["moments"]
    assert (first["steps"], first["length_mean"], first["length_sd"]) == (100, 11.0, 0.0)
    assert second["success_mean"] == pytest.approx(0.7)
    assert second["success_sd"] == pytest.approx(np.std([0.5, 0.9], ddof=1))


@pytest.mark.slow
def test_plans_are_made_with_what_was_learned_so_far(tmp_path, training):
    arguments = ["--work", training, "--tasks", 2, "--seeds", 1, *PLANNING]
    data = study(tmp_path, "dynamics", "obstacle2d", *arguments)
    nothing, away, learned, whole = data["found"]["plans"]
    steps = [one["steps"] for one in data["found"]["plans"]]
    assert steps == [0, 100, 300, 450]
    assert (nothing["shortcuts"], nothing["relative_length"]) == ([], 1.0)
    assert (away["shortcuts"], away["used"], away["relative_length"]) == (
        ["Clear_On-e41568a9"], [], 1.0,
    )  # fmt: skip
    assert learned["used"] == learned["shortcuts"] == ["Clear_On-e41568a9"]
    assert learned["relative_length"] == whole["relative_length"] < 1.0
    _, by_name = compared()
    lengths = [Experiment(DOMAIN, 2, 1).run(0, i, by_name["slap"]).plan_length for i in range(2)]
    assert [trial["plan_length"] for trial in whole["trials"]] == lengths
    assert data["library"]["digest"] == load_library(LIBRARY, DOMAIN).digest


def test_a_training_of_another_library_is_refused(tmp_path, training):
    for damage in ("snapshots", "finished"):
        (kept,) = training.glob(f"*/{damage}")
        kept.rename(tmp_path / damage)
        arguments = ["--work", training, "--output", tmp_path / "out", *PLANNING]
        code, message = refusal("dynamics", "obstacle2d", *arguments)
        assert code == InvalidParameterError.code
        assert "train the library again" in message
        (tmp_path / damage).rename(kept)


@pytest.mark.parametrize(
    "damage",
    ["not JSON", "[]", '{"stage": 0}', '{"stage": 0, "steps": 5, "success": "x", "length": 1}',
     '{"stage": 0, "steps": 5, "success": NaN, "length": 1}',
     '{"stage": 0, "steps": 5, "success": 7, "length": null}'],
)  # fmt: skip
def test_a_damaged_line_is_refused_and_named(tmp_path, training, damage):
    path = progress_of(training)
    lines = path.read_text().split("\n")
    path.write_text("\n".join([lines[0], damage, *lines[1:]]))
    code, message = refusal(
        "dynamics", "obstacle2d", "--work", training, "--output", tmp_path / "out"
    )
    assert code == InvalidParameterError.code
    assert "progress.jsonl, line 2: damaged" in message.replace("- ", "-")
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("name", ["dynamics", "pruning"])
def test_a_folder_without_a_training_or_with_another_domains_is_refused(tmp_path, name, training):
    code, message = refusal(name, "obstacle2d", "--work", tmp_path / "nothing")
    assert (code, "give the work folder" in message) == (InvalidParameterError.code, True)
    code, message = refusal(name, "obstacle_tower", "--work", training, "--output", tmp_path)
    assert (code, "a training of domain 'obstacle2d'" in message) == (
        InvalidParameterError.code,
        True,
    )


@pytest.mark.slow
def test_pruning_counts_what_a_training_has_explored(tmp_path, training):
    distribution = TaskDistribution(DomainChoice("obstacle2d", "fair"), 3)
    how = training_settings("ours", get_domain("obstacle2d")).exploration
    explored = [jobs.explore(distribution, index, how) for index in range(2)]
    (training / "explored.json").write_text(json.dumps(explored))
    tasks = ["--tasks", 1, "--seeds", 2, *PLANNING]
    data = study(tmp_path / "kept", "pruning", "obstacle2d", "--work", training, *tasks)
    tasks = data["found"]["tasks"]
    assert [task["candidates"] for task in tasks] == [one["candidates"] for one in explored]
    assert [len(task["hits"]) for task in tasks] == [len(one["finds"]) for one in explored]
    hits = [find["hits"] for one in explored for find in one["finds"]]
    for row in data["found"]["thresholds"]:
        assert row["remaining"] == sum(hit >= row["k"] for hit in hits)
    assert data["found"]["thresholds"][0]["remaining"] == len(hits) > 0
    _, by_name = compared()
    experiment = Experiment(DOMAIN, 1, 2)
    lengths = {
        shortcuts: [experiment.run(*which, by_name[name]).plan_length for which in experiment]
        for shortcuts, name in (((), "pure_planning"), (("Clear_On-e41568a9",), "slap"))
    }
    wanted = {c.hits for one in explored for c in _candidates_of_library(one)}
    for row in data["found"]["thresholds"]:
        assert bool(row["shortcuts"]) == (max(wanted) >= row["k"])
        own = lengths[tuple(row["shortcuts"])]
        (plans,) = [p for p in data["found"]["plans"] if p["shortcuts"] == row["shortcuts"]]
        assert [trial["plan_length"] for trial in plans["trials"]] == own
        assert row["relative_length"] == pytest.approx(sum(own) / sum(lengths[()]))
    assert data["library"]["digest"] == load_library(LIBRARY, DOMAIN).digest


def _candidates_of_library(explored):
    (shortcut,) = load_library(LIBRARY, DOMAIN).shortcuts
    candidates = ExplorationResult.from_json(explored).candidates
    return [c for c in candidates if c.signature.patterns == shortcut.signature.patterns]


@pytest.mark.slow
def test_without_a_library_candidates_are_counted_all_the_same(tmp_path):
    arguments = ["--tasks", 1, "--seeds", 1, "--shortcuts", "none"]
    data = study(tmp_path, "pruning", "obstacle2d", *arguments)
    assert "library" not in data
    assert "plan_length" not in data["found"]["thresholds"][0]
    assert data["found"]["tasks"][0]["candidates"] > 0


@pytest.mark.slow
def test_tasks_of_a_training_are_explored_as_it_does(tmp_path):
    how = training_settings("ours", get_domain("obstacle2d")).exploration
    other = TaskDistribution(DomainChoice("obstacle2d", "fair"), 0)
    with StudyLog(tmp_path / "log", Provenance("obstacle2d", "", {})) as log:
        fresh = pruning.explore([other], 1, how, JobRunner(log, 1, SilentProgress()))
    assert fresh[0].explored.pairs == jobs.explore(other, 0, how)["candidates"]


class SilentProgress:
    """Shows nothing."""

    def begin(self, what, total):
        pass

    def advance(self):
        pass

    def report_failure(self, complaint):
        pass


def test_another_kind_of_exploring_is_not_mixed_in(training, tmp_path):
    other = tmp_path / "other"
    other.mkdir()
    settings = json.loads((training / "settings.json").read_text())
    settings["exploration"]["rollouts"] = 7
    (other / "settings.json").write_text(json.dumps(settings))
    with pytest.raises(InvalidParameterError, match="explored in another way"):
        pruning.explored_in([TrainingFolder(training), TrainingFolder(other)], "obstacle2d")


# -- files ----------------------------------------------------------------------------------------


@pytest.mark.slow
def test_files_are_complete_and_made_again_byte_for_byte(tmp_path, training):
    """The first is; that the others find the same again, interrupted studies tell."""
    commands = [
        ["generalisation", "obstacle2d", "--tasks", 1, "--seeds", 2, *PLANNING,
         "--vary", "bystanders=0,1"],
        ["goals", "obstacle2d", "--goals", 3, "--seeds", 1, *PLANNING],
        ["planning_time", "obstacle2d", "--tasks", 1, "--seeds", 1, *PLANNING],
        ["pruning", "obstacle2d", "--tasks", 1, "--seeds", 1, *PLANNING],
        ["dynamics", "obstacle2d", "--work", training, "--tasks", 1, "--seeds", 1, *PLANNING],
    ]  # fmt: skip
    for command in commands:
        name = f"{command[0]}_obstacle2d"
        one = tmp_path / "one"
        data = study(one, *command)
        assert {"study", "source", "domain", "command", "versions", "found"} <= set(data)
        picture = ET.parse(one / f"{name}.svg").getroot()
        assert len(list(picture.iter("{http://www.w3.org/2000/svg}text"))) > 5
        page = (one / f"{name}.md").read_text()
        assert f"]({name}.svg)" in page
        assert f"    {data['command']}\n" in page
    other = tmp_path / "other"
    again = study(other, *commands[0])
    stored = json.loads((one / "generalisation_obstacle2d.json").read_text())
    assert without_seconds(stored) == without_seconds(again)
    for ending in ("svg", "md"):
        file = f"generalisation_obstacle2d.{ending}"
        assert (one / file).read_bytes() == (other / file).read_bytes()
    assert {path.suffix for path in one.iterdir()} == {".json", ".svg", ".md"}
    assert len(list(one.iterdir())) == 3 * len(commands)


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ('{"command": "slap study goals obstacle2d"}', "has the data of `slap study goals obs"),
        ('{"rows": []}', "is no data of a study"),
        ("notes", "is no data of a study"),
    ],
)
def test_other_data_stays(tmp_path, content, said):
    path = tmp_path / "goals_obstacle2d.json"
    path.write_text(content)
    code, message = refusal("goals", "obstacle2d", "--tasks", 2, "--output", tmp_path)
    assert code == InvalidParameterError.code
    assert said in message
    assert path.read_text() == content
    assert list(tmp_path.iterdir()) == [path]


def test_data_tells_where_it_comes_from(tmp_path):
    data = study(tmp_path, "goals", "obstacle2d", "--goals", 1, "--seeds", 1, *PLANNING)
    assert data["command"] == (
        f"slap study goals obstacle2d --shortcuts {LIBRARY} --goals 1 --preset fair --tasks 1 "
        f"--seeds 1 --first-seed 0 --samples {SAMPLES}"
    )
    assert data["versions"]["slap_ros"]
    library = data["library"]
    assert (library["name"], library["shortcuts"]) == ("obstacle2d", ["Clear_On-e41568a9"])
    assert len(library["digest"]) == 16


def test_without_matplotlib_nothing_is_begun(monkeypatch):
    monkeypatch.setattr("slap_ros.studies.figures.find_spec", lambda _: None)
    code, message = refusal("pruning", "obstacle2d")
    assert code == InvalidParameterError.code
    assert "pip install 'slap_ros[studies]'" in message


@pytest.mark.slow
def test_noise_in_perception_is_measured_in_the_world(tmp_path, monkeypatch):
    monkeypatch.setattr(perception, "NOISE_KINDS", perception.NOISE_KINDS[1:2])
    arguments = ("perception", "obstacle2d", "--tasks", 2, "--seeds", 1, *PLANNING)
    data = study(tmp_path / "once", *arguments)
    levels = data["found"]["levels"]
    assert [(one["value"], one["approach"]) for one in levels] == [
        (value, approach)
        for value in ("exact", "1", "2", "5")
        for approach in ("pure_planning", "slap")
    ]
    exact = levels[0]
    experiment = Experiment(DOMAIN, 2, 1)
    lengths = [experiment.run(0, index).plan_length for index in range(2)]
    assert [one["plan_length"] for one in exact["attempts"]] == lengths
    assert exact["replans"]["mean"] == 0.0
    assert any(one["replans"]["mean"] > 0.0 for one in levels)
    for one in levels:
        assert one["success_rate"] == np.mean([t["success"] for t in one["attempts"]])
        assert all(t["believed"] for t in one["attempts"] if t["success"])
    same = study(tmp_path / "again", *arguments)
    assert without_seconds(data) == without_seconds(same)
    for ending in ("svg", "md"):
        name = f"perception_obstacle2d.{ending}"
        once, again = ((tmp_path / run / name).read_text() for run in ("once", "again"))
        assert once == again
    ET.fromstring((tmp_path / "once" / "perception_obstacle2d.svg").read_text())


@pytest.mark.parametrize("path", sorted(PUBLISHED.glob("*.json")), ids=lambda path: path.stem)
def test_published_data_is_as_studies_write_it(path):
    text = path.read_text(encoding="utf-8")
    assert pretty_json(json.loads(text)) + "\n" == text


@pytest.mark.parametrize("name", sorted(published(PUBLISHED)))
def test_published_data_can_be_made_again_by_its_command(name):
    """The command line still has every option that the recorded command gives."""
    data = json.loads((PUBLISHED / f"{name}.json").read_text(encoding="utf-8"))
    assert {"study", "source", "domain", "command", "versions", "found"} <= set(data)
    slap, group, study, *arguments = shlex.split(data["command"])
    assert (slap, group, study) == ("slap", "study", data["study"])
    (entry,) = (one for one in COMMANDS if one.name == group)
    command = entry.load().commands[study]
    given = command.make_context(study, arguments).params
    assert given["domain"] == data["domain"]
    for setting in ("preset", "tasks", "seeds", "first_seed", "samples"):
        if setting in data:
            assert given[setting] == data[setting]
