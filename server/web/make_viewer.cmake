# cmake -DNPM=… -DSOURCE=… -DWORK=… -DOUTPUT=… -P make_viewer.cmake
# Puts the viewer together in OUTPUT. The file `complete` appears last; a failure is a warning, so that a build without a network
# still ends, and the next build tries again.
file(REMOVE ${OUTPUT}/complete)
set(lock ${SOURCE}/package-lock.json)
file(SHA256 ${lock} wanted)
set(have "")
if(EXISTS ${WORK}/installed)
  file(READ ${WORK}/installed have)
endif()
if(NOT have STREQUAL wanted)
  file(COPY ${SOURCE}/package.json ${lock} DESTINATION ${WORK})
  execute_process(
    COMMAND ${NPM} ci --ignore-scripts --no-audit --no-fund --loglevel=error --fetch-retries=1
    WORKING_DIRECTORY ${WORK} RESULT_VARIABLE status OUTPUT_QUIET ERROR_VARIABLE reason)
  if(NOT status EQUAL 0)
    string(REGEX REPLACE "\n.*" "" reason "${reason}")
    message(WARNING "The viewer was left out, the server works without it: npm ci failed: ${reason}")
    return()
  endif()
  file(WRITE ${WORK}/installed ${wanted})
endif()

set(cesium ${WORK}/node_modules/cesium)
foreach(part Cesium.js Assets ThirdParty Widgets Workers)
  file(COPY ${cesium}/Build/Cesium/${part} DESTINATION ${OUTPUT}/cesium)
endforeach()
file(COPY ${cesium}/LICENSE.md DESTINATION ${OUTPUT}/cesium)
foreach(file index.html style.css viewer.js dataset_panel.js globe.js keyboard.js looks.js snippets.js terrain_style.js token.js upload.js)
  file(COPY ${SOURCE}/${file} DESTINATION ${OUTPUT})
endforeach()
# The server hands this out as it is; compressing six megabytes for the first visitor would take seconds. Without it, it does so.
get_filename_component(programs ${NPM} DIRECTORY)
find_program(NODE node HINTS ${programs})
set(largest ${OUTPUT}/cesium/Cesium.js)
if(NODE AND ${largest} IS_NEWER_THAN ${largest}.br)
  execute_process(COMMAND ${NODE} ${SOURCE}/compress.mjs ${largest})
endif()
file(TOUCH ${OUTPUT}/complete)
