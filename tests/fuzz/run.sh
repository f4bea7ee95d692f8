#!/bin/bash
# Runs each fuzzer in FOLDER for SECONDS and keeps new inputs in FOLDER/corpus. Stops at the first
# finding, whose input is then in FOLDER/findings.
#
#   tests/fuzz/run.sh FOLDER SECONDS
set -euo pipefail
folder=$1 seconds=$2
seeds=$(dirname "$(realpath "$0")")/seeds

for fuzzer in "$folder"/*_fuzzer; do
  name=$(basename "$fuzzer")
  mkdir -p "$folder/corpus/$name" "$folder/findings"
  echo "== $name, $seconds s"
  inputs=("$folder/corpus/$name")
  if [[ -d $seeds/${name%_fuzzer} ]]; then inputs+=("$seeds/${name%_fuzzer}"); fi
  "$fuzzer" -max_total_time="$seconds" -timeout=25 -rss_limit_mb=4096 -verbosity=0 \
    -print_final_stats=1 -artifact_prefix="$folder/findings/$name-" "${inputs[@]}"
done
