# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Learned shortcuts between abstract states: found, trained, kept in libraries, planned with."""
