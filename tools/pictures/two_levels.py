# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The two levels of the abstract planning graph, of a task of Obstacle 2D.

Above, abstract states and what joins them; below, the low-level states that running it in the
model leads to. Both the plan with given skills and the one with a shortcut are shown.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from slap_ros.core import VisibleBody
from slap_ros.domains import get_domain
from slap_ros.drawing.layout import Area, RoutePoint
from slap_ros.drawing.palette import (
    BACKGROUND,
    BORDER,
    CARD,
    GOAL,
    INK,
    MUTED,
    OPTION_PEN,
    PLAN,
    PLAN_PEN,
    PLAN_TINT,
    SHORTCUT,
    SHORTCUT_PEN,
)
from slap_ros.drawing.svg import (
    SvgCurve,
    SvgGroup,
    SvgPicture,
    SvgRectangle,
    SvgShape,
    SvgText,
)
from slap_ros.drawing.words import AtomNaming
from slap_ros.evaluation.approaches import Approach, approaches
from slap_ros.evaluation.experiment import solve
from slap_ros.planning.options import OptionKind
from slap_ros.relational import AtomSpace, State
from slap_ros.shortcuts.sampling import DEFAULT
from slap_ros.shortcuts.shipped import chosen_library

GROUND = "#f3f4f2"
DOMAIN, SEED = "obstacle2d", 5
TITLE = "One task on two levels"
WIDTH_PX, HEIGHT_PX, MARGIN_PX = 1080.0, 640.0, 24.0
CARD_PX = (150.0, 78.0)  # width, height
SCENE_PX = (126.0, 84.0)
LEVELS_PX = ((48.0, 288.0), (318.0, 616.0))  # top and bottom of each level
ROWS_PX = ((128.0, 228.0), (402.0, 532.0))  # of each level: with given skills, with a shortcut
MIDDLE_PX = 178.0  # height of the start and the goal, above
LINE_PX, TEXT_PX = 15.0, 11.0
VIEW_M = (
    -0.16,
    1.16,
    -0.16,
    0.72,
)  # what of a scene is shown: x from, x to, height from, height to


@dataclass(frozen=True)
class Stop:
    """A state on the way to the goal."""

    state: State
    steps: int  # environment steps from the start
    option: str  # that led there; empty at the start
    learned: bool


@dataclass(frozen=True)
class Place:
    """Where a stop is drawn: the middle of its column, and its heights on both levels."""

    x: float
    above: float
    below: float


def make(path: Path) -> None:
    """Solve the task in both ways and draw both plans."""
    domain = get_domain(DOMAIN)
    given, _, slap = approaches(chosen_library(None, domain), DEFAULT)
    space = domain.atom_space(domain.task(SEED).initial_state)
    drawing = TwoLevels(space, stops(given), stops(slap))
    path.write_text(drawing.picture().markup() + "\n", encoding="utf-8")


def stops(approach: Approach) -> list[Stop]:
    """Where a plan's options end when it is executed.

    Raises:
        RuntimeError: It was not executed as planned.
    """
    domain = get_domain(DOMAIN)
    task = domain.task(SEED)
    goal = domain.atom_space(task.initial_state).mask(task.goal)
    plan = approach.planner("lazy", domain, task.initial_state).plan(task.initial_state, goal).plan
    episode = solve(domain, task, approach)
    if episode.plan_length != plan.predicted_steps:
        raise RuntimeError(f"{episode.plan_length} steps, not {plan.predicted_steps}")
    found = [Stop(task.initial_state, 0, "", False)]
    for edge in plan.edges:
        steps = found[-1].steps + edge.predicted_steps
        learned = edge.option.kind is OptionKind.SHORTCUT
        name = "learned shortcut" if learned else edge.option.skill.name
        found.append(Stop(episode.states[steps], steps, name, learned))
    return found


class TwoLevels:
    """Both plans, the given skills' above the other on each level; start and goal are shared."""

    def __init__(self, space: AtomSpace, given: list[Stop], slap: list[Stop]) -> None:
        self._space, self._naming = space, AtomNaming(space)
        columns = len(given)
        pitch = (WIDTH_PX - 2 * MARGIN_PX - CARD_PX[0] - 16) / (columns - 1)
        self._left = MARGIN_PX + 8 + CARD_PX[0] / 2
        self._places: dict[tuple[int, int], Place] = {}
        self._rows = (given, slap)
        for row, plan in enumerate(self._rows):
            for number in range(len(plan)):
                # Half a column to the right, so that nothing stands above or below another row.
                column = float(number) if row == 0 else number + 0.5
                shared = number in (0, len(plan) - 1)
                if shared:
                    column = 0.0 if number == 0 else columns - 1.0
                above = MIDDLE_PX if shared else ROWS_PX[0][row]
                below = sum(ROWS_PX[1]) / 2 if number == 0 else ROWS_PX[1][row]
                self._places[row, number] = Place(self._left + column * pitch, above, below)

    def picture(self) -> SvgPicture:
        """The drawing."""
        shapes: list[SvgShape] = [*self._levels()]
        for row, plan in enumerate(self._rows):
            for number in range(1, len(plan)):
                shapes += self._edge(row, number)
        for row, plan in enumerate(self._rows):
            for number, stop in enumerate(plan):
                if row == 0 or number > 0:
                    shapes.append(self._scene(self._places[row, number], stop, row))
                if row == 0 or 0 < number < len(plan) - 1:
                    shapes.append(self._card(self._places[row, number], row, number))
        given, slap = (plan[-1].steps for plan in self._rows)
        description = (
            f"Above, abstract states and the options that join them. Below, the low-level states "
            f"in which running the options ends: the goal after {given} steps with given skills, "
            f"after {slap} steps with a learned shortcut."
        )
        return SvgPicture(WIDTH_PX, HEIGHT_PX, TITLE, description, BACKGROUND, shapes)

    def _levels(self) -> Iterator[SvgShape]:
        titles: list[SvgText] = []
        below = "Low-level states: where options end when they are run in the model"
        names = (
            "Abstract states, joined by options: which atoms hold",
            f"{below}, and the environment steps so far",
        )
        for name, (top, bottom) in zip(names, LEVELS_PX, strict=True):
            area = Area(MARGIN_PX / 2, top - 24, WIDTH_PX - MARGIN_PX, bottom - top + 24)
            yield SvgRectangle(area, GROUND, "none", 0.0, 8.0)
            titles.append(SvgText(MARGIN_PX, top - 6, name, 12.5, INK, bold=True))
        yield from self._projections()
        yield from _on_ground(*titles)

    def _projections(self) -> Iterator[SvgShape]:
        """From each low-level state up to its abstract state."""
        for (row, number), place in self._places.items():
            if row == 1 and number in (0, len(self._rows[1]) - 1):
                continue  # as above it
            top = place.above + CARD_PX[1] / 2
            lowest = ROWS_PX[1][1] if number == len(self._rows[row]) - 1 else place.below
            area = Area(place.x - 0.5, top, 1.0, lowest - SCENE_PX[1] / 2 - top)
            for y in range(int(area.y), int(area.bottom), 6):
                yield SvgRectangle(Area(area.x, float(y), 1.0, 3.0), BORDER, radius_px=0.0)

    def _edge(self, row: int, number: int) -> Iterator[SvgShape]:
        stop, before = self._rows[row][number], self._rows[row][number - 1]
        start, end = self._places[row, number - 1], self._places[row, number]
        pen = SHORTCUT_PEN if stop.learned else PLAN_PEN if row else OPTION_PEN
        colour = SHORTCUT if stop.learned else PLAN if row else MUTED
        for (width, _), a, b in (
            (CARD_PX, start.above, end.above),
            (SCENE_PX, start.below, end.below),
        ):
            left, right = start.x + width / 2, end.x - width / 2
            yield SvgCurve((RoutePoint(left, a, 1), RoutePoint(right, b, 1)), pen)
        x = (start.x + end.x) / 2
        steps = f"{stop.steps - before.steps} steps"
        lift = 26 if row == 0 else -16
        y = (start.below + end.below) / 2 - lift
        bent = abs(start.below - end.below) > 1
        if bent:
            x, y = x - (0 if row else 14), y + (-14 if row == 0 else 22)
        name = SvgText(x, y, stop.option, TEXT_PX, colour, bold=stop.learned, centred=True)
        yield from _on_ground(name, SvgText(x, y + 14, steps, TEXT_PX, colour, centred=True))
        if stop.learned:
            middle = (start.above + end.above) / 2 + 34
            yield from _on_ground(SvgText(x, middle, stop.option, TEXT_PX, colour, True, True))

    def _card(self, place: Place, row: int, number: int) -> SvgGroup:
        plan = self._rows[row]
        mask = self._space.abstract(plan[number].state)
        start, goal = number == 0, number == len(plan) - 1
        width, height = CARD_PX
        area = Area(place.x - width / 2, place.above - height / 2, width, height)
        stroke = GOAL if goal else PLAN if row or start else BORDER
        fill = PLAN_TINT if row or start or goal else CARD
        shapes: list[SvgShape] = [SvgRectangle(area, fill, stroke, 1.6)]
        shown = [atom for atom in self._naming.atoms(mask) if self._matters(atom)]
        lines = [*(["start"] if start else ["goal"] if goal else []), *shown][:5]
        top = place.above - (len(lines) - 1) * LINE_PX / 2 + 4
        for k, line in enumerate(lines):
            bold = k == 0 and (start or goal)
            colour = GOAL if goal and bold else INK
            y = top + k * LINE_PX
            shapes.append(SvgText(place.x, y, line, TEXT_PX, colour, bold=bold, centred=True))
        return SvgGroup(self._naming.sentence(mask), shapes)

    def _matters(self, atom: str) -> bool:
        """What is said of the two blocks and the target; the others stay where they are."""
        return not any(name in atom for name in ("block3", "block4", "Clear(table)", "Overlap"))

    def _scene(self, place: Place, stop: Stop, row: int) -> SvgGroup:
        width, height = SCENE_PX
        area = Area(place.x - width / 2, place.below - height / 2, width, height)
        stroke = PLAN if row or stop.steps == 0 else BORDER
        shapes: list[SvgShape] = [SvgRectangle(area, CARD, stroke, 1.2)]
        domain = get_domain(DOMAIN)
        robot, *others = domain.display.bodies(stop.state)
        # The table first, so that the target area is seen on it.
        shapes += [_square(body, area, body is robot) for body in (*reversed(others), robot)]
        label = "start" if stop.steps == 0 else f"{stop.steps} steps"
        shapes.append(
            SvgText(place.x, area.bottom + 15, label, TEXT_PX, INK, bold=True, centred=True)
        )
        return SvgGroup(
            f"{label}: {self._naming.sentence(self._space.abstract(stop.state))}", shapes
        )


def _on_ground(*texts: SvgText) -> Iterator[SvgShape]:
    """Texts, and below them ground that covers what passes behind."""
    for text in texts:
        yield SvgRectangle(text.area, GROUND, radius_px=0.0)
        yield text


def _square(body: VisibleBody, scene: Area, is_robot: bool) -> SvgRectangle:
    """A body in a scene; the robot, which is where what it holds is, as a frame."""
    left, right, low, high = VIEW_M
    scale = min(scene.width / (right - left), scene.height / (high - low))
    width, height = body.size[0] * scale, body.size[2] * scale
    x = scene.x + (body.position[0] - left) * scale - width / 2
    y = scene.bottom - (body.position[2] - low) * scale - height / 2
    x, width = max(x, scene.x + 1), min(width, scene.width - 2)
    if is_robot:
        y = max(y, scene.y + 3)  # it may be further up than there is room for
        return SvgRectangle(Area(x - 1, y - 1, width + 2, height + 2), "none", INK, 1.6, 2.0)
    height = max(height, 4.0)
    return SvgRectangle(Area(x, y, width, height), _colour(body.colour), radius_px=1.0)


def _colour(rgba: tuple[float, float, float, float]) -> str:
    return "#" + "".join(f"{round(255 * c):02x}" for c in rgba[:3])
