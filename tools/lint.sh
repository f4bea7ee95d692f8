#!/bin/bash
# Checks the sources' form.
#
#   tools/lint.sh [SINCE]   clang-format on all sources, clang-tidy on those that differ from the
#                           commit SINCE (default: origin/main; "none" or no such commit: all), buf
#                           on the protos
#   tools/lint.sh --form    the same without clang-tidy and without comparing the protos
#   tools/lint.sh --fix     formats all sources
#
# clang-tidy takes about 15 s for a source.
set -euo pipefail
cd "$(dirname "$0")/.."

rooms=(base map wire storage server ingest simulation client_libs tests)
mapfile -t sources < <(find "${rooms[@]}" -name '*.h' -o -name '*.cc' | sort)

if [[ ${1:-} == --fix ]]; then
  exec clang-format-14 -i "${sources[@]}"
fi

clang-format-14 --dry-run --Werror "${sources[@]}"
echo "clang-format: ${#sources[@]} files"

tidy=true
since=${1:-origin/main}
if [[ $since == --form ]]; then
  tidy=false
  since=
fi
[[ -n $since ]] && git rev-parse --quiet --verify "$since^{commit}" >/dev/null || since=

if $tidy; then
  if [[ -n $since ]]; then
    mapfile -t changed < <({ git diff --name-only --diff-filter=d "$since" -- "${rooms[@]}"
                             git ls-files --others --exclude-standard -- "${rooms[@]}"; } |
                           grep '\.cc$' | sort -u || true)
  else
    mapfile -t changed < <(printf '%s\n' "${sources[@]}" | grep '\.cc$')
  fi
  if ((${#changed[@]})); then
    # Without precompiled headers, so that a missing include is found; only the generated headers are
    # built.
    cmake --preset release -B build/lint -DHYPERMAP_PCH=OFF >/dev/null
    ninja -C build/lint -t targets all | sed -nE 's/^(.*\.pb\.h): .*/\1/p' |
      xargs ninja -C build/lint >/dev/null
    printf '%s\n' "${changed[@]}" | xargs -P "$(nproc)" -n 1 clang-tidy-14 -p build/lint --quiet
  fi
  echo "clang-tidy: ${#changed[@]} files"
fi

buf=build/tools/node_modules/.bin/buf
if [[ -x $buf ]]; then
  $buf lint proto
  echo "buf lint: passed"
  if [[ -n $since ]] && git cat-file -e "$since:proto/buf.yaml" 2>/dev/null; then
    $buf breaking proto --against ".git#ref=$(git rev-parse "$since"),subdir=proto"
    echo "buf breaking: nothing since $since"
  fi
fi
