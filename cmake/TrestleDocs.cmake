# `--target docs`: the reference of the public headers, from their comments (docs/reference). It fails on a warning of
# Doxygen, and when a public class, struct or enumeration has no comment (docs/reference/undocumented.cmake).
set(TRESTLE_DOCS ${PROJECT_BINARY_DIR}/docs CACHE PATH "Where the target docs puts the reference")
configure_file(${PROJECT_SOURCE_DIR}/docs/reference/Doxyfile.in ${PROJECT_BINARY_DIR}/Doxyfile @ONLY)
add_custom_target(docs
  COMMAND ${CMAKE_COMMAND} -E rm -rf ${TRESTLE_DOCS}/html
  COMMAND ${CMAKE_COMMAND} -E make_directory ${TRESTLE_DOCS}
  COMMAND ${CMAKE_COMMAND} -D DOXYFILE=${PROJECT_BINARY_DIR}/Doxyfile
    -P ${PROJECT_SOURCE_DIR}/docs/reference/undocumented.cmake
  COMMAND doxygen ${PROJECT_BINARY_DIR}/Doxyfile
  VERBATIM)
