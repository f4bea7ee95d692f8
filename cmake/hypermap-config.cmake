# find_package(hypermap) gives hypermap::client, the C++ client (client_libs/cpp/client.h).
include(CMakeFindDependencyMacro)
find_dependency(absl)
find_dependency(Eigen3)
find_dependency(GEOS)
find_dependency(Protobuf)
find_dependency(gRPC CONFIG)
include(${CMAKE_CURRENT_LIST_DIR}/hypermap-targets.cmake)
