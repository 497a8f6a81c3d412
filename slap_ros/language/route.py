# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How a server is reached: by which proxy, if any, and with which HTTP library.

The variables of the environment are read here, and not by the HTTP library: it would refuse to
start for a proxy that the server at hand does not need.
"""

from __future__ import annotations

import importlib
import os
from ipaddress import IPv6Address, ip_address
from socket import gethostname
from types import ModuleType
from typing import Any
from urllib.parse import urlsplit
from urllib.request import getproxies, proxy_bypass

from slap_ros.errors import LanguageUnavailableError
from slap_ros.redaction import redacted, secret_forms, without_secrets

LOCAL_NAMES = ("localhost", "localhost.localdomain", "ip6-localhost", "ip6-loopback")
CERTIFICATES = ("SSL_CERT_FILE", "SSL_CERT_DIR")


def http_library(openai: ModuleType) -> ModuleType:
    """The HTTP library below the ``openai`` package, which depends on the package's version.

    Args:
        openai: The package. Its client's base class is the library's.
    """
    roots = {base.__module__.partition(".")[0] for base in openai.DefaultHttpxClient.__mro__}
    (name,) = (root for root in roots if root.startswith("httpx"))
    return importlib.import_module(name)


def is_on_this_host(host: str) -> bool:
    """Whether a host's name or address means this machine, which no proxy need be asked for."""
    name = host.rstrip(".").lower()
    if name in (*LOCAL_NAMES, gethostname().lower()) or name.endswith(".localhost"):
        return True
    try:
        address = ip_address(name)
    except ValueError:
        return False
    if isinstance(address, IPv6Address) and address.ipv4_mapped is not None:
        return address.ipv4_mapped.is_loopback
    return address.is_loopback or address.is_unspecified


def proxy_of(url: str) -> str | None:
    """The proxy by which an address is asked, from the environment; None: without one.

    Args:
        url: Address of the server.
    """
    parts = urlsplit(url)
    if is_on_this_host(parts.hostname or "") or proxy_bypass(parts.netloc):
        return None
    proxies = getproxies()
    proxy = proxies.get(parts.scheme) or proxies.get("all")
    return f"http://{proxy}" if proxy and "://" not in proxy else proxy


def described_route(url: str) -> str:
    """Words for messages that say how an address is asked; empty where it is without a proxy."""
    variables = _proxy_variables(url) if proxy_of(url) else ""
    return f" by way of the proxy in {variables}" if variables else ""


def open_client(openai: ModuleType, url: str, key: str) -> Any:
    """The client of the ``openai`` package for one address; nothing is sent yet.

    A key goes nowhere but to the address given: redirections are not followed. So a plain http
    address never comes to TLS, and reading the certificates for it is left out.

    Args:
        openai: The package.
        url: Address of the server.
        key: What the server is given as key.

    Raises:
        LanguageUnavailableError: The address, or the proxy or certificates that the environment
            names, cannot be used.
    """
    proxy = proxy_of(url)
    try:
        transport = http_library(openai).HTTPTransport(
            proxy=proxy, verify=proxy is not None or not url.startswith("http://")
        )
        http = openai.DefaultHttpxClient(follow_redirects=False, transport=transport)
        return openai.OpenAI(api_key=key, base_url=url, max_retries=0, http_client=http)
    except Exception as error:  # the packages' and those below them, of whatever kinds
        words = redacted(f"{type(error).__name__}: {error}", secret_forms(key))
        raise LanguageUnavailableError(
            f"{url} cannot be asked{described_route(url)}: {without_secrets(words)}. "
            f"{_advice(url, proxy)}"
        ) from None


def _proxy_variables(url: str) -> str:
    wanted = (f"{urlsplit(url).scheme}_proxy", "all_proxy")
    found = (name for name, value in os.environ.items() if value and name.lower() in wanted)
    return " and ".join(sorted(found)) or "the settings of this machine"


def _advice(url: str, proxy: str | None) -> str:
    if proxy is None:
        named = [name for name in CERTIFICATES if os.environ.get(name)]
        return f"Check the address{''.join(f', {name}' for name in named)}"
    without = f"set NO_PROXY={urlsplit(url).hostname} to ask without a proxy"
    if proxy.lower().startswith("socks"):
        return (
            f"A SOCKS proxy takes another package, and an address with socks5: "
            f"pip install socksio; or {without}"
        )
    return f"Correct the address of the proxy; or {without}"
