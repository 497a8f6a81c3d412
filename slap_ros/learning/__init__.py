# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What both learners share, of shortcuts and of skills, while they learn."""
