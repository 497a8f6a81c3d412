# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A simulated FR3 that speaks the robot's protocol: a program for the Python that has franky-sim.

It imports nothing of slap_ros, since franky-sim may have an environment of its own. The clock of
this robot waits for its driver: during a motion it stands still after each state, until the
driver's command for the next millisecond is there. So a busy machine changes no motion, and
durations are those of this clock.

It writes the address at which it listens. Lines on its standard input raise faults, and each is
written back when the fault is there:

- ``reflex``: the arm collides, and the robot's control stops it;
- ``delay S``: states arrive S seconds late; the control gives up after 20 ms without an answer;
- ``gripper``: each motion of the fingers fails from now on;
- ``silence``: nothing is sent any more, as if the cable had been pulled.

It ends when its standard input does.
"""

from __future__ import annotations

import json
import queue
import select
import sys
import threading
import time
from typing import Any

from franky_sim import franka_robot_protocol as protocol
from franky_sim.franka_gripper_protocol import GripperCommand, GripperCommandStatus
from franky_sim.franka_gripper_server import FrankaGripperServer
from franky_sim.franka_robot_server import FrankaRobotServer
from franky_sim.mujoco_simulator import MujocoSimulator
from franky_sim.simulation_server import LocalHostnames

PERIOD_S = 0.001  # of the robot's control
PATIENCE_S = 0.7  # for which the clock waits for a command: the driver gives up after 1 s
START_S = 0.05  # as long before the first command of a motion: a driver answers the third state
LOST = 20  # ms without an answer, after which the robot's control stops the arm
JOINT_REFLEX, COMMUNICATION = 6, 25  # places of these errors in the robot's state
# An arm that follows its commands within 20 ms: Nm/rad, Nm s/rad.
STIFFNESS = (4500.0, 4500.0, 3500.0, 3500.0, 2000.0, 2000.0, 2000.0)
DAMPING = (90.0, 90.0, 70.0, 70.0, 30.0, 30.0, 30.0)

STILL = (0.0,) * 7


class Fr3Server(FrankaRobotServer):  # type: ignore[misc]  # franky-sim has no types
    """The robot's control, with reflexes, and with a clock that can wait for commands."""

    def __init__(self, robot: Any, hostnames: Any) -> None:
        self.error: int | None = None  # of a reflex, until somebody recovers from it
        self.delay_s = 0.0
        self._in_control = False  # whether the driver has answered a state of this motion
        self._unanswered = 0  # ms since the last command
        super().__init__(robot, hostnames)

    def raise_reflex(self, error: int) -> None:
        """Stop the arm; the motion under way ends as aborted."""
        motion = self.current_motion_id
        self.error = error
        self.stop_motion()
        self.reset_current_motion_id()
        super().send_state()
        if motion:
            protocol.BaseCommand.send_response(
                self._tcp_socket,
                protocol.RobotCommand.kMove,
                motion,
                protocol.MoveStatus.kReflexAborted,
            )

    def start_motion(self, *given: Any) -> None:
        """Begin a motion, unless a reflex has stopped the arm."""
        if self.error is not None:
            raise RuntimeError("stopped by a reflex")
        # A driver answers each state that shows the motion before, to end it: such an answer may
        # still wait here, and would end this motion, as franky-sim reads it after the Move.
        self._process_udp_commands()
        self._in_control, self._unanswered = False, 0
        super().start_motion(*given)
        # A robot begins where its control holds it; franky-sim would begin where it is measured,
        # which looks like a jump.
        held = protocol.UDPCommand(q_c=tuple(self.robot_state.q_d))
        self._FrankaRobotServer__current_control_command = held

    @property
    def robot_state(self) -> Any:
        """The state, at rest before the first command of a motion, and with a reflex's errors."""
        state = super().robot_state
        if not (self.current_motion_id and self._in_control):  # franky-sim's differences lag
            state = state.replace(dq_d=STILL, ddq_d=STILL)
        if self.error is None:
            return state
        errors = tuple(i == self.error for i in range(len(state.errors)))
        mode = protocol.RobotMode.kReflex
        return state.replace(robot_mode=mode, errors=errors, reflex_reason=errors)

    def send_state(self) -> None:
        """Send the state; a state that is late by too much stops the arm instead."""
        if not (self.delay_s and self.current_motion_id):
            super().send_state()
            return
        self._unanswered += 1
        if self._unanswered > LOST:
            self.raise_reflex(COMMUNICATION)

    def wait_for_command(self) -> None:
        """Let no time pass until the driver has answered the last state."""
        udp = self._FrankaServer__udp_socket
        if self.current_motion_id and udp is not None and not self.delay_s:
            select.select([udp], [], [], PATIENCE_S if self._in_control else START_S)

    def _handle_udp_command(self, command_data: bytes) -> None:
        self._in_control = True
        super()._handle_udp_command(command_data)


def recover(command: Any, server: Fr3Server) -> None:
    """End a reflex, as the command of the protocol asks."""
    server.error = None
    command.reply(protocol.AutomaticErrorRecoveryStatus.kSuccess)


def break_gripper() -> None:
    """Let each motion of the fingers fail from now on."""

    def failing(kind: Any) -> Any:
        def start(_: Any, *given: Any) -> None:
            command_id, socket = given[-2:]
            protocol.BaseCommand.send_response(
                socket,
                kind,
                command_id,
                GripperCommandStatus.kFail,
                command_type_struct="H",
                status_type_struct="H",
            )

        return start

    FrankaGripperServer.start_move = failing(GripperCommand.kMove)
    FrankaGripperServer.start_grasp = failing(GripperCommand.kGrasp)


def inject(line: str, server: Fr3Server) -> bool:
    """Raise the fault that a line names; whether the robot still sends anything."""
    name, _, value = line.strip().partition(" ")
    if name == "reflex":
        server.raise_reflex(JOINT_REFLEX)
    elif name == "delay":
        server.delay_s = float(value)
    elif name == "gripper":
        break_gripper()
    return name != "silence"


def serve(server: Fr3Server, simulator: Any, lines: queue.Queue[str | None]) -> None:
    """Run the robot until there are no more lines.

    Args:
        server: Control of the robot.
        simulator: Physics of the robot.
        lines: Faults to raise, as they are read; None at their end.
    """
    sending = True
    while True:
        began = time.monotonic()
        while not lines.empty():
            line = lines.get()
            if line is None:
                return
            sending = inject(line, server) and sending
            say(line.strip())
        if sending:
            server.process_commands()
            simulator.step()
            server.send_state()
            server.wait_for_command()
        if not (sending and server.current_motion_id):
            time.sleep(max(0.0, PERIOD_S - (time.monotonic() - began)))


def say(line: str) -> None:
    """Tell a line to whoever started this program."""
    sys.stdout.write(f"{line}\n")
    sys.stdout.flush()


def read_lines(lines: queue.Queue[str | None]) -> None:
    """Pass on what is read from the standard input, and its end."""
    for line in sys.stdin:
        lines.put(line)
    lines.put(None)


def main() -> None:
    """Simulate an FR3 in the pose of the first argument, seven joint positions in rad as JSON."""
    joints = json.loads(sys.argv[1])
    protocol.AutomaticErrorRecoveryCommand.handle = recover
    lines: queue.Queue[str | None] = queue.Queue()
    threading.Thread(target=read_lines, args=(lines,), daemon=True).start()
    with MujocoSimulator() as simulator:
        robot = simulator.add_robot(
            initial_q=joints, initial_hand_width=0.08, kp=STIFFNESS, kv=DAMPING
        )
        server = Fr3Server(robot, LocalHostnames())
        server.init()
        simulator.start()
        say(server.hostname)
        serve(server, simulator, lines)
        server.cleanup()


if __name__ == "__main__":
    main()
