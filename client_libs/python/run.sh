#!/bin/bash
# Builds and tests the Python client. All output is in build/python.
#
#   run.sh wheel   builds dist/*.whl and dist/*.tar.gz with the tools of requirements/build.txt
#   run.sh test    builds and installs the wheel with the tools of requirements/test.txt, and runs
#                  mypy, ruff and pytest; further arguments are passed to pytest
#
# $HYPERMAP_BIN is the folder of hypermapd (default build/bin), $PYTHON the interpreter. The exit
# code is 77 if virtual environments cannot be created, because venv or a package index is missing.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
root=$(cd "$here/../.." && pwd)
out=$root/build/python
python=${PYTHON:-$(PATH=/usr/bin:$PATH command -v python3)}
export PIP_DISABLE_PIP_VERSION_CHECK=1 PYTHONDONTWRITEBYTECODE=1

skip() {
  echo "skipped: $*" >&2
  exit 77
}

# Creates the virtual environment of requirements/NAME.txt, or recreates it if that file or the
# interpreter has changed.
make_environment() {
  local venv=$out/$1 requirements=$here/requirements/$1.txt stamp
  stamp=$("$python" --version; sha256sum <"$requirements")
  [[ -f $venv/stamp && $(<"$venv/stamp") == "$stamp" ]] && return
  rm -rf "$venv"
  "$python" -m venv "$venv" || skip "no python3-venv here"
  if ! "$venv/bin/pip" install --quiet --require-hashes -r "$requirements"; then
    "$venv/bin/pip" download --quiet --no-deps --dest "$venv" packaging || skip "no package index"
    return 1
  fi
  echo "$stamp" >"$venv/stamp"
}

make_wheel() {
  make_environment build
  rm -rf "$out/dist"
  "$out/build/bin/python" -m build --no-isolation --outdir "$out/dist" "$here" >"$out/build.log" 2>&1 ||
    { cat "$out/build.log" >&2; return 1; }
}

# Checks types and style. mypy reads the unpacked wheel, which includes the generated code, because it
# does not check installed packages.
check_types_and_style() {
  rm -rf "$out/unpacked"
  "$python" -m zipfile -e "$out"/dist/*.whl "$out/unpacked"
  cp "$here/pyproject.toml" "$out/unpacked"
  (cd "$out/unpacked" && "$out/test/bin/mypy" --cache-dir "$out/mypy")
  "$out/test/bin/ruff" check --no-cache --quiet "$here"
  "$out/test/bin/ruff" format --no-cache --quiet --check "$here"
}

mkdir -p "$out"
exec 9>"$out/lock"
flock 9  # Tests of several build folders can run at the same time and share build/python.
case ${1:-} in
  wheel)
    make_wheel
    ls "$out"/dist/* ;;
  test)
    make_wheel
    make_environment test
    "$out/test/bin/pip" install --quiet --no-deps --force-reinstall "$out"/dist/*.whl
    check_types_and_style
    cd "$here"
    "$out/test/bin/python" -m pytest --quiet "${@:2}" ;;
  *)
    echo "usage: run.sh wheel | test [PYTEST ARGUMENTS]" >&2
    exit 2 ;;
esac
