#!/bin/bash
# Runs test modules of this folder in a virtual environment with the packages of requirements.txt,
# which is made in build/ros2 of the project.
#
#   tests/ros2/run.sh MODULE...
#
# The exit code is 77 if the environment can't be made, because venv or a package index is missing.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
root=$(cd "$here/../.." && pwd)
out=$root/build/ros2
venv=$out/venv
export PIP_DISABLE_PIP_VERSION_CHECK=1 PYTHONDONTWRITEBYTECODE=1

skip() {
  echo "skipped: $*" >&2
  exit 77
}

mkdir -p "$out"
(
  flock 9  # Tests of several build folders share the environment.
  stamp=$(/usr/bin/python3 --version; sha256sum <"$here/requirements.txt")
  if [[ ! -f $venv/stamp || $(<"$venv/stamp") != "$stamp" ]]; then
    rm -rf "$venv"
    # Debian's Shapely and gRPC are used, too.
    /usr/bin/python3 -m venv --system-site-packages "$venv" || skip "no python3-venv here"
    "$venv/bin/pip" install --quiet --require-hashes --no-deps -r "$here/requirements.txt" ||
      skip "no package index"
    echo "$stamp" >"$venv/stamp"
  fi
) 9>"$out/lock"
cd "$here"
PYTHONPATH=$PYTHONPATH:$root/tests/integration:$here exec "$venv/bin/python" \
  "$root/tests/integration/run.py" "$@"
