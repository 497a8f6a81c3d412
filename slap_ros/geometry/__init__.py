# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Rigid geometry: poses, oriented boxes and their separation, static transforms."""
