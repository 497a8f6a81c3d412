# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The trained baselines that a study compares with."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from slap_ros.api.left_out import Tell
from slap_ros.baselines.trained_baseline import TrainedBaseline, load_baseline
from slap_ros.core import Domain
from slap_ros.errors import InvalidLibraryError
from slap_ros.policies.shipped_models import shipped_folder

BASELINES = "runs/baselines"


def baselines_in_runs(domain: str) -> list[Path]:
    """The baselines of a domain in the folder in which they are by default."""
    return sorted(path.parent for path in Path(BASELINES).glob(f"{domain}-*/baseline.json"))


def shipped_baselines(domain: str) -> list[Path]:
    """The baselines that ship for a domain, by method and seed; none for most domains."""
    folder = shipped_folder("baselines", domain)
    return [] if folder is None else sorted(path.parent for path in folder.glob("*/baseline.json"))


def open_baselines(
    folders: Sequence[Path],
    domain: Domain,
    why_not: Callable[[TrainedBaseline], str],
    tell: Tell,
) -> dict[str, TrainedBaseline]:
    """Open baselines; one that cannot be used is left out, and said.

    Args:
        folders: Folders that ``slap baseline train`` made.
        domain: Domain that they must be of.
        why_not: Function that says why a study cannot use a baseline; empty where it can.
        tell: Function that receives what is left out.

    Returns:
        The others, by the names of their folders.
    """
    found: dict[str, TrainedBaseline] = {}
    for folder in folders:
        try:
            baseline = load_baseline(folder, domain)
        except InvalidLibraryError as error:
            tell(f"a baseline is left out: {error}")
            continue
        if reason := why_not(baseline):
            tell(f"a baseline is left out: {folder}: {reason}")
            continue
        found[folder.resolve().name] = baseline
    return found


def other_goal(baseline: TrainedBaseline) -> str:
    """Why a baseline cannot be compared in the tasks of its preset; empty where it can."""
    return "" if baseline.goal is None else f"trained for another goal, {baseline.goal}"
