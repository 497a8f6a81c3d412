# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
# Two network namespaces joined by a cable, a node in each: `unshare -rn bash two_hosts.sh PYTHON`.
set -euo pipefail
here="$(dirname "$0")"
node="$here/lonely_node.py"
port=$((7410 + 250 * ROS_DOMAIN_ID)) # where a domain's first participant listens

unshare -n sleep 150 & other=$!
trap 'kill $other' EXIT
until [ "$(readlink /proc/$other/ns/net)" != "$(readlink /proc/self/ns/net)" ]; do sleep 0.1; done
there() { nsenter --target $other --net "$@"; }

ip link add inside type veth peer name outside
ip link set outside netns $other
ip link set lo up
ip addr add 10.9.0.1/24 dev inside
ip link set inside up
there ip link set lo up
there ip addr add 10.9.0.2/24 dev outside
there ip link set outside up

"$1" "$node" inside & one=$!
"$1" "$here/knock.py" 127.0.0.1 $port open
if there "$1" "$here/knock.py" 10.9.0.1 $port refused; then echo door:False; else echo door:True; fi
export CYCLONEDDS_URI='<CycloneDDS><Domain><General><Interfaces><NetworkInterface name="outside"/>
  </Interfaces></General><Discovery><ParticipantIndex>auto</ParticipantIndex>
  <Peers><Peer address="10.9.0.1"/></Peers></Discovery></Domain></CycloneDDS>'
there "$1" "$node" outside & two=$!
wait $one && wait $two
