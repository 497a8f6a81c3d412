# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The command ``slap`` in the process of the test, which has everything imported."""

from typer.testing import CliRunner, Result

from ensemble.cli.application import app


def slap(*arguments: object, **environment: str) -> Result:
    """What a command comes to: its exit code, and what it wrote to each stream.

    Args:
        arguments: Words after ``slap``, each as its str.
        environment: Environment variables that the command sees besides this process's.
    """
    return CliRunner().invoke(app, [str(argument) for argument in arguments], env=environment)
