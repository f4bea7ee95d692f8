#!/bin/bash
# Builds BUILD/tests/hypermap_linearizability.
#
#   tests/linearizability/build.sh [BUILD]    the build folder, default build
#
# The exit code is 77 if this machine has no suitable Go.
set -euo pipefail
build=$(realpath -m "${1:-$(dirname "$0")/../../build}")
cd "$(dirname "$0")"

go=$(go env GOVERSION 2>/dev/null | sed 's/^go//' || true)
if [[ -z $go ]] || ! printf '%s\n' 1.24 "$go" | sort --check=quiet --version-sort; then
  echo "tests/linearizability needs Go 1.24 or newer, found ${go:-none}" >&2
  exit 77
fi

# The program embeds the descriptors of all messages, but those of reflection.
mkdir -p recorder/schema
(
  cd ../../proto
  find . -path ./grpc/reflection -prune -o -name '*.proto' -printf '%P\0' | sort -z | xargs -0 protoc --include_imports \
    --descriptor_set_out=../tests/linearizability/recorder/schema/hypermap.binpb
)
go build -trimpath -o "$build/tests/hypermap_linearizability" .
