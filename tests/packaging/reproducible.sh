#!/bin/bash
# Builds the Python packages and the npm package twice, in two folders and with files of two dates,
# and compares them byte by byte. The exit code is 77 if one of them can't be built here.
set -euo pipefail
cd "$(dirname "$0")/../.."
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

# build FOLDER DATE: copies the sources, and builds in the copy.
build() {
  mkdir -p "$1"
  git ls-files -z | xargs -0 cp --parents --target-directory "$1"
  find "$1" -exec touch --date="$2" {} +
  client=$1/client_libs
  "$client/python/run.sh" wheel >/dev/null || exit $?
  "$client/web/build.sh" >/dev/null || exit $?
  "$client/web/pack.sh" >/dev/null
  (cd "$1/build" && sha256sum python/dist/* npm/*) >"$1.sums"
}

build "$work/one" 2001-02-03
build "$work/other/folder" "$(date +%F)"
diff "$work/one.sums" "$work/other/folder.sums" || { echo "FAILED: the packages differ" >&2; exit 1; }
cat "$work/one.sums"
