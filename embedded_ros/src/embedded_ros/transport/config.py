# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""CycloneDDS's configuration: host-only unless the environment opens it up."""

from __future__ import annotations

import os
from html import escape

from .errors import RCLError

# A killed peer disappears from the graph after this long; CycloneDDS's own default is 10 s.
LEASE_DURATION_S = 4
# Participants (processes, as a rule) a host can have in one domain, less one.
MAX_PARTICIPANT_INDEX = 63
MAX_DOMAIN_ID = 232
# How often a participant announces itself again. Whoever listens to multicast alone, as a ROS 2 at
# its default range does, is not heard on lo and waits for the next time (CycloneDDS's own: 30 s).
ANNOUNCEMENT_PERIOD_S = 2
# How long a writer that is deleted waits for acknowledgements. On one host they take well under
# 1 ms; only readers that died keep it waiting (CycloneDDS's own default: 1 s each).
WRITER_LINGER_MS = 200
# Where each thread that receives puts what others announce, until it is full and there is a new
# one. Into CycloneDDS's own 1 MiB an idle process grows by 1 KiB/s for a quarter of an hour, which
# looks like a leak (11.0.1). 128 KiB have to be free for the next packet.
RECEIVE_BUFFER_KIB = 256
DOMAIN_VARIABLE = "ROS_DOMAIN_ID"
SECURITY_VARIABLE = "ROS_SECURITY_ENABLE"

_RANGES = ("OFF", "LOCALHOST", "SUBNET", "SYSTEM_DEFAULT")


def domain_id_from_environment() -> int:
    """``ROS_DOMAIN_ID``, or 0.

    Raises:
        RCLError: It is no number from 0 to 232.
    """
    text = os.environ.get(DOMAIN_VARIABLE, "").strip() or "0"
    if not text.isdecimal():
        raise RCLError(f"{DOMAIN_VARIABLE} is {text!r}, expected a number")
    return checked_domain_id(int(text))


def checked_domain_id(domain_id: int) -> int:
    """The domain, if there can be one of this number; raises RCLError otherwise."""
    if not 0 <= domain_id <= MAX_DOMAIN_ID:
        raise RCLError(f"domain {domain_id} is not in 0..{MAX_DOMAIN_ID}")
    return domain_id


def configuration() -> str | None:
    """The configuration as XML, or None where CYCLONEDDS_URI or CycloneDDS itself decides.

    Raises:
        RCLError: ROS_AUTOMATIC_DISCOVERY_RANGE is none of ROS 2's ranges, or SROS 2 is asked for.
    """
    if os.environ.get(SECURITY_VARIABLE, "").strip().lower() == "true":
        raise RCLError(
            f"{SECURITY_VARIABLE} is true, but embedded_ros has no SROS 2: source a ROS 2, or "
            "unset it to run without encryption"
        )
    if os.environ.get("CYCLONEDDS_URI"):
        return None
    reach = _discovery_range()
    if reach == "SYSTEM_DEFAULT":
        return None
    if reach == "SUBNET":
        # Without lo, announcements that arrive over it are dropped (CycloneDDS 11.0.1).
        interfaces = (
            '<NetworkInterface autodetermine="true"/>'
            '<NetworkInterface name="lo" multicast="false"/>'
        )
        multicast = "true"
    else:
        interfaces = '<NetworkInterface name="lo"/>'
        multicast = "false"
    # Without an index a participant listens on ports that nobody can guess.
    index = "none" if reach == "OFF" else "auto"
    peers = [] if reach == "OFF" else ["localhost", *_static_peers()]
    # CycloneDDS asks this host's own ports whatever the peers are; participants with different
    # tags ignore each other.
    tag = f"<Tag>{os.getpid()}</Tag>" if reach == "OFF" else ""
    # PruneDelay: a peer that is not there yet must go on being asked for.
    peer_elements = "".join(f'<Peer address="{escape(p)}" PruneDelay="inf"/>' for p in peers)
    return (
        "<CycloneDDS><Domain><General>"
        f"<Interfaces>{interfaces}</Interfaces>"
        f"<AllowMulticast>{multicast}</AllowMulticast>"
        "</General><Discovery>"
        f"<ParticipantIndex>{index}</ParticipantIndex>"
        f"<MaxAutoParticipantIndex>{MAX_PARTICIPANT_INDEX}</MaxAutoParticipantIndex>"
        f"<LeaseDuration>{LEASE_DURATION_S} s</LeaseDuration>"
        f"<SPDPInterval>{ANNOUNCEMENT_PERIOD_S} s</SPDPInterval>"
        f"{tag}<Peers>{peer_elements}</Peers>"
        "</Discovery><Sizing>"
        f"<ReceiveBufferSize>{RECEIVE_BUFFER_KIB} KiB</ReceiveBufferSize>"
        "</Sizing><Internal>"
        f"<WriterLingerDuration>{WRITER_LINGER_MS} ms</WriterLingerDuration>"
        "</Internal></Domain></CycloneDDS>"
    )


def is_host_only() -> bool:
    """Whether nobody from another host is to be heard; only where :func:`configuration` decides."""
    return _discovery_range() in ("OFF", "LOCALHOST")


def _discovery_range() -> str:
    if os.environ.get("ROS_LOCALHOST_ONLY") == "1":
        return "LOCALHOST"
    reach = os.environ.get("ROS_AUTOMATIC_DISCOVERY_RANGE", "").strip() or "LOCALHOST"
    if reach not in _RANGES:
        raise RCLError(
            f"ROS_AUTOMATIC_DISCOVERY_RANGE is {reach!r}, expected one of {', '.join(_RANGES)}"
        )
    return reach


def _static_peers() -> list[str]:
    return [peer for peer in os.environ.get("ROS_STATIC_PEERS", "").split(";") if peer]
