# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Published tables are those of the data, and the data is about the libraries that ship."""

import json
import re
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from string import Formatter

import pytest
from typer.testing import CliRunner

from ensemble.cli.application import app
from slap_ros.domains import get_domain
from slap_ros.errors import ErrorCode, InvalidParameterError
from slap_ros.policies.shipped_models import shipped_with_siblings
from slap_ros.shortcuts.shipped import shipped_libraries, shipped_library
from slap_ros.shortcuts.shortcut_library import load_library
from slap_ros.skills.skill_library import load_skill_library
from slap_ros.studies.options import FRESH_SEED
from slap_ros.studies.readme import PLACE, with_tables

ROOT = Path(__file__).parent.parent.parent
PUBLISHED = ROOT / "docs" / "results"
PAGES = [ROOT / "README.md", *ROOT.glob("docs/**/*.md")]
TASKS = 20  # for each condition, at least
RESULTS = {path.stem: json.loads(path.read_text()) for path in PUBLISHED.glob("*.json")}


def digests(folders, domain):
    return [load_library(folder, get_domain(domain)).digest for folder in folders]


def test_tables_of_pages_are_those_of_the_data():
    named = {
        page: {n for _, n, _ in PLACE.findall(page.read_text(encoding="utf-8"))} for page in PAGES
    }
    assert named[ROOT / "README.md"] == {"slap", "mujoco", "lg_sail"}
    assert named[PUBLISHED / "README.md"] == {"table1", "skills"}
    for page in PAGES:
        text = page.read_text(encoding="utf-8")
        assert with_tables(text, PUBLISHED) == text, f"slap study readme {page}"


def home_of(study):
    """The module that makes a study."""
    rooms = ("slap_ros.studies.slap", "slap_ros.studies.lg_sail", "benchmarks")
    return next(f"{room}.{study}" for room in rooms if find_spec(f"{room}.{study}"))


@pytest.mark.parametrize("name", sorted(n for n, data in RESULTS.items() if "study" in data))
def test_pages_explain_their_numbers_in_the_words_of_their_study(name):
    home = home_of(RESULTS[name]["study"])
    words = import_module(home).MEASURED
    parts = [re.escape(literal) for literal, *_ in Formatter().parse(words)]
    page = (PUBLISHED / f"{name}.md").read_text(encoding="utf-8")
    assert re.search(".+?".join(parts), page, re.DOTALL), f"{home}: MEASURED"


@pytest.mark.parametrize("name", sorted(n for n, data in RESULTS.items() if "library" in data))
def test_figures_are_of_the_shipped_library(name):
    data = RESULTS[name]
    assert [data["library"]["digest"]] == digests(
        [shipped_library(data["domain"])], data["domain"]
    ), data["command"]
    assert f"`{data['library']['digest']}`" in (PUBLISHED / f"{name}.md").read_text()


def test_every_page_on_slap_names_its_libraries():
    pages = {n for n, data in RESULTS.items() if data.get("source", "").startswith("SLAP")}
    named = {"library", "libraries", "baselines"}
    # What is pruned is learned by the study itself, and kept nowhere.
    learning = {n for n in pages if RESULTS[n]["study"] == "pruned"}
    assert not {n for n in pages - learning if not named & set(RESULTS[n])}


def test_pages_have_tasks_enough():
    per_condition = ("generalisation", "perception", "planning_time", "pruning", "dynamics")
    assert not {
        name
        for name, data in RESULTS.items()
        if data.get("study") in per_condition
        and "library" in data
        and data["tasks"] * data["seeds"] < TASKS
    }


def of_libraries(learners):
    """The results about several libraries: of other learners as well, or of ours alone."""
    both = ("learners", "curves")
    named = (name for name, data in RESULTS.items() if "libraries" in data)
    return sorted(name for name in named if (RESULTS[name]["study"] in both) == learners)


@pytest.mark.parametrize("name", of_libraries(False))
def test_the_main_table_is_of_all_shipped_libraries(name):
    data = RESULTS[name]
    shipped = digests(shipped_libraries(data["domain"]), data["domain"])
    assert [library["digest"] for library in data["libraries"]] == shipped, data["command"]
    assert len(set(shipped)) == len(shipped)


@pytest.mark.parametrize("name", of_libraries(True))
def test_other_learners_are_those_whose_libraries_ship(name):
    data = RESULTS[name]
    others = sorted((ROOT / "models" / "learners" / data["domain"]).iterdir())
    wanted = digests([shipped_library(data["domain"]), *others], data["domain"])
    assert {library["digest"] for library in data["libraries"]} == set(wanted), data["command"]


def test_figures_are_of_tasks_that_development_did_not_look_at():
    # A language model is asked in the one task of its own seed, and exploration is that of a
    # training, whose tasks no evaluation has.
    asked = {"planning_ablation", "models", "reward_ablation", "possible_savings", "pruned"}
    first = {
        name: data.get("first_seed", data.get("seed", FRESH_SEED))
        for name, data in RESULTS.items()
        if data.get("study") not in asked
    }
    assert not {name for name, seed in first.items() if seed < FRESH_SEED}


@pytest.mark.parametrize(
    "name", sorted(n for n, data in RESULTS.items() if data.get("study") == "acquisition")
)
def test_task_progress_is_that_of_all_shipped_skills(name):
    data = RESULTS[name]
    domain = get_domain(data["domain"], data["preset"])
    shipped = shipped_with_siblings("skills", domain.name)
    wanted = {load_skill_library(folder, domain).digest for folder in shipped}
    for goal in {one["goal"] for one in data["found"]["goals"]}:
        rows = [one for one in data["found"]["goals"] if one["goal"] == goal]
        measured = [one["library"] for row in rows for one in row["libraries"]]
        assert sorted(measured) == sorted(wanted), data["command"]


@pytest.mark.parametrize("name", sorted(n for n in RESULTS if n.startswith("replanning_")))
def test_success_with_replanning_is_that_of_all_shipped_skills_with_written_rewards(name):
    data = RESULTS[name]
    domain = get_domain(data["domain"], data["preset"])
    folders = shipped_with_siblings("skills", domain.name)
    libraries = [load_skill_library(folder, domain) for folder in folders]
    wanted = [one.digest for one in libraries if one.record["rewarder"] == "manual"]
    goals = data["found"]["goals"]
    for goal in {row["goal"] for row in goals}:
        rows = [one for row in goals if row["goal"] == goal for one in row["libraries"]]
        assert [one["library"] for one in rows] == wanted, data["command"]
        assert len(rows[0]["tasks"]) == 100, data["command"]


def test_what_search_without_learning_and_slap_save_is_said_as_measured():
    page = " ".join((PUBLISHED / "README.md").read_text(encoding="utf-8").split())
    saved = {}
    for domain in ("obstacle2d", "obstacle_tower", "cluttered_drawer", "cleanup_table"):
        rows = RESULTS[f"table1_{domain}"]["found"]["rows"]
        for name in ("shooting", "slap"):
            (row,) = (r for r in rows if (r["preset"], r["approach"]) == ("fair", name))
            saved[domain, name] = f"{1 - row['relative_length']:.0%}".replace("%", " %")
    for (domain, name), share in saved.items():
        if name == "slap":
            assert f"(SLAP: {share})" in page, domain
        elif share != "0 %":
            assert re.search(rf"\b{share} (shorter|in the tower|on the table)", page), domain


def test_every_page_is_linked():
    index = (PUBLISHED / "README.md").read_text(encoding="utf-8")
    pages = {path.name for path in PUBLISHED.glob("*.md")} - {"README.md"}
    assert pages <= set(re.findall(r"\]\((\w+\.md)\)", index))


def test_random_policies_are_said_to_succeed_as_often_as_measured():
    page = (ROOT / "docs" / "benchtop.md").read_text(encoding="utf-8")
    said = re.findall(r"a random one in ([^\n]*?) \(\[table\]\(results/(vacuity_\w+)\.md\)\)", page)
    assert {name for _, name in said} == {n for n in RESULTS if n.startswith("vacuity_")}
    for sentence, name in said:
        measured = {
            round(100 * policy["rate"], 1)
            for operator in RESULTS[name]["found"]["operators"]
            for policy in operator["policies"]
            if policy["policy"] == "random"
        }
        percents = set(map(float, re.findall(r"([\d.]+) %", sentence)))
        assert percents <= measured, f"docs/benchtop.md: {name}: a random one in {sentence}"


def test_what_noise_costs_is_said_as_measured():
    page = (ROOT / "docs" / "perception.md").read_text(encoding="utf-8")
    said = []
    for name, domain in (
        ("Obstacle 2D", "obstacle2d"),
        ("tower", "obstacle_tower"),
        ("drawer", "cluttered_drawer"),
        ("table", "cleanup_table"),
    ):
        rates = {
            one["approach"]: f"{one['success_rate']:.0%}".replace("%", " %")
            for one in RESULTS[f"perception_{domain}"]["found"]["levels"]
            if (one["kind"], one["value"]) == ("position noise [mm]", "2")
        }
        said.append(f"{name} {rates['pure_planning']} and {rates['slap']}")
    assert (
        "With 2 mm of noise, these shares of tasks are solved by pure planning and with "
        f"shortcuts: {', '.join(said)}."
    ) in page


@pytest.mark.parametrize(
    "name", sorted(n for n, d in RESULTS.items() if d.get("study") in ("transfer", "camera"))
)
def test_tasks_and_steps_in_mujoco_are_said_as_measured(name):
    """Wherever a page says them, before a link to the page of the results."""
    (*_, (pure, slap)) = RESULTS[name]["found"].values()
    steps = [f"{one['plan_length']['mean']:.1f}" for one in (pure, slap)]
    tasks = len(slap["trials"])
    solved = [sum(trial["success"] for trial in one["trials"]) for one in (pure, slap)]
    numbers = {"all" if count == tasks else str(count) for count in solved}
    said = [
        sentence
        for page in ("camera", "mujoco", "real-robot")
        for sentence in re.findall(
            rf"Of {tasks} (?:(?!Of {tasks} ).)*?\(\[page\]\(results/{name}\.md",
            (ROOT / "docs" / f"{page}.md").read_text(encoding="utf-8"),
            re.IGNORECASE,
        )
    ]
    assert said
    for sentence in said:
        assert re.findall(r"\b\d+\.\d\b", sentence) == steps, sentence
        assert numbers <= set(re.findall(r"\w+", sentence)), sentence


@pytest.mark.parametrize(
    ("page", "said"),
    [
        ("<!-- table9: slap study readme -->\n<!-- end -->\n", "there is no table 'table9'"),
        ("<!-- table1: slap study readme -->\n<!-- end -->\n", "no data in"),
        (
            "<!-- mujoco: slap study readme -->\n<!-- end -->\n",
            "make it with `slap study transfer obstacle_tower`",
        ),
    ],
)
def test_a_page_is_left_as_it_is_where_a_table_cannot_be_made(tmp_path, page, said):
    path = tmp_path / "page.md"
    path.write_text(page)
    arguments = ["study", "readme", str(path), "--results", str(tmp_path)]
    result = CliRunner().invoke(app, arguments)
    assert result.exit_code == ErrorCode.INVALID_PARAMETER
    assert said in " ".join(result.stderr.split())
    assert path.read_text() == page


def test_the_best_rival_solves_most_and_then_in_the_fewest_steps(tmp_path):
    for path in PUBLISHED.glob("table1_*.json"):
        (tmp_path / path.name).write_bytes(path.read_bytes())
    name = "rivals_obstacle2d.json"
    rows = json.loads((PUBLISHED / name).read_text(encoding="utf-8"))["found"]["rows"]
    under_paper = {row["approach"]: row for row in rows if row["preset"] == "paper"}
    page = "<!-- slap: slap study readme -->\n<!-- end -->\n"
    said = []
    for weaken in (lambda: None, lambda: under_paper["ppo"].update(success_rate=0.9)):
        weaken()
        (tmp_path / name).write_text(json.dumps({"found": {"rows": rows}}), encoding="utf-8")
        (said_of_2d,) = [row for row in with_tables(page, tmp_path).splitlines() if "2D" in row]
        said.append(said_of_2d.split("|")[-2].strip())
    steps = {name: row["plan_length"] for name, row in under_paper.items()}
    assert said[0] == f"PPO: 100%, {steps['ppo']['mean']:.1f} steps"
    assert said[1] == f"SOL: 100%, {steps['sol']['mean']:.1f} steps"


def test_the_table_of_the_front_page_wants_data_of_its_preset(tmp_path):
    """A study of other presets, or of pure planning alone, is not enough, and is no crash."""
    name = "table1_obstacle2d.json"
    data = json.loads((PUBLISHED / name).read_text(encoding="utf-8"))
    rows = data["found"]["rows"]
    page = "<!-- slap: slap study readme -->\n<!-- end -->\n"
    for some in (
        [row for row in rows if row["preset"] != "fair"],
        [row for row in rows if row["approach"] == "pure_planning"],
    ):
        assert some
        (tmp_path / name).write_text(json.dumps({"found": {"rows": some}}), encoding="utf-8")
        with pytest.raises(InvalidParameterError, match="slap study table1 obstacle2d"):
            with_tables(page, tmp_path)
