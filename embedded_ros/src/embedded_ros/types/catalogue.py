# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Where interface definitions come from, and looking one up by its name.

In order of precedence:

1. the environment variable ``EMBEDDED_ROS_INTERFACES``: ``name=directory`` entries separated
   by ``os.pathsep``;
2. installed distributions' entry points in the group ``embedded_ros.interfaces``: the entry
   point's name is the interface package, its value an importable package with ``msg/``,
   ``srv/`` and ``action/`` folders;
3. the text shipped in ``embedded_ros/interfaces``, of the common packages of ROS 2 Jazzy.
"""

from __future__ import annotations

import functools
import importlib.resources
import importlib.util
import os
from collections.abc import Iterator
from importlib.resources.abc import Traversable
from pathlib import Path

from .. import sources
from .derived import action_messages, action_services, service_messages
from .errors import InterfaceError, UnknownInterfaceError
from .model import PRIMITIVES, ActionSpec, MessageSpec, ServiceSpec
from .parser import parse_action, parse_message, parse_service

KINDS = ("msg", "srv", "action")


class Package:
    """The interface files of one package."""

    def __init__(self, name: str, root: Traversable) -> None:
        self.name = name
        self._root = root

    @functools.cached_property
    def files(self) -> dict[str, dict[str, Traversable]]:
        """The files, by kind and by interface name."""
        return {kind: dict(self._scan(kind)) for kind in KINDS}

    def _scan(self, kind: str) -> Iterator[tuple[str, Traversable]]:
        folder = self._root.joinpath(kind)
        if folder.is_dir():
            for file in sorted(folder.iterdir(), key=lambda entry: entry.name):
                if file.name.endswith(f".{kind}"):
                    yield file.name.removesuffix(f".{kind}"), file


class Catalogue:
    """Every interface definition this process can use, parsed when first asked for."""

    def __init__(self) -> None:
        self._messages: dict[str, MessageSpec] = {}

    @functools.cache  # noqa: B019 -- the one catalogue lives as long as the process
    def _packages(self, name: str) -> list[Package]:
        """The packages of this name, those that win first."""
        return [Package(name, root) for root in _roots(name)]

    def names(self, package: str, kind: str) -> list[str]:
        """The names of a package's interfaces of one kind, sorted."""
        return sorted({name for p in self._packages(package) for name in p.files[kind]})

    def message(self, full_name: str) -> MessageSpec:
        """The definition of a message, or of a message derived from a service or action.

        Raises:
            InterfaceError: No source knows it, or its text is malformed.
        """
        if full_name not in self._messages:
            package, kind, name = _split(full_name)
            if kind == "msg":
                self._messages[full_name] = self._read_message(package, name)
            elif kind == "srv":
                self._add(service_messages(self.service(f"{package}/srv/{_owner(name)}")))
            else:
                self._add(action_messages(self.action(f"{package}/action/{_owner(name)}")))
        try:
            return self._messages[full_name]
        except KeyError:
            raise UnknownInterfaceError(
                f"{full_name} is no part of its service or action"
            ) from None

    @functools.cache  # noqa: B019 -- the one catalogue lives as long as the process
    def service(self, full_name: str) -> ServiceSpec:
        """The definition of a service, or of a service derived from an action.

        Raises:
            InterfaceError: No source knows it, or its text is malformed.
        """
        package, kind, name = _split(full_name)
        if kind == "action":
            action = self.action(f"{package}/action/{_owner(name)}")
            derived = {service.full_name: service for service in action_services(action)}
            return derived[full_name]
        text, source = self._text(package, "srv", name)
        return parse_service(full_name, text, source)

    @functools.cache  # noqa: B019 -- the one catalogue lives as long as the process
    def action(self, full_name: str) -> ActionSpec:
        """The definition of an action.

        Raises:
            InterfaceError: No source knows it, or its text is malformed.
        """
        package, _, name = _split(full_name)
        return parse_action(full_name, *self._text(package, "action", name))

    def _add(self, messages: list[MessageSpec]) -> None:
        self._messages.update({message.full_name: message for message in messages})

    def _read_message(self, package: str, name: str) -> MessageSpec:
        full_name = f"{package}/msg/{name}"
        text, source = self._text(package, "msg", name)
        message = parse_message(full_name, text, source)
        self._check_references(message, source)
        return message

    def _check_references(self, message: MessageSpec, source: str) -> None:
        for field in message.fields:
            if field.type.base not in PRIMITIVES:
                package, _, name = _split(field.type.base)
                if name not in self.names(package, "msg"):
                    raise InterfaceError(
                        f"{source}: {message.full_name}.{field.name}: "
                        f"no source of interfaces knows {field.type.base}"
                    )

    def _file(self, package: str, kind: str, name: str) -> Traversable | None:
        for candidate in self._packages(package):
            if name in candidate.files[kind]:
                return candidate.files[kind][name]
        return None

    def _text(self, package: str, kind: str, name: str) -> tuple[str, str]:
        file = self._file(package, kind, name)
        if file is None:
            known = ", ".join(self.names(package, kind)) or "none"
            raise UnknownInterfaceError(
                f"no source of interfaces knows {package}/{kind}/{name} "
                f"(known {kind} interfaces of {package}: {known})"
            )
        return file.read_text(encoding="utf-8"), str(file)


@functools.cache
def catalogue() -> Catalogue:
    """The process's catalogue."""
    return Catalogue()


def _roots(package: str) -> Iterator[Traversable]:
    for name, directory in sources.from_environment():
        if name == package:
            if not os.path.isdir(directory):
                raise InterfaceError(
                    f"{sources.ENVIRONMENT_VARIABLE}: {directory!r} (package {name}) "
                    "is no directory"
                )
            yield Path(directory)
    if package in (entry_points := sources.from_entry_points()):
        yield _resources(package, entry_points[package])
    if package in sources.shipped():
        yield importlib.resources.files("embedded_ros").joinpath("interfaces", package)


def _resources(package: str, module: str) -> Traversable:
    spec = importlib.util.find_spec(module)
    if spec is None:
        raise InterfaceError(
            f"entry point {package!r} in group {sources.ENTRY_POINT_GROUP!r}: "
            f"there is no module {module!r}"
        )
    # Folders without __init__.py, found by an editable installation's path hook, are beyond
    # importlib.resources.
    for location in spec.submodule_search_locations or ():
        if os.path.isdir(location):
            return Path(location)
    return importlib.resources.files(module)


def _split(full_name: str) -> tuple[str, str, str]:
    parts = full_name.split("/")
    if len(parts) != 3 or parts[1] not in KINDS:
        raise InterfaceError(f"{full_name!r} is not of the form package/msg|srv|action/Name")
    return parts[0], parts[1], parts[2]


def _owner(name: str) -> str:
    """``AddTwoInts`` of ``AddTwoInts_Request``: an interface's own name has no underscore."""
    return name.split("_", 1)[0]
