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
E2E_RUN=$spec E2E_WORKERS=1 exec ../node_modules/.bin/playwright test "specs/$spec.spec.ts"
