#!/bin/bash
# Checks the format and the style of the sources.
#
#   tools/lint.sh [SINCE]   clang-format on all sources, clang-tidy on those that differ from the
#                           commit SINCE (default: origin/main; "none" or no such commit: all),
#                           rustfmt, buf on the protos
#   tools/lint.sh --ci      the same since the commit before the newest, with clang-tidy on at most
#                           12 sources that are not tests
#   tools/lint.sh --fix     formats all sources
#
# clang-tidy takes 15 to 40 s per source file, so CI leaves most files to `make nightly`.
set -euo pipefail
cd "$(dirname "$0")/.."

rooms=(base map wire storage server ingest simulation client_libs tests)
rust=tests/ros2/peer/src/main.rs  # rustfmt finds its modules.
has_rustfmt() { rustfmt --version >/dev/null 2>&1; }
mapfile -t sources < <(find "${rooms[@]}" -name '*.h' -o -name '*.cc' | sort)

if [[ ${1:-} == --fix ]]; then
  clang-format-14 -i "${sources[@]}"
  if has_rustfmt; then rustfmt --edition 2024 "$rust"; fi
  exit
fi

clang-format-14 --dry-run --Werror "${sources[@]}"
echo "clang-format: ${#sources[@]} files"

exists() { git rev-parse --quiet --verify "$1^{commit}" >/dev/null; }

since=${1:-origin/main}
[[ $since == --ci ]] && since=HEAD^
exists "$since" || since=

if [[ -n $since ]]; then
  mapfile -t tidied < <({ git diff --name-only --diff-filter=d "$since" -- "${rooms[@]}"
                          git ls-files --others --exclude-standard -- "${rooms[@]}"; } |
                        grep '\.cc$' | sort -u || true)
else
  mapfile -t tidied < <(printf '%s\n' "${sources[@]}" | grep '\.cc$')
fi
count=${#tidied[@]}
if [[ ${1:-} == --ci ]]; then
  mapfile -t tidied < <(printf '%s\n' "${tidied[@]}" | grep '\.cc$' | grep -v '_test\.cc$' | head -12)
fi
if ((${#tidied[@]})); then
  # Each source alone and without precompiled headers, so that a missing include is found; only the
  # generated headers are built.
  cmake --preset release -B build/lint -DHYPERMAP_PCH=OFF -DHYPERMAP_UNITY=OFF >/dev/null
  ninja -C build/lint -t targets all | sed -nE 's/^(.*\.pb\.h): .*/\1/p' |
    xargs ninja -C build/lint >/dev/null
  printf '%s\n' "${tidied[@]}" | xargs -P "$(nproc)" -n 1 clang-tidy-14 -p build/lint --quiet 2>&1 |
    sed '/^[0-9]* warnings generated\.$/d'
fi
echo "clang-tidy: ${#tidied[@]} of $count files"

if has_rustfmt; then
  rustfmt --check --edition 2024 "$rust"
  echo "rustfmt: passed"
else
  echo "rustfmt: not installed, so tests/ros2/peer was not checked"
fi

buf=build/tools/node_modules/.bin/buf
if [[ -x $buf ]]; then
  $buf lint proto
  echo "buf lint: passed"
  if [[ -n $since ]] && git cat-file -e "$since:proto/buf.yaml" 2>/dev/null; then
    $buf breaking proto --against ".git#ref=$(git rev-parse "$since"),subdir=proto"
    echo "buf breaking: nothing since $since"
  fi
else
  echo "buf: not installed, so the protos were not checked"
fi
