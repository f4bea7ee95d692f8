# The doors of the project. Everything they make lies under build/.
#
#   make demo    build, load a small office, ask it the three questions, map two rooms from a
#                robot's drive, let three robots explore, leave the server and the
#                dashboard running (ARGS=--exit: stop after the tour)
#   make test    build and run all tests; with CI=true also under ASan and UBSan
#   make dashboard   the dashboard of the server on SERVER, in the browser
#   make bench   the benchmarks, each beside its brute force or its floor (docs/performance.md)
#   make help    the rest

JOBS ?= $(shell nproc)
ARGS ?=
# Compiled objects are shared between build folders and checkouts.
export CCACHE_BASEDIR ?= $(CURDIR)
export CCACHE_NOHASHDIR ?= 1
# Precompiled headers are hashed by what they include.
export CCACHE_SLOPPINESS ?= pch_defines,time_macros
# No test output is lost, nothing is run twice at once.
CTEST = ctest --output-on-failure --parallel $(JOBS)
SANITIZED_TESTS ?= .

.DEFAULT_GOAL := build
.PHONY: build web python dashboard test e2e demo bench deps asan tsan fuzz format lint clean help
.PHONY: prove-feed prove-asof prove-kill prove-replica prove-slow-reader prove-once

help:
	@echo 'make build                 programs in build/bin'
	@echo 'make web                   TypeScript client, dashboard and gateway (Node 20, Go 1.24)'
	@echo 'make python                the Python client as a wheel, in build/python/dist'
	@echo 'make dashboard [SERVER=HOST:PORT] [LISTEN=HOST:PORT]  builds the dashboard and serves it'
	@echo 'make test                  all tests (CI=true: under ASan and UBSan as well)'
	@echo 'make e2e                   the dashboard in a browser, with its figures and screenshots in build/e2e'
	@echo 'make demo [ARGS=--exit]    a short tour on a site of the project'\''s own'
	@echo 'make bench [PEERS=1]       benchmarks, with PEERS also of PostGIS (SERVER_ARGS, ARGS=--help)'
	@echo 'make prove-feed | prove-asof | prove-kill [KILLS=200] | prove-replica | prove-slow-reader | prove-once'
	@echo '                           long proofs of what is promised of revisions (ARGS=--help)'
	@echo 'make asan | make tsan      tests under sanitizers, in build/asan and build/tsan'
	@echo 'make fuzz [SECONDS=60]     each fuzzer for so many seconds (clang)'
	@echo 'make format                clang-format on all sources'
	@echo 'make lint [SINCE=origin/main]  format, clang-tidy on changed files, buf lint'
	@echo 'make deps                  Debian packages that are missing, grpcurl, buf'
	@echo 'make clean                 removes build/'

deps:
	@tools/deps.sh build test web python lint

# One stamp for each group of packages: looked at again when the list changes.
build/.deps-%: tools/deps.sh
	@tools/deps.sh $*
	@mkdir -p build && touch $@

build: build/.deps-build
	@cmake --preset release $(CMAKE_ARGS)
	@cmake --build build --parallel $(JOBS)

web: build/.deps-web
	@client_libs/web/build.sh build

# Tools and their versions: client_libs/python/requirements.
python: build/.deps-python
	@client_libs/python/run.sh wheel

dashboard: web
	@build/bin/hypermap-gateway --server $(or $(SERVER),127.0.0.1:50051) \
	  --listen $(or $(LISTEN),127.0.0.1:8080) $(ARGS)

# The sanitized run comes first, and the figures of the browser before the summary, so that the last
# lines are the summary of the full run.
test: build build/.deps-test build/.deps-web build/.deps-python $(if $(filter true 1,$(CI)),asan)
	@client_libs/web/build.sh build || test $$? = 77
	@cmake --preset release $(CMAKE_ARGS) >/dev/null
	@rm -rf build/e2e/figures
	@$(CTEST) --test-dir build --output-log build/ctest.log
	@cat build/e2e/figures/*.txt 2>/dev/null || true
	@sed -n '/% tests passed/,$$p' build/ctest.log

# The dashboard in a browser alone.
e2e: build build/.deps-test web
	@rm -rf build/e2e/figures
	@$(CTEST) --test-dir build --label-regex e2e
	@cat build/e2e/figures/*.txt

asan tsan: build/.deps-build build/.deps-test
	@cmake --preset $@ $(CMAKE_ARGS)
	@cmake --build build/$@ --parallel $(JOBS)
	@LSAN_OPTIONS=suppressions=$(CURDIR)/tests/lsan.supp:print_suppressions=0 \
	  $(CTEST) --test-dir build/$@ --tests-regex '$(SANITIZED_TESTS)'

# Only the programs: the tour must not wait for the tests to be built.
demo: build/.deps-build
	@cmake --preset release $(CMAKE_ARGS)
	@cmake --build build --parallel $(JOBS) --target hypermapd hypermap \
	  $(if $(findstring HYPERMAP_INGEST=OFF,$(CMAKE_ARGS)),,hypermap-ingest render_sequence)
	@client_libs/web/build.sh build || test $$? = 77
	@demo/run.sh $(ARGS)

# The server's figures are judged one by one in build/bench/results.json.
bench: $(if $(filter true 1,$(PEERS)),build/.deps-bench) build
	@build/tests/hypermap_bench $(ARGS)
	@! test -x build/tests/ingest_bench || build/tests/ingest_bench
	@build/tests/replica_bench --server build/bin/hypermapd
	@build/tests/server_bench --server build/bin/hypermapd \
	  --floor_server build/tests/floor_server $(if $(filter true 1,$(PEERS)),--peers) $(SERVER_ARGS)

# Each ends with one JSON object with its counts and "holds".
prove-feed prove-asof prove-kill prove-replica prove-slow-reader prove-once: build
	@build/tests/hypermap_prove $(@:prove-%=%) --server build/bin/hypermapd \
	  $(if $(findstring kill,$@),--history 1000) $(if $(findstring replica,$@),--edits 5000) $(if $(KILLS),--kills $(KILLS)) $(ARGS)

fuzz: build/.deps-build build/.deps-fuzz
	@cmake --preset fuzz $(CMAKE_ARGS)
	@cmake --build build/fuzz --parallel $(JOBS) --target fuzzers
	@tests/fuzz/run.sh build/fuzz/tests/fuzz $(or $(SECONDS),60)

format: build/.deps-lint
	@tools/lint.sh --fix

lint: build build/.deps-lint
	@tools/lint.sh $(SINCE)

clean:
	rm -rf build
