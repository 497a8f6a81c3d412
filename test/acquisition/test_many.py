# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The checks against thousands: random edits, planted faults, sound sets."""

from __future__ import annotations

import json
from collections import Counter, deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from random import Random
from typing import Any

from slap_ros.acquisition.proposals.complaints import ComplaintClass, serious
from slap_ros.acquisition.proposals.drafts import check_operator
from slap_ros.acquisition.proposals.problem import AcquisitionProblem
from slap_ros.acquisition.proposals.reward_templates import check_rewards
from slap_ros.acquisition.proposals.verification import verify
from slap_ros.errors import MalformedAnswerError
from slap_ros.language.formats import OperatorDraft, parse_operator, parse_rewards
from slap_ros.relational import GroundOperator, Layout, LiftedOperator, Object, ground_operators
from support.model_answers import operator_data, operator_json, operator_text, reward_data
from support.paper_problems import ALL, Printed, symbol

C = ComplaintClass
Data = dict[str, Any]
LISTS = ("preconditions", "delete_effects", "add_effects")
EDITS = 2_000
FAULTY_SETS = 300
SOUND_SETS = 100


# -- random edits ----------------------------------------------------------------------------------


def edited(text: str, rng: Random) -> str:
    """A text with one to three edits, of characters or of words."""
    for _ in range(rng.randint(1, 3)):
        words = text.replace(",", " , ").split(" ")
        at = rng.randrange(len(text))
        kind = rng.randrange(7)
        if kind == 0:
            text = text[:at] + text[at + 1 :]
        elif kind == 1:
            text = text[:at] + rng.choice('{}[]():,?"-+0129.eE \n\x00πNaN') + text[at:]
        elif kind == 2:
            text = text[:at]
        elif kind == 3:
            i, j = rng.randrange(len(words)), rng.randrange(len(words))
            words[i], words[j] = words[j], words[i]
            text = " ".join(words)
        elif kind == 4:
            words.insert(rng.randrange(len(words)), rng.choice(words))
            text = " ".join(words)
        elif kind == 5:
            del words[rng.randrange(len(words))]
            text = " ".join(words)
        else:
            text = text.replace(
                rng.choice(words) or " ", rng.choice(["Holding", "?peg", "0", "In"])
            )
        text = text or " "
    return text


def rearranged(data: Data, rng: Random) -> Data:
    """An operator with one to three edits that leave its form as it is."""
    data = json.loads(json.dumps(data))
    for _ in range(rng.randint(1, 3)):
        one, other = data[rng.choice(LISTS)], data[rng.choice(LISTS)]
        kind = rng.randrange(5)
        if kind == 0 and one:
            one.remove(rng.choice(one))
        elif kind == 1 and one:
            other.append(rng.choice(one))
        elif kind == 2 and one and other:
            first, second = rng.choice(one), rng.choice(other)
            first["predicate"], second["predicate"] = second["predicate"], first["predicate"]
        elif kind == 3 and one:
            rng.shuffle(rng.choice(one)["arguments"])
        else:
            rng.shuffle(data["parameters"])
    return data


def test_edited_operators_are_refused_with_a_class_or_plan() -> None:
    rng = Random(0)
    printed = [make() for make in ALL]
    outcome: Counter[str] = Counter()
    for _ in range(EDITS):
        one = rng.choice(printed)
        victim = rng.choice(one.operators)
        if rng.random() < 0.5:
            text = edited(rng.choice([operator_json(victim), operator_text(victim)]), rng)
        else:
            text = json.dumps(rearranged(operator_data(victim), rng))
        outcome[judge_operator(text, victim, one)] += 1
    assert sum(outcome.values()) == EDITS
    assert outcome["plans"] > 100 and outcome["refused"] > 500 and outcome["no plan"] > 50


def judge_operator(text: str, victim: LiftedOperator, printed: Printed) -> str:
    try:
        draft = parse_operator(text).draft
    except MalformedAnswerError:
        return "refused"
    operator, complaints = check_operator(draft, victim.name, printed.problem)
    if operator is None:
        assert serious(complaints)
        return "refused"
    operators = [operator if op is victim else op for op in printed.operators]
    verification = verify(operators, printed.problem)
    if verification.plan is None:
        assert serious(verification.complaints) and verification.culprits
        return "no plan"
    assert not serious(verification.complaints)
    state = printed.problem.start_mask
    for step in verification.plan:
        assert step.applicable(state)
        state = step.apply(state)
    assert state & printed.problem.goal_mask == printed.problem.goal_mask
    return "plans"


def test_edited_rewards_are_refused_with_a_class_or_sound() -> None:
    rng = Random(1)
    printed = [make() for make in ALL]
    outcome: Counter[str] = Counter()
    for _ in range(EDITS):
        one = rng.choice(printed)
        operator = rng.choice(one.operators)
        text = edited(json.dumps(reward_data(one, operator)), rng)
        try:
            draft = parse_rewards(text).draft
        except MalformedAnswerError:
            outcome["refused"] += 1
            continue
        template, complaints = check_rewards(draft, operator, one.problem)
        if template is None:
            assert serious(complaints)
            outcome["refused"] += 1
            continue
        outcome["sound"] += 1
        for term in template.terms:
            assert 0.0 <= term.weight <= 1.0
            assert term.metric in one.problem.metrics
            assert set(term.arguments) <= set(operator.parameters)
            for variable, wanted in zip(term.arguments, term.metric.types, strict=True):
                assert variable.type.is_a(wanted)
    assert outcome["sound"] > 50 and outcome["refused"] > 500


# -- sound sets, and faults planted in them --------------------------------------------------------


@dataclass(frozen=True)
class Draft:
    """A problem, and operators as a model would write them."""

    problem: AcquisitionProblem
    operators: list[Data]


def sound(seed: int) -> Draft:
    """Operators of the paper in other words, for more objects, in any order."""
    rng = Random(seed)
    printed = rng.choice(ALL)()
    problem = printed.with_goal(rng.choice(list(printed.goals)))
    for _ in range(rng.randint(0, 2)):
        problem = with_twin(problem, rng.choice(problem.layout.objects), rng)
    operators = [renamed(operator_data(op), rng) for op in printed.operators]
    rng.shuffle(operators)
    return Draft(problem, operators)


def with_twin(problem: AcquisitionProblem, obj: Object, rng: Random) -> AcquisitionProblem:
    """One more object, of which the same holds at first."""
    twin = obj.type(f"{obj.name}x{rng.randrange(10_000)}")
    if twin.name in problem.layout.by_name:
        return problem
    about = [atom for atom in problem.init if obj in atom.objects]
    copies = {
        atom.predicate(*(twin if each == obj else each for each in atom.objects)) for atom in about
    }
    return replace(
        problem, layout=Layout.of((*problem.layout.objects, twin)), init=problem.init | copies
    )


def renamed(data: Data, rng: Random) -> Data:
    """The same operator with other variables, in another order."""
    names = {p["name"]: f"{p['name']}_{rng.randrange(10)}" for p in data["parameters"]}
    parameters = [p | {"name": names[p["name"]]} for p in data["parameters"]]
    rng.shuffle(parameters)
    changed = data | {"parameters": parameters}
    for part in LISTS:
        atoms = [a | {"arguments": [names[w] for w in a["arguments"]]} for a in data[part]]
        rng.shuffle(atoms)
        changed[part] = atoms
    return changed


def classes(draft: Draft) -> set[ComplaintClass]:
    """Everything that the checks say, as the loop would: one by one, then all together."""
    found: set[ComplaintClass] = set()
    operators = []
    for data in draft.operators:
        parsed: OperatorDraft = parse_operator(json.dumps(data)).draft
        operator, complaints = check_operator(parsed, data["name"], draft.problem)
        found |= {complaint.kind for complaint in complaints}
        operators.append(operator)
    if None not in operators:
        sound_ones = [operator for operator in operators if operator is not None]
        found |= {c.kind for c in verify(sound_ones, draft.problem).complaints}
    return found


def test_no_false_alarms_on_sound_sets() -> None:
    for seed in range(SOUND_SETS):
        assert classes(sound(seed)) == set(), seed


Planter = Callable[[Draft, Data, Random], tuple[Draft, ComplaintClass] | None]


def some_atom(data: Data, rng: Random, least: int = 0) -> Data:
    atoms = [a for part in LISTS for a in data[part] if len(a["arguments"]) >= least]
    return rng.choice(atoms)


def hallucination(draft: Draft, data: Data, rng: Random) -> tuple[Draft, ComplaintClass]:
    some_atom(data, rng)["predicate"] += rng.choice(["ed", "s", "_of", "2"])
    return draft, C.UNKNOWN_PREDICATE


def arity(draft: Draft, data: Data, rng: Random) -> tuple[Draft, ComplaintClass]:
    atom = some_atom(data, rng)
    if atom["arguments"] and rng.random() < 0.5:
        atom["arguments"].pop()
    else:
        atom["arguments"].append(data["parameters"][0]["name"])
    return draft, C.WRONG_ARITY


def wrong_type(draft: Draft, data: Data, rng: Random) -> tuple[Draft, ComplaintClass] | None:
    if len({p["type"] for p in data["parameters"]}) < 2:
        return None
    types = {p["name"]: p["type"] for p in data["parameters"]}
    atom = some_atom(data, rng, 1)
    at = rng.randrange(len(atom["arguments"]))
    kind = types[atom["arguments"][at]]
    others = [name for name, other in types.items() if other != kind]
    if not others or len(atom["arguments"]) > 1:
        return None
    atom["arguments"][at] = rng.choice(others)
    return draft, C.WRONG_TYPE


def object_name(draft: Draft, data: Data, rng: Random) -> tuple[Draft, ComplaintClass]:
    atom = some_atom(data, rng, 1)
    atom["arguments"][0] = rng.choice(draft.problem.layout.objects).name
    return draft, C.OBJECT_NAME


def unbound(draft: Draft, data: Data, rng: Random) -> tuple[Draft, ComplaintClass]:
    some_atom(data, rng, 1)["arguments"][-1] = "?something"
    return draft, C.UNBOUND_VARIABLE


def unused(draft: Draft, data: Data, rng: Random) -> tuple[Draft, ComplaintClass]:
    kind = rng.choice(draft.problem.types)
    data["parameters"].append({"name": "?idle", "type": kind.name})
    return draft, C.UNUSED_VARIABLE


def unknown_type(draft: Draft, data: Data, rng: Random) -> tuple[Draft, ComplaintClass]:
    rng.choice(data["parameters"])["type"] += "_like"
    return draft, C.UNKNOWN_TYPE


def contradiction(draft: Draft, data: Data, rng: Random) -> tuple[Draft, ComplaintClass]:
    one, other = rng.choice([LISTS[1:], LISTS[:0:-1]])
    data[one].append(rng.choice(data[other]))
    return draft, C.CONTRADICTORY_EFFECT


def nothing(draft: Draft, data: Data, rng: Random) -> tuple[Draft, ComplaintClass]:
    data["preconditions"] = [a for part in LISTS for a in data[part]]
    unique = {json.dumps(a): a for a in data["preconditions"]}
    data.update(preconditions=list(unique.values()), delete_effects=[], add_effects=[])
    return draft, C.NO_EFFECT


def not_required(draft: Draft, data: Data, rng: Random) -> tuple[Draft, ComplaintClass]:
    lost = rng.choice([a for a in data["delete_effects"] if a in data["preconditions"]])
    data["preconditions"].remove(lost)
    used = {w for part in LISTS for a in data[part] for w in a["arguments"]}
    assert used >= set(lost["arguments"])
    return draft, C.DELETED_NOT_REQUIRED


def twin_atom(draft: Draft, data: Data, rng: Random) -> tuple[Draft, ComplaintClass]:
    atoms = data[rng.choice([part for part in LISTS if data[part]])]
    atoms.append(dict(rng.choice(atoms)))
    return draft, C.DUPLICATE


def twin_operator(draft: Draft, data: Data, rng: Random) -> tuple[Draft, ComplaintClass]:
    copy = renamed(json.loads(json.dumps(data)), rng)
    draft.operators.append(copy | {"name": f"{data['name']}Again"})
    return draft, C.DUPLICATE


def never_true(draft: Draft, data: Data, rng: Random) -> tuple[Draft, ComplaintClass]:
    variable = rng.choice(data["parameters"])
    kind = draft.problem.types_by_name[variable["type"]]
    blessed = symbol("IsBlessed", kind)
    data["preconditions"].append({"predicate": "IsBlessed", "arguments": [variable["name"]]})
    problem = replace(draft.problem, predicates=(*draft.problem.predicates, blessed))
    return Draft(problem, draft.operators), C.PRECONDITION_NEVER_TRUE


def circle(draft: Draft, data: Data, rng: Random) -> tuple[Draft, ComplaintClass]:
    """Needs what only it gives, or what another gives that needs what it gives."""
    keys = symbol("HasKey"), symbol("HasDoor")
    problem = replace(draft.problem, predicates=(*draft.problem.predicates, *keys))
    key, door = ({"predicate": p.name, "arguments": []} for p in keys)
    others = [one for one in draft.operators if one is not data]
    other = rng.choice([data, *others])
    data["preconditions"].append(key)
    if other is data:
        data["add_effects"].append(key)
    else:
        other["preconditions"].append(door)
        other["add_effects"].append(key)
        data["add_effects"].append(door)
    return Draft(problem, draft.operators), C.CIRCULAR_PRECONDITIONS


def impossible(draft: Draft, data: Data, rng: Random) -> tuple[Draft, ComplaintClass]:
    atom = rng.choice(data["add_effects"])
    fixed = draft.problem.predicates_by_name[atom["predicate"]]
    problem = replace(draft.problem, static=frozenset({fixed}))
    return Draft(problem, draft.operators), C.IMPOSSIBLE_CHANGE


def lost_effect(draft: Draft, data: Data, rng: Random) -> tuple[Draft, ComplaintClass] | None:
    """An effect is forgotten; which class that is, a search of its own says."""
    if len(data["add_effects"]) < 2:
        return None
    data["add_effects"].remove(rng.choice(data["add_effects"]))
    used = {w for part in LISTS for a in data[part] for w in a["arguments"]}
    if any(p["name"] not in used for p in data["parameters"]):
        return None
    kind = truth(draft)
    return None if kind is None else (draft, kind)


def truth(draft: Draft) -> ComplaintClass | None:
    """Whether the goal is unreachable, or its atoms never hold together, by plain enumeration."""
    parsed = (parse_operator(json.dumps(data)).draft for data in draft.operators)
    checked = [check_operator(d, d.name or "", draft.problem)[0] for d in parsed]
    operators = [operator for operator in checked if operator is not None]
    assert len(operators) == len(draft.operators)
    space, goal = draft.problem.space, draft.problem.goal_mask
    states = reachable(draft.problem.start_mask, ground_operators(operators, space))
    if any(state & goal == goal for state in states):
        return None
    each = all(any(state & space.bit(a) for state in states) for a in draft.problem.goal)
    return C.GOALS_NEVER_TOGETHER if each else C.GOAL_UNREACHABLE


def reachable(start: int, operators: Sequence[GroundOperator]) -> set[int]:
    found, queue = {start}, deque([start])
    while queue:
        state = queue.popleft()
        for operator in operators:
            successor = operator.apply(state)
            if operator.applicable(state) and successor not in found:
                found.add(successor)
                queue.append(successor)
    return found


PLANTERS: list[Planter] = [
    hallucination, arity, wrong_type, object_name, unbound, unused, unknown_type, contradiction,
    nothing, not_required, twin_atom, twin_operator, never_true, circle, impossible, lost_effect,
]  # fmt: skip


def test_planted_faults_are_found() -> None:
    missed, planted, seed = [], Counter[str](), 0
    while sum(planted.values()) < FAULTY_SETS:
        seed += 1
        rng = Random(seed)
        planter = PLANTERS[seed % len(PLANTERS)]
        draft = sound(seed)
        made = planter(draft, rng.choice(draft.operators), rng)
        if made is None:
            continue
        planted[planter.__name__] += 1
        found = classes(made[0])
        if made[1] not in found:
            missed.append((seed, planter.__name__, made[1], found))
    assert len(missed) <= FAULTY_SETS // 100, missed
    assert len(planted) == len(PLANTERS)
