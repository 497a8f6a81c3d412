# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What the documentation shows of the sources is what the sources have."""

import json
import re
from pathlib import Path

import pytest
import yaml

import slap_ros
from slap_ros.acquisition.training.settings import AcquisitionSettings
from slap_ros.learning.setting_changes import setting_names
from slap_ros.shortcuts.settings import TrainingSettings
from tools import quotations
from tools.pictures import architecture

ROOT = Path(__file__).parents[1]
PAGES = [
    *sorted(path for path in ROOT.glob("docs/**/*.md") if path.parent.name != "results"),
    ROOT / "README.md",
    ROOT / "CONTRIBUTING.md",
]
SOURCES = [
    path.relative_to(ROOT).as_posix()
    for folder in (
        "slap_ros",
        "ensemble",
        "*_node",
        "skill_server",
        "robot_bridge",
        "test",
        "tools",
    )
    for path in ROOT.glob(f"{folder}/**/*.py")
]


def test_the_picture_of_the_architecture_is_what_the_command_draws():
    shown = (ROOT / "docs" / "images" / "architecture.svg").read_text(encoding="utf-8")
    assert shown == architecture.draw() + "\n", "run: python -m tools.pictures architecture"


def test_the_picture_leaves_out_what_other_imports_imply():
    chain = {"a": frozenset("bcd"), "b": frozenset("c"), "c": frozenset("d"), "d": frozenset()}
    reduced = architecture.without_implied(chain)
    assert reduced == {"a": {"b"}, "b": {"c"}, "c": {"d"}, "d": set()}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_code_on_pages_is_that_of_the_files(page):
    text = page.read_text(encoding="utf-8")
    assert text == quotations.up_to_date(text), "run: python -m tools.quotations"


def test_a_quotation_of_what_is_not_there_is_refused():
    page = '```python title="slap_ros/errors.py: NoSuchError"\n```\n'
    with pytest.raises(LookupError, match="defines no 'NoSuchError'"):
        quotations.up_to_date(page)


def test_every_source_file_that_pages_name_exists():
    dead = [
        f"{page.name}: {name}"
        for page in PAGES
        for name in re.findall(r"`([\w/]+\.py)[`:]", page.read_text(encoding="utf-8"))
        if not any(f"/{source}".endswith(f"/{name}") for source in [*SOURCES, "setup.py"])
    ]
    assert not dead


def test_every_class_that_pages_name_is_in_the_sources():
    """Or every predicate or operator: anything that is written like a class."""
    files = [ROOT / name for name in SOURCES]
    files += [path for path in ROOT.glob("examples/**/*.*") if path.suffix in (".py", ".txt")]
    known = {path.stem for path in ROOT.glob("msg_schemas/*/*.*")} | {"Makefile"}
    known |= {path.stem for path in ROOT.glob("embedded_ros/src/**/*.*")}
    known.update(*(re.findall(r"\w+", path.read_text(encoding="utf-8")) for path in files))
    dead = [
        f"{page.name}: {name}"
        for page in PAGES
        for name in re.findall(r"`([A-Z][a-z]+\w*)[`.]", page.read_text(encoding="utf-8"))
        if name not in known
    ]
    assert not dead


def test_settings_that_pages_name_have_that_name_today():
    """Earlier names are read as well, and ``skill-figures.md`` has commands that were recorded."""
    known = {*setting_names(AcquisitionSettings), *setting_names(TrainingSettings)}
    groups = "|".join(sorted({name.partition(".")[0] for name in known if "." in name}))
    stale = [
        f"{page.name}: {name}"
        for page in PAGES
        if page.name != "skill-figures.md"
        for name in re.findall(rf"(?:--set |`)((?:{groups})\.[a-z_]+)[=`]", page.read_text("utf-8"))
        if name not in known and not name.endswith(".py")
    ]
    assert not stale


def test_the_citation_is_of_this_version():
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    assert citation["version"] == slap_ros.__version__
    changes = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    assert f"## {slap_ros.__version__}" in changes


def test_the_results_name_the_pybullet_of_their_figures():
    (named,) = re.findall(
        r"on PyBullet (\d+\.\d+\.\d+)", (ROOT / "docs" / "results" / "README.md").read_text()
    )
    results = [json.loads(path.read_text()) for path in ROOT.glob("docs/results/*.json")]
    assert {result["versions"]["pybullet"] for result in results} == {named}


def test_no_picture_is_left_over():
    docs = ROOT / "docs"
    pages = (*docs.rglob("*.md"), ROOT / "README.md")
    text = "".join(path.read_text(encoding="utf-8") for path in pages)
    unused = [path.name for path in (docs / "images").iterdir() if path.name not in text]
    assert not unused
