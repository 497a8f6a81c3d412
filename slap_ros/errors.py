# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Every way in which slap_ros refuses or fails: one code and one exception class a cause.

The codes are the ones that ROS results carry (``slap_msgs/ErrorCode``) and the exit codes of
``slap``. Each server has a range of its own.
"""

from __future__ import annotations

from enum import IntEnum


class ErrorCode(IntEnum):
    """Causes of failure. Values fit a process exit code."""

    NONE = 0
    UNKNOWN = 1

    # 3-9: what no command foresaw; 2 is wrong usage of the command line
    INTERNAL_ERROR = 3
    OUT_OF_MEMORY = 4
    INPUT_OUTPUT = 5

    # 10-29: input, refused at the door
    UNKNOWN_DOMAIN = 10
    INVALID_DOMAIN = 11
    MALFORMED_PDDL = 12
    UNKNOWN_OBJECT = 13
    UNKNOWN_PREDICATE = 14
    INVALID_PARAMETER = 15
    INVALID_STATE = 16
    INVALID_LIBRARY = 17
    MISMATCHED_ATOM = 18
    INVALID_MESH = 19
    MESH_UNAVAILABLE = 20
    UNKNOWN_GOAL = 21

    # 30-49: planner
    UNSOLVABLE = 30
    PLANNING_LIMIT = 31
    REPLANS_EXHAUSTED = 32
    STEP_LIMIT = 33
    GOAL_CANCELED = 34
    EPISODE_CHANGED = 35
    BUSY = 36
    NO_TASK = 37
    NO_SKILLS = 38

    # 50-69: skill server
    UNKNOWN_SKILL = 50
    SKILL_NOT_APPLICABLE = 51
    SKILL_STEP_LIMIT = 52
    SKILL_STOPPED_SHORT = 53
    SKILL_CANCELED = 54
    NO_STATE = 55
    SKILL_REJECTED = 56

    # 70-89: simulator and robot bridge
    INVALID_COMMAND = 70
    STALE_COMMAND = 71
    UNSAFE_COMMAND = 72
    CONTROLLER_REJECTED = 73
    CONTROLLER_ABORTED = 74
    CONTROLLER_TIMEOUT = 75
    NO_JOINT_STATE = 76
    NO_DETECTION = 77
    INVALID_MEASUREMENT = 78
    INVALID_SCENE = 79
    OPEN_LOOP_ONLY = 80
    ROBOT_REFLEX = 81
    ROBOT_UNREACHABLE = 82
    ROBOT_VERSION = 83
    GRIPPER_FAILED = 84

    # 90-109: bags
    DAMAGED_BAG = 90
    FOREIGN_BAG = 91
    STORAGE_FULL = 92
    BAG_EXISTS = 93
    REPLAY_MISMATCH = 94
    START_MISMATCH = 95

    # 110-129: the ensemble
    NODE_DIED = 110
    TIMEOUT = 111
    NOT_READY = 112
    ALREADY_RUNNING = 113
    SKILLS_CHANGED = 114

    # 130-149: acquisition; from 140 on, proposals and language models
    INVALID_REWARD = 130
    TRAINER_DIED = 131
    NOTHING_LEARNED = 132
    PROPOSAL_REJECTED = 140
    MALFORMED_ANSWER = 141
    CASSETTE_MISS = 142
    INVALID_CASSETTE = 143
    LANGUAGE_OFF = 144
    LANGUAGE_UNAVAILABLE = 145
    LANGUAGE_REFUSED = 146


class SlapError(Exception):
    """Base of all errors; its message says what was wrong, where, and what to do."""

    code = ErrorCode.UNKNOWN


def error_from(code: int, message: str) -> SlapError:
    """The error that a result with this code and message stands for."""
    error = SlapError(message)
    error.code = ErrorCode(code)
    return error


class InternalError(SlapError):
    """What a node's code did not foresee; its log has the traceback."""

    code = ErrorCode.INTERNAL_ERROR


class UnknownDomainError(SlapError):
    """No domain of that name is registered."""

    code = ErrorCode.UNKNOWN_DOMAIN


class InvalidDomainError(SlapError):
    """A domain's parts do not fit together."""

    code = ErrorCode.INVALID_DOMAIN


class MalformedPddlError(SlapError):
    """PDDL text that cannot be read."""

    code = ErrorCode.MALFORMED_PDDL


class UnknownObjectError(SlapError):
    """An object that the task does not have."""

    code = ErrorCode.UNKNOWN_OBJECT


class UnknownPredicateError(SlapError):
    """A predicate that the domain does not have."""

    code = ErrorCode.UNKNOWN_PREDICATE


class MismatchedAtomError(SlapError):
    """A ground atom with the wrong number or types of objects."""

    code = ErrorCode.MISMATCHED_ATOM


class InvalidParameterError(SlapError):
    """A parameter or option with a value it cannot take."""

    code = ErrorCode.INVALID_PARAMETER


class InvalidStateError(SlapError):
    """A state that does not fit its objects, or a scene that cannot be."""

    code = ErrorCode.INVALID_STATE


class InvalidLibraryError(SlapError):
    """A shortcut library that is missing, damaged or of another version."""

    code = ErrorCode.INVALID_LIBRARY


class InvalidMeshError(SlapError):
    """A mesh that is no solid body, or a file that holds none."""

    code = ErrorCode.INVALID_MESH


class MeshUnavailableError(SlapError):
    """A mesh that is not on this machine and cannot be had, or a library that it takes."""

    code = ErrorCode.MESH_UNAVAILABLE


class UnknownGoalError(SlapError):
    """A goal's name that the domain does not have."""

    code = ErrorCode.UNKNOWN_GOAL


class NoSkillsError(SlapError):
    """A domain whose skills are still to be acquired cannot be planned in, nor run."""

    code = ErrorCode.NO_SKILLS


class UnsolvableError(SlapError):
    """No sequence of options reaches the goal."""

    code = ErrorCode.UNSOLVABLE


class PlanningLimitError(SlapError):
    """Planning was given up at one of its limits; the task may be solvable."""

    code = ErrorCode.PLANNING_LIMIT


class SkillNotApplicableError(SlapError):
    """An option that cannot start from this state."""

    code = ErrorCode.SKILL_NOT_APPLICABLE


class TaskCanceledError(SlapError):
    """A run was canceled by its client."""

    code = ErrorCode.GOAL_CANCELED


class NoTaskError(SlapError):
    """No task is known: nothing perceived yet."""

    code = ErrorCode.NO_TASK


class BusyError(SlapError):
    """Only one of these can be under way at a time."""

    code = ErrorCode.BUSY


class EpisodeChangedError(SlapError):
    """The simulator was reset while something was under way."""

    code = ErrorCode.EPISODE_CHANGED


class NoStateError(SlapError):
    """No perceived state is known."""

    code = ErrorCode.NO_STATE


class UnknownSkillError(SlapError):
    """An option that the domain does not have."""

    code = ErrorCode.UNKNOWN_SKILL


class SkillRejectedError(SlapError):
    """The skill server did not accept a goal."""

    code = ErrorCode.SKILL_REJECTED


class InvalidCommandError(SlapError):
    """A command that is not finite, has the wrong length or is out of range."""

    code = ErrorCode.INVALID_COMMAND


class StaleCommandError(SlapError):
    """A command that answers another state than the current one."""

    code = ErrorCode.STALE_COMMAND


class UnsafeCommandError(SlapError):
    """A command that would take a real arm beyond its limits or out of its workspace."""

    code = ErrorCode.UNSAFE_COMMAND


class ControllerRejectedError(SlapError):
    """A controller of the robot did not accept a goal."""

    code = ErrorCode.CONTROLLER_REJECTED


class ControllerAbortedError(SlapError):
    """A controller of the robot gave a goal up."""

    code = ErrorCode.CONTROLLER_ABORTED


class ControllerTimeoutError(SlapError):
    """A controller of the robot is not there, or did not answer in time."""

    code = ErrorCode.CONTROLLER_TIMEOUT


class NoJointStateError(SlapError):
    """The robot does not say where its joints are."""

    code = ErrorCode.NO_JOINT_STATE


class NoDetectionError(SlapError):
    """An object is not detected."""

    code = ErrorCode.NO_DETECTION


class InvalidMeasurementError(SlapError):
    """A measurement that is not finite, no pose at all, or older than one already known."""

    code = ErrorCode.INVALID_MEASUREMENT


class InvalidSceneError(SlapError):
    """A description of a real scene that is missing, malformed or of another domain."""

    code = ErrorCode.INVALID_SCENE


class OpenLoopOnlyError(SlapError):
    """A domain of the contact world, in closed loop on an arm that stands between commands."""

    code = ErrorCode.OPEN_LOOP_ONLY


class RobotReflexError(SlapError):
    """The robot's own control stopped the arm: a collision, a limit, or commands that came late."""

    code = ErrorCode.ROBOT_REFLEX


class RobotUnreachableError(SlapError):
    """The robot does not answer, or no longer does."""

    code = ErrorCode.ROBOT_UNREACHABLE


class RobotVersionError(SlapError):
    """The robot speaks another version of its protocol than the library here."""

    code = ErrorCode.ROBOT_VERSION


class GripperFailedError(SlapError):
    """The robot's gripper reported that a motion of its fingers failed."""

    code = ErrorCode.GRIPPER_FAILED


class DamagedBagError(SlapError):
    """A bag that ends early or cannot be read."""

    code = ErrorCode.DAMAGED_BAG


class ForeignBagError(SlapError):
    """A readable bag that no slap_ros run wrote."""

    code = ErrorCode.FOREIGN_BAG


class StorageFullError(SlapError):
    """No room left where a bag is being written."""

    code = ErrorCode.STORAGE_FULL


class BagExistsError(SlapError):
    """A bag would overwrite something."""

    code = ErrorCode.BAG_EXISTS


class StartMismatchError(SlapError):
    """A robot, or what is around it, that is not where a recording begins."""

    code = ErrorCode.START_MISMATCH


class NodeDiedError(SlapError):
    """A node of the ensemble ended while a run was under way; its own code is kept, if any."""

    code = ErrorCode.NODE_DIED

    def __init__(self, message: str, code: ErrorCode = ErrorCode.NODE_DIED) -> None:
        super().__init__(message)
        self.code = code


class RunTimeoutError(SlapError):
    """The ensemble did not answer in time."""

    code = ErrorCode.TIMEOUT


class NotReadyError(SlapError):
    """The ensemble did not come up."""

    code = ErrorCode.NOT_READY


class AlreadyRunningError(SlapError):
    """Another ensemble uses the same domain id and namespace."""

    code = ErrorCode.ALREADY_RUNNING


class SkillsChangedError(SlapError):
    """Other skills than the world announces, or than shortcuts were learned over."""

    code = ErrorCode.SKILLS_CHANGED


class InvalidRewardError(SlapError):
    """A reward that does not fit its operator, or that cannot be weighed."""

    code = ErrorCode.INVALID_REWARD


class TrainerDiedError(SlapError):
    """The process that learns skills ended before it was done; what it learned is kept."""

    code = ErrorCode.TRAINER_DIED


class NothingLearnedError(SlapError):
    """No skill came of an acquisition; the message says why."""

    code = ErrorCode.NOTHING_LEARNED


class ProposalRejectedError(SlapError):
    """No proposal passed the checks within the budget; the message has the last complaints."""

    code = ErrorCode.PROPOSAL_REJECTED


class MalformedAnswerError(SlapError):
    """A text that should be operators, rewards or a decomposition, and cannot be read as such."""

    code = ErrorCode.MALFORMED_ANSWER


class CassetteMissError(SlapError):
    """A recording of a language model does not have what is asked."""

    code = ErrorCode.CASSETTE_MISS


class InvalidCassetteError(SlapError):
    """A recording of a language model that is missing, damaged or would be overwritten."""

    code = ErrorCode.INVALID_CASSETTE


class LanguageOffError(SlapError):
    """A language model was to be asked, and must not be."""

    code = ErrorCode.LANGUAGE_OFF


class LanguageUnavailableError(SlapError):
    """A language model cannot be asked, or did not answer in time."""

    code = ErrorCode.LANGUAGE_UNAVAILABLE


class LanguageRefusedError(SlapError):
    """The server of a language model does not accept the key, the model or the request."""

    code = ErrorCode.LANGUAGE_REFUSED
