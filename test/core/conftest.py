# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Lets the tests of the contract import how the tests of domains execute a task."""
