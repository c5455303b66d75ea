# Runs in `cmake --install`: puts the public headers down, with includes of each other as users see them. Within the
# project a header says #include "sd/net/node.hpp", where it is installed <trestle/sd/net/node.hpp>.
# In: TRESTLE_SOURCE, TRESTLE_STAGE (a folder for what was rewritten), TRESTLE_INCLUDES (where they go), TRESTLE_HEADERS.
foreach(header IN LISTS TRESTLE_HEADERS)
  set(path ${header})
  if(header MATCHES "\\.h$")  # of C
    get_filename_component(path ${header} NAME)
  endif()
  file(READ ${TRESTLE_SOURCE}/${header} text)
  string(REGEX REPLACE "(#include )\"([a-z_]+/[a-z0-9_/]+\\.hpp)\"" "\\1<trestle/\\2>" text "${text}")
  # Where nothing has changed the file stays as it is, so that nobody has to compile anew. What has changed is replaced in one
  # step: another `cmake --install` of this build may be copying the file now, and must not get half of it.
  if(EXISTS ${TRESTLE_STAGE}/${path})
    file(READ ${TRESTLE_STAGE}/${path} before)
  else()
    set(before "")
  endif()
  if(NOT text STREQUAL before)
    string(RANDOM LENGTH 12 mark)
    file(WRITE ${TRESTLE_STAGE}/${path}.${mark} "${text}")
    file(RENAME ${TRESTLE_STAGE}/${path}.${mark} ${TRESTLE_STAGE}/${path})
  endif()
  get_filename_component(folder ${path} DIRECTORY)
  file(INSTALL DESTINATION ${TRESTLE_INCLUDES}/${folder} TYPE FILE FILES ${TRESTLE_STAGE}/${path})
endforeach()
