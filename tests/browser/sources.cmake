# The types, the style, the layout and the imports of the viewer's sources: tsc, eslint and dprint find their modules beside
# what they read; so they read a copy beside the packages. Lambert's client is checked with them. -DSOURCE= -DBUILD= -DNODE=
file(REMOVE_RECURSE ${BUILD}/src ${BUILD}/js)
set(client ${SOURCE}/../../deploy/js)
file(COPY ${client}/lambert.js ${client}/lambert.d.ts ${client}/openapi.d.ts ${CMAKE_CURRENT_LIST_DIR}/client_types.ts
     DESTINATION ${BUILD}/js)
set(as_users "--noEmit --strict --exactOptionalPropertyTypes --target ES2022 --module ES2022 --moduleResolution Bundler --typeRoots js")
file(COPY ${SOURCE}/src ${SOURCE}/tsconfig.json ${SOURCE}/eslint.config.mjs ${SOURCE}/build.mjs ${SOURCE}/format.mjs
     ${SOURCE}/circles.mjs DESTINATION ${BUILD})
foreach(tool "node_modules/typescript/bin/tsc -p ." "node_modules/typescript/bin/tsc ${as_users} js/client_types.ts"
         "node_modules/eslint/bin/eslint.js src js/lambert.js --max-warnings 0"
        "format.mjs node_modules" "circles.mjs" "${client}/types.mjs node_modules")
  separate_arguments(tool)
  execute_process(COMMAND ${NODE} ${tool} WORKING_DIRECTORY ${BUILD} RESULT_VARIABLE failed)
  if(failed)
    message(FATAL_ERROR "${tool}")
  endif()
endforeach()
