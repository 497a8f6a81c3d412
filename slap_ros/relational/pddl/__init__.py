# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""PDDL text out and in: STRIPS with types."""

from slap_ros.relational.pddl.domain_reader import parse_domain
from slap_ros.relational.pddl.problem_reader import parse_goal, parse_problem
from slap_ros.relational.pddl.task import PddlDomain, PddlProblem
from slap_ros.relational.pddl.writer import write_domain, write_problem

__all__ = [
    "PddlDomain",
    "PddlProblem",
    "parse_domain",
    "parse_goal",
    "parse_problem",
    "write_domain",
    "write_problem",
]
