# What `cmake --install` installs, and the Debian packages that CPack makes of it (tools/package.sh). The
# packages are install components:
#
#   server      hypermapd, its unit and its configuration; needs no PCL
#   ingest      hypermap-ingest
#   ros2        hypermap-ros2, its unit, and packages for ROS workspaces
#   client      hypermap, the demo, and the C++ client as a CMake package: find_package(hypermap) gives
#               hypermap::client and, with COMPONENTS replica, hypermap::replica. The installed headers include
#               no header of gRPC, Protobuf, SQLite or GEOS.
#   dashboard   hypermap-gateway, its unit, and the dashboard, if client_libs/web/build.sh has built them
include(CMakePackageConfigHelpers)

set(share ${CMAKE_INSTALL_DATAROOTDIR})
set(etc ${CMAKE_INSTALL_SYSCONFDIR}/hypermap)
# Packages and programs read units, users and temporary files below lib, whatever CMAKE_INSTALL_LIBDIR is.
set(units lib/systemd/system)
find_program(HYPERMAP_PYTHON NAMES python3 PATHS /usr/bin NO_DEFAULT_PATH)

# hypermap_documents(TARGET SECTION COMPONENT)
# Makes and installs the man page of a program and, for programs with commands (section 1), its completions.
function(hypermap_documents target section component)
  if(HYPERMAP_SANITIZE OR NOT HYPERMAP_PYTHON)
    return()
  endif()
  set(folder ${PROJECT_BINARY_DIR}/documents)
  set(page ${folder}/man/${target}.${section})
  set(bash ${folder}/completions/${target}.bash)
  set(zsh ${folder}/completions/_${target})
  set(made ${page})
  if(section EQUAL 1)
    list(APPEND made ${bash} ${zsh})
  endif()
  set(maker ${PROJECT_SOURCE_DIR}/packaging/make_documents.py)
  set(text ${PROJECT_SOURCE_DIR}/packaging/man/${target}.roff)
  add_custom_command(
    OUTPUT ${made}
    COMMAND ${HYPERMAP_PYTHON} -B ${maker} ${folder} ${PROJECT_VERSION} $<TARGET_FILE:${target}> ${text}
    DEPENDS ${target} ${maker} ${text}
    VERBATIM)
  add_custom_target(${target}_documents ALL DEPENDS ${made})
  install(FILES ${page} DESTINATION ${CMAKE_INSTALL_MANDIR}/man${section} COMPONENT ${component} OPTIONAL)
  if(section EQUAL 1)
    install(FILES ${bash} DESTINATION ${share}/bash-completion/completions RENAME ${target}
      COMPONENT ${component} OPTIONAL)
    install(FILES ${zsh} DESTINATION ${share}/zsh/vendor-completions COMPONENT ${component} OPTIONAL)
  endif()
endfunction()

# server
install(TARGETS hypermapd COMPONENT server)
hypermap_documents(hypermapd 8 server)
install(FILES packaging/hypermapd.yaml DESTINATION ${etc} COMPONENT server)
install(FILES packaging/systemd/hypermapd.service DESTINATION ${units} COMPONENT server)
install(FILES packaging/systemd/hypermap.sysusers DESTINATION lib/sysusers.d RENAME hypermap.conf
  COMPONENT server)
install(FILES packaging/systemd/hypermap.tmpfiles DESTINATION lib/tmpfiles.d RENAME hypermap.conf
  COMPONENT server)

# ingest
if(HYPERMAP_INGEST)
  install(TARGETS hypermap-ingest COMPONENT ingest)
  hypermap_documents(hypermap-ingest 1 ingest)
endif()

# ros2
if(HYPERMAP_ROS2)
  install(TARGETS hypermap-ros2 COMPONENT ros2)
  hypermap_documents(hypermap-ros2 8 ros2)
  install(FILES packaging/ros2.env DESTINATION ${etc} COMPONENT ros2)
  install(FILES packaging/systemd/hypermap-ros2@.service DESTINATION ${units} COMPONENT ros2)
  install(DIRECTORY client_libs/ros2/packages/ DESTINATION ${share}/hypermap/ros2 COMPONENT ros2)
endif()

# client
install(TARGETS hypermap COMPONENT client)
hypermap_documents(hypermap 1 client)
install(PROGRAMS demo/run.sh DESTINATION ${share}/hypermap/demo COMPONENT client)
install(DIRECTORY demo/office DESTINATION ${share}/hypermap/demo COMPONENT client)
install(TARGETS hypermap_cancellation hypermap_client hypermap_containers hypermap_content_digest
    hypermap_digest hypermap_edits hypermap_metering
    hypermap_exploration hypermap_frames hypermap_geometry hypermap_grid hypermap_identity hypermap_images hypermap_layers hypermap_limits hypermap_map
    hypermap_objects hypermap_observations hypermap_proto hypermap_query hypermap_registration hypermap_robot_reports hypermap_status
    hypermap_sync hypermap_tls hypermap_values hypermap_watch hypermap_wire
    hypermap_replica hypermap_geopackage hypermap_outbox hypermap_outbox_file hypermap_sqlite
    hypermap_storage hypermap_storage_encoding hypermap_text
  EXPORT hypermap-targets COMPONENT client)
foreach(folder base client_libs/cpp map)
  cmake_path(GET folder PARENT_PATH parent)
  install(DIRECTORY ${folder} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/hypermap/${parent}
    COMPONENT client
    FILES_MATCHING PATTERN "*.h" PATTERN "testing" EXCLUDE PATTERN "example" EXCLUDE
    # Only for the sources of its room, because it includes the header of GEOS.
    PATTERN "geos_context.h" EXCLUDE)
endforeach()
install(EXPORT hypermap-targets NAMESPACE hypermap:: FILE hypermap-targets.cmake
  DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/hypermap COMPONENT client)
write_basic_package_version_file(hypermap-config-version.cmake COMPATIBILITY SameMinorVersion)
install(FILES cmake/hypermap-config.cmake ${PROJECT_BINARY_DIR}/hypermap-config-version.cmake
  DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/hypermap COMPONENT client)

# dashboard: built by client_libs/web/build.sh, not by CMake
install(PROGRAMS ${PROJECT_BINARY_DIR}/bin/hypermap-gateway TYPE BIN COMPONENT dashboard OPTIONAL)
install(FILES ${PROJECT_BINARY_DIR}/documents/man/hypermap-gateway.8
  DESTINATION ${CMAKE_INSTALL_MANDIR}/man8 COMPONENT dashboard OPTIONAL)
install(DIRECTORY ${PROJECT_BINARY_DIR}/dashboard/ DESTINATION ${share}/hypermap/dashboard
  COMPONENT dashboard OPTIONAL)
install(FILES packaging/gateway.env DESTINATION ${etc} COMPONENT dashboard)
install(FILES packaging/systemd/hypermap-gateway.service DESTINATION ${units} COMPONENT dashboard)

set(components server ingest ros2 client dashboard)
foreach(component ${components})
  install(FILES LICENSE DESTINATION ${share}/doc/hypermap-${component} RENAME copyright
    COMPONENT ${component})
  install(FILES CHANGELOG.md DESTINATION ${share}/doc/hypermap-${component} COMPONENT ${component})
endforeach()

# Debian packages, named hypermap-COMPONENT.
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME hypermap)
set(CPACK_PACKAGE_VENDOR "Hypermap")
set(CPACK_PACKAGE_CONTACT "Hypermap maintainers <hypermap@localhost>")
set(CPACK_PACKAGE_DIRECTORY ${PROJECT_SOURCE_DIR}/build/packages)
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
# Whatever the umask of who makes the packages.
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS OWNER_READ OWNER_WRITE OWNER_EXECUTE
  GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
set(CPACK_COMPONENTS_ALL ${components})
if(NOT HYPERMAP_INGEST)
  list(REMOVE_ITEM CPACK_COMPONENTS_ALL ingest)
endif()
if(NOT HYPERMAP_ROS2)
  list(REMOVE_ITEM CPACK_COMPONENTS_ALL ros2)
endif()
set(CPACK_COMPONENTS_GROUPING IGNORE)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION database)
set(CPACK_DEBIAN_PACKAGE_PRIORITY optional)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
foreach(component ${components})
  string(TOUPPER ${component} upper)
  set(CPACK_DEBIAN_${upper}_PACKAGE_NAME hypermap-${component})
endforeach()

set(CPACK_COMPONENT_SERVER_DESCRIPTION "map database server for fleets of robots\n\
Serves layered maps of sites over gRPC: queries, edits, watches, fusion of observations and exploration.")
set(CPACK_COMPONENT_INGEST_DESCRIPTION "turns camera frames of robots into observations for Hypermap")
set(CPACK_COMPONENT_ROS2_DESCRIPTION "shows maps of Hypermap to robots that run ROS 2\n\
Speaks ROS 2's wire protocol itself: map topics, markers, costmap masks and services, without ROS.")
set(CPACK_COMPONENT_CLIENT_DESCRIPTION "command and C++ client of Hypermap, with its demo")
set(CPACK_COMPONENT_DASHBOARD_DESCRIPTION "dashboard of Hypermap and its gateway for browsers")

set(debian ${PROJECT_SOURCE_DIR}/packaging/debian)
# apt takes the first alternative only if none is installed: containers get no systemd.
set(CPACK_DEBIAN_SERVER_PACKAGE_DEPENDS "debconf (>= 0.5) | debconf-2.0, \
systemd-standalone-sysusers | systemd | systemd-sysusers, \
systemd-standalone-tmpfiles | systemd | systemd-tmpfiles")
set(CPACK_DEBIAN_SERVER_PACKAGE_CONTROL_EXTRA ${debian}/server/conffiles ${debian}/server/config
  ${debian}/server/templates ${debian}/server/postinst ${debian}/server/prerm ${debian}/server/postrm)
set(CPACK_DEBIAN_SERVER_PACKAGE_RECOMMENDS "ca-certificates")
set(CPACK_DEBIAN_SERVER_PACKAGE_SUGGESTS "hypermap-client, hypermap-dashboard, hypermap-ingest, hypermap-ros2, prometheus")
set(CPACK_DEBIAN_ROS2_PACKAGE_CONTROL_EXTRA ${debian}/ros2/conffiles
  ${debian}/ros2/postinst ${debian}/ros2/prerm ${debian}/ros2/postrm)
set(CPACK_DEBIAN_DASHBOARD_PACKAGE_CONTROL_EXTRA ${debian}/dashboard/conffiles
  ${debian}/dashboard/postinst ${debian}/dashboard/prerm ${debian}/dashboard/postrm)
set(CPACK_DEBIAN_CLIENT_PACKAGE_DEPENDS "bash")
set(CPACK_DEBIAN_CLIENT_PACKAGE_RECOMMENDS "ca-certificates")
# The demo starts the other programs; programs with the C++ client are linked with these libraries.
set(CPACK_DEBIAN_CLIENT_PACKAGE_SUGGESTS "hypermap-server, hypermap-ingest, hypermap-dashboard, cmake, \
g++, libabsl-dev, libeigen3-dev, libgeos-dev, libgrpc++-dev, libpng-dev, libprotobuf-dev, libsqlite3-dev, \
libssl-dev, libtiff-dev, nlohmann-json3-dev, protobuf-compiler-grpc")
include(CPack)
