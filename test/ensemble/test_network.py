# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Who can join in: nobody from another host, unless that was asked for."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
import rclpy

from ensemble.network import DISCOVERY_RANGE, is_embedded, join_network
from slap_ros.errors import ErrorCode, InvalidParameterError
from support.marks import slow

HERE = Path(__file__).parent


def two_hosts_possible():
    """Whether a user may have network namespaces of their own, which are like hosts."""
    if not all(map(shutil.which, ("unshare", "nsenter", "ip"))):
        return False
    return subprocess.run(["unshare", "-rn", "true"], capture_output=True).returncode == 0


@pytest.mark.timeout(180)  # who is to hear nothing listens for a while
@pytest.mark.skipif(not two_hosts_possible(), reason="no network namespaces for this user")
@pytest.mark.parametrize(("reach", "open_to_all"), [(None, False), *slow(("SUBNET", True))])
def test_another_host_is_heard_only_where_that_was_asked_for(network, tmp_path, reach, open_to_all):
    """The other host knows the address and asks for it; nobody has to be discovered."""
    environment = {key: value for key, value in os.environ.items() if key != DISCOVERY_RANGE}
    environment |= {DISCOVERY_RANGE: reach} if reach else {}
    # In 10 s others, where they can be found at all, are found many times over.
    limit = "60" if open_to_all else "10"
    script = [str(HERE / "two_hosts.sh"), sys.executable, str(tmp_path), limit]
    told = subprocess.run(
        ["unshare", "-rn", "bash", *script],
        env=environment,
        capture_output=True,
        text=True,
        timeout=400,
    )
    assert told.returncode == 0, told.stderr
    assert set(told.stdout.split()) == {
        "inside:True" if open_to_all else "inside:False",
        "outside:True" if open_to_all else "outside:False",
        # Bound to lo, a port is as good as closed; with a filter it is open, but nobody hears.
        "door:True" if open_to_all or not is_embedded() else "door:False",
    }


@pytest.mark.parametrize(("given", "taken"), [(None, "LOCALHOST"), ("SUBNET", "SUBNET")])
def test_jazzys_own_default_is_not_taken(network, monkeypatch, given, taken):
    if given is not None:
        monkeypatch.setenv(DISCOVERY_RANGE, given)
    join_network()
    rclpy.shutdown()
    assert os.environ[DISCOVERY_RANGE] == taken


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("ROS_DOMAIN_ID", "abc"),
        ("ROS_DOMAIN_ID", "1000"),
        ("ROS_DOMAIN_ID", "-1"),
        (DISCOVERY_RANGE, "EVERYWHERE"),
        (DISCOVERY_RANGE, "subnet"),  # ROS 2 takes it for LOCALHOST
        ("ROS_STATIC_PEERS", "no host"),
        ("ROS_STATIC_PEERS", "<x>&"),
    ],
)
def test_a_wrong_environment_is_refused(network, monkeypatch, name, value):
    monkeypatch.setenv(name, value)
    with pytest.raises(InvalidParameterError, match=value):
        join_network()
    assert not rclpy.ok()


def test_a_missing_keystore_is_refused(network, monkeypatch, tmp_path):
    monkeypatch.setenv("ROS_SECURITY_ENABLE", "true")
    monkeypatch.setenv("ROS_SECURITY_STRATEGY", "Enforce")
    monkeypatch.setenv("ROS_SECURITY_KEYSTORE", str(tmp_path / "keys"))
    with pytest.raises(InvalidParameterError, match="no keystore"):
        join_network()
    assert not rclpy.ok()


@pytest.mark.parametrize("uri", ["<CycloneDDS><Domain", "file:///nowhere/cyclonedds.xml"])
def test_a_network_that_dds_refuses_ends_a_node_in_an_error(network, uri):
    node = subprocess.run(
        [sys.executable, "-m", "sim_node"],
        env={**os.environ, "CYCLONEDDS_URI": uri},
        capture_output=True,
        text=True,
        timeout=100,
    )
    assert node.returncode == ErrorCode.INVALID_PARAMETER, node.stderr
    assert "sim_node: DDS cannot be started here" in node.stderr
    assert "Traceback" not in node.stderr
