# trestle_headers(<target> <file>): an interface library with the folder that has <file>, found where packages put it.
function(trestle_headers target file)
  find_path(headers ${file} PATHS /usr/include /usr/local/include NO_DEFAULT_PATH REQUIRED NO_CACHE)
  get_filename_component(folder ${file} DIRECTORY)
  file(MAKE_DIRECTORY ${PROJECT_BINARY_DIR}/headers)
  file(CREATE_LINK ${headers}/${folder} ${PROJECT_BINARY_DIR}/headers/${folder} SYMBOLIC)
  add_library(${target} INTERFACE IMPORTED GLOBAL)
  target_include_directories(${target} SYSTEM INTERFACE ${PROJECT_BINARY_DIR}/headers)
endfunction()
