# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Tags in a camera's pictures, as frames: what apriltag_ros does on a robot."""
