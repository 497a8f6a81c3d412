# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The messages and services that ROS 2 derives from a service or an action definition."""

from __future__ import annotations

from .model import ActionSpec, Field, FieldType, MessageSpec, ServiceSpec, Shape

GOAL_ID = Field("goal_id", FieldType("unique_identifier_msgs/msg/UUID"))
STAMP = Field("stamp", FieldType("builtin_interfaces/msg/Time"))


def service_event(full_name: str) -> MessageSpec:
    """The introspection message of a service; part of the service's type hash."""
    return MessageSpec(
        f"{full_name}_Event",
        (
            Field("info", FieldType("service_msgs/msg/ServiceEventInfo")),
            Field("request", FieldType(f"{full_name}_Request", 0, Shape.SEQUENCE, 1)),
            Field("response", FieldType(f"{full_name}_Response", 0, Shape.SEQUENCE, 1)),
        ),
    )


def service_messages(service: ServiceSpec) -> list[MessageSpec]:
    """Every message that a service consists of."""
    return [service.request, service.response, service_event(service.full_name)]


def action_services(action: ActionSpec) -> list[ServiceSpec]:
    """The services an action consists of, besides action_msgs/srv/CancelGoal."""
    base = action.full_name
    send_goal, get_result = f"{base}_SendGoal", f"{base}_GetResult"
    return [
        ServiceSpec(
            send_goal,
            MessageSpec(
                f"{send_goal}_Request", (GOAL_ID, Field("goal", FieldType(f"{base}_Goal")))
            ),
            MessageSpec(f"{send_goal}_Response", (Field("accepted", FieldType("bool")), STAMP)),
        ),
        ServiceSpec(
            get_result,
            MessageSpec(f"{get_result}_Request", (GOAL_ID,)),
            MessageSpec(
                f"{get_result}_Response",
                (Field("status", FieldType("int8")), Field("result", FieldType(f"{base}_Result"))),
            ),
        ),
    ]


def action_feedback(action: ActionSpec) -> MessageSpec:
    """The message on an action's feedback topic."""
    feedback = Field("feedback", FieldType(f"{action.full_name}_Feedback"))
    return MessageSpec(f"{action.full_name}_FeedbackMessage", (GOAL_ID, feedback))


def action_messages(action: ActionSpec) -> list[MessageSpec]:
    """Every message that an action consists of."""
    messages = [action.goal, action.result, action.feedback, action_feedback(action)]
    for service in action_services(action):
        messages += service_messages(service)
    return messages
