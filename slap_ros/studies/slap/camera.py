# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Plans executed on a robot in MuJoCo by what a camera sees: tags on blocks, in rendered pictures.

Nothing is trained again, and the planner's model stays as it is.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from slap_ros.api.left_out import Tell
from slap_ros.core import Domain
from slap_ros.evaluation.experiment import Trial
from slap_ros.relational import State
from slap_ros.robot.mujoco.installed import require_mujoco
from slap_ros.studies.comparison import Comparison, PlanningSetup
from slap_ros.studies.comparison_options import ChosenComparison, ComparisonOptions
from slap_ros.studies.results import Data, MarkdownTable, StudyReport
from slap_ros.studies.slap.transfer import (
    COLUMNS,
    PhysicsResult,
    draw,
    measured_by,
    solve_measured,
    words,
)
from slap_ros.studies.study import PreparedStudy, Study
from slap_ros.vision.installed import require_camera_libraries

if TYPE_CHECKING:
    from slap_ros.robot.mujoco.closed_loop import ClosedLoopWorld

SEEN = "MuJoCo, by camera"
MEASURED = """\
Pure planning and SLAP solve the same tasks on a robot in MuJoCo, of which a camera is all that says
where objects are. It is rendered (960 × 540 pixels, noise of two grey levels), stands across the
table, and sees an AprilTag on each face of each block. The arm hides what is behind it. A closed
loop runs as behind the bridge: an arm that lags follows each command, fingers hold by friction, and
what the pictures say once everything is at rest is the next state. Length is the number of
environment steps executed, mean ± sample standard deviation over solved tasks. Relative length is
the mean over that of pure planning by camera, on tasks that both solved. Success is that the goal's
atoms hold in the state that was measured. A block that no first picture shows is left out of the
task; a task about it is not solved (NO_DETECTION). A plan that begins with a held block on
something begins as if the block were lifted off it. Nothing was trained again."""


def study(comparison: Comparison) -> StudyReport:
    """Solve every task by what a camera sees.

    Args:
        comparison: Approaches, and the tasks that they solve.

    Returns:
        The report.
    """
    result = PhysicsResult(SEEN, measured_by(solve_by_camera, "by camera", comparison))
    return StudyReport(
        study="camera",
        source="",
        title=f"By camera, in another physics: {comparison.domain.name}",
        measured=MEASURED,
        table=MarkdownTable(COLUMNS, result.rows()),
        found={SEEN: [one.as_json() for one in result.measured]},
        draw=lambda figure: draw(figure, (result,)),
        size=(3.2, 3.4),
    )


def solve_by_camera(setup: PlanningSetup, seed: int, index: int) -> Trial:
    """Plan for what a camera sees, and execute the plan on a robot in MuJoCo.

    Args:
        setup: Choice of domain, planner and approach; they are made in the process that runs this.
        seed: Seed of the task.
        index: Index of the task among those of its seed.

    Returns:
        What came of it; a robot that holds after a fault has not solved its task.
    """
    return solve_measured(setup, seed, index, _before_a_camera)


def _before_a_camera(domain: Domain, initial: State) -> ClosedLoopWorld:
    from slap_ros.robot.mujoco.closed_loop import ClosedLoopWorld, camera_settings
    from slap_ros.robot.mujoco.detectors import TagCameraDetector, camera_beside

    detector = TagCameraDetector(domain, initial, camera_beside())
    return ClosedLoopWorld(domain, initial, camera_settings(), detector)


def _summary(found: Data) -> str:
    return words(found[SEEN])


def prepare(options: ComparisonOptions, tell: Tell) -> PreparedStudy:
    """Open domain and library.

    Raises:
        InvalidParameterError: MuJoCo, or a library for tags, is not installed; or the domain has
            no such robot.
        OpenLoopOnlyError: The domain's robot is a hand that acts by forces.
    """
    require_mujoco()
    require_camera_libraries()
    # Not above: the registry of studies is imported where there is no physics.
    from slap_ros.robot.usable_domains import require_robot

    compared = ChosenComparison.of(options, tell).ends()
    require_robot(compared.domain, compared.domain.task(0).initial_state)
    return compared.prepare(study)


STUDY = Study(
    "camera",
    help="Plans executed by what a camera sees of tags on blocks: a robot in MuJoCo, closed loop.",
    example="slap study camera obstacle_tower",
    options=ComparisonOptions,
    prepare=prepare,
    summary=_summary,
    costs="planning, simulation and tags",
)
