# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""PyBullet's line on its build time appears on no terminal, and nothing else is lost."""

import subprocess
import sys
from importlib.metadata import PackageNotFoundError, version

import pytest

from slap_ros.worlds.bullet import BUILD_TIME

# An extension in PyBullet's place that prints as it does, to both streams, and more.
TALKATIVE = """
import ctypes, importlib.machinery, sys

class Talkative:
    def find_spec(self, name, path=None, target=None):
        if name == "pybullet":
            return importlib.machinery.ModuleSpec(name, self)
    def create_module(self, spec):
        libc = ctypes.CDLL(None)
        for name in ("stdout", "stderr"):
            stream = ctypes.c_void_p(ctypes.c_void_p.in_dll(libc, name).value)
            libc.fputs(f"{name} before\\npybullet build time: now\\n{name} after".encode(), stream)
    def exec_module(self, module):
        print("by python", flush=True)

sys.meta_path.insert(0, Talkative())
import slap_ros.worlds.bullet
ctypes.CDLL(None).puts(b"; later")
"""


def run(program):
    return subprocess.run([sys.executable, "-c", program], capture_output=True, check=True)


def installed():
    for name in ("pybullet", "pybullet-arm64"):
        try:
            return version(name)
        except PackageNotFoundError:
            continue
    return None


@pytest.mark.skipif(installed() is None, reason="needs PyBullet")
def test_a_process_that_imports_our_physics_prints_nothing():
    talk = run("import pybullet")
    assert BUILD_TIME in talk.stdout + talk.stderr  # else there is nothing to suppress any more
    answer = run("import slap_ros.worlds.joint_space.world, slap_ros.worlds.rendering")
    assert (answer.stdout, answer.stderr) == (b"", b"")


def test_all_else_that_is_printed_meanwhile_is_kept():
    answer = run(TALKATIVE)
    assert answer.stdout == b"by python\nstdout before\nstdout after; later\n"
    assert answer.stderr == b"stderr before\nstderr after"
