# Installs the library into a folder of its own, builds examples/embed against it and runs it on samples.
# Arguments: BUILD (build tree), SOURCE (source tree), WORK (scratch folder).
file(REMOVE_RECURSE ${WORK})
function(run)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE status OUTPUT_VARIABLE out ERROR_VARIABLE out)
  if(NOT status EQUAL 0)
    message(FATAL_ERROR "${ARGN}\n${out}")
  endif()
endfunction()
run(${CMAKE_COMMAND} --install ${BUILD} --prefix ${WORK}/prefix)
run(${CMAKE_COMMAND} -S ${SOURCE}/examples/embed -B ${WORK}/build -G Ninja
  -DCMAKE_BUILD_TYPE=Release -DCMAKE_PREFIX_PATH=${WORK}/prefix)
run(${CMAKE_COMMAND} --build ${WORK}/build)
run(${WORK}/prefix/bin/photocoag reduce --set grid.min_cells=2000 --out ${WORK}/model.json)
file(WRITE ${WORK}/samples.txt "3.1\n6.0\n8.2\nnan\n9.9\n")
execute_process(COMMAND ${WORK}/build/embed ${WORK}/model.json INPUT_FILE ${WORK}/samples.txt
  RESULT_VARIABLE status OUTPUT_VARIABLE powers)
string(REGEX MATCHALL "[0-9.]+\n" lines "${powers}")
list(LENGTH lines count)
# Cold tissue far below the reference: the first power is the limit; then one power for each sample.
if(NOT status EQUAL 0 OR NOT count EQUAL 6 OR NOT powers MATCHES "^0.100000\n")
  message(FATAL_ERROR "embed printed (status ${status}):\n${powers}")
endif()
execute_process(COMMAND ${WORK}/build/embed ${WORK}/absent.json RESULT_VARIABLE status ERROR_VARIABLE said)
if(NOT status EQUAL 2 OR NOT said MATCHES "absent.json")
  message(FATAL_ERROR "embed without a model: status ${status}, said ${said}")
endif()
