# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The floors of the house: imports run down, never up and never in a circle."""

import ast
import re
from graphlib import CycleError, TopologicalSorter

import pytest

from slap_ros.domains.registry import OURS
from tools.imports import ABOVE_THE_CORE, ROOT, all_imports

LONGEST = 60  # lines of a function, its docstring among them
NODES = tuple(name for name in ABOVE_THE_CORE if name != "ensemble")

# From the top. A package imports packages of lower floors, and of its own floor those to the
# right of it.
FLOORS = (
    NODES,
    ("ensemble",),
    ("cli", "domain_check", "doctor"),
    ("studies",),
    ("api",),
    ("report", "calibration"),
    ("baselines", "imitation"),
    ("environments", "robot", "bags", "evaluation", "encoding"),
    ("acquisition", "shortcuts"),
    ("learning", "language"),
    ("skills",),
    ("policies",),
    ("drawing", "planning"),
    ("perception", "messages"),
    ("domains",),
    ("motion",),
    ("worlds",),
    ("core",),
    ("relational", "meshes", "vision", "geometry"),
    (
        "compilation",
        "tiered_function",
        "versions",
        "files",
        "signals",
        "whole_numbers",
        "portable_math",
        "redaction",
        "errors",
        "slap_ros",
    ),
)
LEARNERS = {"acquisition", "baselines", "imitation", "learning", "shortcuts"}
ALONE = {
    "torch": LEARNERS,
    "stable_baselines3": LEARNERS,
    "gymnasium": {"environments", *LEARNERS},
    "matplotlib": {"studies"},
    "numba": {"compilation"},
    "rich": {"cli", "ensemble"},
    "typer": {"cli", "ensemble"},
}
ORDER = [package for floor in FLOORS for package in floor]
ROS = re.compile(r"rclpy|embedded_ros|cyclonedds|launch(_ros)?|rosidl_.*|\w+_(msgs|interfaces)$")


@pytest.fixture(scope="module")
def imports():
    return all_imports()


DOOR = ("slap_ros", "api")  # what ``import slap_ros`` gives is named there for type checkers alone


def inside(imports):
    """Imports of one package of the project by another, the door's for types aside."""
    return [
        i
        for i in imports
        if i.imported in ORDER
        and i.importer != i.imported
        and ((i.importer, i.imported) != DOOR or i.at_run_time)
    ]


def test_every_package_has_a_floor(imports):
    assert {i.importer for i in imports} <= set(ORDER)
    packages = {path.stem for path in (ROOT / "slap_ros").iterdir() if path.stem[0] not in "_."}
    assert packages - {"py"} == set(ORDER) - set(ABOVE_THE_CORE) - {"slap_ros"}


def test_imports_run_down(imports):
    up = [
        f"{i.where}: {i.importer} imports {i.imported}"
        for i in inside(imports)
        if ORDER.index(i.importer) > ORDER.index(i.imported)
        or {i.importer, i.imported} <= set(NODES)
    ]
    assert not up, "\n".join(up)


def test_who_never_imports_whom(imports):
    """The two learners stand beside each other; a model is asked in relational words."""
    pairs = {(i.importer, i.imported) for i in inside(imports)}
    assert ("acquisition", "shortcuts") not in pairs
    assert ("shortcuts", "acquisition") not in pairs
    asking = {imported for importer, imported in pairs if importer == "language"}
    assert asking <= {"relational", "files", "redaction", "errors"}


def across(package, rooms):
    """Which files of a package import one of its rooms and lie in none or in another."""
    home = ROOT / "slap_ros" / package
    return [
        (path.relative_to(home).as_posix(), room)
        for path in sorted(home.rglob("*.py"))
        for room in rooms
        if path.relative_to(home).parts[0] != room
        and re.search(
            rf"from slap_ros\.{package}(\.| import .*\b){room}\b", path.read_text(encoding="utf-8")
        )
    ]


@pytest.mark.parametrize(
    ("package", "rooms"), [("worlds", ("joint_space", "contact")), ("domains", OURS)]
)
def test_worlds_and_domains_do_not_know_one_another(package, rooms):
    """Each imports what all share; what they share imports none of them."""
    assert not across(package, rooms)


def test_proposals_and_training_do_not_know_one_another():
    """The curriculum imports both, and neither of them imports it."""
    found = across("acquisition", ("proposals", "training", "curriculum"))
    assert {path.partition("/")[0] for path, _ in found} == {"curriculum"}


def test_the_figures_of_one_paper_need_none_of_the_other():
    rooms = ("slap", "lg_sail")
    assert not [found for found in across("studies", rooms) if found[0].startswith(rooms)]


@pytest.mark.parametrize(("library", "packages"), ALONE.items())
def test_only_these_import_what_is_slow_to_import_or_an_extra(imports, library, packages):
    """So acquired skills and shortcuts run without torch, and the core without a terminal."""
    others = {i.importer for i in imports if i.imported == library} - packages
    assert not others


def test_nothing_that_is_read_is_executed():
    """Answers of models, libraries, bags and cassettes become names and numbers, and no code."""
    executing = {"eval", "exec", "compile", "__import__", "literal_eval", "from_string"}
    serialising = {"pickle", "marshal", "shelve", "dill"}
    found = []
    packages = (
        "acquisition",
        "baselines",
        "bags",
        "language",
        "learning",
        "messages",
        "policies",
        "relational",
        "shortcuts",
        "skills",
    )
    paths = [path for name in packages for path in sorted((ROOT / "slap_ros" / name).rglob("*.py"))]
    assert len(paths) > len(packages)
    for path in paths:
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            names = set()
            if isinstance(node, ast.Name):
                names = {node.id}
            elif isinstance(node, ast.Attribute) and node.attr in ("literal_eval", "from_string"):
                names = {node.attr}
            elif isinstance(node, ast.Import | ast.ImportFrom):
                names = {alias.name.partition(".")[0] for alias in node.names}
                names |= {getattr(node, "module", None)}
            if bad := names & (executing | serialising):
                found.append(f"{path.relative_to(ROOT)}:{node.lineno}: {', '.join(bad)}")
    assert not found, "\n".join(found)


def test_no_circle_of_packages_at_run_time(imports):
    """Follows from the order above; said by itself, as the order may change."""
    graph = {package: set() for package in ORDER}
    for i in inside(imports):
        if i.at_run_time:
            graph[i.importer].add(i.imported)
    try:
        tuple(TopologicalSorter(graph).static_order())
    except CycleError as error:
        pytest.fail(" imports ".join(error.args[1]))


def test_the_core_names_no_ros_package(imports):
    core = [i for i in imports if i.importer not in ABOVE_THE_CORE]
    ros = [f"{i.where}: {i.imported}" for i in core if ROS.fullmatch(i.imported)]
    assert not ros, "\n".join(ros)


def test_contributing_lists_the_same_floors():
    text = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    block = re.search(r"```text\n(nodes.*?)```", text, re.S)[1]
    listed = [re.sub(r"\(.*", "", line).split() for line in block.strip().split("\n")]
    assert listed == [["nodes"], *(list(floor) for floor in FLOORS[1:])]


def test_no_class_name_means_two_things():
    """A reader who searches for a name finds one class; an underscore parts no meanings."""
    defined = {}
    for folder in ("slap_ros", *ABOVE_THE_CORE):
        for path in sorted((ROOT / folder).rglob("*.py")):
            for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
                if isinstance(node, ast.ClassDef):
                    where = f"{path.relative_to(ROOT)}:{node.lineno}"
                    defined.setdefault(node.name.lstrip("_"), []).append(where)
    twice = {name: places for name, places in defined.items() if len(places) > 1}
    assert not twice, "\n".join(f"{name}: {', '.join(p)}" for name, p in twice.items())


def test_no_function_is_long():
    long = []
    for folder in ("slap_ros", *ABOVE_THE_CORE, "benchmarks", "examples", "launch", "tools"):
        for path in sorted((ROOT / folder).rglob("*.py")):
            for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
                if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
                    lines = (node.end_lineno or node.lineno) - node.lineno + 1
                    if lines > LONGEST:
                        where = f"{path.relative_to(ROOT)}:{node.lineno}"
                        long.append(f"{where}: {node.name}, {lines} lines")
    assert not long, "\n".join(long)
