# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""One task of Obstacle 2D, planned with what ships and executed, for all tests."""

import pytest

import slap_ros


@pytest.fixture(scope="session")
def domain():
    return slap_ros.make("obstacle2d")


@pytest.fixture(scope="session")
def task(domain):
    return domain.task(seed=1)


@pytest.fixture(scope="session")
def plan(domain, task):
    return slap_ros.plan(domain, task)


@pytest.fixture(scope="session")
def run(domain, task, plan):
    return slap_ros.execute(domain, task, plan)


@pytest.fixture(scope="session")
def bag(run, tmp_path_factory):
    return run.bag(tmp_path_factory.mktemp("bags") / "by_api")
