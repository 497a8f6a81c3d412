# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How the help of commands is laid out: panels of options, and an example for each command."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

TASK, PLANNING, SKILLS = "Task", "Planning", "Skills"
MODEL, LEARNING = "Language model", "Learning"
ROBOT, OUTPUT = "Robot", "Output"
# The panel of an option by the name of its parameter; all others are in the panel "Options".
PANELS: Mapping[str, str] = {
    **dict.fromkeys(
        ("seed", "index", "preset", "goal", "tasks", "seeds", "first_seed", "presets"), TASK
    ),
    **dict.fromkeys(
        ("shortcuts", "samples", "planner", "within", "effort", "no_improve", "max_replans"),
        PLANNING,
    ),
    **dict.fromkeys(
        ("with_shooting", "against"),
        PLANNING,
    ),
    **dict.fromkeys(
        (
            "skills",
            "acquire",
            "grow",
            "acquisition",
            "proposer",
            "rewarder",
            "demonstrations",
            "operators",
            "revise",
        ),
        SKILLS,
    ),
    **dict.fromkeys(
        ("model", "base_url", "language_settings", "cassette", "attempts", "tokens", "seconds"),
        MODEL,
    ),
    **dict.fromkeys(
        (
            "settings",
            "set",
            "skill_settings",
            "set_skills",
            "steps",
            "work",
            "ray",
            "begin",
            "encoder",
            "keep",
            "scratch",
            "relearn",
            "trajectories",
        ),
        LEARNING,
    ),
    **dict.fromkeys(
        (
            "world",
            "scene",
            "mock",
            "mujoco",
            "perception",
            "to",
            "robot",
            "dry_run",
            "yes",
            "impedance",
            "stiffness",
            "lag",
        ),
        ROBOT,
    ),
    **dict.fromkeys(
        ("output", "json", "record", "render", "size", "report", "live", "live_port", "watched"),
        OUTPUT,
    ),
    "events": OUTPUT,
}
EXAMPLES: Mapping[str, str] = {  # those of studies are in their files
    "run": "slap run obstacle_tower --seed 1 --record runs/tower --report runs/tower.html",
    "plan": "slap plan obstacle_tower --seed 1 --shortcuts none",
    "propose": "slap propose stow_hammer --proposer induced --demonstrations 3",
    "evaluate": "slap evaluate obstacle2d --tasks 10 --seeds 5",
    "report": "slap report runs/tower --output runs/tower.html",
    "train": "slap train obstacle2d --output runs/models/obstacle2d",
    "acquire": "slap acquire stow_hammer --output runs/skills/stow_hammer",
    "acquire-sequence": "slap acquire-sequence groceries --seeds 5",
    "grow": "slap grow stack_at_target --preset fair:blocked=1 --output runs/grown/blocked",
    "skills": "slap skills models/skills/stow_hammer",
    "check": "slap check obstacle2d",
    "scene": "slap scene obstacle_tower --seed 1 --tags runs/tags",
    "calibrate": "slap calibrate runs/pushes --output runs/calibrated.yaml",
    "domains": "slap domains stow_hammer",
    "list": "slap list",
    "doctor": "slap doctor",
    "bag info": "slap bag info runs/tower",
    "bag evaluate": "slap bag evaluate runs/tower --json",
    "bag render": "slap bag render runs/tower --output runs/tower.gif",
    "bag replay": "slap bag replay runs/tower",
    "bag export": "slap bag export runs/tower --output runs/tower.npz",
    "study readme": "slap study readme",
    "baseline train": "slap baseline train ppo obstacle2d --preset paper",
    "baseline list": "slap baseline list",
}


def arrange(command: Any, path: str) -> None:
    """Put a command's options into panels and end its help with an example; groups likewise.

    Args:
        command: Click's command, or a group of commands.
        path: Name of the command after ``slap``, such as ``bag info``.
    """
    for name, inner in getattr(command, "commands", {}).items():
        arrange(inner, f"{path} {name}")
    for parameter in command.params:
        if parameter.name in PANELS and parameter.param_type_name == "option":
            parameter.rich_help_panel = PANELS[parameter.name]
    if path in EXAMPLES:
        command.epilog = f"Example: {EXAMPLES[path]}"
