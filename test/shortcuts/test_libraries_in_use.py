# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Libraries that are there, are not, are damaged; and that rollouts are reproducible."""

import json
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import slap_ros
from slap_ros.domains import get_domain
from slap_ros.errors import InvalidLibraryError, InvalidParameterError
from slap_ros.evaluation.approaches import PURE_PLANNING, approaches
from slap_ros.evaluation.experiment import Experiment, run_with
from slap_ros.learning.workers import SequentialWorkers
from slap_ros.planning.graph_planner import GraphPlanner
from slap_ros.planning.options import OptionKind
from slap_ros.planning.problem import Problem
from slap_ros.shortcuts import shipped
from slap_ros.shortcuts.grounded_shortcuts import GroundedShortcuts
from slap_ros.shortcuts.sampling import DEFAULT, Sampling
from slap_ros.shortcuts.shipped import chosen_library, require_usable, shipped_library
from slap_ros.shortcuts.shortcut_library import load_library

DATA = Path(__file__).parent / "data" / "obstacle2d"
DOMAIN = get_domain("obstacle2d")
SAMPLING = Sampling(samples=4)


@pytest.fixture
def library(tmp_path):
    return shutil.copytree(DATA, tmp_path / "library")


def only(library, name):
    """A file of the library's only shortcut."""
    (path,) = library.glob(f"*/{name}")
    return path


def plan(library, seed=1):
    """The plan's edges with their steps."""
    task = DOMAIN.task(seed)
    goal = DOMAIN.atom_space(task.initial_state).mask(task.goal)
    approach = approaches(library, SAMPLING)[-1] if library is not None else PURE_PLANNING
    planner = approach.planner("lazy", DOMAIN, task.initial_state)
    result = planner.plan(task.initial_state, goal)
    return [(str(edge), edge.target, edge.predicted_steps) for edge in result.plan.edges]


def steps(edges):
    return sum(predicted for *_, predicted in edges)


def test_the_whole_library_shortens_a_plan(library):
    pure, slap = plan(None), plan(load_library(library, DOMAIN))
    assert steps(slap) < steps(pure)
    assert any(name.startswith("Clear_On") for name, *_ in slap)


def truncate(path):
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])


def flip_header(path):
    content = bytearray(path.read_bytes())
    content[12] ^= 0xFF
    path.write_bytes(bytes(content))


def not_finite(path):
    """The last weight becomes a NaN."""
    path.write_bytes(path.read_bytes()[:-4] + np.float32("nan").tobytes())


@pytest.mark.parametrize(
    ("name", "damage"),
    [
        ("shortcut.json", truncate),
        ("shortcut.json", Path.unlink),
        ("policy.safetensors", truncate),
        ("policy.safetensors", flip_header),
        ("policy.safetensors", not_finite),
        ("policy.safetensors", Path.unlink),
    ],
)
def test_a_damaged_shortcut_is_left_out_with_a_reason(library, name, damage):
    path = only(library, name)
    damage(path)
    loaded = load_library(library, DOMAIN)
    assert loaded.shortcuts == ()
    (reason,) = loaded.refused
    assert str(path) in str(reason)
    assert plan(loaded) == plan(None)


def test_a_renamed_shortcut_is_left_out(library):
    folder = only(library, "shortcut.json").parent
    folder.rename(folder.with_name("Mine"))
    loaded = load_library(library, DOMAIN)
    assert "renamed" in str(loaded.refused[0])
    assert plan(loaded) == plan(None)


def test_flipped_weights_do_no_harm(library):
    """No reader can tell one finite weight from another. The model can."""
    path, rng = only(library, "policy.safetensors"), np.random.default_rng(0)
    content = path.read_bytes()
    for _ in range(3):
        flipped = np.frombuffer(content, np.uint8).copy()
        at = rng.integers(len(content) // 2, len(content), 400)
        flipped[at] ^= rng.integers(1, 256, 400).astype(np.uint8)
        path.write_bytes(flipped.tobytes())
        loaded = load_library(library, DOMAIN)
        assert steps(plan(loaded)) <= steps(plan(None))
        assert loaded.shortcuts or plan(loaded) == plan(None)


def rewrite(library, **values):
    path = library / "library.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | values))


WHOLE = [
    (lambda library: rewrite(library, format=99), "format 99"),
    (lambda library: rewrite(library, domain="obstacle_tower"), "'obstacle_tower', not of"),
    (lambda library: truncate(library / "library.json"), "library.json"),
    (lambda library: (library / "library.json").unlink(), "library.json"),
    (shutil.rmtree, "no such folder"),
]


@pytest.mark.parametrize(("damage", "words"), WHOLE)
def test_a_library_that_cannot_be_used_is_refused(library, damage, words):
    damage(library)
    with pytest.raises(InvalidLibraryError, match=words) as refused:
        chosen_library(str(library), DOMAIN)
    assert str(library) in str(refused.value)


@pytest.mark.parametrize("damage", [damage for damage, _ in WHOLE if damage is not WHOLE[1][0]])
def test_much_can_be_refused_before_the_domain_is_known(library, damage):
    require_usable(str(library))
    damage(library)
    with pytest.raises(InvalidLibraryError, match=str(library)):
        require_usable(str(library))


# -- which library ----------------------------------------------------------------------------


@pytest.fixture
def nothing_shipped(tmp_path, monkeypatch):
    """An installation of its own, still without models; its prefix."""
    prefix = tmp_path / "prefix"
    package = prefix / "lib" / "slap_ros" / "__init__.py"
    monkeypatch.setattr(slap_ros, "__file__", str(package))
    monkeypatch.setattr(sys, "prefix", str(prefix))
    monkeypatch.setenv("AMENT_PREFIX_PATH", "")
    return prefix


def test_nothing_is_shipped_unless_it_is(nothing_shipped):
    assert shipped_library("obstacle2d") is None
    assert chosen_library(None, DOMAIN) is None
    assert chosen_library("", DOMAIN) is None


@pytest.mark.parametrize("where", ["lib/models", "share/slap_ros/models", "overlay"])
def test_the_shipped_library_is_found_and_used_unless_told_otherwise(
    nothing_shipped, where, tmp_path, monkeypatch
):
    overlays = f"{tmp_path / 'none'}:{tmp_path / 'overlay'}"
    monkeypatch.setenv("AMENT_PREFIX_PATH", overlays)
    root = tmp_path / "overlay/share/slap_ros/models" if where == "overlay" else None
    folder = (root or nothing_shipped / where) / "shortcuts" / "obstacle2d"
    shutil.copytree(DATA, folder)
    assert shipped_library("obstacle2d") == folder
    assert shipped_library("obstacle_tower") is None
    assert len(chosen_library(None, DOMAIN).shortcuts) == 1
    assert chosen_library("none", DOMAIN) is None
    assert chosen_library("", DOMAIN, planner="ff") is None  # which cannot use it
    with pytest.raises(InvalidParameterError, match="ff plans without shortcuts"):
        chosen_library(str(DATA), DOMAIN, planner="ff")


def test_a_checkout_ships_what_is_in_its_models():
    root = Path(shipped.__file__).parents[2]
    for name in ("obstacle2d", "obstacle_tower", "cleanup_table"):
        folder = root / "models" / "shortcuts" / name
        assert shipped_library(name) == (folder if folder.is_dir() else None)


# -- the same everywhere ------------------------------------------------------------------------

ROLL_OUT = """
import sys
from dataclasses import replace
from pathlib import Path
from hashlib import sha256
from slap_ros.domains import get_domain
from slap_ros.planning.options import OptionKind
from slap_ros.planning.planner import GraphPlanner, Problem
from slap_ros.shortcuts.shortcut_library import load_library
from slap_ros.shortcuts.grounded_shortcuts import GroundedShortcuts
from slap_ros.shortcuts.shipped import chosen_library
from slap_ros.evaluation.approaches import approaches
import ensemble.cli, ensemble.nodes
assert "torch" not in sys.modules, "torch was imported"
domain = get_domain("obstacle2d")
digest = sha256()
for seed in (1, 4):
    task = domain.task(seed)
    problem = Problem.of(domain, task.initial_state)
    grounded = GroundedShortcuts(domain, load_library(Path(sys.argv[1]), domain).shortcuts,
                            task.initial_state)
    goal = problem.model.space.mask(task.goal)
    plan = GraphPlanner(problem, shortcuts=grounded).plan(task.initial_state, goal).plan
    state = task.initial_state
    for edge in plan.edges:
        policy = edge.option.skill.start(state, edge.option.objects)
        if edge.option.kind is OptionKind.SHORTCUT:
            digest.update(policy(state).tobytes())
            for attempt in (one for _, found in grounded.cached_rollouts() for one in found):
                digest.update(b"".join(action.tobytes() for action in attempt.actions))
        state = problem.model.roll_out(edge.option, state, edge.target).final
print(digest.hexdigest(), sha256().hexdigest() != digest.hexdigest())
assert "torch" not in sys.modules, "torch was imported"
"""


def test_a_rollout_is_the_same_in_every_process_and_needs_no_torch():
    command = [sys.executable, "-c", ROLL_OUT, str(DATA)]
    outputs = [
        subprocess.run(command, capture_output=True, text=True, check=True).stdout.split()
        for _ in range(2)
    ]
    assert outputs[0] == outputs[1]
    assert outputs[0][1] == "True"  # something was rolled out


@pytest.mark.slow
def test_the_shipped_shortcut_halves_what_the_drawer_takes():
    domain = get_domain("cluttered_drawer", "paper:shortcut_speed=1")
    library = chosen_library(None, domain)
    given, *_, learned = approaches(library, DEFAULT)
    alone, together = (
        next(run_with(SequentialWorkers(), Experiment(domain, 1, 1, 0, "lazy"), approach))
        for approach in (given, learned)
    )
    assert alone.success and together.success
    assert together.plan_length < alone.plan_length / 2


TOWER = get_domain("obstacle_tower")


def results(task, *libraries):
    """Of pure planning, and of planning with each of these libraries."""
    goal = TOWER.atom_space(task.initial_state).mask(task.goal)
    for approach in PURE_PLANNING, *(approaches(one, SAMPLING)[-1] for one in libraries):
        yield approach.planner("lazy", TOWER, task.initial_state).plan(task.initial_state, goal)


def test_a_shortcut_serves_a_goal_that_operators_reach_before_it_would_end():
    """To clear the target, operators take three blocks off; a slap ends beyond that, and sooner."""
    task = TOWER.task(3)
    cleared = frozenset({TOWER.atom_space(task.initial_state).atom("NothingOn", ["target"])})
    pure, slap = results(replace(task, goal=cleared), chosen_library(None, TOWER))
    assert slap.graph_nodes > pure.graph_nodes
    assert slap.plan.predicted_steps < 0.6 * pure.plan.predicted_steps


@pytest.mark.slow
def test_the_goal_of_training_needs_nothing_beyond_the_graph():
    pure, slap = results(TOWER.task(3), chosen_library(None, TOWER))
    assert slap.graph_nodes == pure.graph_nodes
    assert slap.plan.predicted_steps < 0.6 * pure.plan.predicted_steps


@pytest.mark.slow
def test_a_shortcut_leads_beyond_the_graph_whatever_another_does_within():
    """To stack the lowest block on the highest, one may let a single block fall, or slap all."""
    task = TOWER.task(3)
    stacked = frozenset({TOWER.atom_space(task.initial_state).atom("On", ["block1", "block3"])})
    task, slap = replace(task, goal=stacked), chosen_library(None, TOWER)
    fall = load_library(DATA.with_name("obstacle_tower"), TOWER)
    both = replace(slap, shortcuts=slap.shortcuts + fall.shortcuts)
    pure, alone, together = results(task, slap, both)
    assert alone.plan.predicted_steps < pure.plan.predicted_steps
    assert together.plan.predicted_steps <= alone.plan.predicted_steps


def test_a_library_without_shortcuts_is_none_to_keep(library, tmp_path):
    (shortcut,) = (entry for entry in library.iterdir() if entry.is_dir())
    shutil.rmtree(shortcut)
    with pytest.raises(InvalidLibraryError, match="no shortcut in it that could be kept"):
        slap_ros.train(DOMAIN, tmp_path / "trained", keep=library)
    assert not (tmp_path / "trained-training").exists()


def test_the_rest_of_a_plan_is_as_short_where_it_is_planned_again_on_the_way():
    """With the wiper in the hand, operators reach what the sweep leads to in twelve more edges."""
    domain = get_domain("cleanup_table")
    task = domain.task(300)
    problem, state = Problem.of(domain, task.initial_state), task.initial_state
    goal = problem.model.space.mask(task.goal)
    shortcuts = load_library(shipped_library(domain.name), domain).shortcuts
    grounded = GroundedShortcuts(domain, shortcuts, state)
    planner = GraphPlanner(problem, shortcuts=grounded)
    plan = planner.plan(state, goal).plan
    kinds = [edge.option.kind for edge in plan.edges]
    assert OptionKind.SHORTCUT in kinds[2:]
    left = plan.predicted_steps
    for edge in plan.edges[:-1]:
        state = problem.model.roll_out(edge.option, state, edge.target).final
        left -= edge.predicted_steps
        assert planner.plan(state, goal).plan.predicted_steps <= left
