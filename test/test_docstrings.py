# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Docstrings state the contract: arguments, what is returned, which errors are raised.

Ruff sees that every public name has a docstring. These tests see that it says something:

- A public function of three or more arguments has ``Args:``, with an entry for each of them.
- It has ``Returns:`` or ``Yields:`` too, unless it returns nothing, or its summary names what it
  returns: it then begins with a word such as "The" or "Whether" rather than with a verb.
- A public function that raises an error of ``slap_ros.errors`` itself names it below ``Raises:``.
- No summary has fewer than three words, or is one that would fit any other name as well.
- An entry of ``Args:`` or ``Attributes:`` is a phrase of its own: "Path of the file", not "Of the
  file". Private names are checked for this too.

A method that implements a protocol may say ``See :class:`Protocol`.`` instead: the contract is
stated there. The docstring of a ``slap`` command is its help: its arguments are documented by their
``help=``, and its errors become exit codes.
"""

import ast
import re

import pytest

from tools.imports import ABOVE_THE_CORE, ROOT

MANY = 3  # arguments, from which on they are documented
LEAST_WORDS = 3  # of a summary
STUBS = {
    "a message",
    "a moment",
    "a state",
    "a step",
    "all of them",
    "everything about it",
    "how it went",
    "how many",
    "plain data",
    "same as above",
    "see above",
    "the other way round",
    "the same as above",
    "the value",
    "what it is",
    "what it says",
    "which one",
    "with the default",
}
# A summary that begins so is a noun phrase: it names what is returned.
NAMING = re.compile(
    r"(An?|All|Another|Both|Each|Every|How|Its|JSON|Number|One|SVG|Text|That|The|Those|What"
    r"|Whatever|When|Where|Whether|Which|Who|Whose|Why)\b"
)
ENTRY = re.compile(r"^ {4}(\*{0,2}\w[\w, *]*): (.*)", re.MULTILINE)
# An entry that begins so is understood only together with what it is an entry of.
NOT_ALONE = re.compile(
    r"(Of|Whose|Who|Is|Are|By|As|Its|That|Was|Were|Has|Have|(In|From|To|With|For|Under) which"
    r"|(From|To) where)\b"
)
PROTOCOL = re.compile(r"See :(class|meth|func):`~?[\w.]+`")
OPTION = re.compile(r"help=|Command(Option|Argument)\(")
SECTION = re.compile(r"^(Args|Attributes|Returns|Yields|Raises):$", re.MULTILINE)
ERRORS = {
    node.name
    for node in ast.parse((ROOT / "slap_ros/errors.py").read_text(encoding="utf-8")).body
    if isinstance(node, ast.ClassDef) and node.name.endswith("Error")
}
Function = ast.FunctionDef | ast.AsyncFunctionDef


class Documented:
    """A public function, method or class, its docstring cut into sections."""

    def __init__(self, node, where, owner=None):
        self.node, self.where = node, f"{where}:{node.lineno}: {node.name}"
        self.text = ast.get_docstring(node) or ""
        parts = SECTION.split(self.text)
        self.summary = parts[0].strip().split("\n\n")[0]
        self.sections = dict(zip(parts[1::2], parts[2::2], strict=True))
        if owner is not None:  # a class may document its constructor itself
            self.sections = Documented(owner, where).sections | self.sections

    @property
    def refers(self):
        return PROTOCOL.match(self.summary) is not None


def sources():
    for folder in ("slap_ros", *ABOVE_THE_CORE):
        for path in sorted((ROOT / folder).rglob("*.py")):
            yield path.relative_to(ROOT), ast.parse(path.read_text(encoding="utf-8"))


def public(body, where, owner=None):
    """Public classes and functions of a module or class, and those of its classes."""
    for node in body:
        if (isinstance(node, Function | ast.ClassDef) and not node.name.startswith("_")) or (
            isinstance(node, Function) and node.name == "__init__"
        ):
            yield Documented(node, where, owner)
        if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
            yield from public(node.body, where, node)


@pytest.fixture(scope="module")
def documented():
    return [found for path, tree in sources() for found in public(tree.body, path)]


@pytest.fixture(scope="module")
def functions(documented):
    return [one for one in documented if isinstance(one.node, Function)]


@pytest.fixture(scope="module")
def option_aliases():
    """Names such as ``Seed``, each an annotation with the help of an option."""
    rooms = [*ROOT.glob("slap_ros/cli/*.py"), *ROOT.glob("ensemble/cli/*.py")]
    return {
        target.id
        for path in [*rooms, ROOT / "slap_ros" / "api" / "command_options.py"]
        for node in ast.parse(path.read_text(encoding="utf-8")).body
        if isinstance(node, ast.Assign) and OPTION.search(ast.unparse(node.value))
        for target in node.targets
    }


def arguments(node):
    given = node.args
    named = [*given.posonlyargs, *given.args, *given.kwonlyargs]
    named += [extra for extra in (given.vararg, given.kwarg) if extra is not None]
    return [one for one in named if one.arg not in ("self", "cls", "_")]


def raised(function):
    """Errors of ``slap_ros.errors`` that a function raises itself, by name."""
    found, waiting = set(), list(function.body)
    while waiting:
        node = waiting.pop()
        if isinstance(node, Function | ast.ClassDef | ast.Lambda):
            continue
        if isinstance(node, ast.Raise) and isinstance(node.exc, ast.Call):
            found.add(ast.unparse(node.exc.func))
        waiting += ast.iter_child_nodes(node)
    return found & ERRORS


def returns_something(node):
    return node.returns is not None and ast.unparse(node.returns) not in ("None", "NoReturn")


def test_every_argument_of_many_is_documented(functions, option_aliases):
    missing = []
    for one in functions:
        given = arguments(one.node)
        entries = one.sections.get("Args", "")
        for argument in given if len(given) >= MANY and not one.refers else ():
            annotation = ast.unparse(argument.annotation) if argument.annotation else ""
            is_option = "help=" in annotation or annotation in option_aliases
            is_option |= annotation.endswith("Options")  # a dataclass of them
            if not is_option and not re.search(
                rf"^ +[\w, ]*\b{argument.arg}\b[\w, ]*: ", entries, re.M
            ):
                missing.append(f"{one.where}: {argument.arg}")
    assert not missing, "\n".join(missing)


def test_what_is_returned_is_said(functions, option_aliases):
    unsaid = [
        one.where
        for one in functions
        if len(arguments(one.node)) >= MANY and returns_something(one.node) and not one.refers
        if not {"Returns", "Yields"} & one.sections.keys()
        if not NAMING.match(one.summary)
        if not is_command(one.node, option_aliases)
    ]
    assert not unsaid, "\n".join(unsaid)


def is_command(function, option_aliases):
    """Whether a function is a ``slap`` command: what it returns is its exit code."""
    annotations = [ast.unparse(a.annotation) for a in arguments(function) if a.annotation]
    return any("help=" in text or text in option_aliases for text in annotations)


def test_errors_raised_are_named(functions, option_aliases):
    unnamed = [
        f"{one.where}: {error}"
        for one in functions
        for error in sorted(raised(one.node))
        if not one.refers and error not in one.sections.get("Raises", "")
        if not is_command(one.node, option_aliases)
    ]
    assert not unnamed, "\n".join(unnamed)


def test_no_summary_is_a_stub(documented):
    stubs = [
        f"{one.where}: {one.summary}"
        for one in documented
        if one.text
        if len(re.findall(r"\w+", one.summary)) < LEAST_WORDS
        or one.summary.rstrip(".").lower() in STUBS
    ]
    assert not stubs, "\n".join(stubs)


def test_every_entry_can_be_read_alone():
    documented = (
        Documented(node, path)
        for path, tree in sources()
        for node in ast.walk(tree)
        if isinstance(node, Function | ast.ClassDef)
    )
    unclear = [
        f"{one.where}: {name}: {text}"
        for one in documented
        for section in ("Args", "Attributes")
        for name, text in ENTRY.findall(one.sections.get(section, ""))
        if NOT_ALONE.match(text)
    ]
    assert not unclear, "\n".join(unclear)
