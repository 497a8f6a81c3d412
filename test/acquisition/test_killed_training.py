# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A curriculum whose process is killed five times, at random moments."""

import subprocess

import pytest

from support.programs import environment, program

pytestmark = pytest.mark.usefixtures("points_installed")


def files(folder):
    """What is kept, by name; without checkpoints, of which one more may be left."""
    paths = [p for part in ("library", "work") for p in (folder / part).rglob("*") if p.is_file()]
    return {str(p.relative_to(folder)): p.read_bytes() for p in paths if p.suffix != ".pt"}


@pytest.mark.training
@pytest.mark.slow
@pytest.mark.timeout(300)  # four trainings' worth of processor time
def test_killed_five_times_it_makes_the_same_library_to_the_byte(tmp_path):
    """And the same work folder: plans carried out, episodes, judgements."""
    ran = subprocess.run(
        [*program("killed_training"), tmp_path], env=environment(), capture_output=True, text=True
    )
    assert ran.returncode == 0, ran.stderr
    kills = (tmp_path / "kills").read_text().splitlines()
    assert len(kills) == 5
    assert len(set(kills)) > 1  # at different stages
    undisturbed = files(tmp_path / "undisturbed")
    assert {"library/library.json", "work/Put/rounds.json"} <= set(undisturbed)
    disturbed = list(tmp_path.glob("killed*"))
    assert disturbed
    for killed in disturbed:
        assert files(killed) == undisturbed
