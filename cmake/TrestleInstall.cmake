# `cmake --install` and, for users, find_package(trestle) and pkg-config. Each component is an export set of its own, so that
# find_package(trestle COMPONENTS sd) does not ask for what another one needs. The order: each uses those before it.
include(CMakePackageConfigHelpers)
set(trestle_components "")
foreach(component IN ITEMS core fuzz net sd dds bridge)
  get_property(libraries GLOBAL PROPERTY TRESTLE_LIBRARIES_${component})
  if(libraries)
    list(APPEND trestle_components ${component})
  endif()
endforeach()

# First of all: whether all is there. Else the prefix would be filled up to the first library that was not built.
function(trestle_check_built component)
  set(files "")
  foreach(target IN LISTS ARGN)
    list(APPEND files $<TARGET_FILE:${target}>)
  endforeach()
  install(CODE "
    foreach(file IN ITEMS ${files})
      if(NOT EXISTS \"\${file}\")
        message(FATAL_ERROR \"Trestle is not built whole, so nothing is installed: there is no \${file}. First \"
          \"`cmake --build ${PROJECT_BINARY_DIR}`; or `./run install`, which does both.\")
      endif()
    endforeach()" COMPONENT ${component})
endfunction()
foreach(component IN LISTS trestle_components)
  get_property(libraries GLOBAL PROPERTY TRESTLE_LIBRARIES_${component})
  trestle_check_built(${component} ${libraries})
endforeach()
if(TARGET trestle)
  trestle_check_built(program trestle)
endif()

set(config_dir ${CMAKE_INSTALL_LIBDIR}/cmake/trestle)
foreach(component IN LISTS trestle_components)
  get_property(libraries GLOBAL PROPERTY TRESTLE_LIBRARIES_${component})
  install(TARGETS ${libraries} EXPORT trestle-${component} ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR}
    COMPONENT ${component})
  install(EXPORT trestle-${component} FILE trestle-${component}-targets.cmake NAMESPACE trestle::
    DESTINATION ${config_dir} COMPONENT ${component})
  get_property(headers GLOBAL PROPERTY TRESTLE_HEADERS_${component})
  install(CODE "
    set(TRESTLE_SOURCE \"${PROJECT_SOURCE_DIR}\")
    set(TRESTLE_STAGE \"${PROJECT_BINARY_DIR}/installed_headers\")
    set(TRESTLE_INCLUDES \"\${CMAKE_INSTALL_PREFIX}/${CMAKE_INSTALL_INCLUDEDIR}/trestle\")
    set(TRESTLE_HEADERS \"${headers}\")" COMPONENT ${component})
  install(SCRIPT ${PROJECT_SOURCE_DIR}/cmake/install_headers.cmake COMPONENT ${component})
endforeach()
if(TARGET trestle)
  install(TARGETS trestle RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT program)
endif()

set(TRESTLE_TLS_PACKAGE "")
set(TRESTLE_PC_TLS "")
if(TRESTLE_TLS)
  set(TRESTLE_TLS_PACKAGE OpenSSL)
  set(TRESTLE_PC_TLS " -lssl -lcrypto")
endif()
configure_package_config_file(${PROJECT_SOURCE_DIR}/cmake/trestle-config.cmake.in
  ${PROJECT_BINARY_DIR}/trestle-config.cmake INSTALL_DESTINATION ${config_dir})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/trestle-config-version.cmake
  COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/trestle-config.cmake ${PROJECT_BINARY_DIR}/trestle-config-version.cmake
  ${PROJECT_SOURCE_DIR}/cmake/TrestleHeaders.cmake
  DESTINATION ${config_dir} COMPONENT core)

# pkg-config: the core as trestle-core, the mutators as trestle-fuzz, the stack with sockets as trestle. The bridge's packages have no files of that kind.
function(trestle_pkg_config name)
  install(FILES ${PROJECT_BINARY_DIR}/${name}.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig COMPONENT ${ARGV1})
  configure_file(${PROJECT_SOURCE_DIR}/cmake/${name}.pc.in ${PROJECT_BINARY_DIR}/${name}.pc @ONLY)
endfunction()
file(RELATIVE_PATH TRESTLE_PC_PREFIX /${CMAKE_INSTALL_LIBDIR}/pkgconfig /)
set(TRESTLE_PC_DEFINITIONS "")
if(NOT TRESTLE_GUARDS)
  set(TRESTLE_PC_DEFINITIONS " -DTRESTLE_GUARDS=0")
endif()
trestle_pkg_config(trestle-core core)
if(TARGET trestle_fuzz_mutate)
  trestle_pkg_config(trestle-fuzz fuzz)
  install(FILES ${PROJECT_SOURCE_DIR}/fuzz/coverage_hook.c DESTINATION ${CMAKE_INSTALL_DATADIR}/trestle COMPONENT fuzz)
endif()
if(TARGET trestle_sd_net)
  trestle_pkg_config(trestle sd)
endif()
