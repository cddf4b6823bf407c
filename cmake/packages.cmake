# Packages that some systems describe to CMake and others to pkg-config only: cordillera_package(NAME TARGET CONFIG MODULE...)
# gives the target cordillera::NAME. find_package(CONFIG) is asked for TARGET first, unless they are "",
# and pkg-config for the modules if it has none.
find_package(PkgConfig)
function(cordillera_package name target config)
  if(TARGET cordillera::${name})
    return()
  endif()
  if(config)
    find_package(${config} CONFIG QUIET)
  endif()
  if(NOT target OR NOT TARGET ${target})
    if(NOT PkgConfig_FOUND)
      message(FATAL_ERROR "Cordillera: neither ${config}Config.cmake nor pkg-config is here: ${ARGN} is wanted")
    endif()
    pkg_check_modules(CORDILLERA_${name} REQUIRED QUIET IMPORTED_TARGET GLOBAL ${ARGN})
    set(target PkgConfig::CORDILLERA_${name})
  endif()
  add_library(cordillera::${name} INTERFACE IMPORTED GLOBAL)
  target_link_libraries(cordillera::${name} INTERFACE ${target})
endfunction()

# cordillera_protobuf(SOURCES SCHEMA...): what protoc makes of the schemas, in this folder of the build. With Abseil (22 and later) only protobuf's
# own configuration knows what to link.
function(cordillera_protobuf sources)
  set(made)
  foreach(schema ${ARGN})
    get_filename_component(stem ${schema} NAME_WE)
    set(both ${CMAKE_CURRENT_BINARY_DIR}/${stem}.pb.cc ${CMAKE_CURRENT_BINARY_DIR}/${stem}.pb.h)
    add_custom_command(OUTPUT ${both}
      COMMAND protobuf::protoc --cpp_out ${CMAKE_CURRENT_BINARY_DIR} -I ${CMAKE_CURRENT_SOURCE_DIR} ${CMAKE_CURRENT_SOURCE_DIR}/${schema}
      DEPENDS ${schema} protobuf::protoc COMMENT "protoc ${schema}" VERBATIM)
    list(APPEND made ${both})
  endforeach()
  set(${sources} ${made} PARENT_SCOPE)
endfunction()
