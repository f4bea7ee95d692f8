#!/bin/bash
# Runs integration tests, unchanged, with servers whose maps are in PostgreSQL.
#
#   tests/postgres/with_cluster.sh tests/postgres/run_integration.sh FOLDER MODULE…
#
# FOLDER has the programs (build/bin); the environment is that of the tests in tests/integration.
set -euo pipefail
here=$(dirname "$(realpath "$0")")
programs=$(realpath "$1")
shift
bin=$(mktemp -d)
trap 'rm -rf "$bin"' EXIT
ln -s "$programs"/* "$bin"
ln -sf "$here/hypermapd.sh" "$bin/hypermapd"
export HYPERMAPD=$programs/hypermapd HYPERMAP_BIN=$bin
cd "$here/../integration"
"${HYPERMAP_TEST_PYTHON:-python3}" run.py "${@/#/test_}"
