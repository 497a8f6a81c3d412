# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The doctor finds nothing wrong where all is well, and what is wrong where it is not."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from importlib.metadata import entry_points
from pathlib import Path

import psutil
import pytest

from slap_ros.doctor import dds, libraries, machine, ros
from slap_ros.doctor.check import Check
from slap_ros.doctor.diagnosis import diagnose
from slap_ros.doctor.processes import PROBE, run_python

ROOT = Path(__file__).parents[1]
ABSENT_INTERFACE = (
    "<CycloneDDS><Domain><General><Interfaces>"
    '<NetworkInterface name="absent0"/>'
    "</Interfaces></General></Domain></CycloneDDS>"
)
# Participants with different tags ignore each other; here each process has one of its own.
TAG_OF_ITS_OWN = (
    "<CycloneDDS><Domain><Discovery><Tag>${CYCLONEDDS_PID}</Tag></Discovery></Domain></CycloneDDS>"
)
ENVIRONMENT = (
    "CYCLONEDDS_URI",
    "RMW_IMPLEMENTATION",
    "ROS_AUTOMATIC_DISCOVERY_RANGE",
    "ROS_DISTRO",
    "ROS_LOCALHOST_ONLY",
    "ROS_STATIC_PEERS",
)

EMBEDDED = ros.RclpyStatus(embedded=True)
LIMIT_S = 120.0  # far more than anything here takes


@pytest.fixture(autouse=True)
def environment(monkeypatch: pytest.MonkeyPatch, network: int) -> Iterator[None]:
    """No settings but a domain of our own; afterwards, no process of ours."""
    for name in ENVIRONMENT:
        monkeypatch.delenv(name, raising=False)
    if not entry_points(group="embedded_ros.interfaces", name="slap_msgs"):
        # A checkout that is not installed.
        monkeypatch.setenv("EMBEDDED_ROS_INTERFACES", f"slap_msgs={ROOT / 'msg_schemas'}")
    before = set(psutil.Process().children(recursive=True))
    yield
    assert not set(psutil.Process().children(recursive=True)) - before


@pytest.fixture(scope="module")
def about() -> ros.RclpyStatus:
    """What there is on this machine."""
    return ros.RclpyStatus.ask()


def expect_problem(check: Check, *words: str) -> None:
    assert check.status == "problem", check
    assert check.advice
    for word in words:
        assert word in check.found, check


# -- where all is well --------------------------------------------------------------------------


def test_healthy(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, about: ros.RclpyStatus) -> None:
    if not about.embedded:
        monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    checks = {check.name: check for check in diagnose(tmp_path / "runs")}
    assert list(checks) == [
        "Python",
        "ROS 2",
        "ROS 2 middleware",
        "slap_msgs",
        "ROS 2 settings",
        "DDS between two processes",
        "rosbags",
        "PyBullet",
        "Training",
        "Figures",
        "Live view",
        "Language models",
        "Local language model",
        "Domains",
        "Disk space for runs",
        "Write permission for runs",
        "Open-file limit",
        "Processors and memory",
    ]
    assert [check for check in checks.values() if check.status == "problem"] == []
    for name in ("Python", "ROS 2", "ROS 2 middleware", "slap_msgs", "ROS 2 settings", "rosbags"):
        assert checks[name].status == "ok", checks[name]
    assert "found each other in" in checks["DDS between two processes"].found
    assert f"ROS_DOMAIN_ID {os.environ['ROS_DOMAIN_ID']}" in checks["ROS 2 settings"].found
    assert not (tmp_path / "runs").exists()


def test_prints_nothing(capfd: pytest.CaptureFixture[str]) -> None:
    dds.conversation(ros.RclpyStatus())
    libraries.pybullet()
    assert capfd.readouterr() == ("", "")


def test_importing_the_doctor_imports_no_ros() -> None:
    program = "import sys, slap_ros.doctor; print(*(m for m in sys.modules if 'rclpy' in m))"
    assert run_python(["-c", program], LIMIT_S).output.strip() == ""


# -- settings -----------------------------------------------------------------------------------


@pytest.mark.parametrize("domain", ["abc", "500", "-1", "1.5", "²"])
def test_impossible_domain(monkeypatch: pytest.MonkeyPatch, domain: str) -> None:
    monkeypatch.setenv("ROS_DOMAIN_ID", domain)
    expect_problem(ros.settings(EMBEDDED), "ROS_DOMAIN_ID", domain)


@pytest.mark.parametrize("domain", ["abc", "500"])
def test_conversation_in_an_impossible_domain(monkeypatch: pytest.MonkeyPatch, domain: str) -> None:
    monkeypatch.setenv("ROS_DOMAIN_ID", domain)
    check = dds.conversation(ros.RclpyStatus())
    expect_problem(check, domain)
    assert "ROS_DOMAIN_ID" in check.advice


def test_domain_with_ports_that_others_may_have(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ROS_DOMAIN_ID", "150")
    check = ros.settings(EMBEDDED)
    assert check.status == "warning"
    assert check.advice


def test_unknown_discovery_range(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "GALAXY")
    expect_problem(ros.settings(EMBEDDED), "GALAXY")
    expect_problem(dds.conversation(ros.RclpyStatus()))


def test_discovery_switched_off(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "OFF")
    expect_problem(ros.settings(EMBEDDED), "OFF")
    monkeypatch.setenv("ROS_LOCALHOST_ONLY", "1")  # an older variable, which counts for more
    assert ros.settings(EMBEDDED).status == "ok"


@pytest.mark.slow
def test_nodes_that_do_not_see_each_other(
    monkeypatch: pytest.MonkeyPatch, about: ros.RclpyStatus
) -> None:
    if not about.embedded:
        pytest.skip("CycloneDDS may not be the middleware")
    monkeypatch.setenv("CYCLONEDDS_URI", TAG_OF_ITS_OWN)
    expect_problem(dds.conversation(about), "did not reach each other", "CYCLONEDDS_URI")


@pytest.mark.parametrize(
    ("uri", "cause"),
    [
        ("<CycloneDDS><Domain", "//CycloneDDS/Domain"),
        ("<CycloneDDS><Domain><Generall/></Domain></CycloneDDS>", "Generall"),
        ("file:///nowhere/cyclonedds.xml", "can't open configuration file"),
        (ABSENT_INTERFACE, "absent0: does not match an available interface"),
    ],
)
def test_impossible_cyclonedds_uri(
    monkeypatch: pytest.MonkeyPatch, about: ros.RclpyStatus, uri: str, cause: str
) -> None:
    if not about.embedded:
        pytest.skip("CycloneDDS may not be the middleware")
    monkeypatch.setenv("CYCLONEDDS_URI", uri)
    check = dds.conversation(about)
    expect_problem(check, cause)
    assert check.advice.startswith("Correct CYCLONEDDS_URI or unset it")


# -- ROS 2 --------------------------------------------------------------------------------------


def test_other_distribution(monkeypatch: pytest.MonkeyPatch, about: ros.RclpyStatus) -> None:
    monkeypatch.setenv("ROS_DISTRO", "humble")
    expect_problem(ros.installation(about), "humble")


def test_jazzy_of_another_python(monkeypatch: pytest.MonkeyPatch, about: ros.RclpyStatus) -> None:
    if not about.embedded:
        pytest.skip("a real ROS 2 is sourced")
    monkeypatch.setenv("ROS_DISTRO", "jazzy")
    check = ros.installation(about)
    assert check.status == "warning"
    assert check.advice


def test_other_middleware_beside_embedded_nodes(
    monkeypatch: pytest.MonkeyPatch, about: ros.RclpyStatus
) -> None:
    if not about.embedded:
        pytest.skip("a real ROS 2 is sourced")
    monkeypatch.setenv("RMW_IMPLEMENTATION", "rmw_fastrtps_cpp")
    expect_problem(ros.middleware(about), "rmw_fastrtps_cpp")
    monkeypatch.setenv("RMW_IMPLEMENTATION", "rmw_cyclonedds_cpp")
    assert ros.middleware(about).status == "ok"


def test_sourced_ros(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, about: ros.RclpyStatus
) -> None:
    """An rclpy of ROS 2 in front of the embedded one, without slap_msgs."""
    if not about.embedded:
        pytest.skip("a real ROS 2 is sourced, with slap_msgs")
    package = tmp_path / "rclpy"
    package.mkdir()
    (package / "__init__.py").write_text(
        "def get_rmw_implementation_identifier():\n    return 'rmw_fastrtps_cpp'\n"
    )
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.setenv("ROS_DISTRO", "jazzy")
    sourced = ros.RclpyStatus.ask()
    assert ros.installation(sourced) == Check("ROS 2", "ok", "ROS 2 jazzy is sourced")
    assert ros.middleware(sourced).status == "warning"
    expect_problem(ros.interfaces(sourced), "slap_msgs")
    assert "colcon build" in ros.interfaces(sourced).advice
    hinted = ros.settings(sourced)
    assert hinted.status == "warning"
    assert "export ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST" in hinted.advice


def test_broken_rclpy(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "rclpy.py").write_text("raise ImportError('librcl.so: cannot open')")
    monkeypatch.syspath_prepend(str(tmp_path))
    about = ros.RclpyStatus.ask()
    expect_problem(ros.installation(about), "librcl.so")
    expect_problem(ros.middleware(about))
    expect_problem(ros.interfaces(about))
    expect_problem(dds.conversation(about))
    expect_problem(dds.conversation(ros.RclpyStatus()), "librcl.so")


# -- libraries ----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("module", "check"),
    [("pybullet", libraries.pybullet), ("rosbags", libraries.rosbags)],
)
def test_library_that_takes_python_down(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, module: str, check: object
) -> None:
    (tmp_path / f"{module}.py").write_text("import os; os.abort()")
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.delitem(sys.modules, module, raising=False)
    assert callable(check)
    expect_problem(check(), "fails")


def test_missing_libraries(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(libraries, "find_spec", lambda name: None)
    expect_problem(libraries.rosbags(), "not installed")
    assert libraries.pybullet().status == "warning"
    assert libraries.pybullet().advice == 'pip install "slap_ros[physics]"'
    extras = {"train": libraries.training, "studies": libraries.figures, "live": libraries.live}
    for extra, check in extras.items():
        assert check().status == "ok"
        assert "not installed; needed" in check().found
        assert check().advice == f'pip install "slap_ros[{extra}]"'


# -- the machine --------------------------------------------------------------------------------


def test_unwritable_folder(tmp_path: Path) -> None:
    folder = tmp_path / "locked"
    folder.mkdir(mode=0o500)
    # Root may write anywhere but in what only looks like a file system.
    runs = Path("/proc/self/fdinfo/runs") if os.geteuid() == 0 else folder / "runs"
    expect_problem(machine.write_permission(runs), "cannot write")


def test_runs_beneath_a_file(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    expect_problem(machine.write_permission(tmp_path / "file" / "runs"), "cannot write")


def test_dangling_link(tmp_path: Path) -> None:
    (tmp_path / "runs").symlink_to(tmp_path / "nowhere")
    expect_problem(machine.disk_space(tmp_path / "runs"))
    expect_problem(machine.write_permission(tmp_path / "runs"))


def test_no_disk_space() -> None:
    expect_problem(machine.disk_space(Path("/proc/runs")), "0 MiB free")


@pytest.mark.parametrize(("limit", "status"), [(200, "problem"), (600, "warning"), (1024, "ok")])
def test_open_file_limit(limit: int, status: str) -> None:
    program = (
        "import resource as r\n"
        f"r.setrlimit(r.RLIMIT_NOFILE, ({limit}, r.getrlimit(r.RLIMIT_NOFILE)[1]))\n"
        "from slap_ros.doctor.machine import open_files\n"
        "print(open_files().status, open_files().advice)"
    )
    outcome = run_python(["-c", program], LIMIT_S)
    assert outcome.output.split()[0] == status, outcome
    assert (status == "ok") == (len(outcome.output.split()) == 1)


def test_other_python(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "version_info", (3, 10, 4, "final", 0))
    expect_problem(machine.python_version())


# -- nothing hangs and nothing stays ------------------------------------------------------------


def test_hanging_process_is_stopped_in_time() -> None:
    program = "import time, signal; signal.signal(signal.SIGTERM, signal.SIG_IGN); time.sleep(9e3)"
    outcome = run_python(["-c", program], 0.5)
    assert outcome.code is None
    assert outcome.last_error == "it did not end in time"


def test_middleware_that_hangs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "rclpy.py").write_text("import time; time.sleep(9e3)")
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.setattr(dds, "LIMIT_S", 2.0)
    expect_problem(dds.conversation(ros.RclpyStatus()), "did not end in time")


def test_probe_ends_when_the_doctor_dies() -> None:
    """Even by SIGKILL, which leaves no time to tidy up."""
    program = (
        "import time\n"
        "from slap_ros.doctor.processes import PROBE, started\n"
        "with started(['-m', PROBE, 'answer', 'orphan']) as process:\n"
        "    print(process.pid, flush=True)\n"
        "    time.sleep(9e3)\n"
    )
    doctor = subprocess.Popen(
        [sys.executable, "-c", program],
        env=os.environ | {"PYTHONPATH": str(ROOT)},
        stdout=subprocess.PIPE,
        text=True,
    )
    with doctor:
        assert doctor.stdout is not None
        probe = psutil.Process(int(doctor.stdout.readline()))
        while not probe.cmdline():  # as long as it is being replaced by its program
            time.sleep(0.01)
        assert PROBE in probe.cmdline()
        doctor.send_signal(signal.SIGKILL)
    for _ in range(600):
        if not probe.is_running() or probe.status() == psutil.STATUS_ZOMBIE:
            return
        time.sleep(0.1)
    probe.kill()
    pytest.fail("the probe went on")
