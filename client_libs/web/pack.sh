#!/bin/bash
# Makes the npm package of the client, BUILD/npm/hypermap-client-VERSION.tgz. The same sources give
# the same bytes.
#
#   client_libs/web/pack.sh [BUILD]    the build folder, default build
#
# Run build.sh before. package.json has the version 0.0.0; the package gets that of the file VERSION.
set -euo pipefail
root=$(realpath "$(dirname "$0")/../..")
build=$(realpath -m "${1:-$root/build}")
cd "$(dirname "$0")/client"
source ../tools.sh
require_tools
[[ -f dist/index.js ]] || { echo "pack.sh: run client_libs/web/build.sh first" >&2; exit 1; }

staged=$(mktemp -d)
trap 'rm -rf "$staged"' EXIT
cp -r dist README.md "$staged"
cp "$root/LICENSE" "$staged"
# A package has no use for the commands that build it.
node -e '
  const fs = require("fs");
  const { scripts, devDependencies, ...rest } = JSON.parse(fs.readFileSync("package.json"));
  const described = { ...rest, version: process.argv[1] };
  fs.writeFileSync(process.argv[2], JSON.stringify(described, null, 2) + "\n");
' "$(<"$root/VERSION")" "$staged/package.json"
mkdir -p "$build/npm"
(cd "$staged" && npm pack --silent --pack-destination "$build/npm")
