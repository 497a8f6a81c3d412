# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What detections and pictures say of the objects of a scene."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Mapping
from types import MappingProxyType

from slap_ros.errors import InvalidMeasurementError
from slap_ros.geometry.pose import Pose
from slap_ros.relational import Object
from slap_ros.robot.line_of_sight import Ways, is_slanted
from slap_ros.robot.opening_sensor import OpeningSensor
from slap_ros.robot.scene_config import DetectedFrame, SceneConfig
from slap_ros.robot.tracking import LONGEST, Detection, Track, TrackingSettings, measured_pose

FARTHEST = 10.0  # m, from the base; what is detected further away is in another unit


class DetectedObjects:
    """The objects that are detected, each with its track, and the pictures that were searched."""

    def __init__(
        self,
        scene_config: SceneConfig,
        tracking: TrackingSettings,
        in_hand: Callable[[Object], Pose | None],
        openings: Mapping[Object, OpeningSensor] = MappingProxyType({}),
    ) -> None:
        """Know of no detection yet.

        Args:
            scene_config: Objects of the scene, and how they are detected.
            tracking: Settings of how far detections can be trusted.
            in_hand: Function that says where the hand has an object; None where it does not hold
                it, or nothing was measured yet.
            openings: Objects of which a part slides or turns, and how that is measured: their
                tracks are those of these parts.
        """
        self.tracks = {obj: Track(tracking) for obj in scene_config.detected}
        self._frames = {
            how.frame: (obj, how) for obj, frames in scene_config.detected.items() for how in frames
        }
        self._pictures: deque[float] = deque(maxlen=LONGEST)  # stamps, each once
        self._in_hand, self._openings = in_hand, openings
        self.refusals: dict[Object, InvalidMeasurementError] = {}  # since the last good detection

    @property
    def has_pictures(self) -> bool:
        """Whether any picture was searched."""
        return bool(self._pictures)

    def add(self, frame: str, stamp_s: float, base: Pose, seen: Pose) -> None:
        """Take a detection; frames that belong to no object are ignored.

        Args:
            frame: Name of the child frame.
            stamp_s: Time of the measurement, s.
            base: Pose of the parent frame in the base's frame; of a tag's, the camera's.
            seen: Pose of the child frame in its parent.

        Raises:
            InvalidMeasurementError: Not finite, no pose, further away than anything a robot works
                with, beside the way of what slides or turns, or not newer than the last one.
        """
        if frame not in self._frames:
            return
        obj, how = self._frames[frame]
        try:
            self._add(obj, how, stamp_s, base, seen)
        except InvalidMeasurementError as error:
            self.refusals[obj] = error
            raise
        self.refusals.pop(obj, None)
        self.add_picture(stamp_s)

    def _add(self, obj: Object, how: DetectedFrame, stamp_s: float, base: Pose, seen: Pose) -> None:
        found, is_tag = measured_pose(*seen), how.tag_size is not None
        pose = base.compose(found).compose(how.offset)
        if is_tag:
            pose = self._likelier(obj, Ways.of(base, found, how.offset))
        if math.hypot(*pose.position) > FARTHEST:
            raise InvalidMeasurementError(
                f"{obj.name} is detected {math.hypot(*pose.position):.6g} m away from the robot: "
                "are positions in m?"
            )
        if is_tag and is_slanted(found):
            return
        if obj in self._openings:
            self._openings[obj].require_on_path(pose)
        eye = base.position if is_tag else None
        self.tracks[obj].add(Detection(stamp_s, pose, how.frame, eye))

    def add_picture(self, stamp_s: float) -> None:
        """Take that a picture was searched: what none of several shows is hidden.

        Args:
            stamp_s: Time at which it was taken, s.
        """
        if not self._pictures or stamp_s > self._pictures[-1]:
            self._pictures.append(stamp_s)

    def _likelier(self, obj: Object, ways: Ways) -> Pose:
        """The likelier of the two ways in which a tag may be turned."""
        if obj in self._openings:
            return self._openings[obj].likelier(*ways)
        held, last = self._in_hand(obj), self.tracks[obj].last_at_rest
        if held is not None:
            return ways.in_hand(held)
        return ways.at_rest(last.pose if last is not None else None)

    def never_seen(self) -> list[Object]:
        """The objects that were never detected."""
        return [obj for obj, track in self.tracks.items() if track.newest_s == -math.inf]

    def is_hidden(self, obj: Object, since_s: float, enough: int) -> bool:
        """Whether pictures since then, and since it was seen last, do not show an object.

        Where none of the last pictures shows anything, something covers the camera.

        Args:
            obj: Object of the scene.
            since_s: Time before which pictures do not count, s.
            enough: Number of pictures in a row without it after which it is hidden; 0: never.
        """
        unseen_s = max(since_s, self.tracks[obj].newest_s)
        newest_s = max(one.newest_s for one in self.tracks.values())
        if not self._pictures or newest_s < self._pictures[0]:
            return False
        return 0 < enough <= sum(stamp_s > unseen_s for stamp_s in self._pictures)
