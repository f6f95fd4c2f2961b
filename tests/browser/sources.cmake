# The types and the style of the viewer's sources: tsc and eslint, which find their modules beside what they read; so they
# read a copy beside the packages. -DSOURCE= -DBUILD= -DNODE=
file(REMOVE_RECURSE ${BUILD}/src)
file(COPY ${SOURCE}/src ${SOURCE}/tsconfig.json ${SOURCE}/eslint.config.mjs DESTINATION ${BUILD})
foreach(tool "typescript/bin/tsc -p ." "eslint/bin/eslint.js src --max-warnings 0")
  separate_arguments(tool)
  execute_process(COMMAND ${NODE} node_modules/${tool} WORKING_DIRECTORY ${BUILD} RESULT_VARIABLE failed)
  if(failed)
    message(FATAL_ERROR "${tool}")
  endif()
endforeach()
