# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Which skills are trained next: one that makes no progress is left for others, and tried again."""

from dataclasses import replace

import pytest

from slap_ros.acquisition.curriculum.curriculum_state import CurriculumState, SkillProgress
from slap_ros.acquisition.curriculum.initiation_states import InitiationStates
from slap_ros.acquisition.curriculum.plan_rollout import PlanRollout, Stage, StageEnd
from slap_ros.acquisition.curriculum.skill_selection import NO_PROGRESS, select_skills
from slap_ros.acquisition.training.settings import AcquisitionSettings

SETTINGS = AcquisitionSettings()
HERE, ELSEWHERE = 0.1, 0.7  # where Put begins, in m
# Put and Open fail equally often.
PLANS = 4


def stage(operator, where, end=StageEnd.DONE):
    return Stage(operator, (), (where,), end.value, 1)


def rolled_out(where):
    """Plans that get to Put, which fails from where it begins, and plans in which Open fails."""
    ends = [stage("Pick", 0.0), stage("Put", where, StageEnd.NO_EFFECT)]
    puts = [PlanRollout(i, ("Pick", "Put"), tuple(ends)) for i in range(PLANS)]
    opened = stage("Open", 0.3, StageEnd.NO_EFFECT)
    return [*puts, *(PlanRollout(PLANS + i, ("Open",), (opened,)) for i in range(PLANS))]


def curriculum(progress, stale=2):
    """As it is once Put has learned from ``HERE``, in vain for so many rounds."""
    learned_from = InitiationStates.of("Put", rolled_out(HERE)).digest
    put = SkillProgress(2, success=0.5, stale=stale, learned_from=learned_from)
    skills = {"Pick": SkillProgress(1, 1.0), "Put": put, "Open": SkillProgress(1, 0.5)}
    return CurriculumState(skills, list(progress))


BETTER, THE_SAME = (0.5, 0.6), (0.6, 0.6)


@pytest.mark.parametrize(
    ("where", "progress", "stale", "chosen"),
    [
        (HERE, BETTER, 1, ("Open", "Put")),  # one round in vain is no reason
        (HERE, BETTER, 2, ("Open",)),
        (HERE, THE_SAME, 2, ("Open",)),
        (ELSEWHERE, BETTER, 2, ("Open", "Put")),
        (ELSEWHERE, THE_SAME, 2, ("Open",)),  # new tasks, but plans get no further
    ],
)
def test_no_progress_in_two_rounds_leaves_a_skill_until_it_begins_elsewhere(
    where, progress, stale, chosen
):
    selection = select_skills(rolled_out(where), curriculum(progress, stale), SETTINGS)
    assert selection.operators == chosen
    reasons = {name: reason["why"] for name, reason in selection.not_trained.items()}
    assert reasons == ({} if "Put" in chosen else {"Put": NO_PROGRESS})


def test_where_no_other_skill_is_left_the_selection_is_empty_and_says_how_it_failed():
    puts = rolled_out(HERE)[:PLANS]
    selection = select_skills(puts, curriculum(BETTER), SETTINGS)
    assert (selection.operators, selection.steps) == ((), 0)
    said = selection.not_trained["Put"]
    assert (said["states"], said["ends"]) == (PLANS, {StageEnd.NO_EFFECT.value: PLANS})


def test_patience_is_a_setting():
    patient = replace(SETTINGS, patience=3)
    chosen = select_skills(rolled_out(HERE), curriculum(THE_SAME), patient).operators
    assert chosen == ("Open", "Put")


def test_what_two_skills_fail_after_is_learned_again_once():
    """Whatever Put and Open have learned: neither has ever succeeded behind Pick."""
    plans = [
        PlanRollout(i, ("Pick", name), (stage("Pick", 0.0), stage(name, HERE, StageEnd.NO_EFFECT)))
        for i, name in enumerate(["Put", "Open"] * PLANS)
    ]
    vain = {
        name: SkillProgress(2, 0.0, 2, InitiationStates.of(name, plans).digest)
        for name in ("Put", "Open")
    }
    state = CurriculumState({"Pick": SkillProgress(1, 1.0), **vain}, list(THE_SAME))
    selection = select_skills(plans, state, SETTINGS)
    assert [end.before for end in selection.dead_ends] == ["Pick", "Pick"]
    assert selection.operators == ("Pick",)
    state.start_over(name for end in selection.dead_ends for name in (end.before, end.skill))
    assert [skill.attempt for skill in state.skills.values()] == [1, 1, 1]
