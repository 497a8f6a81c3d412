# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Libraries that anybody may announce: which are opened, and what is kept of them."""

from contextlib import contextmanager
from dataclasses import replace

import pytest
from diagnostic_msgs.msg import KeyValue
from rclpy.node import Node
from rclpy.parameter import Parameter
from slap_msgs.msg import DomainInfo, SkillLibrary
from slap_msgs.srv import ResetTask

from ensemble.announced_libraries import KEPT, AnnouncedLibraries
from ensemble.common_parameters import CommonParameters
from ensemble.interfaces import DOMAIN, RESET_TASK, SKILLS
from ensemble.spinner import temporary_node
from ensemble.state_synchronizer import StateSynchronizer
from sim_node.node import SimNode
from slap_ros.errors import InvalidLibraryError, InvalidParameterError
from slap_ros.skills.domain_choice import DomainChoice, open_domain
from slap_ros.skills.skill_library import SKILL
from support.steady_skills import PICKING, PUTTING, write_library

LIMIT = 60.0  # s, far more than anything here takes
pytestmark = pytest.mark.usefixtures("points_installed")


def announced(folder, digest="0" * 16, domain="points"):
    return SkillLibrary(domain=domain, folder=str(folder), digest=digest)


def digest_of(folder):
    return open_domain(DomainChoice("points", skills=str(folder))).configuration["skills_digest"]


def unreadable(path):
    """A folder that looks like a library until its skills are read."""
    write_library(path)
    for skill in path.rglob(SKILL):
        skill.write_text("{}")
    return path


def test_a_folder_is_opened_only_below_those_that_are_allowed(tmp_path):
    allowed = tmp_path / "allowed"
    outside = write_library(tmp_path / "outside")
    inside = write_library(allowed / "inside")
    (allowed / "link").symlink_to(outside)
    (allowed / "empty").mkdir()
    libraries = AnnouncedLibraries(f"{tmp_path / 'elsewhere'}:{allowed}")
    strange = [outside, allowed / "link", allowed / ".." / "outside", "/", "", "outside"]
    for folder in (*strange, allowed / "empty", allowed / "nowhere", f"{allowed}/a\0b"):
        with pytest.raises(InvalidLibraryError):
            libraries.add(announced(folder))
    with pytest.raises(InvalidLibraryError, match="skills of domain 'points', not of 'moon'"):
        libraries.add(announced(inside, domain="moon"))
    assert libraries.folders("points") == []
    assert libraries.add(announced(inside))
    assert not libraries.add(announced(inside))  # latched: sent again
    assert libraries.folders("points") == [inside]
    with pytest.raises(InvalidLibraryError, match="below none only"):
        AnnouncedLibraries("").add(announced(inside))


def test_shortcuts_are_those_beside_the_skills_that_were_announced_last(tmp_path):
    """A link out of what is allowed is not followed, nor is what lies beside the allowed folder."""
    allowed, outside = write_library(tmp_path / "allowed"), tmp_path / "shortcuts"
    libraries = AnnouncedLibraries(str(allowed))
    for folder in (outside, allowed / "shortcuts", allowed / "first/shortcuts", allowed / "away"):
        folder.mkdir(parents=True)
    (allowed / "away/shortcuts").symlink_to(outside)
    libraries.add(announced(allowed, "2" * 16))
    libraries.add(announced(write_library(allowed / "away/skills"), "2" * 16))
    assert libraries.shortcuts("points", "2" * 16) is None
    for place in (allowed, allowed / "first"):
        libraries.add(announced(write_library(place / "skills"), "1" * 16))
        assert libraries.shortcuts("points", "1" * 16) == place / "shortcuts"
    assert libraries.shortcuts("points", "2" * 16) is libraries.shortcuts("moon", "1" * 16) is None


def test_what_is_kept_is_bounded_whatever_is_announced(tmp_path):
    libraries = AnnouncedLibraries(str(tmp_path))
    one = write_library(tmp_path / "one")
    for number in range(1000):
        libraries.add(announced(one, f"{number:016x}"))
    assert libraries.folders("points") == [one]
    for number in range(KEPT + 5):
        libraries.add(announced(write_library(tmp_path / f"library{number}", PICKING)))
    assert len(libraries.folders("points")) == KEPT
    assert libraries.folders("points")[0] == tmp_path / f"library{KEPT + 4}"


def test_a_domain_names_no_folder():
    """Whose skills it has is said by a digest: a path that a message or a bag has is not opened."""
    info = DomainInfo(name="points")
    info.configuration = [KeyValue(key="skills", value="/tmp")]
    with pytest.raises(InvalidParameterError, match="unknown skills '/tmp'"):
        DomainChoice.announced(info)


class Asker(Node):
    """Announces libraries, resets the world, and hears which domain it announces."""

    def __init__(self):
        super().__init__("asker")
        self.domains = []
        self.libraries = self.create_publisher(SKILLS.type, SKILLS.name, SKILLS.qos)
        self.reset = self.create_client(RESET_TASK.type, RESET_TASK.name)
        self.create_subscription(DOMAIN.type, DOMAIN.name, self.domains.append, DOMAIN.qos)


@contextmanager
def world(allowed):
    with temporary_node(Asker) as (asker, spinner):
        given = {"domain": "points", "preset": "two", "libraries": str(allowed)}
        node = SimNode(parameter_overrides=[Parameter(k, value=v) for k, v in given.items()])
        spinner.executor.add_node(node)
        try:
            assert spinner.spin_until(asker.libraries.get_subscription_count, LIMIT)
            assert spinner.spin_until(lambda: asker.domains, LIMIT)
            assert spinner.spin_until(asker.reset.service_is_ready, LIMIT)
            yield asker, spinner, node
        finally:
            node.destroy_node()


def digest_after_reset(asker, spinner):
    """Of the skills that the world announces for a new episode, which it must open."""
    before = len(asker.domains)
    answer = asker.reset.call_async(ResetTask.Request(seed=len(asker.domains)))
    assert spinner.spin_until(answer.done, LIMIT)
    assert not answer.result().error_code, answer.result().error_msg
    assert spinner.spin_until(lambda: len(asker.domains) > before, LIMIT)
    return DomainChoice.announced(asker.domains[-1]).digest


def test_a_bad_announcement_changes_nothing_in_the_world(network, tmp_path):
    allowed = tmp_path / "allowed"
    good = write_library(allowed / "good")
    strange = [
        announced(write_library(tmp_path / "outside", PICKING)),
        announced(allowed / "nowhere"),
        announced(unreadable(allowed / "unreadable")),
    ]
    heard = []
    with world(allowed) as (asker, spinner, node):
        node.create_subscription(SKILLS.type, SKILLS.name, heard.append, SKILLS.qos)

        def announce(*messages):
            for message in messages:
                count = len(heard)
                asker.libraries.publish(message)
                assert spinner.spin_until(lambda: len(heard) > count, LIMIT)  # noqa: B023

        announce(*strange)
        assert digest_after_reset(asker, spinner) == ""
        announce(announced(good, "wrong"), *strange)  # the newest are no use
        assert digest_after_reset(asker, spinner) == digest_of(good)
        announce(*strange)
        assert digest_after_reset(asker, spinner) == digest_of(good)
        other = write_library(allowed / "other", replace(PICKING, horizon=40), PUTTING)
        announce(announced(other, digest_of(other)))
        assert digest_after_reset(asker, spinner) == digest_of(other)


def test_nodes_find_the_library_whatever_strangers_say_of_it(network, tmp_path):
    good = write_library(tmp_path / "good")
    write_library(tmp_path / "other", PICKING)
    common = CommonParameters(libraries=str(tmp_path))
    with world(tmp_path) as (asker, spinner, _):
        listener = StateSynchronizer(asker, lambda _: None, common=common)
        tracker = listener._episodes
        for number in range(300):
            tracker._on_skills(announced(tmp_path / "good", f"{number:016x}"))
            tracker._on_skills(announced(tmp_path.parent, f"{number:016x}"))
        tracker._on_skills(announced(tmp_path / "other", digest_of(good)))
        assert tracker._refusals.counts["refused_skills"] == 300
        asker.libraries.publish(announced(good))
        assert spinner.spin_until(lambda: listener.episode is not None, LIMIT)
        while digest_after_reset(asker, spinner) != digest_of(good):
            pass  # until the announcement has reached the world
        assert spinner.spin_until(lambda: tracker.library_folder == good, LIMIT)
        listener.destroy()
