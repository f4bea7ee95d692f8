#!/bin/bash
# run.sh NAME BUILD SPEC...
# Runs spec files (their names without .spec.ts), one after the other, against the programs and the
# dashboard of the folder BUILD. NAME is that of the folder for the results. The exit code is 77 if
# this machine has no browser or no suitable Node or Go.
set -euo pipefail
name=$1
HYPERMAP_BUILD=$(realpath "$2")
export HYPERMAP_BUILD
specs=("${@:3}")
specs=("${specs[@]/#/specs/}")
cd "$(dirname "$0")"
source ../tools.sh

require_tools
# Chromium's headless shell has no windows, whose own pages cost more than those of the tests.
HYPERMAP_CHROMIUM=$(command -v "${HYPERMAP_CHROMIUM:-chromium-headless-shell}" ||
  command -v chromium) || {
  echo 'the end-to-end tests need Chromium' >&2
  exit 77
}
export HYPERMAP_CHROMIUM
# As root, Chromium raises the priority of its threads and takes the processors from everything
# else. Without this capability it runs as it does for other users.
as_others=()
if ((EUID == 0)); then as_others=(setpriv --bounding-set -sys_nice --inh-caps -sys_nice); fi
E2E_RUN=$name E2E_WORKERS=1 exec "${as_others[@]}" ../node_modules/.bin/playwright test \
  "${specs[@]/%/.spec.ts}"
