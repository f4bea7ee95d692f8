#!/bin/bash
# Runs every test once, in the build in which it finds the most errors (CI=true make test):
#
#   lint      the format of all sources, the rules of the protos, clang-tidy on sources of the newest
#             commit (clang's warnings, and its analysis of locks, are errors in every build)
#   asan      unit tests, short proofs and the shorter integration tests, under AddressSanitizer
#             and UndefinedBehaviorSanitizer
#   tsan      unit tests of code that threads share, and short proofs, under ThreadSanitizer
#   release   the programs as they are shipped: integration tests, short proofs and benchmarks,
#             web, Python, the dashboard in a browser
#
# A failed test does not stop the rest. The last line counts the tests of all builds; the exit code
# is 0 if none has failed.
set -euo pipefail
cd "$(dirname "$0")/.."
jobs=${JOBS:-$(nproc)}
logs=build/ci
mkdir -p "$logs"

stage() { printf '\n== %s (after %d min)\n' "$1" $((SECONDS / 60)); }

# run_tests NAME FOLDER CTEST_ARGUMENTS...
run_tests() {
  local name=$1 folder=$2
  shift 2
  ctest --test-dir "$folder" --output-on-failure --parallel "$jobs" \
    --output-log "$logs/$name.log" "$@" || true
}

stage lint
lint=0
tools/lint.sh --ci || lint=1

stage "release: build"
cmake --preset release -DHYPERMAP_UNIT_TESTS=none
cmake --build build --parallel "$jobs"
client_libs/web/build.sh build || test $? = 77

stage "asan: build"
cmake --preset asan
cmake --build build/asan --parallel "$jobs" --target unit_tests hypermapd hypermap hypermap-ingest \
  render_sequence hypermap_prove hypermap_proto_python
stage "asan: tests"
LSAN_OPTIONS=suppressions=$PWD/tests/lsan.supp:print_suppressions=0 \
  run_tests asan build/asan --label-regex '^(unit|integration|prove)$' --label-exclude long

stage "tsan: build"
cmake --preset tsan
cmake --build build/tsan --parallel "$jobs" --target unit_tests hypermapd hypermap_prove
stage "tsan: tests"
TSAN_OPTIONS=suppressions=$PWD/tests/tsan.supp:ignore_noninstrumented_modules=1:halt_on_error=1:second_deadlock_stack=1 \
  run_tests tsan build/tsan --label-regex '^(unit|prove)$'

stage "release: tests"
rm -rf build/e2e/figures
run_tests release build
cat build/e2e/figures/*.txt 2>/dev/null || true

# ctest's summary: "98% tests passed, 3 tests failed out of 150".
stage "sum"
echo "lint: $((1 - lint)) passed, $lint failed"
total=1
failed=$lint
for name in asan tsan release; do
  read -r bad all < <(sed -nE 's/.*tests passed, ([0-9]+) tests failed out of ([0-9]+).*/\1 \2/p' \
    "$logs/$name.log" | tail -1)
  echo "$name: $((all - bad)) passed, $bad failed"
  sed -n '/The following tests FAILED/,/^Errors while/p' "$logs/$name.log" | grep -E '^\s+[0-9]+ - ' || true
  total=$((total + all))
  failed=$((failed + bad))
done
echo "$((total - failed)) passed, $failed failed"
((failed == 0))
