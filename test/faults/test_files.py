# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Bags, models and configurations damaged byte by byte: read as far as they go, or refused."""

import random
import shutil
import sys
from dataclasses import replace
from itertools import cycle
from pathlib import Path

import pytest
from rosbags.rosbag2 import CompressionMode, StoragePlugin

from ensemble.entry_point import run_node
from sim_node.node import SimNode
from slap_ros.bags import bag_digest, bag_info, evaluate_bag, read_bag, replay_bag
from slap_ros.domains import get_domain
from slap_ros.errors import ErrorCode, SlapError
from slap_ros.evaluation.approaches import Approach
from slap_ros.evaluation.experiment import Experiment
from slap_ros.learning.task_distribution import TaskDistribution
from slap_ros.learning.workers import SequentialWorkers
from slap_ros.meshes.obj import from_obj
from slap_ros.meshes.solid import Solid
from slap_ros.relational.pddl import write_domain, write_problem
from slap_ros.report import read_report, render
from slap_ros.robot.scene_config import read_scene_config
from slap_ros.shortcuts.exploration_settings import ExplorationSettings
from slap_ros.shortcuts.named_settings import training_settings
from slap_ros.shortcuts.sampling import Sampling
from slap_ros.shortcuts.shortcut_library import load_library
from slap_ros.shortcuts.training import Training
from slap_ros.shortcuts.work_folder import ShortcutWorkFolder
from slap_ros.skills.domain_choice import DomainChoice
from slap_ros.studies.slap.trainings import TrainingFolder
from support.damage import DAMAGES
from support.marks import slow
from support.rosbags_writer import write_with_rosbags
from support.slap_command import slap
from support.truthful_run import record, under

pytestmark = pytest.mark.timeout(3600)  # for as many cases as somebody may ask for
ROOT = Path(__file__).parents[2]
LIBRARY = ROOT / "test" / "shortcuts" / "data" / "obstacle2d"
SHORTCUT = "Clear_On-e41568a9"
OBSTACLES, TOWER = get_domain("obstacle2d"), get_domain("obstacle_tower")
FEW, MANY = 6, 30  # cases of each kind of damage to a file, where each takes long or does not


def damaged_files(file, count, case_seed):
    """Every kind of damage to a file, which is there damaged while the loop runs."""
    whole = file.read_bytes()
    for damage in DAMAGES:
        for case in range(count):
            rng = random.Random(f"{case_seed} {damage.__name__} {case}")
            file.write_bytes(damage(whole, rng))
            yield f"{damage.__name__} {case}"
    file.write_bytes(whole)


def refused(error):
    """A refusal has a code of its own, and one line that says why."""
    assert error.code > ErrorCode.UNKNOWN
    assert str(error)
    return True


@pytest.fixture
def count(request):
    """How many times as many cases as usual: there are thousands anyway."""
    return 1 + request.config.getoption("--fault-cases") // 10


# -- bags -----------------------------------------------------------------------------------------


def with_sqlite(path, messages, compression=CompressionMode.NONE):
    write_with_rosbags(path, messages, StoragePlugin.SQLITE3, compression)


def with_compressed_messages(path, messages):
    with_sqlite(path, messages, CompressionMode.MESSAGE)


def with_compressed_files(path, messages):
    with_sqlite(path, messages, CompressionMode.FILE)


def of_two_ensembles(path, messages):
    record(path, [*messages, *under("robot1", messages)])


def page(bag):
    """A report of a bag."""
    found = read_report(bag)
    assert "<html" in render([found])
    return found.evaluation


TOOLS = (evaluate_bag, replay_bag, bag_info, bag_digest, page)


def told(bag, tool):
    """Whether a tool tells all there is in a bag."""
    try:
        result = tool(bag)
    except SlapError as error:
        return not refused(error)
    return getattr(result, "damage", None) is None


@pytest.mark.parametrize(
    ("write", "name"),
    [
        (record, "bag_0.mcap"),
        (record, "metadata.yaml"),
        (with_sqlite, "bag.db3"),
        (with_compressed_files, "bag.db3.zstd"),
        *slow((with_compressed_messages, "bag.db3"), (of_two_ensembles, "bag_0.mcap")),
    ],
    ids=["mcap", "metadata", "sqlite", "files", "messages", "ensembles"],
)
def test_a_damaged_bag_is_told_as_far_as_it_goes(script, tmp_path, write, name, count):
    bag = tmp_path / "bag"
    write(bag, script.messages)
    assert all(told(bag, tool) for tool in TOOLS)
    whole = [(m.topic, m.stamp_ns) for m in read_bag(bag)]
    incomplete = 0
    for case, tool in zip(damaged_files(bag / name, FEW * count, name), cycle(TOOLS), strict=False):
        incomplete += not told(bag, tool)
        try:
            found = [(m.topic, m.stamp_ns) for m in read_bag(bag)]
        except SlapError as error:
            assert refused(error)
            continue
        if write is record:  # a database has no checksums
            assert found == whole[: len(found)], case
    assert incomplete


# -- models ---------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "name", ["library.json", f"{SHORTCUT}/shortcut.json", f"{SHORTCUT}/policy.safetensors"]
)
def test_a_damaged_library_is_refused_or_does_no_harm(tmp_path, name, count):
    library = tmp_path / "library"
    shutil.copytree(LIBRARY, library)
    experiment = Experiment(OBSTACLES, tasks=1, seeds=1)
    usable = 0
    for case in damaged_files(library / name, MANY * count, name):
        try:
            loaded = load_library(library, OBSTACLES)
        except SlapError as error:
            assert refused(error)
            continue
        for error in loaded.refused:
            assert refused(error)
        if loaded.shortcuts and usable < FEW:  # whatever it now says of itself
            usable += 1
            approach = Approach(case, loaded.shortcuts, Sampling(samples=1, horizon=15))
            assert experiment.run(3, 0, approach).success, case
    policies = [loaded for loaded in (load_library(library, OBSTACLES),) if loaded.shortcuts]
    assert policies, "the undamaged library is refused as well"


def test_a_damaged_mesh_is_refused_or_is_a_solid(tmp_path, count):
    file = tmp_path / "duck.obj"
    shutil.copy(ROOT / "slap_ros/domains/cleanup_table/shapes/duck.obj", file)
    for case in damaged_files(file, MANY * count, "mesh"):
        try:
            solid = Solid.of(from_obj(file.read_text(encoding="utf-8", errors="replace")))
        except SlapError as error:
            assert refused(error)
        else:
            assert solid.radius < float("inf"), case


# -- configurations -------------------------------------------------------------------------------

SCENE = """\
objects:
  block1:
    type: block
    frame: tag36h11:1
    offset: [0, 0, -0.025]
    features: {mass: 0.5, friction: 0.9, half_x: 0.025, half_y: 0.025, half_z: 0.025,
               is_movable: 1, is_target: 0}
  target:
    type: surface
    pose: [0.5, 0, 0.0745, 0, 0, 0, 1]
    features: {half_x: 0.026, half_y: 0.026, half_z: 0.0005, is_movable: 0, is_target: 1}
"""


def test_a_damaged_scene_is_refused_or_read(tmp_path, count):
    scene = tmp_path / "scene.yaml"
    scene.write_text(SCENE)
    for _ in damaged_files(scene, MANY * count, "scene"):
        try:
            scene_config = read_scene_config(scene, TOWER)
        except SlapError as error:
            assert refused(error)
        else:
            assert scene_config.template.objects


def test_damaged_parameters_end_a_node_with_a_code(network, tmp_path, monkeypatch, count):
    config = tmp_path / "ensemble.yaml"
    whole = (ROOT / "config" / "ensemble.yaml").read_text(encoding="utf-8")
    config.write_text(whole[: whole.index("/**/robot_bridge")])  # what a simulator reads
    arguments = ["sim_node", "--ros-args", "--log-level", "fatal", "--params-file", str(config)]
    monkeypatch.setattr(sys, "argv", arguments)

    def make():
        SimNode().destroy_node()
        raise KeyboardInterrupt  # instead of spinning

    codes = set()
    for case in damaged_files(config, FEW * count, "parameters"):
        code = run_node("sim_node", make)
        assert code != ErrorCode.UNKNOWN, case
        codes.add(ErrorCode(code))
    assert {ErrorCode.NONE, ErrorCode.INVALID_PARAMETER} <= codes


@pytest.mark.parametrize("name", ["domain.pddl", "problem.pddl"])
def test_damaged_pddl_is_planned_for_or_refused(tmp_path, name, count):
    task = OBSTACLES.task(0)
    space = OBSTACLES.atom_space(task.initial_state)
    start = tuple(space.decode(space.abstract(task.initial_state)))
    parts = OBSTACLES.types, OBSTACLES.predicates, OBSTACLES.operators
    problem = write_problem("task", OBSTACLES.name, space.layout.objects, start, task.goal)
    (tmp_path / "domain.pddl").write_text(write_domain(OBSTACLES.name, *parts))
    (tmp_path / "problem.pddl").write_text(problem)
    command = ["plan", *(str(tmp_path / part) for part in ("domain.pddl", "problem.pddl"))]
    codes = set()
    for case in damaged_files(tmp_path / name, FEW * count, name):
        result = slap(*command)
        assert isinstance(result.exception, SystemExit | None), (case, result.exception)
        assert result.exit_code != ErrorCode.UNKNOWN, case
        codes.add(ErrorCode(result.exit_code))
    assert {ErrorCode.NONE, ErrorCode.MALFORMED_PDDL} <= codes


# -- trainings ------------------------------------------------------------------------------------

PLACE = TaskDistribution(DomainChoice("obstacle2d", "fair"), 3)
BRIEF = replace(
    training_settings("ours", get_domain("obstacle2d")),
    exploration=ExplorationSettings(tasks=1, rollouts=60, length=30, action_repeat=4),
    shortcuts=0,  # nothing is learned: what is there is read
)


class Nobody:
    """Is told of a training, and does not mind."""

    def __getattr__(self, _):
        return lambda *_: None


@pytest.fixture(scope="module")
def trained(tmp_path_factory):
    """The work folder of a training that was about to learn."""
    folder = tmp_path_factory.mktemp("training") / "work"
    Training(PLACE, BRIEF, folder, SequentialWorkers(), Nobody()).run()
    kept = ShortcutWorkFolder(folder / SHORTCUT)
    for steps in (100, 200):
        kept.append({"stage": 0, "steps": steps, "success": 0.5, "length": 9.0, "seconds": 1.0})
    return folder


@pytest.mark.parametrize(
    "name", ["settings.json", "explored.json", "plans.json", f"{SHORTCUT}/progress.jsonl"]
)
def test_a_damaged_training_goes_on_or_is_refused(trained, tmp_path, name, count):
    folder = tmp_path / "work"
    shutil.copytree(trained, folder)
    readers = (
        lambda: Training(PLACE, BRIEF, folder, SequentialWorkers(), Nobody()).run(),
        lambda: TrainingFolder(folder).exploration(),
        lambda: TrainingFolder(folder).explored(),
        lambda: TrainingFolder(folder).curves(),
    )
    refusals = 0
    for _ in damaged_files(folder / name, MANY * count, name):
        for read in readers:
            try:
                read()
            except SlapError as error:
                refusals += refused(error)
    assert refusals


def test_a_damaged_checkpoint_is_refused(tmp_path, count):
    torch = pytest.importorskip("torch")
    from slap_ros.shortcuts.ppo import read_checkpoint

    file = tmp_path / "stage0.pt"
    torch.save({"steps": 7, "shortest": 3, "policy": {"w": torch.ones(40)}, "optimizer": {}}, file)
    assert read_checkpoint(file)["steps"] == 7
    for case in damaged_files(file, MANY * count, "checkpoint"):
        try:
            saved = read_checkpoint(file)
        except SlapError as error:
            assert refused(error)
        else:
            assert set(saved) == {"steps", "shortest", "policy", "optimizer"}, case


def test_every_case_is_the_same_again():
    data = bytes(range(256)) * 4
    for damage in DAMAGES:
        once, again = (damage(data, random.Random(5)) for _ in range(2))
        assert once == again != data
