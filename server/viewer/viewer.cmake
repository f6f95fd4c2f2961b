# The page at GET /: bundled by esbuild from the sources of this folder and put into the daemon. Packages come from the npm
# registry, in the versions that package-lock.json has, when a build folder is configured.
set(LAMBERT_VIEWER AUTO CACHE STRING "the viewer in lambertd: ON, OFF, or AUTO: where Node.js and its packages are there")
set(viewer_source ${CMAKE_CURRENT_LIST_DIR})
set(viewer_build ${CMAKE_BINARY_DIR}/viewer)

# npm_packages(RESULT SOURCE BUILD OPTION...): installs into BUILD what the package-lock.json of SOURCE lists; RESULT is
# empty, or says why it is not there.
function(npm_packages result source build)
  find_program(LAMBERT_NODE NAMES node nodejs DOC "Node.js")
  find_program(LAMBERT_NPM npm DOC "the package manager of Node.js")
  if(NOT LAMBERT_NODE OR NOT LAMBERT_NPM)
    set(${result} "Node.js or npm is not installed" PARENT_SCOPE)
    return()
  endif()
  set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${source}/package-lock.json)
  file(SHA256 ${source}/package-lock.json lock)
  set(lock "${lock} ${ARGN}")
  set(installed "")
  if(EXISTS ${build}/installed)
    file(READ ${build}/installed installed)
  endif()
  if(NOT installed STREQUAL lock)
    message(STATUS "installing the packages of ${source}")
    file(MAKE_DIRECTORY ${build})
    file(COPY ${source}/package.json ${source}/package-lock.json DESTINATION ${build})
    # Scripts of packages are not run: none of them needs one.
    execute_process(COMMAND ${LAMBERT_NPM} ci ${ARGN} --ignore-scripts --no-audit --no-fund --prefer-offline
                    WORKING_DIRECTORY ${build} RESULT_VARIABLE failed OUTPUT_VARIABLE said ERROR_VARIABLE said)
    if(failed)
      # npm says why in lines of its own, after any number of warnings.
      string(REGEX MATCHALL "npm (ERR!|error) [^\n]*" why "${said}")
      if(why)
        list(SUBLIST why 0 3 why)
        list(JOIN why ", " said)
      endif()
      string(STRIP "${said}" said)
      string(REGEX REPLACE "\n.*" "" said "${said}")
      set(${result} "npm could not install its packages: ${said}" PARENT_SCOPE)
      return()
    endif()
    file(WRITE ${build}/installed "${lock}")
  endif()
  set(${result} "" PARENT_SCOPE)
endfunction()

set(viewer_off "LAMBERT_VIEWER is off")
if(LAMBERT_VIEWER)
  # Its checks need more packages than its bundle.
  set(which --omit=dev)
  if(LAMBERT_DEVELOP)
    set(which --include=dev)
  endif()
  npm_packages(viewer_off ${viewer_source} ${viewer_build} ${which})
  if(viewer_off AND NOT LAMBERT_VIEWER STREQUAL "AUTO")
    message(FATAL_ERROR "viewer: ${viewer_off}; -DLAMBERT_VIEWER=OFF builds the daemon without it")
  endif()
endif()
if(viewer_off)
  string(CONCAT how "to get it, install Node.js and npm (Debian: nodejs and npm), "
                    "run cmake again with -DLAMBERT_VIEWER=ON and build")
  message(STATUS "viewer: the page of lambertd is not built: ${viewer_off}; ${how}")
  file(CONFIGURE OUTPUT ${CMAKE_BINARY_DIR}/generated/viewer_files.c CONTENT [[
#include "server/route/viewer_files.h"
const bool viewer_is_built = false;
const fixed_bytes viewer_files[VIEWER_PARTS] = {{0}};
]])
  target_sources(lambert_service PRIVATE ${CMAKE_BINARY_DIR}/generated/viewer_files.c)
else()
  file(GLOB_RECURSE viewer_sources CONFIGURE_DEPENDS ${viewer_source}/src/*)
  add_custom_command(OUTPUT ${viewer_build}/out/viewer_files.c COMMENT "Bundling the viewer"
                     COMMAND ${LAMBERT_NODE} ${viewer_source}/build.mjs ${viewer_source} ${viewer_build}/node_modules ${viewer_build}/out
                     DEPENDS ${viewer_sources} ${viewer_source}/../../deploy/js/lambert.js ${viewer_source}/build.mjs ${viewer_source}/page.html ${viewer_source}/icon.svg
                             ${viewer_build}/installed)
  target_sources(lambert_service PRIVATE ${viewer_build}/out/viewer_files.c)
endif()
