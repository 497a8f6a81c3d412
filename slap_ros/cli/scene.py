# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``slap scene``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from slap_ros.api.command_options import DomainName, Preset
from slap_ros.cli.console import console
from slap_ros.cli.options import Index, Seed
from slap_ros.core import task_with_goal
from slap_ros.domains import get_domain
from slap_ros.files import require_writable, write_whole
from slap_ros.robot.scene_config import read_scene_config
from slap_ros.robot.tagged_scene import placed_tags, tagged_scene
from slap_ros.vision.installed import require_camera_libraries
from slap_ros.vision.tag_sheets import PrintedTag, tag_sheets

SCENE_FILE = "scene.yaml"
TAG_FILE = "tags.pdf"


def scene(
    domain: DomainName,
    tags: Annotated[
        Path,
        typer.Option(help="Folder for the scene file and for tags.pdf, with the tags to print."),
    ],
    preset: Preset = None,
    seed: Seed = 0,
    index: Index = 0,
) -> None:
    """Write a scene file with AprilTags on every object, and a PDF of these tags to print."""
    require_camera_libraries()
    scene_file, tag_file = tags / SCENE_FILE, tags / TAG_FILE
    chosen = get_domain(domain, preset)
    text = tagged_scene(chosen, task_with_goal(chosen, seed, index, "").initial_state)
    for path in (scene_file, tag_file):
        require_writable(path)
    write_whole(scene_file, text)
    placed = placed_tags(read_scene_config(scene_file, chosen))
    write_whole(tag_file, tag_sheets([PrintedTag(t.tag, t.size, t.obj.name) for t in placed]))
    console.print(f"scene file: {scene_file}\n{len(placed)} tags to print: {tag_file}")
