# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A domain of another distribution that fails breaks only itself."""

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

from slap_ros.core import Domain, DomainFactory, presets
from slap_ros.doctor import domains as doctor
from slap_ros.domain_check.cost import import_time
from slap_ros.domains import domain_names, get_domain, preset_names
from slap_ros.domains.registry import OURS
from slap_ros.errors import ErrorCode, InvalidDomainError, InvalidParameterError
from support.slap_command import slap

# What a module may do while it is imported, and its `make` when it is called.
RAISING = {
    "an exception": "raise RuntimeError('no licence')",
    "an import": "import simulator_that_is_not_there",
    "an exit": "raise SystemExit(0)",
    "an exit in words": "import sys; sys.exit('no display')",
    "a base exception": "raise type('Fatal', (BaseException,), {})('gone')",
    "an end of generators": "raise GeneratorExit",
    "an interrupt of nobody": "raise InterruptedError(4, 'call')",
    "a message that fails": (
        "raise type('Mute', (Exception,), {'__str__': lambda self: 1 / 0})('secret')"
    ),
    "an assertion": "assert False",
    "memory": "raise MemoryError",
    "recursion": "f = lambda: f(); f()",
    "another domain's error": (
        "from slap_ros.errors import UnknownDomainError; raise UnknownDomainError('obstacle2d')"
    ),
    "a parameter's error at import": (
        "from slap_ros.errors import InvalidParameterError; raise InvalidParameterError('x')"
    ),
}
SOUND = "from support.sweeping import make\n"


def refused(name):
    with pytest.raises(InvalidDomainError, match=re.escape(repr(name))) as caught:
        get_domain(name)
    return str(caught.value)


@pytest.mark.parametrize("how", RAISING)
def test_whatever_is_raised_at_import_is_that_domains_error(how, install):
    install({"stranger": "stranger:make"}, stranger=RAISING[how])
    refused("stranger")
    assert get_domain("obstacle2d").preset == "fair"


@pytest.mark.parametrize("how", [how for how in RAISING if how != "a parameter's error at import"])
def test_whatever_is_raised_when_it_is_made_is_that_domains_error(how, install):
    body = "\n    ".join(RAISING[how].split("\n"))
    install({"stranger": "stranger:make"}, stranger=f"def make():\n    {body}\n")
    refused("stranger")


@pytest.mark.parametrize(
    ("entry", "text", "words"),
    [
        ("stranger:make", "make = 3", "3 is not a function that makes it"),
        ("stranger:make", "make = lambda: 3", "made 3, which is not a Domain"),
        ("stranger:make", "make = lambda: 'x' * 9999", "xxx...xxxxxxxxxxxxx', which is not a"),
        ("stranger:make", SOUND, "calls itself 'sweeping'"),
        ("stranger:make", "", "has no attribute 'make'"),
        ("stranger", "", "is not a function that makes it"),
        ("stranger:", "", ""),
        ("a b c", "", ""),
        ("stranger:make", "make = (", "SyntaxError"),
        ("stranger:make", "make = lambda a, *, b: 3", "required keyword-only argument"),
        (
            "stranger:make",
            "from slap_ros.core import presets\nmake = presets('a', 'a')(lambda preset: 3)",
            "each once",
        ),
    ],
)
def test_what_is_no_domain_is_refused_with_its_name(entry, text, words, install):
    install({"stranger": entry}, stranger=text)
    assert words in refused("stranger")


def test_ctrl_c_is_not_a_fault_of_the_domain(install):
    install({"stranger": "stranger:make"}, stranger="raise KeyboardInterrupt")
    with pytest.raises(KeyboardInterrupt):
        get_domain("stranger")


def test_a_name_that_two_distributions_register_is_nobodys(install):
    install({"sweeping": "support.sweeping:make"}, "one")
    install({"sweeping": "support.gripper_first:make"}, "two")
    said = refused("sweeping")
    assert "one (support.sweeping:make)" in said
    assert "two (support.gripper_first:make)" in said


def test_a_domain_of_ours_cannot_be_replaced(install):
    install({"obstacle2d": "support.sweeping:make"})
    assert get_domain("obstacle2d").name == "obstacle2d"


@pytest.mark.parametrize("content", [b"[slap_ros.domains]\nstranger\n", b"\xff\x00[x]"])
def test_entry_points_that_cannot_be_read_cost_only_their_distribution(content, install, tmp_path):
    install({}, "broken")
    (points,) = tmp_path.glob("**/broken-1.0.dist-info/entry_points.txt")
    points.write_bytes(content)
    install({"sweeping": "support.sweeping:make"}, "sound")
    assert "sweeping" in domain_names()
    assert get_domain("sweeping").name == "sweeping"
    check = doctor.others()
    assert check.status == "warning"
    assert "entry points of broken: " in check.found


def test_a_domain_of_others_is_a_gymnasium_environment(install):
    """Also beside one that cannot be made, whose code nobody runs."""
    pytest.importorskip("gymnasium")
    pytest.importorskip("pybullet")
    install({"sweeping": "support.sweeping:make"}, "sound")
    install({"exits": "exits:make"}, "exits", exits="raise SystemExit(7)")
    code = (
        "import gymnasium, slap_ros.environments\n"
        "env = gymnasium.make('slap_ros/Sweeping-v0')\n"
        "seen, info = env.reset(seed=500)\n"
        "print(info['success'], 'slap_ros/Exits-v0' in gymnasium.registry)"
    )
    ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60)
    assert ran.stdout.strip() == "False True", ran.stderr


@pytest.mark.slow
def test_commands_go_on_beside_broken_domains(install):
    """The case that was seen: `slap domains` ended in a traceback of the stranger's."""
    pytest.importorskip("pybullet")
    install({"sweeping": "support.sweeping:make"}, "sound")
    install({"exits": "exits:make"}, "exits", exits="raise SystemExit(7)")
    install({"dies": "dies:make"}, "dies", dies="def make():\n    raise RuntimeError('no GPU')")
    listed = slap("domains", "--json")
    assert listed.exit_code == 0
    found = [(one["name"], one["preset"]) for one in json.loads(listed.stdout)]
    ours = [(name, preset) for name in OURS for preset in preset_names(name)]
    assert found[: len(ours)] == ours
    assert ("sweeping", "default") in found
    for name in ("'exits'", "'dies'"):
        assert name in listed.stderr
    check = doctor.others()
    assert check.status == "warning"
    assert "dies: " in check.found
    assert "no GPU" in check.found
    assert "sweeping" not in check.found
    planned = slap("plan", "dies")
    assert planned.exit_code == ErrorCode.INVALID_DOMAIN
    assert "RuntimeError: no GPU" in planned.stderr


def test_the_doctor_survives_a_domain_that_takes_python_down(install):
    install({"fatal": "fatal:make"}, fatal="import os; os._exit(3)")
    assert "fatal: it ended with exit code 3" in doctor.others().found


def test_a_domain_without_names_of_presets_has_one(install):
    install({"sweeping": "support.sweeping:make"})
    assert preset_names("sweeping") == ("default",)
    assert get_domain("sweeping") is get_domain("sweeping", "default")
    for preset in ("fair", "paper", "default:pucks=3"):
        with pytest.raises(InvalidParameterError, match="default"):
            get_domain("sweeping", preset)
    run = slap("evaluate", "sweeping", "--tasks", "1", "--seeds", "1", "--json")
    assert run.exit_code == 0


TALKS = """
import os
from dataclasses import replace
from support import sweeping

print("imported")

def sample_task(rng):
    print("sampled")
    os.write(1, b"as code in C would\\n")
    return sweeping.sample_task(rng)

def make():
    return replace(sweeping.make(), name="talks", sample_task=sample_task)
"""


def test_what_a_domain_prints_is_no_data(install):
    """Neither here nor in processes that plan for it, which inherit stdout."""
    install({"talks": "talks:make"}, talks=TALKS)
    command = [sys.executable, "-m", "ensemble.cli", "evaluate", "talks", "--tasks", "1"]
    command += ["--seeds", "2", "--jobs", "2", "--json"]
    run = subprocess.run(command, capture_output=True, text=True, timeout=200)
    assert run.returncode == 0, run.stderr
    assert json.loads(run.stdout)["domain"] == "talks"
    for said in ("imported", "sampled", "as code in C would"):
        assert said in run.stderr.splitlines()


PRESETS = """
from dataclasses import replace
from slap_ros.core import presets
from support.sweeping import make as make_one

@presets("narrow", "wide")
def make(preset, changes={}):
    return replace(make_one(), name="stranger", configuration={"preset": preset, **changes})
"""


def test_presets_have_names_of_their_own_and_the_first_is_the_default(install):
    install({"stranger": "stranger:make"}, stranger=PRESETS)
    assert preset_names("stranger") == ("narrow", "wide")
    made = {p: get_domain("stranger", p) for p in ("narrow", "wide", "wide:pucks=3", None)}
    assert [d.preset for d in made.values()] == ["narrow", "wide", "wide:pucks=3", "narrow"]
    assert dict(made["wide:pucks=3"].configuration) == {"preset": "wide", "pucks": "3"}
    assert made[None] is made["narrow"]
    listed = slap("domains", "--json").stdout
    assert [one["preset"] for one in json.loads(listed) if one["name"] == "stranger"] == [
        "narrow", "wide",
    ]  # fmt: skip
    with pytest.raises(InvalidParameterError, match="there are narrow, wide"):
        get_domain("stranger", "fair")


@pytest.mark.parametrize("names", [("",), ("a b",), ("a:b",), (3,), ("a", "a")])
def test_names_that_no_command_line_could_tell_apart_are_refused(names):
    with pytest.raises(InvalidDomainError):
        presets(*names)(lambda preset: None)
    with pytest.raises(InvalidDomainError):
        DomainFactory(lambda: None, ())


def test_what_ours_print_and_record_stays_fair():
    pytest.importorskip("pybullet")
    assert all(preset_names(name)[:2] == ("fair", "paper") for name in OURS)
    assert get_domain("obstacle2d") is get_domain("obstacle2d", "fair")
    assert isinstance(get_domain("obstacle2d"), Domain)


@pytest.mark.slow
def test_nodes_of_their_own_run_a_strangers_default(install, network, tmp_path):
    """Every node imports the domain by itself; nothing tells them a preset."""
    install({"stranger": "stranger:make"}, stranger=PRESETS)
    command = [sys.executable, "-m", "ensemble.cli", "run", "stranger", "--json"]
    command += ["--patience", "10"]  # for a loaded machine
    run = subprocess.run(
        [*command, "--record", str(tmp_path / "bag")], capture_output=True, text=True, timeout=200
    )
    assert run.returncode == 0, run.stderr
    assert json.loads(run.stdout)["preset"] == "narrow"


# A domain that can be made, and fails once it is used.
FAILING = """
from dataclasses import replace
from support import sweeping


def make():
    sound = sweeping.make()
    first, *others = sound.predicates

    def classifier(state, *columns):
        return {}["token=of-a-lab"]

    return replace(
        sound, name="stranger", predicates=(replace(first, classifier=classifier), *others)
    )


def undrawn():
    return replace(sweeping.make(), name="undrawn", sample_task=lambda rng: None)


def worldless():
    return replace(sweeping.make(), name="worldless", make_world=lambda: None)


print("a banner")
"""


def test_a_mistake_in_a_domains_own_code_is_no_fault_of_ours(install):
    install({"stranger": "stranger:make", "undrawn": "stranger:undrawn"}, stranger=FAILING)
    failed = slap("plan", "stranger")
    assert failed.exit_code == ErrorCode.INVALID_DOMAIN
    assert "KeyError in stranger.py, line 11, of the package stranger" in failed.stderr
    assert "token" not in failed.stderr
    log = Path(failed.stderr.split()[-1])
    assert "KeyError: 'token=of-a-lab'" in log.read_text(encoding="utf-8")
    log.unlink()
    failed = slap("plan", "undrawn")
    assert failed.exit_code == ErrorCode.INVALID_DOMAIN
    assert "sample_task gives NoneType, expected a Task" in failed.stderr


def test_where_slap_fails_with_what_a_domain_gave_it_the_domain_is_named(install):
    install({"worldless": "stranger:worldless"}, stranger=FAILING)
    failed = slap("plan", "worldless")
    assert failed.exit_code == ErrorCode.INTERNAL_ERROR
    # Tests before this one may have used other packages in this process.
    words = r"a fault of slap, or of what the package (\w+ or )*stranger( or \w+)* gives it: TypeE"
    assert re.search(words, failed.stderr)
    Path(failed.stderr.split()[-1]).unlink()


def test_a_domain_that_prints_when_it_is_imported_is_timed(install):
    install({"undrawn": "stranger:undrawn"}, stranger=FAILING)
    assert import_time(get_domain("undrawn")).status == "ok"
