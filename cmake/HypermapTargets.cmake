# One target per folder. A library's public dependencies are the rooms that its headers include, its
# private ones those that only its sources include; docs/architecture.md draws them as a diagram.

# A clean build takes a third of the time with both. `make lint` compiles every source without them,
# so that a missing include is found.
option(HYPERMAP_PCH "Use precompiled headers" ON)
option(HYPERMAP_UNITY "Compile several sources of a target at once" ON)
set(CMAKE_UNITY_BUILD ${HYPERMAP_UNITY})
set(CMAKE_UNITY_BUILD_BATCH_SIZE 8)

# hypermap_precompiled(NAME HEADERS ... [LINKS ...] [OPTIONS ...])
# Adds the precompiled header hypermap_pch_NAME for targets that are compiled with the same OPTIONS.
function(hypermap_precompiled name)
  if(NOT HYPERMAP_PCH)
    return()
  endif()
  cmake_parse_arguments(ARG "" "" "HEADERS;LINKS;OPTIONS" ${ARGN})
  set(source ${PROJECT_BINARY_DIR}/pch/${name}.cc)
  file(CONFIGURE OUTPUT ${source} CONTENT "// Gives the precompiled headers a target.\n")
  add_library(hypermap_pch_${name} OBJECT ${source})
  set_target_properties(hypermap_pch_${name} PROPERTIES UNITY_BUILD OFF)
  target_link_libraries(hypermap_pch_${name} PRIVATE ${ARG_LINKS} hypermap_warnings)
  target_compile_options(hypermap_pch_${name} PRIVATE ${ARG_OPTIONS})
  target_precompile_headers(hypermap_pch_${name} PRIVATE ${ARG_HEADERS})
endfunction()

# Makes a target use the precompiled header NAME, or none if NAME is "none".
function(hypermap_use_precompiled target name)
  if(HYPERMAP_PCH AND NOT name STREQUAL "none")
    target_precompile_headers(${target} REUSE_FROM hypermap_pch_${name})
  endif()
endfunction()

# hypermap_library(NAME [SOURCES ...] [PUBLIC ...] [PRIVATE ...] [PCH domain|rpc|none])
# Adds the static library hypermap_NAME with the alias hypermap::NAME; without sources, an
# INTERFACE library. PCH: the precompiled header, by default "domain".
function(hypermap_library name)
  cmake_parse_arguments(ARG "" "PCH" "SOURCES;PUBLIC;PRIVATE" ${ARGN})
  if(NOT ARG_SOURCES)
    add_library(hypermap_${name} INTERFACE)
    add_library(hypermap::${name} ALIAS hypermap_${name})
    target_include_directories(hypermap_${name} INTERFACE $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}>
      $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}/hypermap>)
    target_link_libraries(hypermap_${name} INTERFACE ${ARG_PUBLIC})
    set_target_properties(hypermap_${name} PROPERTIES EXPORT_NAME ${name})
    return()
  endif()
  add_library(hypermap_${name} STATIC ${ARG_SOURCES})
  add_library(hypermap::${name} ALIAS hypermap_${name})
  target_include_directories(hypermap_${name} PUBLIC $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}>
    $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}/hypermap>)
  target_link_libraries(hypermap_${name} PUBLIC ${ARG_PUBLIC}
    PRIVATE ${ARG_PRIVATE} $<BUILD_INTERFACE:hypermap_warnings>)
  set_target_properties(hypermap_${name} PROPERTIES EXPORT_NAME ${name})
  if(NOT ARG_PCH)
    set(ARG_PCH domain)
  endif()
  hypermap_use_precompiled(hypermap_${name} ${ARG_PCH})
endfunction()

# Builds all programs of hypermap_test.
add_custom_target(unit_tests)

# Tests are compiled without optimization, which would take longer than most of them run: under
# sanitizers, three times as long as without.
set(HYPERMAP_TEST_OPTIONS $<$<CONFIG:Release,RelWithDebInfo>:-O0>)

# hypermap_test(NAME [THREADS] [POSTGRES] SOURCES ... DEPS ... [PROGRAMS ...] [DEFINITIONS ...]
#   [PCH test|rpc_test|none])
# Adds one GoogleTest program of the folder's tests and registers each of them with ctest, labelled
# "unit". THREADS: the code under test is shared by threads; only these programs are built for
# ThreadSanitizer. POSTGRES: the tests share a PostgreSQL server, which takes a second to start, so that
# ctest runs them as one test; it is skipped where there is no PostgreSQL. PROGRAMS: targets that the tests start. PCH: the precompiled header,
# by default "test".
function(hypermap_test name)
  cmake_parse_arguments(ARG "THREADS;POSTGRES" "PCH" "SOURCES;DEPS;PROGRAMS;DEFINITIONS" ${ARGN})
  if(HYPERMAP_UNIT_TESTS STREQUAL "none" OR (HYPERMAP_UNIT_TESTS STREQUAL "threads" AND NOT ARG_THREADS))
    return()
  endif()
  add_executable(${name} ${ARG_SOURCES})
  target_compile_options(${name} PRIVATE ${HYPERMAP_TEST_OPTIONS})
  target_compile_definitions(${name} PRIVATE ${ARG_DEFINITIONS})
  if(ARG_PROGRAMS)
    add_dependencies(${name} ${ARG_PROGRAMS})
  endif()
  if(NOT ARG_PCH)
    set(ARG_PCH test)
  endif()
  add_dependencies(unit_tests ${name})
  hypermap_use_precompiled(${name} ${ARG_PCH})
  target_link_libraries(${name} PRIVATE ${ARG_DEPS} hypermap_warnings GTest::gmock GTest::gtest_main)
  set_target_properties(${name} PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/tests)
  if(ARG_POSTGRES)
    add_test(NAME ${name} COMMAND ${name})
    set_tests_properties(${name} PROPERTIES TIMEOUT 1200 LABELS unit
      SKIP_REGULAR_EXPRESSION "PostgreSQL 15 is not installed")
    return()
  endif()
  gtest_discover_tests(${name} NO_PRETTY_VALUES DISCOVERY_TIMEOUT 60
    PROPERTIES TIMEOUT 600 LABELS unit)
endfunction()
