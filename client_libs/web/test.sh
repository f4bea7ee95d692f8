#!/bin/bash
# Runs the tests of one web part (client, dashboard, foxglove, gateway) against the programs of a build
# folder. The exit code is 77 if this machine has no suitable Node or Go.
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
  # Go would cache a result although the tested programs have changed.
  exec go test -count=1 ./...
fi
exec npm test --silent --workspace "$part"
