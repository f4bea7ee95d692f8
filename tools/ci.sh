#!/bin/bash
# Runs every test once, in the build in which it finds the most errors (CI=true make test):
#
#   lint      the format of all sources, the rules of the protos, clang-tidy on sources of the newest
#             commit (clang's warnings, and its analysis of locks, are errors in every build)
#   release   the programs as they are shipped: integration tests, short proofs and benchmarks,
#             web, Python, the dashboard in a browser
#   asan      unit tests, short proofs and the shorter integration tests, under AddressSanitizer
#             and UndefinedBehaviorSanitizer; then each fuzzer for CI_FUZZ_SECONDS, 10 by default
#   tsan      unit tests of code that threads share, and short proofs, under ThreadSanitizer
#
# A failed test does not stop the rest. The last line counts the tests of all builds; the exit code
# is 0 if none has failed.
#
# Tests under the sanitizers that are not done when the time is over are left out, and the summary
# says so: CI gives 90 minutes, and would tell nothing after them. On two cores all takes about 60.
set -euo pipefail
cd "$(dirname "$0")/.."
jobs=${JOBS:-$(nproc)}
# Many tests wait for a server, a browser or a clock.
test_jobs=$((2 * jobs))
logs=build/ci
mkdir -p "$logs"

limit_s=$((60 * ${CI_SANITIZER_MINUTES:-80}))
left_out=()

stage() { printf '\n== %s (after %d min)\n' "$1" $((SECONDS / 60)); }

# run_tests NAME FOLDER CTEST_ARGUMENTS...
run_tests() {
  local name=$1 folder=$2
  shift 2
  ctest --test-dir "$folder" --output-on-failure --parallel "$test_jobs" \
    --output-log "$logs/$name.log" "$@" || true
}

# within_limit COMMAND...: a command that can't end in time is left out, or ended.
within_limit() { ((SECONDS < limit_s)) && timeout --kill-after=10 $((limit_s - SECONDS)) "$@"; }

# run_sanitized NAME LABELS TARGETS...
run_sanitized() {
  local name=$1 labels=$2
  shift 2
  stage "$name: build"
  cmake --preset "$name"
  if ! within_limit cmake --build "build/$name" --parallel "$jobs" --target "$@"; then
    ((SECONDS >= limit_s)) || exit 1
    left_out+=("$name")
    return
  fi
  stage "$name: tests"
  within_limit ctest --test-dir "build/$name" --output-on-failure --parallel "$test_jobs" \
    --output-log "$logs/$name.log" --label-regex "$labels" --label-exclude long || true
  ((SECONDS < limit_s)) || left_out+=("the rest of $name")
}

rm -f "$logs"/*.log "$logs"/*.txt

stage lint
lint=0
tools/lint.sh --ci || lint=1

stage "release: build"
cmake --preset release -DHYPERMAP_UNIT_TESTS=none
cmake --build build --parallel "$jobs"
client_libs/web/build.sh build || test $? = 77
stage "release: tests"
rm -rf build/e2e/figures
run_tests release build
cat build/e2e/figures/*.txt 2>/dev/null || true

LSAN_OPTIONS=suppressions=$PWD/tests/lsan.supp:print_suppressions=0 \
  run_sanitized asan '^(unit|integration|prove)$' unit_tests hypermapd hypermap hypermap-ingest \
  render_sequence hypermap_prove hypermap_histories hypermap_proto_python
if [[ " ${left_out[*]} " != *" asan "* ]]; then
  stage "fuzz"
  if within_limit cmake --build build/asan --parallel "$jobs" --target fuzzers; then
    JOBS=$jobs within_limit tests/fuzz/run.sh build/asan/tests/fuzz "${CI_FUZZ_SECONDS:-10}" |
      tee "$logs/fuzz.txt" || true
  fi
  ((SECONDS < limit_s)) || left_out+=("fuzz")
fi
TSAN_OPTIONS=suppressions=$PWD/tests/tsan.supp:ignore_noninstrumented_modules=1:halt_on_error=1:second_deadlock_stack=1 \
  run_sanitized tsan '^(unit|prove)$' unit_tests hypermapd hypermap_prove hypermap_histories

# numbers LOG: of all tests and of failed ones, by ctest's summary such as "98% tests passed, 3 tests
# failed out of 150", or by what it printed of each test before it was ended.
numbers() {
  if grep -q 'tests failed out of' "$1"; then
    sed -nE 's/.*tests passed, ([0-9]+) tests failed out of ([0-9]+).*/\2 \1/p' "$1" | tail -1
  else
    local ended='Test +#[0-9]+: .*'
    echo "$(grep -cE "$ended( Passed |\*\*\*)" "$1")" \
      "$(grep -cE "$ended\*\*\*(Failed|Timeout|Exception|Not Run)" "$1")"
  fi
}

# failures LOG: what each failed test printed last. Every test's output begins with ctest's line of
# its result and ends before the next such line.
failures() {
  awk '/^ *[0-9]+\/[0-9]+ Test +#[0-9]+:/ || /^[0-9]+% tests passed/ { show() }
    /^ *[0-9]+\/[0-9]+ Test +#[0-9]+:.*\*\*\*/ { failed = 1 }
    failed && !/^ +Start +[0-9]+:/ { lines[++count] = $0 }
    function show(  i) {
      for (i = 1; i <= count; ++i) if (i == 1 || i > count - 100) print lines[i]
      failed = count = 0
    }
    END { show() }' "$1"
}

for name in release asan tsan; do
  [[ -e $logs/$name.log ]] || continue
  output=$(failures "$logs/$name.log")
  if [[ -n $output ]]; then
    stage "$name: output of the failed tests"
    printf '%s\n' "$output"
  fi
done

stage "sum"
echo "lint: $((1 - lint)) passed, $lint failed"
total=1
failed=$lint
for name in release asan tsan; do
  [[ -e $logs/$name.log ]] || continue
  read -r all bad < <(numbers "$logs/$name.log")
  echo "$name: $((all - bad)) passed, $bad failed"
  sed -n '/The following tests FAILED/,/^Errors while/p' "$logs/$name.log" | grep -E '^\s+[0-9]+ - ' || true
  total=$((total + all))
  failed=$((failed + bad))
done
if [[ -e $logs/fuzz.txt ]]; then
  all=$(sed '1,/^target /d' "$logs/fuzz.txt" | wc -l)
  bad=$(sed '1,/^target /d' "$logs/fuzz.txt" | grep -cv ' 0$' || true)
  echo "fuzz: $((all - bad)) passed, $bad failed"
  total=$((total + all))
  failed=$((failed + bad))
fi
# Playwright's summaries name the tests that passed only when they were tried again.
grep -E -A 5 '^ +[0-9]+ flaky$' build/Testing/Temporary/LastTest.log || true
if ((${#left_out[@]})); then
  echo "left out, because it was not done after $((limit_s / 60)) minutes: ${left_out[*]}"
fi
echo "$((total - failed)) passed, $failed failed"
((failed == 0))
