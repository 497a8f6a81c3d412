# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Whether predicates and their margins agree, have the right shape, and leave a tolerance."""

from __future__ import annotations

import numpy as np

from slap_ros.core import Domain
from slap_ros.doctor.check import Check
from slap_ros.domain_check.experience import Experience
from slap_ros.relational import Column, GroundAtom, State

JITTER = 1e-9  # in the margin's unit: what rounding may change


def shapes(domain: Domain, seed: int) -> Check:
    """Whether predicates and margins judge each atom in each state of a batch by itself.

    What has another shape may still fit by numpy's broadcasting, and be wrong.

    Args:
        domain: Domain to check.
        seed: Seed of the task whose initial state is judged.
    """
    state = domain.task(seed).initial_state
    batch = State(state.layout, np.stack([state.data, state.data]))
    space = domain.atom_space(state)
    for predicate in domain.predicates:
        atoms = [atom.objects for atom in space.atoms if atom.predicate == predicate]
        columns = [Column(objects) for objects in zip(*atoms, strict=True)]
        for states in (state, batch) if atoms else ():
            wanted = (*states.data.shape[:-1], len(atoms))
            for what, judge in (("classifier", predicate.classifier), ("margin", predicate.margin)):
                found = wanted if judge is None else np.shape(judge(states, *columns))
                if found != wanted:
                    return Check(
                        "predicates",
                        "problem",
                        f"the {what} of {predicate.name} has the shape {found} for {len(atoms)} "
                        f"atoms and states of shape {states.data.shape}, wanted {wanted}",
                        "features of a Column have an axis of atoms after those of states",
                    )
    return Check("predicates", "ok", f"{len(domain.predicates)} judge each atom by itself")


def margins(domain: Domain, experience: Experience) -> Check:
    """Whether an atom holds exactly where its margin is at least 0, in every state seen."""
    compared = 0
    for state in experience.states:
        space = domain.atom_space(state)
        truth = space.truth(state)
        for i, atom in enumerate(space.atoms):
            if (margin := margin_of(atom, state)) is None:
                continue
            compared += 1
            if (margin >= 0.0) != bool(truth[i]):
                return Check(
                    "margins",
                    "problem",
                    f"{atom} {'holds' if truth[i] else 'does not hold'}, but its margin is "
                    f"{margin}",
                    "a margin is positive or 0 exactly where the predicate holds; "
                    "Predicate.threshold makes the one from the other",
                )
    fluent = (p for p in domain.predicates if p not in domain.static_predicates)
    without = sorted(p.name for p in fluent if p.margin is None)
    found = f"{compared} atoms agree with their margins"
    if without:  # learned from as well, but without a direction
        found += f"; true or false alone: {', '.join(without)}"
    return Check("margins", "ok", found)


def unread(domain: Domain, experience: Experience) -> Check:
    """Whether predicates that are evaluated only once, or not for each robot state, may be.

    Args:
        domain: Domain to check.
        experience: Transitions; the robot of each state is put into the state before it.
    """
    for transition in experience.transitions:
        before, after = map(domain.atom_space, (transition.state, transition.following))
        if changed := before.static_truth ^ after.static_truth:
            atom = next(iter(before.decode(changed)))
            return Check(
                "unread features",
                "problem",
                f"{atom.predicate.name} counts as static, as no operator changes it, but {atom} "
                "changes",
                "say in the operators' effects what changes it",
            )
    alike: dict[int, State] = {}  # the newest state, by its objects
    for state in experience.states:
        other = alike.get(id(state.layout), state)
        alike[id(state.layout)] = state
        if read := _read_of_robot(domain, state, other):
            return Check(
                "unread features",
                "problem",
                f"{read} changes with the robot's features alone",
                f"add {read.predicate.name} to Domain.robot_predicates, or take the robot's type "
                "out of robot_types: other predicates are not evaluated again when only a robot "
                "moves",
            )
    return Check("unread features", "ok", "what is not evaluated again does not change")


def _read_of_robot(domain: Domain, state: State, other: State) -> GroundAtom | None:
    """An atom that another robot state changes, though it is said to read none; None for none.

    Args:
        domain: Domain of the atoms.
        state: State whose atoms are compared.
        other: State of the same objects that has the other robot state.
    """
    space, data = domain.atom_space(state), state.data.copy()
    for obj, part in state.layout.slices.items():
        if obj.type in domain.robot_types:
            data[part] = other.data[part]
    differs = space.truth(state) != space.truth(State(state.layout, data))
    found = (space.atoms[i] for i in np.flatnonzero(differs))
    return next((a for a in found if a.predicate not in domain.robot_predicates), None)


def thresholds(domain: Domain, seed: int, count: int) -> Check:
    """Whether atoms of initial states are so close to their thresholds that rounding decides.

    Args:
        domain: Domain to check.
        seed: Seed of the tasks.
        count: Number of tasks.

    Returns:
        The finding, with the closest atom.
    """
    close: dict[str, float] = {}
    for index in range(count):
        state = domain.task(seed, index).initial_state
        for atom in domain.atom_space(state).atoms:
            margin = margin_of(atom, state)
            if margin is not None and abs(margin) <= JITTER:
                close[str(atom)] = margin
    if close:
        closest = min(close, key=lambda name: abs(close[name]))
        return Check(
            "thresholds",
            "warning",
            f"{len(close)} kinds of atoms are within {JITTER} of their thresholds in initial "
            f"states, {closest} by {close[closest]:.2g}",
            "another machine's rounding may find another atom there: leave a tolerance",
        )
    return Check("thresholds", "ok", f"no atom of {count} initial states is decided by rounding")


def margin_of(atom: GroundAtom, state: State) -> float | None:
    """An atom's margin in a single state; None where its predicate has none."""
    if atom.predicate.margin is None:
        return None
    columns = [Column.of(obj) for obj in atom.objects]
    return float(np.asarray(atom.predicate.margin(state, *columns))[..., 0])
