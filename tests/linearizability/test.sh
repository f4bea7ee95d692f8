#!/bin/bash
# Runs one test with the programs of a build folder.
#
#   tests/linearizability/test.sh model BUILD           go vet and the unit tests
#   tests/linearizability/test.sh histories BUILD       a few histories are linearizable
#   tests/linearizability/test.sh finds_planted BUILD   each planted fault is found
#   tests/linearizability/test.sh failovers BUILD       a few histories of several servers are, too
#   tests/linearizability/test.sh finds_local_reads BUILD   reads that are not linearizable are found
#
# The exit code is 77 if this machine has no suitable Go, or no PostgreSQL for several servers.
set -euo pipefail
test=$1
build=$(realpath "$2")
cd "$(dirname "$0")"
./build.sh "$build"

# Of several servers. The pauses of a busy machine count as times without writes.
prove_fleet() {
  ../postgres/with_cluster.sh "$build/tests/hypermap_linearizability" --server "$build/bin/hypermapd" --servers 3 \
    --max_write_gap 60s --artifacts "$build/tests/linearizability" "$@"
}

prove() { "$build/tests/hypermap_linearizability" --server "$build/bin/hypermapd" "$@"; }

# find_planted FAULT: a history must be found that is not linearizable. Those that can't be judged in time,
# which a fault makes likelier on a busy machine, prove nothing, and the next one is made. Short histories are
# judged soonest.
find_planted() {
  local last
  last=$(prove --plant "$1" --histories 40 --operations 150 --timeout 20s --artifacts "$found" |
    tee /dev/stderr | tail -1) || true
  [[ $last =~ \"violations\":1,\"undecided\":[0-9]+,\"holds\":false\}$ ]] || {
    echo "the planted fault $1 was not found" >&2
    return 1
  }
}

case $test in
  model)
    go vet ./...
    go test ./...
    ;;
  histories) prove --histories 5 --artifacts "$build/tests/linearizability" ;;
  finds_planted)
    found=$(mktemp -d)
    trap 'rm -rf "$found"' EXIT
    for fault in stale_read lost_update double_apply lost_commits; do find_planted "$fault"; done
    ;;
  failovers)
    prove_fleet --faults kill,promote,cut_requests,pause,cut_answers --failovers 5 --cut_time 4s --clients 8
    ;;
  finds_local_reads)
    status=0
    last=$(prove_fleet --plant local_reads --histories 20 | tee /dev/stderr | tail -1) || status=$?
    if ((status == 77)); then exit 77; fi
    [[ $last =~ \"violations\":1,\"undecided\":[0-9]+,\"holds\":false\}$ ]]
    ;;
  *)
    echo "test.sh: no test '$test'" >&2
    exit 2
    ;;
esac
