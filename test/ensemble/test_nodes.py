# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Nodes as processes: start in any order, stop cleanly, come back, refuse, survive a kill."""

import os
import signal
import subprocess
import sys
import time
from contextlib import ExitStack, contextmanager, suppress
from copy import deepcopy
from functools import partial
from pathlib import Path

import pytest
import rclpy
from rcl_interfaces.srv import GetParameters
from slap_msgs.msg import RobotCommand
from slap_msgs.srv import ListSkills, ResetTask

from benchmarks.control_loop import state_command_state
from ensemble.client import RunClient
from ensemble.endpoints import advertise, subscribe
from ensemble.interfaces import ATOMS, COMMAND, DOMAIN, LIST_SKILLS, RESET_TASK, TASK
from ensemble.interfaces import STATE as STATE_TOPIC
from ensemble.launcher import InProcessLauncher, ProcessLauncher
from ensemble.nodes import RunSettings, node_parameters
from ensemble.spinner import temporary_node
from ensemble.state_synchronizer import StateSynchronizer
from slap_ros.bags import evaluate_bag
from slap_ros.errors import EpisodeChangedError, ErrorCode, NoTaskError
from slap_ros.messages.events import PlanEventKind
from slap_ros.messages.interfaces import PLAN_EVENT, STATE
from slap_ros.skills.domain_choice import DomainChoice
from support.marks import slow

LIBRARY = Path(__file__).parent.parent / "shortcuts" / "data" / "obstacle2d"
ALL = ("sim_node", "perception_node", "skill_server", "planner_node", "recorder_node")
PATIENTLY = ("--patience", "10")  # for a loaded machine
LIMIT = 120.0  # s, far more than anything here takes: a loaded machine takes its time


class Listener(RunClient):
    """A client that notes what it hears."""

    def __init__(self):
        super().__init__(lambda type_name, message: self.heard.append((type_name, message)))
        self.heard = []


def parameters(record=None, seed=3, pace=0.0):
    return node_parameters(
        RunSettings(
            DomainChoice("obstacle2d", "fair"),
            seed,
            0,
            "lazy",
            record,
            pace=pace,
            shortcuts="none",
            patience=5.0,
        )
    )


@contextmanager
def started(name, *arguments):
    """A node as a process, which does not outlive the test, however that ends."""
    process = subprocess.Popen(
        [sys.executable, "-m", name, "--ros-args", "--log-level", "warn", *arguments],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        yield process
    finally:
        process.kill()
        process.communicate()


def solve(client, spinner, episode=0, **limits):
    """Ask for the task to be solved; the action's result."""
    sent = client.send((), limits.get("step_limit", 0), limits.get("max_replans", 5), episode)
    assert spinner.spin_until(sent.done, LIMIT)
    result = sent.result().get_result_async()
    assert spinner.spin_until(result.done, LIMIT)
    return result.result().result


def states(client):
    return [message for type_name, message in client.heard if type_name == STATE]


@pytest.mark.slow
@pytest.mark.parametrize("order", [ALL, ALL[::-1]], ids=["sim first", "recorder first"])
def test_any_order_of_start_gives_the_same_complete_bag(network, tmp_path, order):
    nodes = parameters(tmp_path / "bag")
    with temporary_node(Listener) as (client, spinner), ExitStack() as running:
        for name in order:
            running.enter_context(InProcessLauncher({name: nodes[name]}, spinner.executor))
            spinner.spin_until(lambda: False, 1.0)
        assert spinner.spin_until(lambda: client.ready(True), LIMIT)
        result = solve(client, spinner)
        assert result.success
        closed = client.close_bag()
        assert spinner.spin_until(closed.done, LIMIT)
    found = evaluate_bag(tmp_path / "bag")
    assert found.runs[0].success
    assert found.states == found.compared == found.runs[0].plan_length + 1
    assert found.runs[0].bound == result.bound >= 1.0


def test_the_daemon_of_the_ros2_command_is_no_other_ensemble(network):
    with temporary_node(Listener) as (client, spinner):
        nodes = [rclpy.create_node(name) for name in ("_ros2cli_daemon_7", "neighbour")]
        assert spinner.spin_until(lambda: bool(client.other_nodes()), LIMIT)
        assert client.other_nodes() == ["neighbour"]
        for node in nodes:
            node.destroy_node()


@pytest.mark.parametrize("name", ALL)
@pytest.mark.parametrize("stop", [signal.SIGINT, *slow(signal.SIGTERM)])
def test_a_node_stops_cleanly(network, tmp_path, name, stop):
    bag = ["-p", f"bag:={tmp_path / 'bag'}"] if name == "recorder_node" else []
    with started(name, *bag) as process:
        with temporary_node(Listener) as (client, spinner):
            assert spinner.spin_until(lambda: name in client.other_nodes(), LIMIT)
            time.sleep(0.2)
        process.send_signal(stop)
        out, err = process.communicate(timeout=LIMIT)
    assert process.returncode == 0, err
    assert "Traceback" not in out + err


WORKING = """
import time
from concurrent.futures import ThreadPoolExecutor

def main():
    workers = ThreadPoolExecutor(1)
    workers.submit(time.sleep, 600.0)  # s
    workers.shutdown(wait=False)
    return 7
"""
MISSING = """
from slap_ros.errors import InvalidParameterError

raise InvalidParameterError("it is not installed")
"""


@pytest.mark.parametrize(
    ("code", "returned", "said"), [(WORKING, 7, ""), (MISSING, 15, "busy: it is not installed\n")]
)
def test_a_node_ends_though_it_works_and_says_what_it_cannot_begin_for(
    tmp_path, code, returned, said
):
    (tmp_path / "busy").mkdir()
    (tmp_path / "busy" / "node.py").write_text(code)
    run = "import sys; from ensemble.startup import main_of; sys.exit(main_of('busy'))"
    ran = subprocess.run(
        [sys.executable, "-c", f"import sys; sys.path.append({str(tmp_path)!r}); {run}"],
        capture_output=True,
        text=True,
        timeout=LIMIT,
    )
    assert (ran.returncode, ran.stderr) == (returned, said)


def test_a_recorder_that_cannot_write_says_so_before_anything_is_recorded(network, tmp_path):
    (tmp_path / "file").touch()
    with started("recorder_node", "-p", f"bag:={tmp_path / 'file' / 'bag'}") as process:
        _, err = process.communicate(timeout=LIMIT)
    assert process.returncode == ErrorCode.INVALID_PARAMETER
    assert f"parameter bag: {tmp_path / 'file' / 'bag'}: Not a directory" in err
    assert "Traceback" not in err


INTERRUPTED_DESTRUCTOR = """
import os, signal, sys, time
import rclpy
from ensemble.entry_point import run_node

class Destroyed:
    def __del__(self):
        os.kill(os.getpid(), signal.SIGINT)
        time.sleep(1)

def make():
    Destroyed()
    return rclpy.create_node("late")

sys.exit(run_node("late", make))
"""


def test_ctrl_c_in_a_destructor_ends_a_node_without_a_word(network):
    """Nothing can be raised from there: Python prints the error, and goes on."""
    process = subprocess.run(
        [sys.executable, "-c", INTERRUPTED_DESTRUCTOR],
        capture_output=True,
        text=True,
        timeout=LIMIT,
    )
    assert process.returncode == 0, process.stderr
    assert "KeyboardInterrupt" not in process.stdout + process.stderr


INTERRUPTED_IMPORT = """
import sys
from ensemble.entry_point import run_node

def make():
    import interrupted
    from rclpy.node import Node
    return Node("late")

def main():
    return run_node("late", make)
"""
MAIN = "import time, rclpy; from ensemble.startup import main_of; "
ENDINGS = {
    "at once": MAIN + "exit(main_of('late'))",
    "slow shutdown": MAIN
    + "shutdown = rclpy.try_shutdown; rclpy.try_shutdown = lambda: [time.sleep(0.2), shutdown()]; "
    "exit(main_of('late'))",
    "slow exit": MAIN + "code = main_of('late'); time.sleep(0.2); exit(code)",
}
INTERRUPTED = """
import os, signal
from pathlib import Path
os.kill(os.getpid(), signal.SIGINT)
Path(__file__).with_suffix(".done").touch()
"""


@pytest.mark.parametrize("ending", ENDINGS)
def test_ctrl_c_waits_for_a_module_that_a_node_imports(network, tmp_path, ending):
    """What is raised meanwhile is printed by compiled ones, which go on.

    It is raised afterwards, when the node may be ending already.
    """
    (tmp_path / "late").mkdir()
    (tmp_path / "late" / "node.py").write_text(INTERRUPTED_IMPORT)
    (tmp_path / "interrupted.py").write_text(INTERRUPTED)
    process = subprocess.run(
        [sys.executable, "-c", ENDINGS[ending]],
        env=os.environ
        | {"PYTHONPATH": f"{tmp_path}{os.pathsep}{os.environ.get('PYTHONPATH', '')}"},
        capture_output=True,
        text=True,
        timeout=LIMIT,
    )
    assert process.returncode == 0, process.stderr
    assert (tmp_path / "interrupted.done").exists()
    assert "Traceback" not in process.stderr


INTERRUPTED_TWICE = """
import os, signal, sys
from pathlib import Path
from rclpy.node import Node
from ensemble.entry_point import run_node

def interrupt():
    os.kill(os.getpid(), signal.SIGINT)

class Closing(Node):
    def destroy_node(self):
        interrupt()
        Path(sys.argv[1]).write_text("closed")
        super().destroy_node()

def make():
    node = Closing("closing")
    node.create_timer(0.01, interrupt)
    return node

sys.exit(run_node("closing", make))
"""


def test_a_second_ctrl_c_lets_a_node_end_what_the_first_began(network, tmp_path):
    """A recorder closes its bag then, and a robot's node brings the arm to rest."""
    file = tmp_path / "closed"
    process = subprocess.run(
        [sys.executable, "-c", INTERRUPTED_TWICE, str(file)],
        capture_output=True,
        text=True,
        timeout=LIMIT,
    )
    assert process.returncode == 0, process.stderr
    assert file.exists()


@contextmanager
def all_but(late):
    """A client, what spins it, and in its process all nodes but one."""
    others = {name: p for name, p in parameters().items() if name != late}
    with (
        temporary_node(Listener) as (client, spinner),
        InProcessLauncher(others, spinner.executor),
    ):
        yield client, spinner


@pytest.mark.timeout(180)  # waits for a dead node
@pytest.mark.parametrize("victim", [*slow("perception_node", "skill_server"), "planner_node"])
def test_a_node_that_comes_back_is_taken_up_again(network, victim):
    nodes = parameters()
    with all_but(victim) as (client, spinner):
        with ProcessLauncher({victim: nodes[victim]}) as first:
            assert spinner.spin_until(lambda: client.ready(False), LIMIT)
            assert solve(client, spinner).success
            first.processes[victim].kill()
            first.processes[victim].wait()
        assert spinner.spin_until(lambda: victim not in client.other_nodes(), LIMIT)
        with ProcessLauncher({victim: nodes[victim]}):
            assert spinner.spin_until(lambda: client.ready(False), LIMIT)
            opened = reset(client, spinner, seed=4)
            assert solve(client, spinner, episode=opened.episode).success


@pytest.mark.slow
def test_a_skill_server_that_comes_after_the_plan_is_waited_for(network):
    nodes = parameters()
    nodes["planner_node"]["patience"] = 24.0  # 120 s for it to come
    late = {"skill_server": nodes.pop("skill_server")}
    with (
        temporary_node(Listener) as (client, spinner),
        InProcessLauncher(nodes, spinner.executor),
    ):
        assert spinner.spin_until(client._solve.server_is_ready, LIMIT)
        sent = client.send((), 0, 5)
        assert spinner.spin_until(lambda: PLAN_EVENT in client.newest, LIMIT)
        edge_started = PlanEventKind.EDGE_STARTED
        assert spinner.spin_until(lambda: client.newest[PLAN_EVENT].kind == edge_started, LIMIT)
        with ProcessLauncher(late):
            assert spinner.spin_until(sent.done, LIMIT)
            result = sent.result().get_result_async()
            assert spinner.spin_until(result.done, LIMIT)
            assert result.result().result.success


@pytest.mark.slow
@pytest.mark.timeout(180)  # waits for a dead node
def test_a_simulator_that_comes_back_opens_a_new_episode(network):
    nodes = parameters()
    with all_but("sim_node") as (client, spinner):
        for _ in range(2):
            with ProcessLauncher({"sim_node": nodes["sim_node"]}):
                client.heard.clear()
                assert spinner.spin_until(lambda: client.ready(False) and states(client), LIMIT)
                # Until the planner has heard: the old task is done already, in no steps.
                assert spinner.spin_until(lambda: solve(client, spinner).plan_length > 0, LIMIT)
            assert spinner.spin_until(lambda: "sim_node" not in client.other_nodes(), LIMIT)


def reset(client, spinner, **request):
    service = client.create_client(RESET_TASK.type, RESET_TASK.name)
    assert spinner.spin_until(service.service_is_ready, LIMIT)
    answer = service.call_async(ResetTask.Request(**request))
    assert spinner.spin_until(answer.done, LIMIT)
    client.destroy_client(service)
    return answer.result()


def test_a_task_is_solved_in_the_episode_that_was_asked_for(network):
    with (
        temporary_node(Listener) as (client, spinner),
        InProcessLauncher(parameters(), spinner.executor),
    ):
        assert spinner.spin_until(lambda: client.ready(False), LIMIT)
        for episode in (2, 3):  # at once: before the planner can have heard of it
            assert reset(client, spinner, seed=episode).episode == episode
            assert solve(client, spinner, episode=episode).success
        late = solve(client, spinner, episode=2)
        assert late.error_code == 35
        assert "goal for episode 2, but episode 3 is under way" in late.error_msg


def test_commands_that_are_stale_or_impossible_move_nothing(network):
    only = {"sim_node": parameters()["sim_node"]}
    with temporary_node(Listener) as (client, spinner), InProcessLauncher(only, spinner.executor):
        assert spinner.spin_until(lambda: states(client), LIMIT)
        publisher = client.create_publisher(COMMAND.type, COMMAND.name, COMMAND.qos)
        assert spinner.spin_until(lambda: publisher.get_subscription_count() == 1, LIMIT)
        refused = [
            RobotCommand(episode=1, step=7, deltas=[0.0, 0.01], gripper=0.0),  # not now
            RobotCommand(episode=2, step=0, deltas=[0.0, 0.01], gripper=0.0),  # another episode
            RobotCommand(episode=1, step=0, deltas=[float("nan"), 0.0], gripper=0.0),
            RobotCommand(episode=1, step=0, deltas=[0.0, 0.5], gripper=0.0),  # too far
            RobotCommand(episode=1, step=0, deltas=[0.0], gripper=0.0),  # too few
        ]
        for command in refused:
            publisher.publish(command)
        publisher.publish(RobotCommand(episode=1, step=0, deltas=[0.0, -0.01], gripper=0.0))
        publisher.publish(RobotCommand(episode=1, step=0, deltas=[0.0, -0.01], gripper=0.0))
        assert spinner.spin_until(lambda: len(states(client)) == 2, LIMIT)
        spinner.spin_until(lambda: False, 0.5)
        assert [state.step for state in states(client)] == [0, 1]
        before, after = (state.objects[0].features for state in states(client))
        assert after[1] == before[1] - 0.01


def test_resets_are_checked_at_the_door(network):
    only = {"sim_node": parameters()["sim_node"]}
    with temporary_node(Listener) as (client, spinner), InProcessLauncher(only, spinner.executor):
        assert spinner.spin_until(lambda: states(client), LIMIT)
        explicit = states(client)[0]
        answer = reset(client, spinner, seed=9)
        assert (answer.error_code, answer.episode) == (0, 2)
        assert (reset(client, spinner, initial_state=explicit).episode) == 3
        assert spinner.spin_until(lambda: len(states(client)) == 3, LIMIT)
        assert states(client)[2].objects == explicit.objects
        explicit.objects[0].features[0] = float("nan")
        answer = reset(client, spinner, initial_state=explicit)
        assert (answer.error_code, answer.episode) == (16, 3)
        assert "features of robot are not finite" in answer.error_msg


def test_cancelling_makes_the_robot_hold(network):
    with (
        temporary_node(Listener) as (client, spinner),
        InProcessLauncher(parameters(pace=5.0), spinner.executor),
    ):
        assert spinner.spin_until(lambda: client.ready(False), LIMIT)
        sent = client.send((), 0, 5)
        assert spinner.spin_until(sent.done, LIMIT)
        assert spinner.spin_until(lambda: len(states(client)) > 5, LIMIT)
        answer = sent.result().cancel_goal_async()
        assert spinner.spin_until(answer.done, LIMIT)
        result = sent.result().get_result_async()
        assert spinner.spin_until(result.done, LIMIT)
        assert result.result().result.error_code == 34
        # A command may have been under way, then comes the one that holds, and nothing more.
        assert spinner.spin_until(lambda: holds(states(client)), LIMIT)
        held = len(states(client))
        spinner.spin_until(lambda: False, 1.0)
        assert len(states(client)) == held


def holds(told):
    """Whether the robot did not move in the last step."""
    before, after = told[-2:]
    return before.objects[0].features == after.objects[0].features


def test_skills_are_listed_with_their_signatures(network):
    with (
        temporary_node(Listener) as (client, spinner),
        InProcessLauncher(parameters(), spinner.executor),
    ):
        service = client.create_client(LIST_SKILLS.type, LIST_SKILLS.name)
        assert spinner.spin_until(service.service_is_ready, LIMIT)

        def listed():
            answer = service.call_async(ListSkills.Request())
            assert spinner.spin_until(answer.done, LIMIT)
            return {s.name: list(s.parameters) for s in answer.result().skills}

        assert spinner.spin_until(listed, LIMIT)  # once the skill server knows the domain
        skills = listed()
        assert skills["PlaceInTarget"] == ["robot", "block", "surface"]
        assert len(skills) == 4


@pytest.mark.timeout(180)  # starts an ensemble, each node a process, and waits for a dead one
# What the run does is the same for the others, which test/faults kills at any moment.
@pytest.mark.parametrize("victim", [*slow("sim_node", "planner_node"), "recorder_node"])
def test_a_killed_node_ends_the_run_with_a_code_and_a_readable_bag(network, tmp_path, victim):
    bag = tmp_path / "bag"
    runner = subprocess.Popen(
        [sys.executable, "-m", "ensemble.cli", "run", "obstacle2d", "--seed", "3",
         "--pace", "10", "--record", str(bag), *PATIENTLY],
        stderr=subprocess.PIPE,
        text=True,
    )  # fmt: skip
    pid = victim_of(runner.pid, victim, bag)
    os.kill(pid, signal.SIGKILL)
    _, err = runner.communicate(timeout=LIMIT)
    assert runner.returncode == 110, err
    assert f"{victim} was killed by SIGKILL" in err
    assert "Traceback" not in err
    assert evaluate_bag(bag).states > 0


def victim_of(runner, victim, bag):
    """Wait until the run is under way and recorded; the victim's process id."""
    import psutil

    end = time.monotonic() + 3 * LIMIT
    while time.monotonic() < end:
        recorded = sum(f.stat().st_size for f in bag.glob("*.mcap")) if bag.exists() else 0
        if recorded > 40_000:  # of some 90,000: long before the end
            children = psutil.Process(runner).children(recursive=True)
            with suppress(psutil.NoSuchProcess):  # what looks at the machine comes and goes
                pids = [child.pid for child in children if child.name() == victim]
                if pids:
                    return pids[0]
        time.sleep(0.002)
    raise AssertionError("the run did not get under way")


@pytest.mark.slow
@pytest.mark.timeout(180)  # starts an ensemble, each node a process
def test_a_full_disk_ends_the_run_and_keeps_what_was_recorded(network, tmp_path):
    import resource

    bag = tmp_path / "bag"
    result = subprocess.run(
        [
            sys.executable,
            "-m",
            "ensemble.cli",
            "run",
            "obstacle2d",
            "--pace",
            "30",
            "--record",
            str(bag),
            *PATIENTLY,
        ],
        capture_output=True,
        text=True,
        timeout=2 * LIMIT,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (80_000, 80_000)),
    )
    assert result.returncode == 92, result.stderr
    assert "no room left" in result.stderr
    assert "Traceback" not in result.stderr
    assert evaluate_bag(bag).states > 0


@pytest.mark.parametrize(
    ("arguments", "code", "words"),
    [
        (["sim_node", "-p", "seed:=three"], 15, "seed"),
        (["sim_node", "-p", "domain:=moon"], 10, "unknown domain 'moon'"),
        (["sim_node", "-p", "preset:=easy"], 15, "unknown preset 'easy'"),
        (["planner_node", "-p", "planner:=best"], 15, "unknown planner 'best'"),
        (["planner_node", "-p", "shortcuts:=/nowhere"], 17, "/nowhere: no shortcut library"),
        (["planner_node", "-p", "planner:=ff", "-p", f"shortcuts:={LIBRARY}"], 15, "planner ff"),
        (["skill_server", "-p", "shortcuts:=/nowhere"], 17, "/nowhere: no shortcut library"),
        (["skill_server", "-p", "samples:=0"], 15, "samples must be at least 1"),
        (["sim_node", "-p", "domian:=moon"], 15, "'domian'; sim_node has domain, goal, index"),
        (["planner_node", "-p", "sampels:=2"], 15, "planner_node has domain, libraries"),
        (["recorder_node", "-p", "use_sim_time:=false", "-p", "seed:=3"], 15, "must name the"),
        (["recorder_node", "-p", "bag:=/tmp"], 93, "/tmp exists"),
    ],
)
def test_a_wrong_parameter_is_refused_in_one_line(network, arguments, code, words):
    with started(*arguments) as process:
        _, err = process.communicate(timeout=LIMIT)
    assert process.returncode == code, err
    (line,) = err.strip().splitlines()
    assert line.startswith(f"{arguments[0]}: ")
    assert words in line


def test_parameters_can_be_read_from_outside(network):
    with (
        temporary_node(Listener) as (client, spinner),
        InProcessLauncher(parameters(), spinner.executor),
    ):
        service = client.create_client(GetParameters, "planner_node/get_parameters")
        assert spinner.spin_until(service.service_is_ready, LIMIT)
        answer = service.call_async(GetParameters.Request(names=["planner", "server_timeout"]))
        assert spinner.spin_until(answer.done, LIMIT)
        planner, timeout = answer.result().values
        assert (planner.string_value, timeout.double_value) == ("lazy", 5.0)


def test_a_thousand_steps_are_answered_one_by_one(network):
    """Sent and received between two processes: none lost, none twice."""
    milliseconds = state_command_state(1000)
    assert len(milliseconds) == 1000


def test_states_of_an_episode_that_is_over_are_ignored(network):
    """A message of the old episode that comes late must not look like news."""
    only = {name: parameters()[name] for name in ("sim_node", "perception_node")}
    with (
        temporary_node(Listener) as (client, spinner),
        InProcessLauncher(only, spinner.executor),
    ):
        observations = []
        synchronizer = StateSynchronizer(client, observations.append)
        assert spinner.spin_until(lambda: synchronizer.latest is not None, LIMIT)
        reset(client, spinner, seed=8)
        assert spinner.spin_until(lambda: synchronizer.latest.episode.number == 2, LIMIT)
        assert [o.episode.number for o in observations] == [1, 2]
        assert synchronizer.latest.step == 0
        spinner.executor.create_task(synchronizer.observe(99, 0.2, NoTaskError))
        with pytest.raises(EpisodeChangedError, match="goal for episode 99, but episode 2 is"):
            spinner.spin_until(lambda: False, LIMIT)


def test_what_a_new_simulator_says_before_its_task_is_opened_is_kept(network):
    """It counts from 1 again, so its first atoms are of an episode and a step that are known."""
    topics = (DOMAIN, TASK, STATE_TOPIC, ATOMS)
    only = {name: parameters()[name] for name in ("sim_node", "perception_node")}
    with temporary_node(Listener) as (client, spinner):
        said = {}
        for topic in topics:
            subscribe(client, topic, partial(said.setdefault, topic.name))
        with InProcessLauncher(only, spinner.executor):
            assert spinner.spin_until(lambda: len(said) == len(topics), LIMIT)
    domain, task, state, atoms = (said[topic.name] for topic in topics)
    with temporary_node(Listener) as (client, spinner):
        synchronizer = StateSynchronizer(client, lambda _: None)
        publish = {topic.name: advertise(client, topic).publish for topic in topics}
        for message, topic in zip((domain, task, state, atoms), topics, strict=True):
            publish[topic.name](message)
        assert spinner.spin_until(lambda: synchronizer.latest is not None, LIMIT)
        first = synchronizer.latest.episode
        again = [deepcopy(message) for message in (task, state, atoms)]
        for message in (*again, again[0].initial_state):
            message.header.stamp.sec += 1
        for message, topic in zip(again[:0:-1], (ATOMS, STATE_TOPIC), strict=True):
            publish[topic.name](message)
        spinner.spin_until(lambda: False, 0.3)
        publish[TASK.name](again[0])
        assert spinner.spin_until(lambda: synchronizer.latest.episode is not first, LIMIT)
