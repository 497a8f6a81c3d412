# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a control period makes of hand and bodies, and how much of it has to be computed.

Bodies that rest and that nothing moving can reach are left out and stay as they are, to the bit.
Where nothing is left, the hand goes its own way.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace

from slap_ros.geometry.pose import IDENTITY, Pose
from slap_ros.worlds.contact.arm import CONTROL_PERIOD_S
from slap_ros.worlds.contact.contacts import (
    THE_HAND,
    ContactPoint,
    Side,
    Surface,
    grasped,
    groups,
)
from slap_ros.worlds.contact.hand import HandState, hand_at, own_way
from slap_ros.worlds.contact.involved import (
    TOUCH,
    Bounds,
    Involved,
    Mover,
    clusters,
    frame_bounds,
    hand_bounds,
    meet,
    moving_bounds,
    part_bounds,
    rigid_bounds,
    space_of_way,
    touched,
)
from slap_ros.worlds.contact.scene import ContactScene
from slap_ros.worlds.contact.simulation import GRAVITY, ContactSimulation, Outcome
from slap_ros.worlds.contact.snapshot import ContactSnapshot, Opening, Placement
from slap_ros.worlds.layout_index import BodyState
from slap_ros.worlds.panda import FINGER_OPEN

# What moved less than this in a control period, and is slower than this after it, is at rest.
REST_SPEED = 0.02  # m/s and rad/s, along each axis
REST_SHIFT = 2e-4  # m, along each axis
REST_TURN = 1e-3  # 1, of each component of the quaternion; rad, of a joint
FALL = 0.5 * GRAVITY * CONTROL_PERIOD_S**2  # m, from rest in a period
SWING = 0.1  # m, from the grasp point to what moves furthest when the hand turns
OVERSHOOT_S = 0.02  # a hand that moves on goes less far beyond its target than in this time
NOTHING = Involved(hand=False)
SOMEWHERE = hand_at((0.5, 0.0, 0.5))  # stands for any hand where there is to be none
MOST_REMEMBERED = 256  # arrangements of bodies known to stand or not

Moving = BodyState | Opening
Contacts = tuple[ContactPoint, ...]


class ContactDynamics:
    """The dynamics of a scene; it remembers nothing that matters but where fixed bodies stand."""

    def __init__(self, scene: ContactScene, simulation: ContactSimulation) -> None:
        self._scene, self._simulation = scene, simulation
        self._count = len(scene.free) + len(scene.jointed)
        self._standing: dict[object, bool] = {}
        self._quiet: list[Moving | None] = []
        self._hand: tuple[Pose, tuple[float, float], tuple[Bounds, ...]] | None = None
        self._bounded: list[tuple[Moving, Bounds] | None] = [None] * self._count

    def place(self, placement: Placement) -> None:
        """Let the bodies that do not move stand there."""
        self._placement = placement
        self._fixed = [
            bounds
            for body, pose in zip(self._scene.fixed, placement.fixed, strict=True)
            if body.solid
            for bounds in part_bounds(body, pose)
        ]
        self._frames = [
            frame_bounds(body, pose)
            for body, pose in zip(self._scene.jointed, placement.jointed, strict=True)
        ]
        self._standing.clear()
        self._quiet = []
        self._bounded = [None] * self._count

    def after(self, now: ContactSnapshot, pull: Pose) -> tuple[ContactSnapshot, Contacts]:
        """How everything is after a control period, and what touches what.

        Args:
            now: Present snapshot, with the hand's new command.
            pull: Pose that the hand is pulled to in this period.
        """
        far = self._is_far(now, pull)
        involved = NOTHING if far else self._involved(now, self._sweep(now.hand, pull))
        if involved == NOTHING:
            alone = own_way(now.hand, pull, self._scene.hand)
            return now._replace(hand=alone, held=None), ()
        while True:
            outcome = self._run(now, pull, involved)
            if not involved.hand:
                alone = own_way(now.hand, pull, self._scene.hand)
                outcome = replace(outcome, hand=alone)
            wider = self._widened(now, involved, outcome)
            if wider == involved:
                return self._taken_over(now, involved, outcome), outcome.contacts
            involved = wider

    def _run(self, now: ContactSnapshot, pull: Pose, involved: Involved) -> Outcome:
        """One control period, in the simulation that other worlds use in between."""
        with self._simulation.lock:
            self._simulation.place(self._placement)
            return self._simulation.run(now, pull, involved)

    # -- what is involved -----------------------------------------------------------------------

    def _is_far(self, now: ContactSnapshot, pull: Pose) -> bool:
        """Whether nothing moves but the hand, and that passes nothing; quick, so that it may miss.

        What it misses is found out by looking at palm and fingers one by one.
        """
        moving = _all(now)
        if not all(motion.still for motion in moving):
            return False
        margin = TOUCH + OVERSHOOT_S * max(map(abs, now.hand.velocity))
        space = space_of_way(now.hand.pose, pull, margin)
        if space is None or meet((space,), self._fixed):
            return False
        bounds = [self._bounds(i, motion) for i, motion in enumerate(moving)]
        return not meet((space,), bounds) and not self._unsupported(now, bounds)

    def _involved(self, now: ContactSnapshot, sweep: Mover) -> Involved:
        bounds: list[Bounds] = []
        movers: dict[int, Mover] = {}
        resting: list[Bounds | None] = []
        for i, motion in enumerate(_all(now)):
            box = self._bounds(i, motion)
            bounds.append(box)
            resting.append(box if motion.still else None)
            if not motion.still:
                movers[i] = Mover.of(box, self._travel(motion, box))
        movers |= touched([sweep, *movers.values()], resting)
        left = [None if i in movers else box for i, box in enumerate(resting)]
        if falling := self._unsupported(now, left):
            for i in falling:
                movers[i] = Mover.of(bounds[i], FALL)
                left[i] = None
            movers |= touched([movers[i] for i in falling], left)
        met = meet(sweep.spaces, self._fixed) or any(
            meet(sweep.spaces, mover.spaces) for mover in movers.values()
        )
        return Involved(tuple(sorted(movers)), met)

    def _unsupported(self, now: ContactSnapshot, left: Sequence[Bounds | None]) -> list[int]:
        """The bodies that would not stay where they are by themselves."""
        moving = _all(now)
        quiet = [None if box is None else moving[i] for i, box in enumerate(left)]
        if quiet == self._quiet:
            return []
        falling = [
            i for members in clusters(left) if not self._stand(now, members) for i in members
        ]
        if not falling:
            self._quiet = quiet
        return falling

    def _stand(self, now: ContactSnapshot, members: tuple[int, ...]) -> bool:
        """Whether bodies without velocity would stay where they are if there were no hand.

        So they do where they came to rest by themselves. They do not in mid-air, over an edge,
        or where they leaned on the hand.
        """
        moving = _all(now)
        key = (members, tuple(moving[i] for i in members))
        stands = self._standing.get(key)
        if stands is None:
            alone = _alone(now, members)
            outcome = self._run(alone, SOMEWHERE.pose, Involved(members, hand=False))
            after = self._results(outcome)
            stands = all(_rests(moving[i], after[i]) for i in members)
            if len(self._standing) == MOST_REMEMBERED:
                self._standing.clear()
            self._standing[key] = stands
        return stands

    def _widened(self, now: ContactSnapshot, involved: Involved, outcome: Outcome) -> Involved:
        """The bodies involved, with those that were reached although it was not expected."""
        if involved.hand and len(involved.bodies) == self._count:
            return involved
        moving, after = _all(now), self._results(outcome)
        ways = [
            self._bounds(i, moving[i]).hull(self._bounds(i, motion)) for i, motion in after.items()
        ]
        hand = _hulls(self._hand_bounds(now.hand), self._hand_bounds(outcome.hand))
        met = involved.hand or meet(ways, hand)
        if involved.hand:
            ways += hand
        others = [
            i
            for i in range(self._count)
            if i not in after and meet(ways, [self._bounds(i, moving[i])])
        ]
        return Involved(tuple(sorted([*involved.bodies, *others])), met)

    # -- what came of it ------------------------------------------------------------------------

    def _taken_over(
        self, now: ContactSnapshot, involved: Involved, outcome: Outcome
    ) -> ContactSnapshot:
        """The outcome, with what came to rest put to rest."""
        moving, after = _all(now), self._results(outcome)
        resting = {i for i, motion in after.items() if _rests(moving[i], motion)}
        if resting:
            surfaces = {self._surface(i): i for i in involved.bodies}
            for group in groups(outcome.contacts, [*surfaces, THE_HAND]):
                members = {surfaces.get(surface, -1) for surface in group}  # -1: the hand
                if members <= resting:
                    after |= {i: _stopped(moving[i]) for i in members}
        bodies, openings = list(now.bodies), list(now.openings)
        for i, motion in after.items():
            if isinstance(motion, BodyState):
                bodies[i] = motion
            else:
                openings[i - len(bodies)] = motion
        held = grasped(outcome.contacts, outcome.hand.pose) if involved.hand else None
        return now._replace(
            hand=outcome.hand, bodies=tuple(bodies), openings=tuple(openings), held=held
        )

    def _results(self, outcome: Outcome) -> dict[int, Moving]:
        count = len(self._scene.free)
        jointed = {count + i: opening for i, opening in outcome.openings.items()}
        return {**outcome.bodies, **jointed}

    def _surface(self, i: int) -> Surface:
        count = len(self._scene.free)
        return Surface(Side.FREE, i) if i < count else Surface(Side.MOVING, i - count)

    # -- where it is ----------------------------------------------------------------------------

    def _sweep(self, hand: HandState, pull: Pose) -> Mover:
        """Where the hand can touch something on its way, and how far it can push that."""
        way = math.dist(hand.pose.position, pull.position) + SWING * hand.pose.angle_to(pull)
        margin = TOUCH + OVERSHOOT_S * max(map(abs, hand.velocity))
        there = hand_bounds(hand._replace(pose=pull, fingers=(FINGER_OPEN, FINGER_OPEN)))
        spaces = _hulls(self._hand_bounds(hand), there)
        return Mover(tuple(space.grown(margin) for space in spaces), way + margin)

    def _hand_bounds(self, hand: HandState) -> tuple[Bounds, ...]:
        """The bounds of palm and fingers; worked out again when they moved."""
        known = self._hand
        if known is None or known[0] is not hand.pose or known[1] is not hand.fingers:
            known = self._hand = (hand.pose, hand.fingers, hand_bounds(hand))
        return known[2]

    def _bounds(self, i: int, motion: Moving) -> Bounds:
        """The bounds of a body where it is; worked out again when it moved."""
        known = self._bounded[i]
        if known is None or known[0] is not motion:
            known = self._bounded[i] = (motion, self._new_bounds(i, motion))
        return known[1]

    def _new_bounds(self, i: int, motion: Moving) -> Bounds:
        if isinstance(motion, BodyState):
            return rigid_bounds(self._scene.free[i], motion.pose)
        i -= len(self._scene.free)
        pose = self._placement.jointed[i]
        moving = moving_bounds(self._scene.jointed[i], pose, motion.position)
        return moving.hull(self._frames[i])

    def _travel(self, motion: Moving, bounds: Bounds) -> float:
        """How far any point of a body is expected to go in a period, m."""
        size = math.dist(*bounds)
        if isinstance(motion, Opening):
            return abs(motion.velocity) * max(1.0, size) * CONTROL_PERIOD_S + FALL
        speed = math.hypot(*motion.velocity) + 0.5 * size * math.hypot(*motion.angular_velocity)
        return speed * CONTROL_PERIOD_S + FALL


def _alone(now: ContactSnapshot, members: tuple[int, ...]) -> ContactSnapshot:
    """The snapshot of some bodies alone; all others, and the hand, always have the same state."""
    count = len(now.bodies)
    return now._replace(
        hand=SOMEWHERE,
        bodies=tuple(b if i in members else BodyState(IDENTITY) for i, b in enumerate(now.bodies)),
        openings=tuple(
            o if count + i in members else Opening(0.0) for i, o in enumerate(now.openings)
        ),
    )


def _all(now: ContactSnapshot) -> tuple[Moving, ...]:
    """The motion of every free body, then the opening of every jointed one, by number."""
    return (*now.bodies, *now.openings)


def _hulls(some: Iterable[Bounds], others: Iterable[Bounds]) -> tuple[Bounds, ...]:
    return tuple(a.hull(b) for a, b in zip(some, others, strict=True))


def _rests(before: Moving, after: Moving) -> bool:
    """Whether a body hardly moved in a control period and hardly moves now."""
    if isinstance(before, Opening) or isinstance(after, Opening):
        assert isinstance(before, Opening) and isinstance(after, Opening)
        shift = abs(after.position - before.position)
        return abs(after.velocity) < REST_SPEED and shift < REST_SHIFT
    (position, quaternion), (old_position, old_quaternion) = after.pose, before.pose
    return (
        all(abs(v) < REST_SPEED for v in (*after.velocity, *after.angular_velocity))
        and _near(position, old_position, REST_SHIFT)
        and _near(quaternion, old_quaternion, REST_TURN)
    )


def _near(some: Iterable[float], others: Iterable[float], distance: float) -> bool:
    return all(abs(a - b) < distance for a, b in zip(some, others, strict=True))


def _stopped(motion: Moving) -> Moving:
    """The motion with the same pose or opening, and without velocity."""
    if motion.still:
        return motion
    return Opening(motion.position) if isinstance(motion, Opening) else BodyState(motion.pose)
