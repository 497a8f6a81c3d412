# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``import slap_ros`` is light, and gives what is documented: typed, with docstrings."""

import inspect
import re
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import pytest

import slap_ros

ROOT = Path(__file__).parents[2]
DOCUMENTED = {
    "acquire",
    "domains",
    "evaluate",
    "execute",
    "load_bag",
    "make",
    "plan",
    "propose",
    "train",
}
HEAVY = {"torch", "pybullet", "numpy", "rclpy", "embedded_ros", "rosbags", "typer", "rich"}
RUN_TIME = {"torch", "stable_baselines3", "rclpy", "embedded_ros", "typer", "rich", "matplotlib"}


def modules_after(code):
    """Names of the modules that a fresh interpreter has after some code, and not before."""
    return _modules(code) - _modules("pass")


def _modules(code):
    told = subprocess.run(
        [sys.executable, "-c", f"{code}\nimport sys; print(*sys.modules, sep='\\n')"],
        capture_output=True,
        text=True,
        check=True,
        timeout=60,
    )
    return {name.partition(".")[0] for name in told.stdout.split()}


def function(name):
    """A public function; of a package that can be called, what calling it is documented by."""
    found = getattr(slap_ros, name)
    if isinstance(found, ModuleType):
        from slap_ros.api import opening

        return getattr(opening, name)
    return found


def test_importing_the_package_imports_nothing_heavy():
    loaded = modules_after("import slap_ros")
    assert "slap_ros" in loaded
    assert not loaded & HEAVY


def test_planning_without_an_arm_needs_no_physics_no_torch_and_no_ros():
    loaded = modules_after(
        "import slap_ros\n"
        "domain = slap_ros.make('obstacle2d')\n"
        "slap_ros.plan(domain, domain.task(seed=1), shortcuts=None)"
    )
    assert "numpy" in loaded
    assert not loaded & (RUN_TIME | {"pybullet"})


def test_an_arm_is_executed_without_torch_and_without_ros():
    loaded = modules_after("import slap_ros\nslap_ros.execute\nslap_ros.make('obstacle_tower')")
    assert "pybullet" in loaded
    assert not loaded & RUN_TIME


def test_the_public_names_are_the_documented_ones():
    assert set(slap_ros.__all__) == DOCUMENTED
    assert set(dir(slap_ros)) >= DOCUMENTED
    page = (ROOT / "docs" / "python.md").read_text(encoding="utf-8")
    assert set(re.findall(r"^::: slap_ros\.(\w+)$", page, re.MULTILINE)) == DOCUMENTED


@pytest.mark.parametrize("name", sorted(DOCUMENTED))
def test_every_function_is_typed_and_says_what_each_argument_is(name):
    documented = function(name)
    text = inspect.getdoc(documented)
    signature = inspect.signature(documented)
    assert signature.return_annotation is not inspect.Signature.empty
    for parameter in signature.parameters.values():
        assert parameter.annotation is not inspect.Parameter.empty, parameter.name
        assert f"{parameter.name}: " in text, parameter.name


def test_a_name_that_is_not_there_is_an_attribute_error():
    with pytest.raises(AttributeError, match="has no attribute 'plans'"):
        slap_ros.plans  # noqa: B018


def test_domains_is_a_function_and_a_package():
    assert "obstacle_tower" in slap_ros.domains()
    assert slap_ros.domains.get_domain("obstacle2d").name == "obstacle2d"


def test_types_are_shipped():
    assert (Path(slap_ros.__file__).parent / "py.typed").is_file()
