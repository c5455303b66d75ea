# How every target of the project is built: one place for the language level, warnings and sanitizers.
include(GNUInstallDirs)

set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)
if(NOT CMAKE_SYSTEM_NAME STREQUAL Generic)  # which has nobody who would load it elsewhere
  set(CMAKE_POSITION_INDEPENDENT_CODE ON)
endif()

if(NOT CMAKE_BUILD_TYPE AND NOT CMAKE_CONFIGURATION_TYPES)
  set(CMAKE_BUILD_TYPE Release CACHE STRING "Build type" FORCE)
endif()

# What every target of ours is compiled with. Never exported: a user of the libraries picks their own flags.
add_library(trestle_flags INTERFACE)
target_compile_options(trestle_flags INTERFACE
  -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wnon-virtual-dtor -Wold-style-cast -Wcast-align
  -Woverloaded-virtual -Wimplicit-fallthrough -Werror)
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  # GCC 12 sees overlaps in its own std::string at -O3 (its bug 105651).
  target_compile_options(trestle_flags INTERFACE -Wno-restrict)
  if(CMAKE_CXX_COMPILER_VERSION VERSION_GREATER_EQUAL 13)
    # A later one sees what an empty std::optional does not hold be read where it is moved (its bug 80635).
    target_compile_options(trestle_flags INTERFACE -Wno-maybe-uninitialized)
  endif()
  if(CMAKE_UNITY_BUILD)
    # To it, a source that is included is a header, whose types should have no members of local types.
    target_compile_options(trestle_flags INTERFACE -Wno-subobject-linkage)
  endif()
  if(TRESTLE_SANITIZE)
    # The sanitizers' own code looks to it as if variables were used before they are set, says its manual.
    target_compile_options(trestle_flags INTERFACE -Wno-maybe-uninitialized)
  endif()
endif()
if(NOT CMAKE_CROSSCOMPILING)
  target_link_options(trestle_flags INTERFACE LINKER:--as-needed)  # each library that is loaded takes memory
endif()
if(TRESTLE_SANITIZE)
  target_compile_options(trestle_flags INTERFACE
    -fsanitize=${TRESTLE_SANITIZE} -fno-omit-frame-pointer -fno-sanitize-recover=all)
  target_link_options(trestle_flags INTERFACE -fsanitize=${TRESTLE_SANITIZE})
endif()

# What is built to be used on a network that cannot be trusted: a mistake in our code ends the process instead of serving an
# attacker. Sanitizers find more, and get in the way of these; a microcontroller has no libc and no loader for them.
if(NOT CMAKE_CROSSCOMPILING AND NOT TRESTLE_SANITIZE AND NOT TRESTLE_FUZZ)
  include(CheckPIESupported)
  check_pie_supported(LANGUAGES CXX)
  set(optimised $<NOT:$<CONFIG:Debug>>)  # without that, glibc has no checks
  # Level 3 also looks at sizes that only the running program knows.
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND CMAKE_CXX_COMPILER_VERSION VERSION_LESS 12)
    set(fortify_level 2)
  else()
    set(fortify_level 3)
  endif()
  target_compile_options(trestle_flags INTERFACE
    $<${optimised}:-fstack-protector-strong> $<${optimised}:-U_FORTIFY_SOURCE> $<${optimised}:-D_FORTIFY_SOURCE=${fortify_level}>)
  target_link_options(trestle_flags INTERFACE $<${optimised}:-Wl,-z,relro,-z,now>)
endif()

# trestle_stack_usage(<target>): beside each object a .ci file tells how much stack its functions need, and whom they
# call. Not by way of ccache, which would keep the object alone.
function(trestle_stack_usage target)
  target_compile_options(${target} PRIVATE -fcallgraph-info=su)
  set_target_properties(${target} PROPERTIES CXX_COMPILER_LAUNCHER "")
endfunction()

# What users of Trestle include is <trestle/...>, in this build as once it is installed. Here these are links to the public
# headers alone, so that an example which needs another one does not build.
set(TRESTLE_LINKED_HEADERS ${PROJECT_BINARY_DIR}/include)
file(REMOVE_RECURSE ${TRESTLE_LINKED_HEADERS}/trestle)

# trestle_public_headers(<component> <header>...): headers of this folder that are installed, trestle/<their path>, one of C
# on top: trestle/<its name>.
function(trestle_public_headers component)
  foreach(header IN LISTS ARGN)
    file(RELATIVE_PATH path ${PROJECT_SOURCE_DIR} ${CMAKE_CURRENT_SOURCE_DIR}/${header})
    set_property(GLOBAL APPEND PROPERTY TRESTLE_HEADERS_${component} ${path})
    if(path MATCHES "\\.h$")
      get_filename_component(path ${path} NAME)
    endif()
    set(link ${TRESTLE_LINKED_HEADERS}/trestle/${path})
    get_filename_component(folder ${link} DIRECTORY)
    file(MAKE_DIRECTORY ${folder})
    file(CREATE_LINK ${CMAKE_CURRENT_SOURCE_DIR}/${header} ${link} COPY_ON_ERROR SYMBOLIC)
  endforeach()
endfunction()

# trestle_library(<name> [CORE] [COMPONENT <component>] SOURCES ... [PUBLIC_HEADERS ...] [PUBLIC libs...]
#   [PRIVATE libs...])
# Makes library trestle_<name> with alias trestle::<name>. CORE: no exceptions, no RTTI. COMPONENT: it is installed, with
# those of its headers that are public; what a public header includes is public, too (test/install).
function(trestle_library name)
  cmake_parse_arguments(ARG "CORE" "COMPONENT" "SOURCES;PUBLIC_HEADERS;PUBLIC;PRIVATE" ${ARGN})
  add_library(trestle_${name} STATIC ${ARG_SOURCES})
  add_library(trestle::${name} ALIAS trestle_${name})
  set_target_properties(trestle_${name} PROPERTIES EXPORT_NAME ${name})
  target_compile_features(trestle_${name} PUBLIC cxx_std_20)
  target_include_directories(trestle_${name} PUBLIC
    $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}>
    $<BUILD_INTERFACE:${TRESTLE_LINKED_HEADERS}>
    $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
  target_link_libraries(trestle_${name} PUBLIC ${ARG_PUBLIC} PRIVATE ${ARG_PRIVATE} $<BUILD_INTERFACE:trestle_flags>)
  if(ARG_CORE)
    target_compile_options(trestle_${name} PRIVATE -fno-exceptions -fno-rtti)
    if(CMAKE_SYSTEM_NAME STREQUAL Generic)
      trestle_stack_usage(trestle_${name})
    endif()
  endif()
  if(ARG_COMPONENT)
    set_property(GLOBAL APPEND PROPERTY TRESTLE_LIBRARIES_${ARG_COMPONENT} trestle_${name})
    trestle_public_headers(${ARG_COMPONENT} ${ARG_PUBLIC_HEADERS})
  endif()
endfunction()
