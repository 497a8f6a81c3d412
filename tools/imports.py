# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Which package of this project imports which, as the sources say."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parent.parent
ABOVE_THE_CORE = (
    "sim_node",
    "perception_node",
    "planner_node",
    "skill_server",
    "acquisition_node",
    "recorder_node",
    "robot_bridge",
    "ensemble",
)


class Import(NamedTuple):
    """One import statement; packages by name, those of the core without ``slap_ros.``."""

    importer: str
    imported: str  # a package of this project, or the first part of another one's name
    where: str  # file and line
    at_run_time: bool  # False below ``if TYPE_CHECKING``


def all_imports() -> list[Import]:
    """Every import of the core, the ensemble and the nodes, of this project or of others."""
    return [found for path in _sources() for found in _imports_of(path)]


def package_of(module: str) -> str:
    """The package, the unit of the architecture, that a module belongs to.

    ``slap_ros.planning.search`` belongs to ``planning``, ``slap_ros.errors`` to ``errors``, and
    ``ensemble.client`` to ``ensemble``. What ``slap_ros`` itself defines belongs to ``slap_ros``.
    """
    parts = module.split(".")
    if parts[0] == "slap_ros" and len(parts) > 1 and not parts[1].startswith("_"):
        return parts[1]
    return parts[0]


def _sources() -> Iterator[Path]:
    for folder in ("slap_ros", *ABOVE_THE_CORE):
        yield from sorted((ROOT / folder).rglob("*.py"))


def _imports_of(path: Path) -> Iterator[Import]:
    importer = package_of(".".join(path.relative_to(ROOT).with_suffix("").parts))
    tree = ast.parse(path.read_text(encoding="utf-8"))
    for_types = {
        id(inner)
        for node in ast.walk(tree)
        if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test)
        for statement in node.body
        for inner in ast.walk(statement)
    }
    for node in ast.walk(tree):
        for module in _modules(node):
            assert isinstance(node, ast.Import | ast.ImportFrom)
            where = f"{path.relative_to(ROOT)}:{node.lineno}"
            yield Import(importer, package_of(module), where, id(node) not in for_types)


def _modules(node: ast.AST) -> list[str]:
    if isinstance(node, ast.Import):
        return [alias.name for alias in node.names]
    if not isinstance(node, ast.ImportFrom) or node.module is None:
        return []
    if node.module == "slap_ros":  # ``from slap_ros import planning`` names the package after it
        return [f"slap_ros.{alias.name}" for alias in node.names]
    return [node.module]
