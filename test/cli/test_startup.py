# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What starts imports what it uses: modules are counted, as seconds differ by machine."""

import inspect
import json
import os
import subprocess
import sys

import pytest

from ensemble.cli import application

LEARNING = {"torch", "stable_baselines3", "tensorboard", "gymnasium", "ray"}
PHYSICS = {"pybullet", "slap_ros.worlds.joint_space", "slap_ros.worlds.contact", "slap_ros.motion"}
PICTURES = {"PIL", "cv2", "matplotlib", "slap_ros.drawing"}
COMPILER = {"numba", "llvmlite"}
OTHERS = {"scipy", "openai", "transformers", "pandas", "jinja2", "slap_ros.language"}
HEAVY = LEARNING | PHYSICS | PICTURES | OTHERS | COMPILER
ROS = {"rclpy", "rosbags", "cyclonedds", "slap_ros.bags"}
PLANNING = {"yaml", "safetensors", "slap_ros.core", "slap_ros.domains", "slap_ros.evaluation"}
LG_SAIL = {"slap_ros.skills.skill_library", "slap_ros.acquisition.proposals.proposal"}
SHORTCUTS = {"slap_ros.shortcuts.shortcut_library", "slap_ros.shortcuts.shipped"}
STUDIES = {"slap_ros.studies", "slap_ros.report", "slap_ros.doctor.libraries"}

DOMAIN = """(define (domain lamps) (:requirements :strips :typing) (:types lamp)
  (:predicates (Dark ?x - lamp) (Lit ?x - lamp))
  (:action Light :parameters (?x - lamp) :precondition (Dark ?x)
    :effect (and (Lit ?x) (not (Dark ?x)))))
"""
PROBLEM = """(define (problem one) (:domain lamps) (:objects a b - lamp)
  (:init (Dark a) (Dark b)) (:goal (Lit b)))
"""
REPORT = (
    "import atexit, json, sys; atexit.register(lambda: print(json.dumps(sorted(sys.modules))))\n"
)
NODES = (
    "sim_node",
    "perception_node",
    "planner_node",
    "skill_server",
    "recorder_node",
)


def modules_after(program):
    """The names of all modules once a program has ended."""
    command = [sys.executable, "-c", REPORT + program]
    ran = subprocess.run(command, capture_output=True, text=True, timeout=60)
    assert ran.returncode == 0, ran.stderr
    return set(json.loads(ran.stdout.splitlines()[-1]))


def slap(*arguments):
    """The modules after a command of ``slap``."""
    given = ["slap", *map(str, arguments)]
    return modules_after(f"sys.argv = {given!r}\nfrom ensemble.cli import main\nmain()")


def ours(modules):
    return {name for name in modules if name.partition(".")[0] in ("slap_ros", "ensemble")}


def test_help_imports_no_command():
    modules = slap("--help")
    assert not modules & (HEAVY | ROS | PLANNING | LG_SAIL | STUDIES | {"numpy"})
    assert len(ours(modules)) <= 10, ours(modules)


def test_a_symbolic_plan_needs_no_domain(tmp_path):
    (tmp_path / "domain.pddl").write_text(DOMAIN)
    (tmp_path / "problem.pddl").write_text(PROBLEM)
    modules = slap("plan", tmp_path / "domain.pddl", tmp_path / "problem.pddl")
    ours_too = {"slap_ros.shortcuts.shipped", "slap_ros.policies.mlp_policy"}
    theirs_too = {"pydantic", "numpy.ma", "rich"}
    without = HEAVY | ROS | PLANNING | LG_SAIL | STUDIES | ours_too | theirs_too
    assert not modules & without
    assert len(ours(modules)) <= 65, ours(modules)


def test_a_planar_plan_needs_neither_physics_nor_skills_that_were_acquired():
    modules = slap("plan", "obstacle2d", "--shortcuts", "none")
    assert not modules & ((HEAVY - {"slap_ros.drawing"}) | ROS | LG_SAIL | STUDIES)


def test_a_run_is_refused_before_reports_and_language_models_are_imported():
    assert not slap("run", "--help") & (LEARNING | OTHERS | LG_SAIL | STUDIES)


def test_a_run_that_acquires_nothing_asks_nobody():
    assert not modules_after("import ensemble.cli.run_task") & (LEARNING | OTHERS | LG_SAIL)


@pytest.mark.parametrize("node", NODES)
def test_a_node_imports_what_every_domain_needs(node):
    modules = modules_after(f"import {node}.node")
    recording = {"rosbags"} if node != "recorder_node" else set()
    assert not modules & (HEAVY | LG_SAIL | STUDIES | {"urllib.request"} | recording)


def test_the_robots_node_needs_its_arm_and_no_learning():
    modules = modules_after("import robot_bridge.node")
    assert not modules & (LEARNING | PICTURES | OTHERS | LG_SAIL | STUDIES)


def test_acquisition_node_learns_in_another_process():
    modules = modules_after("import acquisition_node.node")
    assert not modules & (
        (LEARNING | PHYSICS | PICTURES | OTHERS) - {"jinja2", "slap_ros.language"}
    )


@pytest.mark.parametrize(
    "package",
    ["slap_ros", "slap_ros.core", "slap_ros.planning", "slap_ros.policies.shipped_models"],
)
def test_packages_for_programs_are_light(package):
    assert not modules_after(f"import {package}") & (HEAVY | ROS | LG_SAIL | STUDIES)


@pytest.mark.parametrize("entry", application.COMMANDS, ids=lambda entry: entry.name)
def test_help_says_of_each_command_what_the_command_says_itself(entry):
    command = entry.load()
    first, *_ = inspect.cleandoc(command.help).split("\n\n")
    assert entry.help == " ".join(first.split())
    assert command.get_short_help_str() == entry.summary().get_short_help_str()


def test_every_command_is_in_the_table():
    """A command that is registered with the application itself would be in no list."""
    assert not application.app.registered_commands
    assert not application.app.registered_groups
    (bag,) = (entry for entry in application.COMMANDS if entry.name == "bag")
    assert {"info", "evaluate", "render", "replay"} <= set(bag.load().commands)


@pytest.mark.parametrize(
    ("words", "offered"),
    [
        ("slap ev", "evaluate"),
        ("slap plan --out", "--output"),
        ("slap bag re", "replay"),
        ("slap study generalisation --va", "--vary"),
    ],
)
def test_a_shell_completes_commands_and_options(words, offered):
    asked = {"_SLAP_COMPLETE": "complete_bash", "COMP_WORDS": words}
    asked["COMP_CWORD"] = str(len(words.split()) - 1)
    program = "import sys; sys.argv = ['slap']; from ensemble.cli import main; main()"
    command = [sys.executable, "-c", program]
    ran = subprocess.run(
        command, capture_output=True, text=True, timeout=60, env=os.environ | asked
    )
    assert offered in ran.stdout.split(), ran.stderr
