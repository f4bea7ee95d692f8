#!/bin/bash
# Runs one spec file (its name without .spec.ts) against the programs and the dashboard of a build
# folder. The exit code is 77 if this machine has no browser or no suitable Node or Go.
set -euo pipefail
spec=$1
HYPERMAP_BUILD=$(realpath "$2")
export HYPERMAP_BUILD
cd "$(dirname "$0")"
source ../tools.sh

require_tools
if ! command -v "${HYPERMAP_CHROMIUM:-chromium}" >/dev/null; then
  echo 'the end-to-end tests need Chromium' >&2
  exit 77
fi
# As root, Chromium raises the priority of its threads and takes the processors from everything else.
# Without this capability it runs as it does for other users.
as_others=()
if ((EUID == 0)); then as_others=(setpriv --bounding-set -sys_nice --inh-caps -sys_nice); fi
E2E_RUN=$spec E2E_WORKERS=1 exec "${as_others[@]}" ../node_modules/.bin/playwright test "specs/$spec.spec.ts"
