#!/bin/bash
# Runs a command beside a PostgreSQL cluster of its own, in a temporary folder, on loopback, and ends
# the cluster with it. The command finds in HYPERMAP_TEST_POSTGRES the URI of the cluster without a
# database, such as postgresql://tests@127.0.0.1:40123. What is committed is not synced to the disk:
# these tests kill servers, not machines.
#
#   tests/postgres/with_cluster.sh COMMAND…
set -euo pipefail
binaries=/usr/lib/postgresql/15/bin
if [[ ! -x $binaries/initdb ]]; then
  echo "with_cluster.sh: PostgreSQL 15 is not installed" >&2
  exit 77
fi

# PostgreSQL refuses to run as root.
as_postgres=()
folder=$(mktemp -d)
if ((EUID == 0)); then
  as_postgres=(runuser -u postgres --)
  chown postgres "$folder"
fi
control() { "${as_postgres[@]}" "$binaries/$1" "${@:2}" >> "$folder/log" 2>&1; }
cleanup() {
  control pg_ctl -D "$folder/data" -m immediate stop || true
  rm -rf "$folder"
}
trap cleanup EXIT

: > "$folder/log"
chmod 666 "$folder/log"
control initdb -D "$folder/data" -U tests -A trust --no-sync
# A port that was free may be taken by the time the cluster listens on it.
for _ in 1 2 3 4 5; do
  port=$(python3 -c 'import socket; s = socket.socket(); s.bind(("127.0.0.1", 0)); print(s.getsockname()[1])')
  if control pg_ctl -D "$folder/data" -w -o "-c listen_addresses=127.0.0.1 -c port=$port \
      -c unix_socket_directories=$folder -c fsync=off -c max_connections=300" start; then
    break
  fi
  port=
done
if [[ -z $port ]]; then
  cat "$folder/log" >&2
  exit 1
fi
export HYPERMAP_TEST_POSTGRES=postgresql://tests@127.0.0.1:$port
"$@"
