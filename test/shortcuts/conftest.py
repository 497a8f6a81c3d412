# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Lets the tests of shortcuts import the starts that they share."""
