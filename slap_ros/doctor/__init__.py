# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Can this machine run slap_ros, and what is missing for what?"""
