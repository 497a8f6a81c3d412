# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What nobody foresaw in a node: told without the secrets of its environment."""

import rclpy
from rclpy.node import Node

from ensemble.answering import domain_error, error_to_answer
from ensemble.entry_point import run_node
from slap_ros.errors import ErrorCode

KEY = "sk-secret-0123456789abcdef"


def header_of(key):
    return f"Bearer “{key}”".encode("ascii")


def test_a_node_that_ends_unforeseen_shows_no_key(network, monkeypatch, capfd):
    monkeypatch.setenv("OPENAI_API_KEY", KEY)

    def make():
        try:
            return header_of(KEY)
        except UnicodeEncodeError as error:
            raise RuntimeError(repr(error)) from error

    assert run_node("some_node", make) == ErrorCode.UNKNOWN  # as Python itself ends
    told = "".join(capfd.readouterr())
    assert "RuntimeError" in told and "test_secrets.py" in told
    assert KEY not in told


def test_answers_and_logs_of_a_node_have_no_key(network, monkeypatch, capfd):
    monkeypatch.setenv("OPENAI_API_KEY", KEY)
    rclpy.init()
    node = Node("some_node")
    try:
        try:
            int(f"Bearer {KEY}")
        except ValueError as error:
            answers = [error_to_answer(node, error), domain_error(node, "moon", error)]
    finally:
        node.destroy_node()
        rclpy.shutdown()
    assert [answer.code for answer in answers] == [
        ErrorCode.INTERNAL_ERROR,
        ErrorCode.INVALID_DOMAIN,
    ]
    told = "".join((*map(str, answers), *capfd.readouterr()))
    assert told.count("ValueError: invalid literal") >= 4  # in the answers and in the log
    assert KEY not in told
