# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
# Two network namespaces joined by a cable, a node in each, which have so long to hear each other:
# `unshare -rn bash two_hosts.sh PYTHON FOLDER SECONDS`.
set -euo pipefail
here="$(dirname "$0")"
node="$here/../support/lonely_node.py"
python="$1" folder="$2" seconds="$3"
port=$((7410 + 250 * ROS_DOMAIN_ID)) # where a domain's first participant listens

unshare -n sleep 500 & other=$!
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

"$python" "$node" inside "$folder" & one=$!
"$python" "$here/../support/knock.py" 127.0.0.1 $port open
if there "$python" "$here/../support/knock.py" 10.9.0.1 $port refused; then echo door:False; else echo door:True; fi
export CYCLONEDDS_URI='<CycloneDDS><Domain><General><Interfaces><NetworkInterface name="outside"/>
  </Interfaces></General><Discovery><ParticipantIndex>auto</ParticipantIndex>
  <Peers><Peer address="10.9.0.1"/></Peers></Discovery></Domain></CycloneDDS>'
there "$python" "$node" outside "$folder" & two=$!
there_is() { [ -e "$folder/inside.$1" ] && [ -e "$folder/outside.$1" ]; }
until there_is up; do sleep 0.1; done
for ((i = 0; i < 10 * seconds; i++)); do
  if there_is heard; then break; fi
  sleep 0.1
done
touch "$folder/end"
wait $one && wait $two
