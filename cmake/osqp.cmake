# OSQP 0.6, the paper's solver, if there is one: the system's, else the one that the photocoag script built.
# Sets PHOTOCOAG_HAS_OSQP. Version 1 of OSQP has another interface and does not count.
set(PHOTOCOAG_HAS_OSQP 0)
find_package(osqp CONFIG QUIET PATHS ${PROJECT_SOURCE_DIR}/build/deps/osqp)
if(TARGET osqp::osqpstatic)
  include(CheckCSourceCompiles)
  set(CMAKE_REQUIRED_LIBRARIES osqp::osqpstatic m)
  check_c_source_compiles("#include <osqp.h>
    int main(void) { OSQPWorkspace* work = 0; return osqp_setup(&work, 0, 0) == 0; }" PHOTOCOAG_OSQP_COMPILES)
  unset(CMAKE_REQUIRED_LIBRARIES)
  if(PHOTOCOAG_OSQP_COMPILES)
    set(PHOTOCOAG_HAS_OSQP 1)
    message(STATUS "OSQP: ${osqp_DIR}")
  endif()
endif()
if(NOT PHOTOCOAG_HAS_OSQP)
  message(STATUS "OSQP: none, control.solver = \"osqp\" will be refused")
endif()
