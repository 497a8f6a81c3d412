# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Which nodes an ensemble has, and the parameters of each for a given run."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from slap_ros.shortcuts.shortcut import DEFAULT

# A node's name is that of its package as well.
CLASSES = {
    "sim_node": "SimNode",
    "perception_node": "PerceptionNode",
    "skill_server": "SkillServer",
    "planner_node": "PlannerNode",
    "recorder_node": "RecorderNode",
}


@dataclass(frozen=True)
class RunSettings:
    """What is to be run."""

    domain: str
    preset: str
    seed: int
    index: int
    planner: str
    record: Path | None  # the bag's folder; None: no recorder
    pace: float = 0.0  # environment steps a second; 0: as fast as commands come
    shortcuts: str = ""  # a library's folder, or none; empty: the shipped one
    samples: int = DEFAULT.samples  # attempts of a shortcut in the model


def node_parameters(settings: RunSettings) -> dict[str, Mapping[str, str | int | float]]:
    """The ROS parameters of every node of the ensemble, by node name."""
    learned: dict[str, str | int | float] = {"samples": settings.samples}
    if settings.shortcuts:
        learned["shortcuts"] = settings.shortcuts
    nodes: dict[str, Mapping[str, str | int | float]] = {
        "sim_node": {
            "domain": settings.domain,
            "preset": settings.preset,
            "seed": settings.seed,
            "index": settings.index,
            "pace": settings.pace,
        },
        "perception_node": {},
        "skill_server": learned,
        "planner_node": {"planner": settings.planner, **learned},
    }
    if settings.record is not None:
        nodes["recorder_node"] = {"bag": str(settings.record)}
    return nodes
