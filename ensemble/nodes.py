# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Which nodes an ensemble has, and the parameters of each for a given run."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from pkgutil import resolve_name
from types import MappingProxyType
from typing import Any

from ensemble.robot_parameters import (
    BEFORE_MUJOCO,
    BEFORE_MUJOCO_AT_A_BENCH,
    MUJOCO_AT_A_BENCH,
    OF_JOINTS,
    Parameters,
)
from slap_ros.robot.worlds import FRANKA, FRANKA_SIM, MOCK, MUJOCO, SIM
from slap_ros.shortcuts.sampling import DEFAULT
from slap_ros.skills.domain_choice import DomainChoice

# What shares a process with others is reached by name: nodes build on the ensemble, not it on them.
NODE_CLASSES: Mapping[str, str] = {  # by the name of the module that is run as a process
    "sim_node": "sim_node.node:SimNode",
    "robot_bridge": "robot_bridge.node:RobotBridge",
    "robot_bridge.servo": "robot_bridge.servo.node:ServoBridge",
    "robot_bridge.mock": "robot_bridge.mock.node:MockRobot",
    "robot_bridge.mujoco": "robot_bridge.mujoco.node:MujocoRobot",
    "robot_bridge.franka": "robot_bridge.franka.node:FrankaDriver",
    "robot_bridge.tag_detector": "robot_bridge.tag_detector.node:TagDetectorNode",
    "robot_bridge.player": "robot_bridge.player:Player",
    "perception_node": "perception_node.node:PerceptionNode",
    "skill_server": "skill_server.node:SkillServer",
    "planner_node": "planner_node.node:PlannerNode",
    "acquisition_node": "acquisition_node.node:AcquisitionNode",
    "recorder_node": "recorder_node.node:RecorderNode",
}


# s without a state after which a skill is given up: a robot takes its time to move and to look.
ROBOT_STATE_TIMEOUT = 8.0
# s until the robot holds, with a camera that is rendered by a processor: ten pictures of what was
# moved take it 3 to 10 s, and the robot's controllers wait for each.
SLOW_CAMERA_TIMEOUT = 15.0
# s until the robot holds, where the clock of a simulated FR3 waits for a busy machine.
SLOW_CLOCK_TIMEOUT = 60.0
WAITING = ("detection_timeout", "joint_timeout")
HIDDEN_AFTER = 5  # pictures without an object: the arm hides what is behind it
# How fast a robot at a bench moves before such a camera: a few pictures a second, each some tenths
# of a second late, are then as 15 Hz and 60 ms.
RENDERED_PACE = 0.2
BEFORE_CAMERA_AT_A_BENCH = {
    **dict.fromkeys(WAITING, SLOW_CAMERA_TIMEOUT),
    "hidden_after": HIDDEN_AFTER,
}
BEFORE_CAMERA = BEFORE_CAMERA_AT_A_BENCH | dict.fromkeys(
    ("controller_timeout", "settle_time"), SLOW_CAMERA_TIMEOUT
)
# Of whoever sends goals to a simulated FR3, whose clock may be slow.
SLOW_CLOCK: Mapping[str, float] = MappingProxyType(
    dict.fromkeys(("gripper_timeout", "controller_timeout", "joint_timeout"), SLOW_CLOCK_TIMEOUT)
)
BEFORE_FRANKA_SIM: Mapping[str, str | float | tuple[float, ...]] = MappingProxyType(
    {
        "arm": "fr3",
        "workspace": BEFORE_MUJOCO["workspace"],  # nothing is around it
        "detection_timeout": SLOW_CLOCK_TIMEOUT,
        **SLOW_CLOCK,
    }
)


def node_class(name: str) -> Any:
    """The class of a node, by the name of the module that is run as a process."""
    return resolve_name(NODE_CLASSES[name])


@dataclass(frozen=True)
class RunSettings:
    """What is to be run."""

    domain: DomainChoice
    seed: int
    index: int
    planner: str
    record: Path | None  # the bag's folder; None: no recorder
    goal: str = ""  # by name, or as atoms; empty: the task's own
    pace: float = 0.0  # environment steps per second; 0: as fast as commands come
    shortcuts: str = ""  # a library's folder, or none; empty: the shipped one
    samples: int = DEFAULT.samples  # attempts of a shortcut in the model
    patience: float = 1.0  # factor of all deadlines
    world: str = SIM  # the simulator, a robot, or the bridge with a simulated robot behind it
    servo: bool = False  # whether the robot is commanded while it moves: in the contact world
    scene: str = ""  # a robot's scene file; empty: the objects of the sampled task
    # Parameters of the simulated robots, of the bridge, of a Franka arm's driver and of perception
    # that are not the default.
    mock: Mapping[str, str | int | float] = field(default_factory=dict)
    mujoco: Mapping[str, str | int | float] = field(default_factory=dict)
    bridge: Mapping[str, str | int | float] = field(default_factory=dict)
    franka: Mapping[str, str | int | float] = field(default_factory=dict)
    perception: Mapping[str, str | int | float] = field(default_factory=dict)
    # Parameters of the acquisition node that are not the default; None: it does not run.
    acquisition: Mapping[str, str | int | float] | None = None


def node_parameters(settings: RunSettings) -> dict[str, Parameters]:
    """The ROS parameters of every node of the ensemble, by node name."""
    learned: dict[str, str | int | float] = {"samples": settings.samples}
    if settings.shortcuts:
        learned["shortcuts"] = settings.shortcuts
    waiting: dict[str, str | int | float] = {}
    if settings.world != SIM:
        waiting["state_timeout"] = ROBOT_STATE_TIMEOUT
    if settings.world == FRANKA_SIM:
        waiting["state_timeout"] = ROBOT_STATE_TIMEOUT + SLOW_CLOCK_TIMEOUT
    if settings.mujoco.get("camera"):
        waiting["state_timeout"] = ROBOT_STATE_TIMEOUT + SLOW_CAMERA_TIMEOUT
    if "debounce" in settings.perception:  # what is debounced is late
        waiting["hold_steps"] = int(settings.perception["debounce"]) - 1
    common: dict[str, str | int | float] = {
        "domain": settings.domain.name,
        "preset": settings.domain.preset,
        "skills": settings.domain.skills,
        "patience": settings.patience,
    }
    common |= _libraries(settings)
    nodes: dict[str, Parameters] = {
        **_world_parameters(settings),
        "perception_node": {**settings.perception, **common},
        "skill_server": learned | waiting | common,
        "planner_node": {"planner": settings.planner, **learned, **common},
    }
    if settings.acquisition is not None:
        nodes["acquisition_node"] = {**settings.acquisition, **common}
    if settings.record is not None:
        nodes["recorder_node"] = {"bag": str(settings.record)}
    return nodes


def _libraries(settings: RunSettings) -> dict[str, str]:
    """Where the libraries may lie that are announced: where the acquisition node writes."""
    output = (settings.acquisition or {}).get("output", "")
    return {"libraries": str(Path(str(output)).absolute())} if output else {}


def _world_parameters(settings: RunSettings) -> dict[str, Parameters]:
    """Whatever is in the world's place."""
    task: dict[str, str | int | float] = {
        "domain": settings.domain.name,
        "preset": settings.domain.preset,
        "skills": settings.domain.skills,
        "seed": settings.seed,
        "index": settings.index,
        "goal": settings.goal,
        **_libraries(settings),
    }
    if settings.world == SIM:
        return {"sim_node": task | {"pace": settings.pace}}
    scene = {"scene": settings.scene} if settings.scene else {}
    bridge = {"robot_bridge": task | scene | dict(settings.bridge)}
    if settings.world == FRANKA:
        bridge["robot_bridge"] = {"arm": "fr3"} | bridge["robot_bridge"]
        return {"robot_bridge.franka": task | dict(settings.franka)} | bridge
    if settings.world == FRANKA_SIM:
        bridge["robot_bridge"] = dict(BEFORE_FRANKA_SIM) | bridge["robot_bridge"]
        simulated = {"simulated": True, "realtime": False}
        return {"robot_bridge.franka": task | dict(settings.franka) | simulated} | bridge
    if settings.world == MOCK:
        return {"robot_bridge.mock": task | dict(settings.mock)} | bridge
    if settings.world == MUJOCO:
        return _mujoco_parameters(settings, task, scene)
    return bridge


def _mujoco_parameters(
    settings: RunSettings, task: Parameters, scene: Parameters
) -> dict[str, Parameters]:
    """The robot in MuJoCo, the bridge to it, and what finds tags where it has a camera.

    Args:
        settings: What is to be run.
        task: Parameters of whatever begins with the task.
        scene: The scene file as a parameter, if there is one.
    """
    camera = bool(settings.mujoco.get("camera"))
    robot: Parameters = scene if camera else {}
    before: Parameters
    if settings.servo:
        pulled = {} if settings.mujoco.keys() & OF_JOINTS else MUJOCO_AT_A_BENCH
        robot = {"pace": RENDERED_PACE if camera else 1.0, **robot, **pulled, **settings.mujoco}
        before = BEFORE_MUJOCO_AT_A_BENCH | (BEFORE_CAMERA_AT_A_BENCH if camera else {})
        bridge, before = "robot_bridge.servo", before | {"pace": robot["pace"]}
    else:
        robot = {**robot, **settings.mujoco}
        bridge, before = "robot_bridge", BEFORE_MUJOCO | (BEFORE_CAMERA if camera else {})
    nodes = {
        "robot_bridge.mujoco": {**task, **robot},
        bridge: {**before, **task, **scene, **settings.bridge},
    }
    if camera:
        detected = {key: task[key] for key in ("domain", "preset", "skills")}
        # A raw picture is millions of bytes, and a busy machine loses most of several a second.
        nodes["robot_bridge.tag_detector"] = {
            **detected,
            **scene,
            "compressed": settings.servo,
        }
    return nodes
