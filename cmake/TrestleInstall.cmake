# `cmake --install` and, for users, find_package(trestle).
include(CMakePackageConfigHelpers)

get_property(installed GLOBAL PROPERTY TRESTLE_INSTALLED_TARGETS)
install(TARGETS ${installed} EXPORT trestle-targets ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})
if(TARGET trestle)
  install(TARGETS trestle RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
endif()

set(header_folders someip/wire someip/core sd/wire sd/core)
if(NOT TRESTLE_CORE_ONLY)
  list(APPEND header_folders someip/net sd/net dds_adapter bridge)
endif()
foreach(folder IN LISTS header_folders)
  install(DIRECTORY ${PROJECT_SOURCE_DIR}/${folder}/ DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/trestle/${folder}
    FILES_MATCHING PATTERN "*.hpp")
endforeach()

install(FILES ${PROJECT_SOURCE_DIR}/sd/c/trestle.h DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/trestle)

set(config_dir ${CMAKE_INSTALL_LIBDIR}/cmake/trestle)
install(EXPORT trestle-targets NAMESPACE trestle:: DESTINATION ${config_dir})
configure_package_config_file(${PROJECT_SOURCE_DIR}/cmake/trestle-config.cmake.in
  ${PROJECT_BINARY_DIR}/trestle-config.cmake INSTALL_DESTINATION ${config_dir})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/trestle-config-version.cmake
  COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/trestle-config.cmake ${PROJECT_BINARY_DIR}/trestle-config-version.cmake
  ${PROJECT_SOURCE_DIR}/cmake/TrestleHeaders.cmake
  DESTINATION ${config_dir})
