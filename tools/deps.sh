#!/bin/bash
# Installs the missing packages that a group of targets needs.
#
#   tools/deps.sh build    compiler and libraries to build the programs
#   tools/deps.sh server   the same without PCL and the tests' libraries: for hypermap-server alone
#   tools/deps.sh package  tools that make and try Debian packages
#   tools/deps.sh test     other software that the tests use: a browser, GDAL, Shapely, gRPC for
#                          Python, ament and rosidl, PostgreSQL, grpcurl; only checks for Rust
#   tools/deps.sh web      protoc, to build the dashboard; only checks for Node and Go
#   tools/deps.sh python   the packages that the virtual environments of the Python client need
#   tools/deps.sh api      protoc and its Python runtime, which make the API reference
#   tools/deps.sh lint     clang-format, clang-tidy, buf
#   tools/deps.sh bench    the databases that `make bench PEERS=1` compares with the server
#
# Debian's packages of PostgreSQL, pgbouncer and etcd start a server each, as they do for everybody who
# installs them. The tests start their own and leave those alone, so that a machine's configuration is
# not touched here.
#
# Debian packages come from apt (with sudo when not root; the package lists are only refreshed when
# something is missing). Pinned versions of grpcurl and buf are installed in build/tools. They are
# optional: without Go, npm or a network the tests that need them are skipped.
set -euo pipefail
cd "$(dirname "$0")/.."

GRPCURL=v1.9.3
BUF=1.75.0

packages_of() {
  case $1 in
    build) echo build-essential clang-14 lld-14 libclang-rt-14-dev cmake ninja-build ccache \
             pkg-config libgrpc++-dev libprotobuf-dev protobuf-compiler protobuf-compiler-grpc \
             libabsl-dev libeigen3-dev libgeos-dev libsqlite3-dev libspdlog-dev libssl-dev \
             libyaml-cpp-dev prometheus-cpp-dev libcivetweb-dev libzip-dev libpng-dev libtiff-dev nlohmann-json3-dev libcli11-dev libutfcpp-dev \
             libgtest-dev libgmock-dev librapidcheck-dev libbenchmark-dev libcairo2-dev \
             libpcl-dev libfastrtps-dev libpq-dev ;;
    server) echo build-essential clang-14 lld-14 cmake ninja-build \
             pkg-config libgrpc++-dev libprotobuf-dev protobuf-compiler protobuf-compiler-grpc \
             libabsl-dev libeigen3-dev libgeos-dev libsqlite3-dev libspdlog-dev libssl-dev \
             libyaml-cpp-dev prometheus-cpp-dev libcivetweb-dev libzip-dev libpng-dev libtiff-dev nlohmann-json3-dev libcli11-dev \
             libutfcpp-dev libcairo2-dev libpq-dev dpkg-dev file python3 ;;
    package) echo dpkg-dev file mmdebstrap python3 ;;
    test)  echo ament-cmake chromium-headless-shell etcd-server fonts-dejavu-core gdal-bin libfaketime \
             librosidl-runtime-c-cpp-dev librosidl-typesupport-interface-dev openssl patroni \
             pgbouncer postgresql-15 postgresql-15-postgis-3 python3-gdal python3-grpcio \
             python3-numpy python3-protobuf python3-shapely python3-yaml python3-venv rosidl-cmake \
             rosidl-generator-c-cpp sqlite3 valgrind ;;
    web)   echo protobuf-compiler ;;
    python) echo openssl python3-venv ;;
    api)   echo protobuf-compiler python3-protobuf ;;
    lint)  echo clang-format-14 clang-tidy-14 ;;
    bench) echo libboost-dev libspatialite-dev postgresql-15 postgresql-15-postgis-3 ;;
    *)     echo "tools/deps.sh: no group '$1'" >&2; return 2 ;;
  esac
}

install_missing() {
  local missing=() package
  for package in "$@"; do
    dpkg-query -W -f='${db:Status-Status}' "$package" 2>/dev/null | grep -qx installed ||
      missing+=("$package")
  done
  ((${#missing[@]})) || return 0
  echo "installing: ${missing[*]}"
  local as_root=()
  ((EUID == 0)) || as_root=(sudo)
  "${as_root[@]}" apt-get update -qq
  "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive \
    apt-get install -y -qq --no-install-recommends "${missing[@]}"
}

install_grpcurl() {
  local bin=$PWD/build/tools/bin
  [[ -x $bin/grpcurl ]] && return
  if ! command -v go >/dev/null; then
    echo "grpcurl not installed: Go is missing"
    return
  fi
  GOBIN=$bin go install "github.com/fullstorydev/grpcurl/cmd/grpcurl@$GRPCURL" ||
    echo "grpcurl not installed: see above"
}

install_buf() {
  local prefix=$PWD/build/tools
  [[ -x $prefix/node_modules/.bin/buf ]] && return
  if ! command -v npm >/dev/null; then
    echo "buf not installed: npm is missing"
    return
  fi
  npm install --silent --no-audit --no-fund --no-save --prefix "$prefix" "@bufbuild/buf@$BUF" ||
    echo "buf not installed: see above"
}

# Reports missing programs. Debian's versions are too old, so users install others themselves.
look_for_web_tools() {
  local tool
  for tool in node npm go; do
    command -v "$tool" >/dev/null ||
      echo "$tool is missing: the web parts (dashboard, gateway, TypeScript client) won't be built"
  done
}

look_for_rust() {
  command -v cargo >/dev/null ||
    echo "cargo is missing: hypermap-ros2 won't be tested with ros2-client, which needs Rust 1.88"
}

for group in "$@"; do
  packages=$(packages_of "$group")
  if command -v dpkg-query >/dev/null; then
    # shellcheck disable=SC2086 # The string is a list of words.
    install_missing $packages
  else
    echo "not a Debian system; these packages are assumed to be installed: $packages"
  fi
  if [[ $group == test ]]; then
    install_grpcurl
    look_for_rust
  fi
  if [[ $group == lint ]]; then install_buf; fi
  if [[ $group == web ]]; then look_for_web_tools; fi
done
