#!/bin/bash
# Runs each fuzzer in FOLDER over its seeds, the inputs that once broke something (found/NAME) and
# its corpus in FOLDER/corpus, and then for SECONDS over new inputs; 0: no new ones. New inputs that
# reach more code are added to the corpus. An input that breaks something is written to
# FOLDER/findings. JOBS fuzzers run at a time, 1 by default. Ends with a table, and with exit code 1
# if there was such an input.
#
#   [JOBS=2] tests/fuzz/run.sh FOLDER SECONDS [NAME...]
set -euo pipefail
folder=$1 seconds=$2
shift 2
here=$(dirname "$(realpath "$0")")
names=("$@")
if ((${#names[@]} == 0)); then
  for fuzzer in "$folder"/*_fuzzer; do names+=("$(basename "$fuzzer" _fuzzer)"); done
fi

# The largest input, and the seconds that one input may take, which depend on the target: whole
# servers and files take longer than parsers. Sanitizers make all of them about ten times slower.
options_of() {
  case $1 in
    checkpoint) echo -max_len=16384 -timeout=10 ;;
    geopackage) echo -max_len=512 -timeout=20 ;;
    replica_stream) echo -max_len=8192 -timeout=10 ;;
    request) echo -max_len=8192 -timeout=20 ;;
    *) echo -timeout=10 ;;
  esac
}

number_of() { sed -nE "s/^stat::$1: +([0-9]+)$/\1/p" "$2" | tail -1; }

# run NAME: writes findings/NAME.log and findings/NAME.row, the latter for the table.
run() {
  local name=$1 corpus=$folder/corpus/$1_fuzzer log=$folder/findings/$1.log
  mkdir -p "$corpus"
  local inputs=("$corpus") more
  for more in "$here/seeds/$name" "$here/found/$name"; do
    if [[ -d $more ]]; then inputs+=("$more"); fi
  done
  local before
  before=$(find "$corpus" -type f | wc -l)
  echo "== ${name}_fuzzer, $seconds s"
  local limit=-max_total_time=$seconds
  if ((seconds == 0)); then limit=-runs=0; fi
  local crashes=0
  # shellcheck disable=SC2046
  "$folder/${name}_fuzzer" "$limit" $(options_of "$name") -rss_limit_mb=4096 -verbosity=0 \
    -print_final_stats=1 -artifact_prefix="$folder/findings/${name}-" "${inputs[@]}" \
    > "$log" 2>&1 || crashes=1
  if ((crashes)); then tail -n 60 "$log"; fi
  local added=$(($(find "$corpus" -type f | wc -l) - before))
  printf '%-18s %12s %8s %10s %8s %8s\n' "$name" "$(number_of number_of_executed_units "$log")" \
    "$(number_of average_exec_per_sec "$log")" "$(number_of slowest_unit_time_sec "$log")" \
    "$added" "$crashes" > "$folder/findings/$name.row"
}

mkdir -p "$folder/findings"
for name in "${names[@]}"; do
  rm -f "$folder/findings/$name.row"
  while (($(jobs -rp | wc -l) >= ${JOBS:-1})); do wait -n || true; done
  run "$name" &
done
wait

printf '\n%-18s %12s %8s %10s %8s %8s\n' target executions per_s slowest_s added crashes
failed=0
for name in "${names[@]}"; do
  # A fuzzer that could not be run has no row.
  row=$(cat "$folder/findings/$name.row" 2>/dev/null || echo "$name could not be run")
  printf '%s\n' "$row"
  if [[ ! $row =~ \ 0$ ]]; then failed=1; fi
done
exit $failed
