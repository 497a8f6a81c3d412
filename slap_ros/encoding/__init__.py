# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""From core objects to messages, for nodes that publish them and for bags that keep them.

The way back is ``slap_ros.messages.decode``. Read ``message_encoder.py`` first.
"""

from slap_ros.encoding.message_encoder import FRAME, MessageEncoder
from slap_ros.encoding.scene_encoder import SceneEncoder

__all__ = ["FRAME", "MessageEncoder", "SceneEncoder"]
