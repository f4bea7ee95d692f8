#!/bin/bash
# Runs the tests of one web part (client, dashboard, gateway) against the programs of a build folder.
# Exit code 77: no Node or Go here that could do so.
set -euo pipefail
part=$1
HYPERMAP_BUILD=$(realpath "$2")
export HYPERMAP_BUILD
cd "$(dirname "$0")"
source ./tools.sh

require_tools
if [[ $part == gateway ]]; then
  cd gateway
  go vet ./...
  # The programs may have changed: never from the cache.
  exec go test -count=1 ./...
fi
exec npm test --silent --workspace "$part"
