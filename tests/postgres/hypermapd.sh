#!/bin/bash
# Runs hypermapd on a PostgreSQL database in place of GeoPackages, for tests and proofs that take the
# path of a server: each folder of maps that they name gets a database of its own in the cluster of
# with_cluster.sh. A server that is started again on a folder has the id of the one before, and so
# need not wait for the end of its lease.
#
#   [HYPERMAPD=build/bin/hypermapd] tests/postgres/hypermapd.sh --data_dir=FOLDER FLAGS…
set -euo pipefail
server=${HYPERMAPD:-$(dirname "$0")/../../build/bin/hypermapd}
for argument in "$@"; do
  if [[ $argument == --data_dir=* ]]; then folder=$(realpath -m "${argument#--data_dir=}"); fi
done
name=t_$(md5sum <<< "$folder" | head -c 24)
psql -qAt -d "$HYPERMAP_TEST_POSTGRES/postgres" \
  -c "SELECT 1 FROM pg_database WHERE datname = '$name'" | grep -q 1 ||
  psql -q -d "$HYPERMAP_TEST_POSTGRES/postgres" -c "CREATE DATABASE $name STRATEGY FILE_COPY"
exec "$server" "--store=$HYPERMAP_TEST_POSTGRES/$name" "--server_id=$name" "$@"
