# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Checking drafts of decompositions and operators, each by itself.

Nothing is repaired: a draft becomes exactly the operator that it says, or a list of complaints.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from math import prod

from slap_ros.acquisition.proposals.complaints import Complaint, ComplaintClass, serious
from slap_ros.acquisition.proposals.problem import AcquisitionProblem
from slap_ros.errors import MalformedPddlError
from slap_ros.language.formats import (
    ActionDraft,
    AtomDraft,
    OperatorDraft,
    ParameterDraft,
    shown,
)
from slap_ros.relational import LiftedAtom, LiftedOperator, Predicate, Type, Variable
from slap_ros.relational.pddl.names import check_name

MAX_ACTIONS = 32
MAX_GROUNDINGS = 5_000  # groundings of one operator; more would only keep the planner busy
DECOMPOSITION = "decomposition"

Atoms = frozenset[LiftedAtom]

_VARIABLE = re.compile(r"\?[A-Za-z][A-Za-z0-9_-]{0,63}")


class _Checker:
    """Collects complaints about one subject."""

    def __init__(self, subject: str, problem: AcquisitionProblem) -> None:
        self.subject = subject
        self.problem = problem
        self.complaints: list[Complaint] = []

    def complain(self, kind: ComplaintClass, fact: str, warning: bool = False) -> None:
        self.complaints.append(Complaint(kind, self.subject, fact, warning))

    def name(self, kind: str, name: str) -> None:
        try:
            check_name(kind, name)
        except MalformedPddlError as error:
            self.complain(ComplaintClass.SYNTAX, str(error))

    def parameters(self, drafts: Sequence[ParameterDraft]) -> dict[str, Variable]:
        """The variables that can be made of a parameter list, by name."""
        variables: dict[str, Variable] = {}
        for draft in drafts:
            kind = self._type_of(draft)
            if not self._is_variable(draft.name, "a parameter"):
                continue
            if draft.name in variables:
                self.complain(ComplaintClass.DUPLICATE, f"the parameter {draft.name} occurs twice")
            elif kind is not None:
                variables[draft.name] = Variable(draft.name, kind)
        return variables

    def _is_variable(self, word: str, what: str) -> bool:
        if _VARIABLE.fullmatch(word):
            return True
        if word in self.problem.layout.by_name:
            fact = f"{what} is {shown(word)}, which is an object, not a variable"
            self.complain(ComplaintClass.OBJECT_NAME, fact)
        elif word.startswith("?"):
            self.complain(
                ComplaintClass.SYNTAX, f"{what} is {shown(word)}, which names no variable"
            )
        else:
            fact = f"{what} is {shown(word)}, which is no variable: those begin with '?'"
            self.complain(ComplaintClass.OBJECT_NAME, fact)
        return False

    def _type_of(self, draft: ParameterDraft) -> Type | None:
        """The type that is written beside a variable, or that the variable is named after."""
        types = self.problem.types_by_name
        if draft.type is not None:
            word = draft.type.removeprefix("?")
        else:
            word = draft.name.removeprefix("?")
            word = word if word in types else word.rstrip("0123456789").rstrip("_-")
        if word not in types:
            fact = (
                f"the parameter {shown(draft.name)} is of the type {shown(word)}, which does not "
                f"exist; there are {', '.join(types)}"
            )
            self.complain(ComplaintClass.UNKNOWN_TYPE, fact)
        return types.get(word)

    def operator(self, draft: OperatorDraft) -> tuple[dict[str, Variable], Atoms, Atoms, Atoms]:
        """The variables by name, PRE, EFF- and EFF+, as far as they can be made of a draft."""
        variables = self.parameters(draft.parameters)
        given = {parameter.name for parameter in draft.parameters}
        before = self.atoms("PRE", draft.preconditions, variables, given)
        deleted = self.atoms("EFF-", draft.delete_effects, variables, given)
        added = self.atoms("EFF+", draft.add_effects, variables, given)
        return variables, before, deleted, added

    def atoms(
        self,
        part: str,
        drafts: Iterable[AtomDraft],
        variables: dict[str, Variable],
        given: set[str],
    ) -> frozenset[LiftedAtom]:
        """The atoms that can be made of a list.

        Args:
            part: Part of the operator in which the atoms stand: PRE, EFF- or EFF+.
            drafts: Drafts of the atoms, as they are written.
            variables: Variables of the operator, by name.
            given: Names of all parameters, those of unknown types too.
        """
        found: list[LiftedAtom] = []
        for draft in drafts:
            atom = self._atom(f"{draft} in {part}", draft, variables, given)
            if atom in found:
                self.complain(ComplaintClass.DUPLICATE, f"{part} has {atom} twice")
            elif atom is not None:
                found.append(atom)
        return frozenset(found)

    def _atom(
        self, where: str, draft: AtomDraft, variables: dict[str, Variable], given: set[str]
    ) -> LiftedAtom | None:
        predicate = self.problem.predicates_by_name.get(draft.name)
        if predicate is None:
            known = ", ".join(self.problem.predicates_by_name)
            fact = f"{where}: there is no predicate {shown(draft.name)}; there are {known}"
            self.complain(ComplaintClass.UNKNOWN_PREDICATE, fact)
            return None
        arguments = self._arguments(where, draft.arguments, variables, given)
        if len(draft.arguments) != len(predicate.types):
            fact = (
                f"{where} has {len(draft.arguments)} arguments, but it is {predicate.signature}, "
                f"with {len(predicate.types)}"
            )
            self.complain(ComplaintClass.WRONG_ARITY, fact)
            return None
        if len(arguments) != len(draft.arguments):
            return None
        return self._typed(where, predicate, arguments)

    def _arguments(
        self, where: str, words: Sequence[str], variables: dict[str, Variable], given: set[str]
    ) -> tuple[Variable, ...]:
        found = []
        for word in words:
            if not self._is_variable(word, f"{where}: an argument"):
                continue
            if word in variables:
                found.append(variables[word])
            elif word not in given:
                fact = f"{where}: {word} is not among the parameters"
                self.complain(ComplaintClass.UNBOUND_VARIABLE, fact)
        return tuple(found)

    def _typed(
        self, where: str, predicate: Predicate, arguments: tuple[Variable, ...]
    ) -> LiftedAtom | None:
        wrong = False
        for variable, wanted in zip(arguments, predicate.types, strict=True):
            if not variable.type.is_a(wanted):
                fact = (
                    f"{where}: {variable} is of the type {variable.type}, but it is "
                    f"{predicate.signature}"
                )
                self.complain(ComplaintClass.WRONG_TYPE, fact)
                wrong = True
        if len(set(arguments)) < len(arguments):
            fact = f"{where} relates a variable to itself"
            self.complain(ComplaintClass.REPEATED_ARGUMENT, fact)
            wrong = True
        return None if wrong else LiftedAtom(predicate, arguments)


def check_decomposition(
    drafts: Sequence[ActionDraft], problem: AcquisitionProblem
) -> tuple[tuple[str, ...], list[Complaint]]:
    """Check the actions that a task is said to be made of.

    Args:
        drafts: Drafts of the actions, as they are written.
        problem: Problem that the actions are for.

    Returns:
        The actions as prompts show them, ``Insert(?peg: peg, ?hole: hole)``, and complaints; the
        actions mean something only where no complaint is serious.
    """
    checker = _Checker(DECOMPOSITION, problem)
    if not drafts:
        checker.complain(ComplaintClass.EMPTY_ANSWER, "the answer names no actions")
    if len(drafts) > MAX_ACTIONS:
        checker.complain(ComplaintClass.TOO_LARGE, f"{len(drafts)} actions; {MAX_ACTIONS} at most")
        drafts = drafts[:MAX_ACTIONS]
    actions, names = [], set()
    for draft in drafts:
        checker.name("action", draft.name)
        if draft.name.lower() in names:
            fact = f"the action {draft.name} occurs twice; each is named once, however often used"
            checker.complain(ComplaintClass.DUPLICATE, fact)
        names.add(draft.name.lower())
        variables = checker.parameters(draft.parameters).values()
        actions.append(f"{draft.name}({', '.join(f'{v.name}: {v.type}' for v in variables)})")
    return tuple(actions), checker.complaints


def check_operator(
    draft: OperatorDraft, name: str, problem: AcquisitionProblem
) -> tuple[LiftedOperator | None, list[Complaint]]:
    """Check one operator by itself.

    Args:
        draft: Draft of the operator, as it is written.
        name: Name that the operator should have.
        problem: Problem that the operator is for.

    Returns:
        The operator, None where something serious is wrong, and complaints.
    """
    checker = _Checker(f"operator {name}", problem)
    checker.name("operator", name)
    if draft.name is not None and draft.name != name:
        fact = f"{name} was asked for, the answer describes {shown(draft.name)}"
        checker.complain(ComplaintClass.WRONG_NAME, fact)
    variables, before, deleted, added = checker.operator(draft)
    _check_use(checker, draft)
    _check_effects(checker, before, deleted, added)
    _check_size(checker, tuple(variables.values()))
    if serious(checker.complaints):
        return None, checker.complaints
    differ = tuple((variables[one], variables[other]) for one, other in draft.inequalities)
    operator = LiftedOperator(name, tuple(variables.values()), before, added, deleted, differ)
    return operator, checker.complaints


def read_operator(draft: OperatorDraft, name: str, problem: AcquisitionProblem) -> LiftedOperator:
    """What can be read of an operator, whatever is wrong with it; nothing is checked.

    Args:
        draft: Draft of the operator, as it is written.
        name: Name of the operator.
        problem: Problem that the operator is for.

    Returns:
        The operator without the parameters and atoms that mean nothing in the problem. What is
        both added and deleted is added.
    """
    variables, before, deleted, added = _Checker(f"operator {name}", problem).operator(draft)
    return LiftedOperator(name, tuple(variables.values()), before, added, deleted - added)


def _check_use(checker: _Checker, draft: OperatorDraft) -> None:
    atoms = (*draft.preconditions, *draft.delete_effects, *draft.add_effects)
    used = {word for atom in atoms for word in atom.arguments}
    for parameter in dict.fromkeys(parameter.name for parameter in draft.parameters):
        if parameter not in used:
            fact = f"no atom is about the parameter {shown(parameter)}"
            checker.complain(ComplaintClass.UNUSED_VARIABLE, fact)
    if not draft.add_effects:
        checker.complain(ComplaintClass.NO_EFFECT, "EFF+ is empty")


def _check_effects(
    checker: _Checker,
    before: frozenset[LiftedAtom],
    deleted: frozenset[LiftedAtom],
    added: frozenset[LiftedAtom],
) -> None:
    for atom in _ordered(added & deleted):
        fact = f"{atom} is both added and deleted"
        checker.complain(ComplaintClass.CONTRADICTORY_EFFECT, fact)
    if added and added <= before:
        fact = f"all that EFF+ has, {_listed(added)}, holds before already, as PRE says"
        checker.complain(ComplaintClass.NO_EFFECT, fact)
    for atom in _ordered(deleted | added):
        if fact := _cannot_change(atom, checker.problem):
            checker.complain(ComplaintClass.IMPOSSIBLE_CHANGE, fact)
    if serious(checker.complaints):
        return  # a precondition may be missing here only because it could not be read
    for atom in _ordered(deleted - before):
        fact = f"{atom} is deleted, but not required before"
        checker.complain(ComplaintClass.DELETED_NOT_REQUIRED, fact, warning=True)


def _cannot_change(atom: LiftedAtom, problem: AcquisitionProblem) -> str:
    """Why nothing in this world can change an atom; empty where it can."""
    if atom.predicate in problem.static:
        return f"{atom} is an effect, but nothing ever changes {atom.predicate.name}"
    for variable in atom.variables:
        if not problem.layout.of_type(variable.type):
            return f"{atom} is an effect, but the task has no {variable.type}"
    if problem.shown and atom.predicate not in problem.shown_to_change:
        return f"{atom} is an effect, but no demonstration shows that {atom.predicate.name} changes"
    return ""


def _check_size(checker: _Checker, variables: tuple[Variable, ...]) -> None:
    groundings = prod(len(checker.problem.layout.of_type(v.type)) for v in variables)
    if groundings > MAX_GROUNDINGS:
        fact = (
            f"{len(variables)} variables stand for {groundings} choices of objects; "
            f"{MAX_GROUNDINGS} are the most"
        )
        checker.complain(ComplaintClass.TOO_LARGE, fact)


def _ordered(atoms: Iterable[LiftedAtom]) -> list[LiftedAtom]:
    return sorted(atoms, key=str)


def _listed(atoms: Iterable[LiftedAtom]) -> str:
    return ", ".join(map(str, _ordered(atoms)))
