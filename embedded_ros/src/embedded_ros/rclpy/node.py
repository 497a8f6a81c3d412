# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Nodes."""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Callable, Iterable, Sequence
from typing import Any, TypeVar

from embedded_ros.transport import names as dds_names
from embedded_ros.transport.errors import InvalidHandle
from embedded_ros.types import Message, message_class
from embedded_ros.types import Service as ServiceType

from . import _names, logging
from ._arguments import RosArguments, parse_arguments
from ._dds_qos import to_policies
from ._entity import Entity
from ._node_graph import NodeGraph
from ._parameters import Parameters
from ._qos_events import QoSWarnings
from .callback_groups import CallbackGroup, MutuallyExclusiveCallbackGroup
from .client import Client
from .clock import Clock, ROSClock
from .context import Context
from .exceptions import NotInitializedException
from .executors import Executor
from .guard_condition import GuardCondition
from .logging import RcutilsLogger
from .parameter import Parameter
from .parameter_service import ParameterService
from .publisher import Publisher
from .qos import (
    QoSProfile,
    qos_profile_parameter_events,
    qos_profile_rosout_default,
    qos_profile_services_default,
)
from .qos_overriding_options import QoSOverridingOptions, overridden
from .service import Service
from .subscription import Subscription
from .time_source import TimeSource
from .timer import Rate, Timer, period_to_ns
from .topic_endpoint_info import TopicEndpointInfo
from .utilities import get_default_context

MsgT = TypeVar("MsgT")
SrvT = TypeVar("SrvT")
ServiceT = TypeVar("ServiceT", bound=Service[Any])


class Node:
    """A node.

    Args:
        node_name: Name of the node, without namespace.
        context: The context; the default one where not given.
        cli_args: Arguments for this node alone, before the global ones in precedence.
        namespace: Namespace of the node.
        use_global_arguments: Whether the arguments given to init count.
        enable_rosout: Whether its log goes to ``/rosout`` as well.
        start_parameter_services: Whether ``ros2 param`` can reach it.
        parameter_overrides: Values that win over declared defaults.
        allow_undeclared_parameters: Whether parameters exist without being declared.
        automatically_declare_parameters_from_overrides: Whether overrides count as declared.
        enable_logger_service: Not provided; must be False.

    Raises:
        NotInitializedException: The context is not started.
        InvalidNodeNameException: The name is invalid.
        InvalidNamespaceException: The namespace is invalid.
    """

    def __init__(
        self,
        node_name: str,
        *,
        context: Context | None = None,
        cli_args: Sequence[str] | None = None,
        namespace: str | None = None,
        use_global_arguments: bool = True,
        enable_rosout: bool = True,
        start_parameter_services: bool = True,
        parameter_overrides: Sequence[Parameter] | None = None,
        allow_undeclared_parameters: bool = False,
        automatically_declare_parameters_from_overrides: bool = False,
        enable_logger_service: bool = False,
    ) -> None:
        if enable_logger_service:
            raise NotImplementedError("the logger service is not part of embedded_ros")
        self._context = context or get_default_context()
        if not self._context.ok():
            raise NotInitializedException("cannot create node")
        self._arguments = _NodeArguments(self._context, cli_args, use_global_arguments)
        self._original_name = node_name
        self._name = self._arguments.special("__node", node_name) or node_name
        self._namespace = _absolute(self._arguments.special("__ns", node_name) or namespace or "/")
        _names.check_node_name(self._name)
        _names.check_namespace(self._namespace)

        self._lock = threading.RLock()
        self._entities: list[Entity] = []
        self._publishers: list[Publisher[Any]] = []
        self._executor: Executor | None = None
        self._destroyed = False
        self._default_callback_group = MutuallyExclusiveCallbackGroup()
        self._logger = logging.get_logger(self._logger_name())
        self._clock = ROSClock()
        self._graph = NodeGraph(self._context)
        self._qos_warnings = QoSWarnings(self)
        self._context.participant.discovery.add_node(self.discovery_key)
        self._context.track(self)

        if enable_rosout and self._arguments.enable_rosout:
            self._start_rosout()
        self._parameter_events: Publisher[Any] = self.create_publisher(
            message_class("rcl_interfaces/msg/ParameterEvent"),
            "/parameter_events",
            qos_profile_parameter_events,
        )
        self._parameter_overrides = self._overrides_with(parameter_overrides or ())
        self._parameters = Parameters(
            self._parameter_overrides,
            self._announce_parameters,
            allow_undeclared_parameters,
        )
        if automatically_declare_parameters_from_overrides:
            for name, override in self._parameter_overrides.items():
                self.declare_parameter(name, override.value, ignore_override=True)
        self._time_source = TimeSource(self, self._clock)
        if start_parameter_services:
            self._parameter_service = ParameterService(self)

    # -- identity

    @property
    def context(self) -> Context:
        """The context it belongs to."""
        return self._context

    @property
    def default_callback_group(self) -> CallbackGroup:
        """The group of callbacks that are given none."""
        return self._default_callback_group

    @property
    def discovery_key(self) -> tuple[str, str]:
        """Namespace and name, as announced."""
        return self._namespace, self._name

    def get_name(self) -> str:
        """The name, without namespace."""
        return self._name

    def get_namespace(self) -> str:
        """The namespace."""
        return self._namespace

    def get_fully_qualified_name(self) -> str:
        """Namespace and name."""
        return f"{self._namespace.rstrip('/')}/{self._name}"

    def get_logger(self) -> RcutilsLogger:
        """The logger, named after the node."""
        return self._logger

    def get_clock(self) -> ROSClock:
        """The clock, simulated where ``use_sim_time`` says so."""
        return self._clock

    def resolve_topic_name(self, topic: str, *, only_expand: bool = False) -> str:
        """A topic's full name, remapped unless only expanded."""
        return self._resolve(topic, only_expand=only_expand)

    def resolve_service_name(self, service: str, *, only_expand: bool = False) -> str:
        """A service's full name, remapped unless only expanded."""
        return self._resolve(service, is_service=True, only_expand=only_expand)

    # -- executor

    @property
    def executor(self) -> Executor | None:
        """The executor that runs its callbacks, or last did."""
        executor = self._executor
        return None if executor is None or executor.is_shutdown else executor

    @executor.setter
    def executor(self, new_executor: Executor | None) -> None:
        current = self._executor
        if current is new_executor:
            return
        if current is not None:
            self._executor = None
            current.remove_node(self)
        self._executor = new_executor
        if new_executor is not None:
            new_executor.add_node(self)

    def entities(self) -> list[Entity]:
        """Everything the executor runs for this node."""
        with self._lock:
            return list(self._entities)

    def add_entity(self, entity: Entity) -> None:
        """Have the executor run something."""
        with self._lock:
            self._entities.append(entity)
        self._entities_changed()

    def remove_entity(self, entity: Entity) -> None:
        """Have the executor run it no more."""
        with self._lock:
            if entity in self._entities:
                self._entities.remove(entity)
        self._entities_changed()

    def wake_executor(self) -> None:
        """Have the executor look again at what is ready."""
        executor = self._executor
        if executor is not None:
            executor.wake()

    def check_qos(self) -> None:
        """Warn of publishers and subscriptions elsewhere whose QoS does not match."""
        self._qos_warnings.check()

    # -- topics

    def create_publisher(
        self,
        msg_type: type[MsgT],
        topic: str,
        qos_profile: QoSProfile | int,
        *,
        callback_group: CallbackGroup | None = None,
        event_callbacks: object = None,
        qos_overriding_options: QoSOverridingOptions | None = None,
        publisher_class: type[Publisher[Any]] = Publisher,
    ) -> Publisher[MsgT]:
        """Create a publisher.

        Args:
            msg_type: The class of its messages.
            topic: The topic: absolute, relative or private.
            qos_profile: QoS, or the history depth of a reliable, volatile publisher.
            callback_group: For event callbacks; without effect.
            event_callbacks: Not provided; must be None.
            qos_overriding_options: Policies that parameters override; None: no policy.
            publisher_class: The class to use.
        """
        _refuse(event_callbacks=event_callbacks)
        kind = _checked_type(msg_type, Message, topic)
        name = self._resolve(topic)
        qos = overridden(self, "publisher", name, _profile(qos_profile), qos_overriding_options)
        writer = self._participant.create_writer(
            _dds_topic(name, qos), kind.ros_type, to_policies(qos)
        )
        publisher: Publisher[MsgT] = publisher_class(self, writer, kind, name, qos)
        with self._lock:
            self._publishers.append(publisher)
        self._qos_warnings.watch(writer, name)
        return publisher

    def create_subscription(
        self,
        msg_type: type[MsgT],
        topic: str,
        callback: Callable[[MsgT], Any] | Callable[[bytes], Any],
        qos_profile: QoSProfile | int,
        *,
        callback_group: CallbackGroup | None = None,
        event_callbacks: object = None,
        qos_overriding_options: QoSOverridingOptions | None = None,
        raw: bool = False,
        content_filter_options: object = None,
    ) -> Subscription[MsgT]:
        """Create a subscription.

        Args:
            msg_type: The class of its messages.
            topic: The topic: absolute, relative or private.
            callback: Called with each message; a function or a coroutine function.
            qos_profile: QoS, or the history depth of a reliable, volatile subscription.
            callback_group: The callback's group; the node's default one where not given.
            event_callbacks: Not provided; must be None.
            qos_overriding_options: Policies that parameters override; None: no policy.
            raw: Whether the callback takes serialized bytes.
            content_filter_options: Not provided; must be None.
        """
        _refuse(event_callbacks=event_callbacks, content_filter_options=content_filter_options)
        kind = _checked_type(msg_type, Message, topic)
        name = self._resolve(topic)
        qos = overridden(self, "subscription", name, _profile(qos_profile), qos_overriding_options)
        group = callback_group or self._default_callback_group
        reader = self._participant.create_reader(
            _dds_topic(name, qos), kind.ros_type, to_policies(qos)
        )
        try:
            subscription: Subscription[MsgT] = Subscription(
                self, reader, kind, name, callback, group, qos, raw
            )
        except Exception:
            self._participant.close_endpoint(reader)
            raise
        subscription.enter_node(self)
        self._qos_warnings.watch(reader, name)
        return subscription

    # -- services

    def create_service(
        self,
        srv_type: type[SrvT],
        srv_name: str,
        callback: Callable[[Any, Any], Any],
        *,
        qos_profile: QoSProfile = qos_profile_services_default,
        callback_group: CallbackGroup | None = None,
    ) -> Service[SrvT]:
        """Create a service.

        Args:
            srv_type: The service's class.
            srv_name: Name of the service: absolute, relative or private.
            callback: Called with request and response, returns the response; may be a
                coroutine function.
            qos_profile: QoS of both directions.
            callback_group: The callback's group; the node's default one where not given.
        """
        group = callback_group or self._default_callback_group
        return self.make_service(Service, srv_type, srv_name, callback, qos_profile, group)

    def make_service(
        self,
        service_class: type[ServiceT],
        srv_type: type[Any],
        srv_name: str,
        callback: Callable[[Any, Any], Any],
        qos_profile: QoSProfile,
        callback_group: CallbackGroup,
    ) -> ServiceT:
        """Create a service of a class of one's own; otherwise as :meth:`create_service`."""
        kind = _checked_type(srv_type, ServiceType, srv_name)
        name = self._resolve(srv_name, is_service=True)
        ends = self._participant.create_server_ends(name, kind.ros_type, to_policies(qos_profile))
        service = service_class(self, ends, kind, name, callback, callback_group, qos_profile)
        service.enter_node(self)
        return service

    def create_client(
        self,
        srv_type: type[SrvT],
        srv_name: str,
        *,
        qos_profile: QoSProfile = qos_profile_services_default,
        callback_group: CallbackGroup | None = None,
    ) -> Client[SrvT]:
        """Create a service client; arguments as for :meth:`create_service`."""
        kind = _checked_type(srv_type, ServiceType, srv_name)
        name = self._resolve(srv_name, is_service=True)
        ends = self._participant.create_client_ends(name, kind.ros_type, to_policies(qos_profile))
        group = callback_group or self._default_callback_group
        client: Client[SrvT] = Client(self, ends, kind, name, group, qos_profile)
        client.enter_node(self)
        return client

    # -- timers and guard conditions

    def create_timer(
        self,
        timer_period_sec: float,
        callback: Callable[[], Any] | None,
        callback_group: CallbackGroup | None = None,
        clock: Clock | None = None,
        autostart: bool = True,
    ) -> Timer:
        """Create a timer.

        Args:
            timer_period_sec: Seconds between calls.
            callback: Called without arguments; may be a coroutine function.
            callback_group: The callback's group; the node's default one where not given.
            clock: What it goes by; the node's clock where not given.
            autostart: Whether it begins at once, or when reset.
        """
        timer = Timer(
            callback,
            callback_group or self._default_callback_group,
            period_to_ns(timer_period_sec),
            clock or self._clock,
            autostart=autostart,
        )
        timer.enter_node(self)
        return timer

    def create_guard_condition(
        self, callback: Callable[[], Any], callback_group: CallbackGroup | None = None
    ) -> GuardCondition:
        """Create a guard condition."""
        guard = GuardCondition(callback, callback_group or self._default_callback_group)
        guard.enter_node(self)
        return guard

    def create_rate(self, frequency: float, clock: Clock | None = None) -> Rate:
        """Create a rate in Hz; raises ValueError where it is not positive."""
        if frequency <= 0:
            raise ValueError("frequency must be > 0")
        timer = self.create_timer(1.0 / frequency, None, MutuallyExclusiveCallbackGroup(), clock)
        return Rate(timer, context=self._context)

    # -- destruction

    def destroy_publisher(self, publisher: Publisher[Any]) -> bool:
        """Delete a publisher; returns whether it was this node's."""
        with self._lock:
            if publisher not in self._publishers:
                return False
            self._publishers.remove(publisher)
        publisher.destroy()
        return True

    def destroy_subscription(self, subscription: Subscription[Any]) -> bool:
        """Delete a subscription; returns whether it was this node's."""
        return self._destroy(subscription)

    def destroy_client(self, client: Client[Any]) -> bool:
        """Delete a client; returns whether it was this node's."""
        return self._destroy(client)

    def destroy_service(self, service: Service[Any]) -> bool:
        """Delete a service; returns whether it was this node's."""
        return self._destroy(service)

    def destroy_timer(self, timer: Timer) -> bool:
        """Delete a timer; returns whether it was this node's."""
        return self._destroy(timer)

    def destroy_guard_condition(self, guard: GuardCondition) -> bool:
        """Delete a guard condition; returns whether it was this node's."""
        return self._destroy(guard)

    def destroy_rate(self, rate: Rate) -> bool:
        """Delete a rate."""
        rate.destroy()
        return self._destroy(rate._timer)

    def destroy_node(self) -> None:
        """Delete the node and everything it has; twice is allowed."""
        with self._lock:
            if self._destroyed:
                return
            self._destroyed = True
        self.executor = None
        logging.remove_sink(self._logger.name)
        for entity in self.entities():
            self._destroy(entity)
        for publisher in list(self._publishers):
            self.destroy_publisher(publisher)
        try:
            self._context.participant.discovery.remove_node(self.discovery_key)
        except (NotInitializedException, InvalidHandle):
            return  # the context was shut down first, and took everything with it

    def detach_from_context(self) -> None:
        """The context is shut down: its participant takes all endpoints with it."""
        logging.remove_sink(self._logger.name)

    def __enter__(self) -> Node:
        return self

    def __exit__(self, *exc: object) -> None:
        self.destroy_node()

    # -- parameters

    def declare_parameter(
        self,
        name: str,
        value: Any = None,
        descriptor: Any = None,
        ignore_override: bool = False,
    ) -> Parameter:
        """Declare a parameter.

        Args:
            name: Name of the parameter.
            value: Default of the parameter; or, where it has none, its :class:`Parameter.Type`.
            descriptor: An rcl_interfaces/msg/ParameterDescriptor.
            ignore_override: Whether to ignore the command line.

        Raises:
            ParameterAlreadyDeclaredException: It is declared.
            InvalidParameterTypeException: The override is of another type.
            InvalidParameterValueException: The value is rejected.
        """
        if descriptor is None:
            descriptor = message_class("rcl_interfaces/msg/ParameterDescriptor")()
        return self._parameters.declare(name, value, descriptor, ignore_override=ignore_override)

    def declare_parameters(
        self, namespace: str, parameters: Iterable[tuple[Any, ...]], ignore_override: bool = False
    ) -> list[Parameter]:
        """Declare several parameters: tuples of name, default and descriptor."""
        prefix = f"{namespace}." if namespace else ""
        declared = []
        for name, *rest in parameters:
            value, descriptor = (*rest, None, None)[:2]
            declared.append(
                self.declare_parameter(f"{prefix}{name}", value, descriptor, ignore_override)
            )
        return declared

    def undeclare_parameter(self, name: str) -> None:
        """Forget a parameter; raises where it is not declared, or read-only."""
        self._parameters.undeclare(name)

    def has_parameter(self, name: str) -> bool:
        """Whether a parameter is declared."""
        return self._parameters.has(name)

    def get_parameter(self, name: str) -> Parameter:
        """A parameter; raises where it is not declared or has no value."""
        return self._parameters.get(name)

    def get_parameters(self, names: Sequence[str]) -> list[Parameter]:
        """Several parameters."""
        return [self.get_parameter(name) for name in names]

    def get_parameter_or(self, name: str, alternative_value: Parameter | None = None) -> Parameter:
        """A parameter, or an alternative where it is not declared or has no value."""
        parameter = self._parameters.peek(name)
        if parameter is None or parameter.type_ is Parameter.Type.NOT_SET:
            return alternative_value or Parameter(name)
        return parameter

    def peek_parameter(self, name: str) -> Parameter | None:
        """A parameter, None where it is not declared."""
        return self._parameters.peek(name)

    def get_parameters_by_prefix(self, prefix: str) -> dict[str, Parameter]:
        """The parameters below a prefix, by their names without it."""
        start = f"{prefix}." if prefix else ""
        return {
            name.removeprefix(start): self.get_parameter(name)
            for name in self._parameters.names()
            if name.startswith(start)
        }

    def get_parameter_types(self, names: Sequence[str]) -> list[Parameter.Type]:
        """The types of parameters."""
        return [self.get_parameter_type(name) for name in names]

    def get_parameter_type(self, name: str) -> Parameter.Type:
        """The type of a parameter."""
        return self.get_parameter(name).type_

    def set_parameters(self, parameter_list: Sequence[Parameter]) -> list[Any]:
        """Set parameters one by one; returns a SetParametersResult for each."""
        return self._parameters.set(parameter_list)

    def set_parameters_atomically(self, parameter_list: Sequence[Parameter]) -> Any:
        """Set all or none; returns a SetParametersResult."""
        return self._parameters.set_atomically(list(parameter_list))

    def list_parameters(self, prefixes: Sequence[str], depth: int) -> Any:
        """Names below prefixes, as a ListParametersResult."""
        return self._parameters.listed(prefixes, depth)

    def describe_parameter(self, name: str) -> Any:
        """A parameter's descriptor."""
        return self._parameters.descriptor(name)

    def describe_parameters(self, names: Sequence[str]) -> list[Any]:
        """Parameters' descriptors."""
        return [self.describe_parameter(name) for name in names]

    def set_descriptor(self, name: str, descriptor: Any, alternative_value: Any = None) -> Any:
        """Replace a parameter's descriptor; returns its ParameterValue."""
        return self._parameters.set_descriptor(name, descriptor, alternative_value)

    def add_on_set_parameters_callback(self, callback: Callable[[list[Parameter]], Any]) -> None:
        """Ask this before parameters are set; it returns a SetParametersResult."""
        self._parameters.on_set_callbacks.insert(0, callback)

    def remove_on_set_parameters_callback(self, callback: Callable[[list[Parameter]], Any]) -> None:
        """Ask it no more."""
        self._parameters.on_set_callbacks.remove(callback)

    def add_pre_set_parameters_callback(
        self, callback: Callable[[list[Parameter]], list[Parameter]]
    ) -> None:
        """Let this change the list of parameters about to be set."""
        self._parameters.pre_set_callbacks.insert(0, callback)

    def remove_pre_set_parameters_callback(
        self, callback: Callable[[list[Parameter]], list[Parameter]]
    ) -> None:
        """Let it change them no more."""
        self._parameters.pre_set_callbacks.remove(callback)

    def add_post_set_parameters_callback(self, callback: Callable[[list[Parameter]], None]) -> None:
        """Tell this after parameters were set."""
        self._parameters.post_set_callbacks.insert(0, callback)

    def remove_post_set_parameters_callback(
        self, callback: Callable[[list[Parameter]], None]
    ) -> None:
        """Tell it no more."""
        self._parameters.post_set_callbacks.remove(callback)

    # -- graph

    def get_node_names(self) -> list[str]:
        """The names of all nodes."""
        return [name for name, _ in self._graph.nodes()]

    def get_node_names_and_namespaces(self) -> list[tuple[str, str]]:
        """Names and namespaces of all nodes."""
        return self._graph.nodes()

    def get_fully_qualified_node_names(self) -> list[str]:
        """Full names of all nodes."""
        return [f"{namespace.rstrip('/')}/{name}" for name, namespace in self._graph.nodes()]

    def get_topic_names_and_types(self, no_demangle: bool = False) -> list[tuple[str, list[str]]]:
        """All topics and their types."""
        _refuse(no_demangle=no_demangle or None)
        return self._graph.topics()

    def get_service_names_and_types(self) -> list[tuple[str, list[str]]]:
        """All services and their types."""
        return self._graph.services()

    def get_publisher_names_and_types_by_node(
        self, node_name: str, node_namespace: str, no_demangle: bool = False
    ) -> list[tuple[str, list[str]]]:
        """The topics a node publishes."""
        _refuse(no_demangle=no_demangle or None)
        return self._graph.topics_of(node_name, node_namespace, writers=True)

    def get_subscriber_names_and_types_by_node(
        self, node_name: str, node_namespace: str, no_demangle: bool = False
    ) -> list[tuple[str, list[str]]]:
        """The topics a node subscribes to."""
        _refuse(no_demangle=no_demangle or None)
        return self._graph.topics_of(node_name, node_namespace, writers=False)

    def get_service_names_and_types_by_node(
        self, node_name: str, node_namespace: str
    ) -> list[tuple[str, list[str]]]:
        """The services a node serves."""
        return self._graph.services_of(node_name, node_namespace, served=True)

    def get_client_names_and_types_by_node(
        self, node_name: str, node_namespace: str
    ) -> list[tuple[str, list[str]]]:
        """The services a node uses."""
        return self._graph.services_of(node_name, node_namespace, served=False)

    def count_publishers(self, topic_name: str) -> int:
        """How many publishers a topic has."""
        return self._graph.count(self._resolve(topic_name), writers=True)

    def count_subscribers(self, topic_name: str) -> int:
        """How many subscriptions a topic has."""
        return self._graph.count(self._resolve(topic_name), writers=False)

    def count_services(self, service_name: str) -> int:
        """How many servers a service has."""
        name = self._resolve(service_name, is_service=True)
        return self._graph.count_service_ends(name, served=True)

    def count_clients(self, service_name: str) -> int:
        """How many clients a service has."""
        name = self._resolve(service_name, is_service=True)
        return self._graph.count_service_ends(name, served=False)

    def get_publishers_info_by_topic(
        self, topic_name: str, no_mangle: bool = False
    ) -> list[TopicEndpointInfo]:
        """The publishers of a topic."""
        _refuse(no_mangle=no_mangle or None)
        return self._graph.info(self._resolve(topic_name), writers=True)

    def get_subscriptions_info_by_topic(
        self, topic_name: str, no_mangle: bool = False
    ) -> list[TopicEndpointInfo]:
        """The subscriptions of a topic."""
        _refuse(no_mangle=no_mangle or None)
        return self._graph.info(self._resolve(topic_name), writers=False)

    # -- what the node's entities can be asked for

    @property
    def publishers(self) -> Iterable[Publisher[Any]]:
        """Its publishers."""
        yield from list(self._publishers)

    @property
    def subscriptions(self) -> Iterable[Subscription[Any]]:
        """Its subscriptions."""
        yield from (e for e in self.entities() if isinstance(e, Subscription))

    @property
    def clients(self) -> Iterable[Client[Any]]:
        """Its clients."""
        yield from (e for e in self.entities() if isinstance(e, Client))

    @property
    def services(self) -> Iterable[Service[Any]]:
        """Its services."""
        yield from (e for e in self.entities() if isinstance(e, Service))

    @property
    def timers(self) -> Iterable[Timer]:
        """Its timers."""
        yield from (e for e in self.entities() if isinstance(e, Timer))

    @property
    def guards(self) -> Iterable[GuardCondition]:
        """Its guard conditions."""
        yield from (e for e in self.entities() if isinstance(e, GuardCondition))

    # -- inside

    @property
    def _participant(self) -> Any:
        if self._destroyed:
            raise InvalidHandle(f"node {self.get_fully_qualified_name()} is destroyed")
        return self._context.participant

    def _destroy(self, entity: Entity) -> bool:
        if entity not in self.entities():
            return False
        destroy: Callable[[], None] = entity.destroy  # type: ignore[attr-defined]
        destroy()
        return True

    def _entities_changed(self) -> None:
        executor = self._executor
        if executor is not None:
            executor.entities_changed()

    def _resolve(self, name: str, *, is_service: bool = False, only_expand: bool = False) -> str:
        full = _names.expand(name, self._name, self._namespace, is_service=is_service)
        if only_expand:
            return full
        return _names.remap(
            full, self._arguments.remaps, self._name, self._namespace, self._original_name
        )

    def _logger_name(self) -> str:
        return f"{self._namespace.strip('/').replace('/', '.')}.{self._name}".lstrip(".")

    def _start_rosout(self) -> None:
        log: Any = message_class("rcl_interfaces/msg/Log")
        stamp: Any = message_class("builtin_interfaces/msg/Time")
        publisher = self.create_publisher(log, "/rosout", qos_profile_rosout_default)

        def publish(record: logging.Record) -> None:
            if not self._context.ok() or self._destroyed:
                return
            seconds, nanoseconds = divmod(record.stamp_ns, logging.NANOSECONDS_PER_SECOND)
            message = log(
                stamp=stamp(sec=seconds, nanosec=nanoseconds),
                level=int(record.severity),
                name=record.name,
                msg=record.message.replace("\0", ""),
                file=record.file,
                function=record.function,
                line=record.line,
            )
            # Shut down by another thread just now: the console has the message.
            with contextlib.suppress(InvalidHandle):
                publisher.publish(message)

        logging.add_sink(self._logger.name, publish)

    def _overrides_with(self, given: Sequence[Parameter]) -> dict[str, Parameter]:
        found = {
            name: Parameter(name, value=value)
            for name, value in self._arguments.parameters_of(
                self._name, self.get_fully_qualified_name()
            ).items()
        }
        found.update({parameter.name: parameter for parameter in given})
        return found

    def _announce_parameters(
        self, new: list[Parameter], changed: list[Parameter], deleted: list[Parameter]
    ) -> None:
        if not self._context.ok():
            return
        event: Any = message_class("rcl_interfaces/msg/ParameterEvent")()
        event.stamp = self._clock.now().to_msg()
        event.node = self.get_fully_qualified_name()
        event.new_parameters = [p.to_parameter_msg() for p in new]
        event.changed_parameters = [p.to_parameter_msg() for p in changed]
        event.deleted_parameters = [p.to_parameter_msg() for p in deleted]
        self._parameter_events.publish(event)


class _NodeArguments:
    """The node's own arguments, then the global ones."""

    def __init__(self, context: Context, cli_args: Sequence[str] | None, use_global: bool) -> None:
        self._own = parse_arguments(list(cli_args)) if cli_args else RosArguments()
        self._global = context.arguments if use_global else RosArguments()
        self.remaps = (*self._own.remaps, *self._global.remaps)
        self.enable_rosout = self._own.enable_rosout and self._global.enable_rosout

    def special(self, key: str, name: str) -> str | None:
        return self._own.remapped_special(key, name) or self._global.remapped_special(key, name)

    def parameters_of(self, name: str, full_name: str) -> dict[str, Any]:
        found = self._global.parameters_of(name, full_name)
        found.update(self._own.parameters_of(name, full_name))
        return found


def _absolute(namespace: str) -> str:
    return namespace if namespace.startswith("/") else f"/{namespace}"


def _profile(qos: QoSProfile | int) -> QoSProfile:
    if isinstance(qos, QoSProfile):
        return qos
    if isinstance(qos, int) and not isinstance(qos, bool):
        if qos < 0:
            raise ValueError("history depth must be greater than or equal to zero")
        return QoSProfile(depth=qos)
    raise TypeError(f"Expected QoSProfile or int, but received {type(qos)!r}")


def _dds_topic(name: str, qos: QoSProfile) -> str:
    return name if qos.avoid_ros_namespace_conventions else dds_names.topic(name)


def _checked_type(given: Any, base: type[Any], name: str) -> Any:
    if not (isinstance(given, type) and issubclass(given, base)):
        raise TypeError(f"{name}: {given!r} is no {base.__name__.lower()} type")
    return given


def _refuse(**arguments: object) -> None:
    for name, value in arguments.items():
        if value is not None:
            raise NotImplementedError(f"{name} is not part of embedded_ros")
