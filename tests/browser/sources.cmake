# The types, the style, the layout and the imports of the viewer's sources: tsc, eslint and dprint find their modules beside
# what they read; so they read a copy beside the packages. -DSOURCE= -DBUILD= -DNODE=
file(REMOVE_RECURSE ${BUILD}/src)
file(COPY ${SOURCE}/src ${SOURCE}/tsconfig.json ${SOURCE}/eslint.config.mjs ${SOURCE}/build.mjs ${SOURCE}/format.mjs
     ${SOURCE}/circles.mjs DESTINATION ${BUILD})
foreach(tool "node_modules/typescript/bin/tsc -p ." "node_modules/eslint/bin/eslint.js src --max-warnings 0"
        "format.mjs node_modules" "circles.mjs")
  separate_arguments(tool)
  execute_process(COMMAND ${NODE} ${tool} WORKING_DIRECTORY ${BUILD} RESULT_VARIABLE failed)
  if(failed)
    message(FATAL_ERROR "${tool}")
  endif()
endforeach()
