# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The pictures of the documentation, each made by ``python -m tools.pictures NAME``."""
