# A hash of everything below src/ at build time: the code version that keys the model cache.
# Written only when it changes, so an unchanged tree rebuilds nothing.
set(PHOTOCOAG_GENERATED ${PROJECT_BINARY_DIR}/generated/photocoag/core/build_info_generated.hpp)
add_custom_target(photocoag_source_hash
  COMMAND ${CMAKE_COMMAND} -DSOURCE_DIR=${PROJECT_SOURCE_DIR} -DOUTPUT=${PHOTOCOAG_GENERATED}
    -DVERSION=${PROJECT_VERSION} -P ${PROJECT_SOURCE_DIR}/cmake/write_build_info.cmake
  BYPRODUCTS ${PHOTOCOAG_GENERATED}
  COMMENT "Hashing sources")
