# Makes the packages' targets for gRPC, Protobuf and abseil name the static libraries. Debian's
# packages for CMake name the shared ones: 50 of the 85 libraries that a program would load when it
# starts, which takes longer than a short command of `hypermap`.

# FindProtobuf looks for libprotobuf.a.
set(Protobuf_USE_STATIC_LIBS ON)

# Call it after find_package of absl and gRPC, which have no such setting.
function(hypermap_link_grpc_statically)
  get_directory_property(targets IMPORTED_TARGETS)
  list(FILTER targets INCLUDE REGEX "^(absl|gRPC)::")
  foreach(target ${targets})
    get_target_property(shared ${target} IMPORTED_LOCATION_NONE)
    string(REGEX REPLACE "\\.so[.0-9]*$" ".a" static "${shared}")
    if(shared MATCHES "\\.so" AND EXISTS "${static}")
      set_target_properties(${target} PROPERTIES
        IMPORTED_LOCATION_NONE "${static}" IMPORTED_SONAME_NONE "")
    endif()
  endforeach()
  # A shared gRPC beside a static Protobuf would bring a second Protobuf into each program.
  get_target_property(grpc gRPC::grpc++ IMPORTED_LOCATION_NONE)
  if(NOT grpc MATCHES "\\.a$")
    message(FATAL_ERROR "There is no static gRPC here: configure with -DHYPERMAP_STATIC_GRPC=OFF")
  endif()
endfunction()
