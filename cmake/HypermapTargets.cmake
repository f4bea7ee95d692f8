# One target per folder. A library's public dependencies are the rooms its headers include, its private
# ones those that only its sources do; together they are the layer diagram of docs/architecture.md.

# hypermap_library(NAME SOURCES ... [PUBLIC ...] [PRIVATE ...])
# Makes the static library hypermap_NAME with the alias hypermap::NAME.
function(hypermap_library name)
  cmake_parse_arguments(ARG "" "" "SOURCES;PUBLIC;PRIVATE" ${ARGN})
  add_library(hypermap_${name} STATIC ${ARG_SOURCES})
  add_library(hypermap::${name} ALIAS hypermap_${name})
  target_include_directories(hypermap_${name} PUBLIC $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}>
    $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}/hypermap>)
  target_link_libraries(hypermap_${name} PUBLIC ${ARG_PUBLIC}
    PRIVATE ${ARG_PRIVATE} $<BUILD_INTERFACE:hypermap_warnings>)
  set_target_properties(hypermap_${name} PROPERTIES EXPORT_NAME ${name})
endfunction()

# hypermap_test(NAME SOURCES ... DEPS ...)
# Makes one GoogleTest program of the folder's tests and registers each of them with ctest.
function(hypermap_test name)
  cmake_parse_arguments(ARG "" "" "SOURCES;DEPS" ${ARGN})
  add_executable(${name} ${ARG_SOURCES})
  target_link_libraries(${name} PRIVATE ${ARG_DEPS} hypermap_warnings GTest::gmock GTest::gtest_main)
  set_target_properties(${name} PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/tests)
  gtest_discover_tests(${name} NO_PRETTY_VALUES DISCOVERY_TIMEOUT 60 PROPERTIES TIMEOUT 600)
endfunction()
