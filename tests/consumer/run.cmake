# The installed package from outside: it is moved away from where it was installed, names neither the build nor the
# source tree, and serves examples/embed with whatever flags, with the same powers. What Eigen lays out otherwise
# does not compile or does not link. Arguments: BUILD (build tree), SOURCE (source tree), WORK (scratch folder).
# Installing writes into the build tree: not for a user who may only read it.
execute_process(COMMAND ${CMAKE_COMMAND} -E touch ${BUILD}/.writable RESULT_VARIABLE status OUTPUT_QUIET ERROR_QUIET)
if(NOT status EQUAL 0)
  message("skipped: ${BUILD} cannot be written")
  return()
endif()
file(REMOVE_RECURSE ${WORK})
# run(COMMAND…): sets `out`; fails if the command does.
function(run)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE status OUTPUT_VARIABLE out ERROR_VARIABLE out)
  if(NOT status EQUAL 0)
    message(FATAL_ERROR "${ARGN}\n${out}")
  endif()
  set(out "${out}" PARENT_SCOPE)
endfunction()
# refused(PATTERN COMMAND…): the command fails and says why.
function(refused pattern)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE status OUTPUT_VARIABLE out ERROR_VARIABLE out)
  if(status EQUAL 0 OR NOT out MATCHES "${pattern}")
    message(FATAL_ERROR "not refused for \"${pattern}\": ${ARGN}\n${out}")
  endif()
endfunction()

set(prefix "${WORK}/a prefix")
run(${CMAKE_COMMAND} --install ${BUILD} --prefix ${WORK}/installed)
file(RENAME ${WORK}/installed "${prefix}")
file(GLOB_RECURSE files "${prefix}/*")
foreach(file IN LISTS files)
  foreach(place IN ITEMS "${BUILD}" "${SOURCE}" "${WORK}/installed")
    file(STRINGS "${file}" naming REGEX "${place}(/|$|;|\")")
    if(naming)
      message(FATAL_ERROR "${file} names ${place}:\n${naming}")
    endif()
  endforeach()
endforeach()

run("${prefix}/bin/photocoag" reduce --set grid.min_cells=2000 --out ${WORK}/model.json)
file(WRITE ${WORK}/samples.txt "3.1\n6.0\n8.2\nnan\n9.9\n")
# build_embed(NAME FLAGS): examples/embed in WORK/NAME; sets `powers` to what it prints.
function(build_embed name flags)
  run(${CMAKE_COMMAND} -S ${SOURCE}/examples/embed -B ${WORK}/${name} -G Ninja
    -DCMAKE_BUILD_TYPE=Release "-DCMAKE_PREFIX_PATH=${prefix}" "-DCMAKE_CXX_FLAGS=${flags}")
  run(${CMAKE_COMMAND} --build ${WORK}/${name})
  execute_process(COMMAND ${WORK}/${name}/embed ${WORK}/model.json INPUT_FILE ${WORK}/samples.txt
    RESULT_VARIABLE status OUTPUT_VARIABLE powers)
  string(REGEX MATCHALL "[0-9.]+\n" lines "${powers}")
  list(LENGTH lines count)
  # Cold tissue far below the reference: the first power is the limit; then one power for each sample.
  if(NOT status EQUAL 0 OR NOT count EQUAL 6 OR NOT powers MATCHES "^0.100000\n")
    message(FATAL_ERROR "embed with \"${flags}\" printed (status ${status}):\n${powers}")
  endif()
  set(powers "${powers}" PARENT_SCOPE)
endfunction()
build_embed(plain "")
set(expected "${powers}")
execute_process(COMMAND ${WORK}/plain/embed ${WORK}/absent.json RESULT_VARIABLE status ERROR_VARIABLE said)
if(NOT status EQUAL 2 OR NOT said MATCHES "absent.json")
  message(FATAL_ERROR "embed without a model: status ${status}, said ${said}")
endif()
foreach(flags IN ITEMS "-march=native" "-DEIGEN_MAX_ALIGN_BYTES=0 -DEIGEN_MALLOC_ALREADY_ALIGNED=1"
    "-DEIGEN_DONT_VECTORIZE")
  string(MAKE_C_IDENTIFIER "with${flags}" name)
  build_embed(${name} "${flags}")
  if(NOT powers STREQUAL expected)
    message(FATAL_ERROR "embed with \"${flags}\" prints\n${powers}instead of\n${expected}")
  endif()
endforeach()

# Memory of Eigen's that the library takes and the program gives back.
run(${CMAKE_COMMAND} -S ${SOURCE}/tests/consumer -B ${WORK}/heap -G Ninja -DCMAKE_BUILD_TYPE=Release
  "-DCMAKE_PREFIX_PATH=${prefix}" -DCMAKE_CXX_FLAGS=-march=native)
run(${CMAKE_COMMAND} --build ${WORK}/heap)
run(${WORK}/heap/heap)

# Without the flags of the CMake targets, and with what takes the looks for NaN away.
file(STRINGS ${WORK}/plain/CMakeCache.txt compiler REGEX "^CMAKE_CXX_COMPILER:")
string(REGEX REPLACE "^[^=]*=" "" compiler "${compiler}")
set(compile ${compiler} -std=c++20 -fsyntax-only -I${prefix}/include -isystem ${EIGEN}
  ${SOURCE}/examples/embed/embed.cpp)
set(fitting -DEIGEN_MAX_STATIC_ALIGN_BYTES=16 -DEIGEN_MAX_ALIGN_BYTES=64 -DEIGEN_MALLOC_ALREADY_ALIGNED=0)
run(${compile} ${fitting})
refused("Eigen's alignment is not the library's" ${compile})
# AVX: 32 bytes. (-march=native may be AVX-512, whose 64 bytes are the library's.)
refused("Eigen's alignment is not the library's" ${compile} ${fitting} -UEIGEN_MAX_ALIGN_BYTES -mavx)
refused("looks for NaN and infinity" ${compile} ${fitting} -ffast-math)
# Another layout that compiles does not link.
execute_process(COMMAND ${CMAKE_COMMAND} -S ${SOURCE}/examples/embed -B ${WORK}/other -G Ninja -DCMAKE_BUILD_TYPE=Release
  "-DCMAKE_PREFIX_PATH=${prefix}" "-DCMAKE_CXX_FLAGS=-DEIGEN_DEFAULT_DENSE_INDEX_TYPE=int" OUTPUT_QUIET ERROR_QUIET)
refused("Layout<.*kIsTheLibrarys" ${CMAKE_COMMAND} --build ${WORK}/other)
