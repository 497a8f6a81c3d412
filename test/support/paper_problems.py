# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The printed problems of LG-SAIL, without a world: words, operators, rewards, goals.

Operators are the printed ones where they chain, and repaired where they do not. Metrics are the
paper's Table 4 and ours for joints; their values are plain functions of poses.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from slap_ros.acquisition.proposals.problem import AcquisitionProblem
from slap_ros.relational import (
    Column,
    Feature,
    GroundAtom,
    Layout,
    LiftedAtom,
    LiftedOperator,
    Metric,
    NormalisedForm,
    Object,
    Predicate,
    State,
    Type,
    Variable,
)
from slap_ros.relational.metrics import TRUTH, at_least, at_most, is_true
from slap_ros.relational.state import Array

PLACE = ("x", "y", "z")
POSE = (*(Feature(name, "m") for name in PLACE), Feature("angle", "rad"))
THING = Type("thing", (*POSE, Feature("held", TRUTH), Feature("opening", "m")))


def make_type(name: str) -> Type:
    return Type(name, THING.features, THING)


def dis_to_obj(state: State, thing: Object) -> float:
    return math.hypot(*(state.get(thing, axis) for axis in PLACE))


def dis_to_obj_of_all(state: State, things: Column) -> Array:
    return np.linalg.norm(state.gather(things, PLACE), axis=-1)


def is_grasped(state: State, thing: Object) -> float:
    return float(state.get(thing, "held"))


def is_grasped_of_all(state: State, things: Column) -> Array:
    return state.stack(things, "held")


def parallel_dis(state: State, thing: Object, place: Object) -> float:
    return math.hypot(*(state.get(thing, a) - state.get(place, a) for a in ("x", "y")))


def parallel_dis_of_all(state: State, things: Column, places: Column) -> Array:
    apart = state.gather(things, ("x", "y")) - state.gather(places, ("x", "y"))
    return np.linalg.norm(apart, axis=-1)


def perpendicular_dis(state: State, thing: Object, place: Object) -> float:
    return abs(float(state.get(thing, "z") - state.get(place, "z")))


def perpendicular_dis_of_all(state: State, things: Column, places: Column) -> Array:
    return np.abs(state.stack(things, "z") - state.stack(places, "z"))


def norm_angle(state: State, thing: Object, place: Object) -> float:
    return float(state.get(thing, "angle") - state.get(place, "angle"))


def norm_angle_of_all(state: State, things: Column, places: Column) -> Array:
    return state.stack(things, "angle") - state.stack(places, "angle")


def opening(state: State, thing: Object) -> float:
    return float(state.get(thing, "opening"))


def opening_of_all(state: State, things: Column) -> Array:
    return state.stack(things, "opening")


CLOSE = NormalisedForm.closeness(10.0)
TURNED = NormalisedForm.closeness(4.0)
ONE, TWO = (THING,), (THING, THING)
IS_GRASPED = Metric(
    "is_grasped", ONE, TRUTH, "Both fingers hold it.", is_grasped_of_all, is_grasped,
    NormalisedForm.truth(), of_hand=True,
)  # fmt: skip
DIS_TO_OBJ = Metric(
    "dis_to_obj", ONE, "m", "Hand to thing.", dis_to_obj_of_all, dis_to_obj, CLOSE, of_hand=True
)
PARALLEL = Metric(
    "parallel_dis", TWO, "m", "Apart in x and y.", parallel_dis_of_all, parallel_dis, CLOSE
)
PERPENDICULAR = Metric(
    "perpendicular_dis", TWO, "m", "Apart in z.", perpendicular_dis_of_all, perpendicular_dis, CLOSE
)
ANGLE = Metric("norm_angle", TWO, "rad", "Turned.", norm_angle_of_all, norm_angle, TURNED)
OPENING = Metric(
    "joint_dis", ONE, "m", "How far it is open.", opening_of_all, opening,
    NormalisedForm.fraction(0.16),
)  # fmt: skip
CLOSURE = Metric("closure", ONE, "m", "How far it is open.", opening_of_all, opening, CLOSE)
METRICS = (IS_GRASPED, DIS_TO_OBJ, PARALLEL, PERPENDICULAR, ANGLE, OPENING, CLOSURE)


def symbol(name: str, *types: Type) -> Predicate:
    """A predicate that no state is asked about here."""
    return Predicate(name, types, lambda state, *columns: np.zeros(1, bool))


def near(name: str, *types: Type) -> Predicate:
    conditions = [at_most(PARALLEL, 0.01), at_most(PERPENDICULAR, 0.02), at_most(ANGLE, 0.1)]
    return Predicate.of(name, types, conditions)


def held(name: str, kind: Type) -> Predicate:
    return Predicate.of(name, (kind,), [is_true(IS_GRASPED)])


@dataclass(frozen=True)
class Words:
    """Turns text into the relational layer's objects."""

    predicates: dict[str, Predicate]
    objects: dict[str, Object]

    @classmethod
    def of(cls, predicates: tuple[Predicate, ...], objects: tuple[Object, ...]) -> Words:
        return cls({p.name: p for p in predicates}, {o.name: o for o in objects})

    def ground(self, text: str) -> frozenset[GroundAtom]:
        """``On(a, b) HandEmpty()``."""
        return frozenset(
            self.predicates[name](*(self.objects[word] for word in words))
            for name, words in map(split, text.split(") "))
        )

    def operator(
        self, name: str, parameters: str, pre: str, minus: str, plus: str
    ) -> LiftedOperator:
        """``?peg ?hole`` are variables named after types, with a digit if there are two."""
        types = {kind.name: kind for obj in self.objects.values() for kind in [obj.type]}
        variables = {
            word: Variable(word, types[word.lstrip("?").rstrip("0123456789")])
            for word in parameters.split()
        }

        def atoms(text: str) -> frozenset[LiftedAtom]:
            return frozenset(
                LiftedAtom(self.predicates[name], tuple(variables[word] for word in words))
                for name, words in map(split, filter(None, text.split(") ")))
            )

        return LiftedOperator(
            name, tuple(variables.values()), atoms(pre), atoms(plus), atoms(minus)
        )


def split(text: str) -> tuple[str, list[str]]:
    name, _, rest = text.rstrip(")").partition("(")
    return name, [word.strip() for word in rest.split(",") if word.strip()]


@dataclass(frozen=True)
class Printed:
    """A problem of the paper, with operators that solve it and its other goals."""

    problem: AcquisitionProblem
    operators: tuple[LiftedOperator, ...]
    plan_length: int
    words: Words
    goals: dict[str, tuple[str, int]]  # by name: atoms, length of the shortest plan

    def with_goal(self, name: str) -> AcquisitionProblem:
        return replace(self.problem, goal=self.words.ground(self.goals[name][0]))


def make(
    name: str,
    types: tuple[Type, ...],
    predicates: tuple[Predicate, ...],
    objects: tuple[Object, ...],
    init: str,
    goals: dict[str, tuple[str, int]],
    operators: list[tuple[str, str, str, str, str]],
) -> Printed:
    words = Words.of(predicates, objects)
    first, length = next(iter(goals.values()))
    problem = AcquisitionProblem(
        name, (THING, *types), predicates, METRICS, frozenset(), Layout.of(objects),
        words.ground(init), words.ground(first),
    )  # fmt: skip
    built = tuple(words.operator(*parts) for parts in operators)
    return Printed(problem, built, length, words, goals)


def peg_in_hole() -> Printed:
    peg, hole = make_type("peg"), make_type("hole")
    predicates = (
        symbol("HandEmpty"), held("Holding", peg), symbol("OnTable", peg), near("In", peg, hole),
        symbol("IsClear", hole),
    )  # fmt: skip
    objects = (peg("peg1"), peg("peg2"), hole("hole1"), hole("hole2"))
    return make(
        "peg_in_hole", (peg, hole), predicates, objects,
        "HandEmpty() OnTable(peg1) OnTable(peg2) IsClear(hole1) IsClear(hole2)",
        {
            "training": ("In(peg1, hole1) In(peg2, hole2)", 4),
            "test1": ("In(peg1, hole2) In(peg2, hole1)", 4),
            "test2": ("In(peg1, hole2)", 2),
        },
        [
            ("Pick", "?peg", "HandEmpty() OnTable(?peg)", "HandEmpty() OnTable(?peg)",
             "Holding(?peg)"),
            ("Insert", "?peg ?hole", "Holding(?peg) IsClear(?hole)",
             "Holding(?peg) IsClear(?hole)", "In(?peg, ?hole) HandEmpty()"),
        ],
    )  # fmt: skip


def printed_insert() -> LiftedOperator:
    """As the paper prints it: nothing gives HandEmpty back."""
    return peg_in_hole().words.operator(
        "Insert", "?peg ?hole", "Holding(?peg) IsClear(?hole)", "Holding(?peg) IsClear(?hole)",
        "In(?peg, ?hole)",
    )  # fmt: skip


def stow_hammer() -> Printed:
    hammer, cabinet = make_type("hammer"), make_type("cabinet")
    is_open = Predicate.of("IsCabinetOpen", (cabinet,), [at_least(OPENING, 0.1)])
    closed = Predicate.of("IsCabinetClose", (cabinet,), [at_most(CLOSURE, 0.01)])
    predicates = (
        symbol("HandEmpty"), held("Holding", hammer), symbol("OnTable", hammer),
        near("In", hammer, cabinet), symbol("HasFreeSpace"), is_open, closed,
    )  # fmt: skip
    objects = (hammer("hammer0"), hammer("hammer1"), cabinet("cabinet0"), cabinet("cabinet1"))
    closed_again = "IsCabinetClose(cabinet0) IsCabinetClose(cabinet1)"
    return make(
        "stow_hammer", (hammer, cabinet), predicates, objects,
        "HandEmpty() OnTable(hammer0) OnTable(hammer1) HasFreeSpace() IsCabinetClose(cabinet0) "
        "IsCabinetClose(cabinet1)",
        {
            "training": (f"In(hammer0, cabinet0) In(hammer1, cabinet1) {closed_again}", 8),
            "test1": (f"In(hammer0, cabinet1) In(hammer1, cabinet0) {closed_again}", 8),
            "test2": ("In(hammer1, cabinet0) IsCabinetClose(cabinet0) IsCabinetOpen(cabinet1)", 5),
        },
        [
            ("Open", "?cabinet", "HasFreeSpace() IsCabinetClose(?cabinet) HandEmpty()",
             "HasFreeSpace() IsCabinetClose(?cabinet)", "IsCabinetOpen(?cabinet)"),
            ("Pick", "?hammer", "HandEmpty() OnTable(?hammer)", "HandEmpty() OnTable(?hammer)",
             "Holding(?hammer)"),
            ("Place", "?hammer ?cabinet", "Holding(?hammer) IsCabinetOpen(?cabinet)",
             "Holding(?hammer)", "In(?hammer, ?cabinet) HandEmpty()"),
            ("Close", "?cabinet", "IsCabinetOpen(?cabinet) HandEmpty()",
             "IsCabinetOpen(?cabinet)", "IsCabinetClose(?cabinet) HasFreeSpace()"),
        ],
    )  # fmt: skip


def stack_at_target() -> Printed:
    cube, target = make_type("cube"), make_type("target")
    predicates = (
        symbol("HandEmpty"), held("Holding", cube), symbol("OnTable", cube),
        near("On", cube, cube), near("OnTarget", cube, target), symbol("IsTopClear", cube),
        symbol("IsEmpty", target),
    )  # fmt: skip
    objects = (cube("cube0"), cube("cube1"), target("target0"))
    return make(
        "stack_at_target", (cube, target), predicates, objects,
        "HandEmpty() OnTable(cube0) OnTable(cube1) IsTopClear(cube0) IsTopClear(cube1) "
        "IsEmpty(target0)",
        {
            "training": ("On(cube1, cube0) OnTarget(cube0, target0)", 4),
            "real": ("OnTarget(cube1, target0) On(cube0, cube1)", 4),
        },
        [
            ("Pick", "?cube", "HandEmpty() OnTable(?cube) IsTopClear(?cube)",
             "HandEmpty() OnTable(?cube)", "Holding(?cube)"),
            ("Place", "?cube ?target", "Holding(?cube) IsEmpty(?target)",
             "Holding(?cube) IsEmpty(?target)", "OnTarget(?cube, ?target) HandEmpty()"),
            ("Stack", "?cube1 ?cube2", "Holding(?cube1) IsTopClear(?cube2)",
             "Holding(?cube1) IsTopClear(?cube2)", "On(?cube1, ?cube2) HandEmpty()"),
        ],
    )  # fmt: skip


def make_coffee() -> Printed:
    pod, holder = make_type("pod"), make_type("holder")
    cabinet, lid = make_type("cabinet"), make_type("lid")
    is_open = Predicate.of("IsCabinetOpen", (cabinet,), [at_least(OPENING, 0.1)])
    closed = Predicate.of("IsCabinetClose", (cabinet,), [at_most(CLOSURE, 0.01)])
    lid_closed = Predicate.of("IsLidClose", (lid,), [at_most(CLOSURE, 0.01)])
    predicates = (
        symbol("HandEmpty"), held("Holding", pod), symbol("InCabinet", pod, cabinet),
        near("In", pod, holder), symbol("IsEmpty", holder), is_open, closed,
        symbol("IsLidOpen", lid), lid_closed,
    )  # fmt: skip
    objects = (pod("pod0"), holder("holder0"), cabinet("cabinet0"), lid("lid0"))
    return make(
        "make_coffee", (pod, holder, cabinet, lid), predicates, objects,
        "HandEmpty() InCabinet(pod0, cabinet0) IsEmpty(holder0) IsCabinetClose(cabinet0) "
        "IsLidOpen(lid0)",
        {"training": ("In(pod0, holder0) IsLidClose(lid0) IsCabinetClose(cabinet0)", 5)},
        [
            ("Open", "?cabinet", "IsCabinetClose(?cabinet) HandEmpty()",
             "IsCabinetClose(?cabinet)", "IsCabinetOpen(?cabinet)"),
            ("Pick", "?pod ?cabinet",
             "HandEmpty() InCabinet(?pod, ?cabinet) IsCabinetOpen(?cabinet)",
             "HandEmpty() InCabinet(?pod, ?cabinet)", "Holding(?pod)"),
            ("Insert", "?pod ?holder ?lid", "Holding(?pod) IsEmpty(?holder) IsLidOpen(?lid)",
             "Holding(?pod) IsEmpty(?holder)", "In(?pod, ?holder) HandEmpty()"),
            ("CloseLid", "?lid", "IsLidOpen(?lid) HandEmpty()", "IsLidOpen(?lid)",
             "IsLidClose(?lid)"),
            ("Close", "?cabinet", "IsCabinetOpen(?cabinet) HandEmpty()",
             "IsCabinetOpen(?cabinet)", "IsCabinetClose(?cabinet)"),
        ],
    )  # fmt: skip


ALL = (peg_in_hole, stow_hammer, stack_at_target, make_coffee)
