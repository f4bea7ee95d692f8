# Entry points of the project. Everything that they build lies under build/.
#
#   make demo    build, load a small office, ask it the three questions, map two rooms from a
#                robot's drive, let three robots explore, leave the server and the
#                dashboard running (ARGS=--exit: stop after the tour)
#   make test    build and run all tests; with CI=true also under sanitizers (tools/ci.sh)
#   make dashboard   open the dashboard of the server on SERVER in the browser
#   make bench   run the benchmarks, each with its brute force or lower bound (docs/performance.md)
#   make help    list all targets

JOBS ?= $(shell nproc)
ARGS ?=
# Lets build folders and checkouts share compiled objects.
export CCACHE_BASEDIR ?= $(CURDIR)
export CCACHE_NOHASHDIR ?= 1
# ccache does not support precompiled headers without these settings.
export CCACHE_SLOPPINESS ?= pch_defines,time_macros
CTEST = ctest --output-on-failure --parallel $(JOBS)
SANITIZED_TESTS ?= .
PROOFS = prove-feed prove-asof prove-kill prove-replica prove-restore prove-slow-reader prove-once

.DEFAULT_GOAL := build
.PHONY: build web python dashboard test e2e demo bench fusion-table deps asan tsan gcc fuzz format lint clean help
.PHONY: api package package-server deps-server test-packages
.PHONY: nightly attack robustness prove prove-failover prove-histories prove-linearizable prove-load prove-patroni $(PROOFS)

help:
	@echo 'make build                 programs in build/bin'
	@echo 'make web                   TypeScript client, dashboard and gateway (Node 20, Go 1.24)'
	@echo 'make python                the Python client as a wheel, in build/python/dist'
	@echo 'make dashboard [SERVER=HOST:PORT] [LISTEN=HOST:PORT]  builds the dashboard and serves it'
	@echo 'make test                  all tests (CI=true: each in the build that finds the most, sanitizers included)'
	@echo 'make e2e                   the dashboard in a browser, with its figures and screenshots in build/e2e'
	@echo 'make demo [ARGS=--exit]    a short tour with the map of a small office'
	@echo 'make bench [PEERS=1]       benchmarks, with PEERS also of PostGIS (SERVER_ARGS, ARGS=--help)'
	@echo 'make fusion-table          quality of fused maps, of eight rendered scenes (ARGS=--help)'
	@echo 'make prove                 long proofs of the promises about revisions, or one of them:'
	@echo '                           prove-feed, prove-asof, prove-kill [KILLS=200], prove-replica,'
	@echo '                           prove-restore, prove-slow-reader, prove-once (ARGS=--help),'
	@echo '                           prove-histories [HISTORIES=100000],'
	@echo '                           prove-linearizable [HISTORIES=1000] (Go 1.24),'
	@echo '                           prove-failover (Go 1.24, PostgreSQL 15; ARGS=--help),'
	@echo '                           prove-patroni [FAILOVERS=3] (root, Patroni, etcd),'
	@echo '                           prove-load (an hour; ARGS=--help)'
	@echo 'make robustness [SEED=1]   faults in every file call, kills, power losses and bit flips (ARGS=--help)'
	@echo 'make attack                attacks on servers with small limits (ARGS=--short, or names such as ARGS=B1)'
	@echo 'make nightly               checks that take hours: lint, sanitizers, gcc, proofs, robustness, fuzzers, the suite ten times, attacks'
	@echo 'make asan | make tsan      tests under sanitizers, in build/asan and build/tsan'
	@echo 'make gcc                   unit tests of a build by gcc, in build/gcc'
	@echo 'make fuzz [SECONDS=60] [FUZZERS=request]  each fuzzer, or those named, for SECONDS seconds (clang)'
	@echo 'make api                   the API reference in docs/api, from the protos and the Python client'
	@echo 'make format                clang-format on all sources'
	@echo 'make lint [SINCE=origin/main]  format, clang-tidy on changed files, buf lint, deploy/'
	@echo 'make deps                  installs missing Debian packages, grpcurl and buf'
	@echo 'make package               Debian packages in build/packages'
	@echo 'make package-server        only that of the server, without PCL (make deps-server installs what it needs)'
	@echo 'make test-packages         installs, upgrades and purges the packages in a fresh Debian'
	@echo 'make clean                 removes build/'

deps:
	@tools/deps.sh build test web python lint

# One stamp file for each group of packages. Packages are checked again when the list changes.
build/.deps-%: tools/deps.sh
	@tools/deps.sh $*
	@mkdir -p build && touch $@

build: build/.deps-build
	@cmake --preset release $(CMAKE_ARGS)
	@cmake --build build --parallel $(JOBS)

web: build/.deps-web
	@client_libs/web/build.sh build

# The Python tools and their versions are in client_libs/python/requirements.
python: build/.deps-python
	@client_libs/python/run.sh wheel

package: build/.deps-build build/.deps-package build/.deps-web
	@JOBS=$(JOBS) CMAKE_ARGS='$(CMAKE_ARGS)' tools/package.sh

# What deploy/Dockerfile uses.
deps-server:
	@tools/deps.sh server

package-server: build/.deps-server
	@JOBS=$(JOBS) CMAKE_ARGS='$(CMAKE_ARGS)' tools/package.sh server

test-packages: package
	@tests/packaging/run.sh build/packages
	@tests/packaging/reproducible.sh

dashboard: web
	@build/bin/hypermap-gateway --server $(or $(SERVER),127.0.0.1:50051) \
	  --listen $(or $(LISTEN),127.0.0.1:8080) $(ARGS)

ifneq ($(filter true 1,$(CI)),)
test: build/.deps-build build/.deps-test build/.deps-web build/.deps-python build/.deps-lint
	@JOBS=$(JOBS) tools/ci.sh
else
# The browser's figures are printed before the summary, so that the summary comes last.
test: build build/.deps-test build/.deps-web build/.deps-python
	@client_libs/web/build.sh build || test $$? = 77
	@cmake --preset release $(CMAKE_ARGS) >/dev/null
	@rm -rf build/e2e/figures
	@$(CTEST) --test-dir build --output-log build/ctest.log
	@cat build/e2e/figures/*.txt 2>/dev/null || true
	@sed -n '/% tests passed/,$$p' build/ctest.log
endif

# Only the tests of the dashboard in a browser.
e2e: build build/.deps-test web
	@rm -rf build/e2e/figures
	@$(CTEST) --test-dir build --label-regex e2e
	@cat build/e2e/figures/*.txt

asan tsan: build/.deps-build build/.deps-test
	@cmake --preset $@ $(CMAKE_ARGS)
	@cmake --build build/$@ --parallel $(JOBS) \
	  $(if $(filter tsan,$@),--target unit_tests hypermapd hypermap_prove hypermap_histories)
	@LSAN_OPTIONS=suppressions=$(CURDIR)/tests/lsan.supp:print_suppressions=0 \
	  TSAN_OPTIONS=suppressions=$(CURDIR)/tests/tsan.supp:ignore_noninstrumented_modules=1:halt_on_error=1:second_deadlock_stack=1 \
	  $(CTEST) --test-dir build/$@ --tests-regex '$(SANITIZED_TESTS)' \
	  $(if $(filter tsan,$@),--label-regex '^(unit|prove)$$')

# gcc may reject sources that clang, the usual compiler, accepts.
gcc: build/.deps-build
	@cmake --preset gcc $(CMAKE_ARGS)
	@cmake --build build/gcc --parallel $(JOBS)
	@$(CTEST) --test-dir build/gcc --label-regex '^unit$$'

# Builds only the programs, so that the tour does not wait for the tests.
demo: build/.deps-build
	@cmake --preset release $(CMAKE_ARGS)
	@cmake --build build --parallel $(JOBS) --target hypermapd hypermap \
	  $(if $(findstring HYPERMAP_INGEST=OFF,$(CMAKE_ARGS)),,hypermap-ingest render_sequence)
	@client_libs/web/build.sh build || test $$? = 77
	@demo/run.sh $(ARGS)

# The goals of the server's rows are checked one by one in build/bench/results.json.
bench: $(if $(filter true 1,$(PEERS)),build/.deps-bench) build
	@build/tests/hypermap_bench $(ARGS)
	@! test -x build/tests/ingest_bench || build/tests/ingest_bench
	@build/tests/fleet_fold_bench --server build/bin/hypermapd
	@build/tests/replica_bench --server build/bin/hypermapd
	@build/tests/server_bench --server build/bin/hypermapd \
	  --floor_server build/tests/floor_server $(if $(filter true 1,$(PEERS)),--peers) $(SERVER_ARGS)

# The quality of the maps that fusion makes of rendered drives, and of those of ARGS. --peer compares with
# the programs of another build.
fusion-table: build
	@HYPERMAP_BIN=$(CURDIR)/build/bin PYTHONDONTWRITEBYTECODE=1 PYTHONPATH=$(CURDIR)/tests/integration \
	  /usr/bin/python3 tests/fusion/table.py $(ARGS)

# Each proof ends with one JSON object with its counts and "holds". With POSTGRES=1 the maps are in
# PostgreSQL.
$(PROOFS): build
	@$(if $(POSTGRES),tests/postgres/with_cluster.sh) build/tests/hypermap_prove $(@:prove-%=%) \
	  --server $(if $(POSTGRES),tests/postgres/hypermapd.sh,build/bin/hypermapd) \
	  $(if $(findstring kill,$@),--history 1000) $(if $(findstring replica,$@),--edits 5000) $(if $(KILLS),--kills $(KILLS)) $(ARGS)

# Simulated histories; planted bugs must be found by the first 1,000 seeds.
prove-histories: build
	@build/tests/hypermap_histories --histories $(or $(HISTORIES),100000) $(ARGS)
	@for plant in skip_sync publish_early resume_late; do \
	  build/tests/hypermap_histories --histories 1000 --plant $$plant 2>/dev/null || exit 1; done

# In Go, because the checker is; skipped where Go is missing.
prove-linearizable: build
	@tests/linearizability/build.sh build && build/tests/hypermap_linearizability \
	  --server build/bin/hypermapd --artifacts build/tests/linearizability \
	  --histories $(or $(HISTORIES),1000) $(ARGS) || test $$? = 77

# Histories of three servers that share a database: 200 kills of the owner of the map, then 50 faults of each
# other kind. Skipped where Go or PostgreSQL is missing.
FAILOVER_HISTORIES = tests/postgres/with_cluster.sh build/tests/hypermap_linearizability --server build/bin/hypermapd \
  --artifacts build/tests/linearizability --servers 3
prove-failover: build
	@tests/linearizability/build.sh build && $(FAILOVER_HISTORIES) --faults kill --failovers 200 $(ARGS) && \
	  $(FAILOVER_HISTORIES) --faults pause,cut,cut_requests,cut_answers,promote --failovers 250 $(ARGS) || test $$? = 77

# The load of a fleet for an hour, with a fault every minute.
prove-load: build build/.deps-test
	@HYPERMAP_BIN=$(CURDIR)/build/bin PYTHONDONTWRITEBYTECODE=1 \
	  PYTHONPATH=$(CURDIR)/build/tests/integration/proto:$(CURDIR)/tests/integration \
	  /usr/bin/python3 tests/load/run.py $(ARGS)

# The servers and the PostgreSQL of deploy/patroni, whose primary is killed. Skipped where Patroni or etcd is
# missing, and unless root.
prove-patroni: build build/.deps-test
	@HYPERMAP_TEST_PATRONI=$(or $(FAILOVERS),3) ctest --test-dir build --tests-regex '^integration.patroni$$' --verbose

prove: $(PROOFS) prove-histories prove-linearizable prove-failover prove-patroni prove-load

# Ends with a table of faults and scenarios, and one JSON object with the counts and "holds". Skipped
# where the calls of a process can't be seen.
robustness: build
	@build/tests/hypermap_robustness $(if $(SEED),--seed $(SEED)) $(ARGS) || test $$? = 77

# Ends with a table, and with a line that names the attacks which are not defended.
attack: build build/.deps-test
	@HYPERMAP_BIN=$(CURDIR)/build/bin PYTHONDONTWRITEBYTECODE=1 \
	  PYTHONPATH=$(CURDIR)/build/tests/integration/proto:$(CURDIR)/tests/integration \
	  /usr/bin/python3 tests/attack/run.py $(ARGS)

# The quickest checks come first. Attacks come last, because they judge times.
nightly:
	@$(MAKE) lint SINCE=none
	@$(MAKE) tsan asan gcc
	@$(MAKE) prove
	@$(MAKE) robustness ARGS=--every_call
	@$(MAKE) fuzz SECONDS=$(or $(SECONDS),600)
	@HYPERMAP_TEST_CUTS=200 HYPERMAP_TEST_WHOLE_DEMO=1 $(MAKE) test CI=
	@$(CTEST) --test-dir build --repeat until-fail:10
	@$(MAKE) attack

fuzz: build/.deps-build
	@cmake --preset asan $(CMAKE_ARGS)
	@cmake --build build/asan --parallel $(JOBS) --target $(or $(FUZZERS:%=%_fuzzer),fuzzers)
	@JOBS=$(JOBS) tests/fuzz/run.sh build/asan/tests/fuzz $(or $(SECONDS),60) $(FUZZERS)

# The test docs.api_is_up_to_date fails if this would change anything.
api: build/.deps-api
	@/usr/bin/python3 -B tools/api_reference/generate.py

format: build/.deps-lint
	@tools/lint.sh --fix

lint: build build/.deps-lint
	@tools/lint.sh $(SINCE)
	@tools/lint_deploy.sh || [ $$? -eq 77 ]

clean:
	rm -rf build
