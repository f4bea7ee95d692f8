#!/bin/bash
# Makes the Debian packages, build/packages/hypermap-*.deb.
#
#   tools/package.sh           all of them; that of the dashboard only where Node and Go are
#   tools/package.sh server    only hypermap-server, which needs no PCL, Node or Go
#
# Their dependencies are what dpkg-shlibdeps finds. Files get the date of the newest commit.
set -euo pipefail
cd "$(dirname "$0")/.."
jobs=${JOBS:-$(nproc)}
if [[ -z ${SOURCE_DATE_EPOCH:-} ]]; then
  # An archive of the sources has no commits.
  SOURCE_DATE_EPOCH=$(git log -1 --format=%ct 2>/dev/null || stat --format=%Y CHANGELOG.md)
fi
export SOURCE_DATE_EPOCH

# pack PRESET COMPONENTS: COMPONENTS are separated by ";".
pack() {
  mkdir -p build/packages
  (cd "build/$1" && cpack -G DEB -D "CPACK_COMPONENTS_ALL=$2")
  ls -l build/packages/*.deb
}

# CMAKE_ARGS are words, as in the Makefile.
case ${1:-all} in
  server)
    # shellcheck disable=SC2086
    cmake --preset package-server ${CMAKE_ARGS:-}
    cmake --build build/package-server --parallel "$jobs" --target hypermapd_documents
    rm -f build/packages/hypermap-server_*.deb
    pack package-server server ;;
  all)
    # shellcheck disable=SC2086
    cmake --preset package ${CMAKE_ARGS:-}
    cmake --build build/package --parallel "$jobs"
    components='server;client'
    [[ ! -x build/package/bin/hypermap-ingest ]] || components+=';ingest'
    [[ ! -x build/package/bin/hypermap-ros2 ]] || components+=';ros2'
    if client_libs/web/build.sh build/package; then
      components+=';dashboard'
    elif (($? != 77)); then
      exit 1
    fi
    rm -f build/packages/*.deb
    pack package "$components" ;;
  *)
    echo "usage: tools/package.sh [server]" >&2
    exit 2 ;;
esac
