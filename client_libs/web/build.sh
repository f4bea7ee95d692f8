#!/bin/bash
# Builds the web parts: the client, BUILD/dashboard and BUILD/bin/hypermap-gateway.
#
#   client_libs/web/build.sh [BUILD]    the build folder, default build
#
# Packages are installed again when the lock file has changed. The exit code is 77 if this machine
# has no suitable Node or Go.
set -euo pipefail
version=$(<"$(dirname "$0")/../../VERSION")
build=$(realpath -m "${1:-$(dirname "$0")/../../build}")
cd "$(dirname "$0")"
source ./tools.sh

build_packages() {
  if [[ ! node_modules/.package-lock.json -nt package-lock.json ]]; then
    PLAYWRIGHT_SKIP_BROWSER_DOWNLOAD=1 npm ci --silent --no-audit --no-fund
    touch node_modules/.package-lock.json
  fi
  npm run --silent build --workspace client
  npm run --silent build --workspace dashboard -- --logLevel warn \
    --emptyOutDir --outDir "$build/dashboard"
}

# The gateway's own calls use Go's messages of the protocol. The generator is of the module that go.mod
# pins for the messages.
generate_messages() {
  local generator=$build/protoc-gen-go files options=() file
  (cd gateway && go build -o "$generator" google.golang.org/protobuf/cmd/protoc-gen-go)
  rm -rf gateway/gen
  cd ../../proto
  files=(hypermap/v1/*.proto)
  for file in "${files[@]}"; do
    options+=("--go_opt=M$file=hypermap-gateway/gen/hypermapv1")
  done
  protoc --plugin="$generator" --go_out=../client_libs/web/gateway --go_opt=module=hypermap-gateway \
    "${options[@]}" "${files[@]}"
}

# The gateway embeds the descriptors of all messages, but those of reflection, which it does not
# serve.
build_gateway() {
  mkdir -p gateway/schema
  (generate_messages)
  npm run --silent schemas --workspace foxglove
  (
    cd ../../proto
    find . -path ./grpc/reflection -prune -o -name '*.proto' -printf '%P\0' | sort -z | xargs -0 protoc --include_imports \
      --descriptor_set_out=../client_libs/web/gateway/schema/hypermap.binpb
  )
  (cd gateway && go build -trimpath -ldflags "-X main.version=$version" -o "$build/bin/hypermap-gateway" .)
}

make_man_page() {
  python3 -B ../../packaging/make_documents.py "$build/documents" "$version" \
    "$build/bin/hypermap-gateway" ../../packaging/man/hypermap-gateway.roff
}

require_tools
build_packages
build_gateway
make_man_page
