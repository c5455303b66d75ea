# What ROS 2 looks for in a prefix, where the program is built as a ROS package: docs/ros.md. The folders are called as ament
# expects them, whatever GNUInstallDirs says.
if(NOT TRESTLE_ROS_PACKAGE)
  return()
endif()
file(WRITE ${PROJECT_BINARY_DIR}/ros/trestle "")
install(FILES ${PROJECT_BINARY_DIR}/ros/trestle DESTINATION share/ament_index/resource_index/packages COMPONENT ros)
install(FILES ${PROJECT_SOURCE_DIR}/package.xml DESTINATION share/trestle COMPONENT ros)
# Without ament_cmake, whose hooks for shells these stand for.
set(hooks ${PROJECT_SOURCE_DIR}/packaging/ros)
configure_file(${hooks}/local_setup.sh.in ${PROJECT_BINARY_DIR}/ros/local_setup.sh @ONLY)
install(FILES ${PROJECT_BINARY_DIR}/ros/local_setup.sh ${hooks}/local_setup.bash ${hooks}/local_setup.zsh ${hooks}/local_setup.dsv
  DESTINATION share/trestle COMPONENT ros)
install(DIRECTORY ${PROJECT_SOURCE_DIR}/packaging/ros/launch DESTINATION share/trestle COMPONENT ros)
if(NOT TARGET trestle)
  return()
endif()
# `ros2 run` and launch files look for programs here; the one in bin is for the shell.
install(CODE "
  set(folder \"\$ENV{DESTDIR}\${CMAKE_INSTALL_PREFIX}/lib/trestle\")
  file(MAKE_DIRECTORY \"\${folder}\")
  file(CREATE_LINK ../../${CMAKE_INSTALL_BINDIR}/trestle \"\${folder}/trestle\" SYMBOLIC)" COMPONENT ros)
