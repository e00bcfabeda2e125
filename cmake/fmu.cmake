# The library inside every FMU, beside the program: the C++ code that `simulate` runs, behind the C functions of FMI 3.0 and 2.0.
# It depends on nothing but libc and libm, and exports nothing but those functions.
find_library(LIBMD_ARCHIVE libmd.a REQUIRED)
find_library(ZLIB_ARCHIVE libz.a REQUIRED)
add_library(photocoag_fmu_library MODULE src/photocoag/fmu/entry.cpp src/photocoag/fmu/fmi2_entry.cpp
  src/photocoag/fmu/dependencies.cpp
  src/fmu/c/fmi3_unsupported.c)
set_target_properties(photocoag_fmu_library PROPERTIES OUTPUT_NAME photocoag_fmu PREFIX "" NO_SONAME ON
  C_VISIBILITY_PRESET hidden CXX_VISIBILITY_PRESET hidden VISIBILITY_INLINES_HIDDEN ON
  LIBRARY_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/apps
  LINK_DEPENDS ${PROJECT_SOURCE_DIR}/src/fmu/exports.map)
target_include_directories(photocoag_fmu_library PRIVATE src/fmu/c)
# fmt and toml++ are compiled into it (dependencies.cpp), their shared objects are then not needed.
set_source_files_properties(src/photocoag/fmu/dependencies.cpp PROPERTIES
  COMPILE_OPTIONS "-w;-UTOML_SHARED_LIB;-UTOML_HEADER_ONLY;-DTOML_HEADER_ONLY=0")
# zlib: where files are compiled together (cmake/compile.cmake) some that are not needed here come along and ask for it.
target_link_options(photocoag_fmu_library PRIVATE -static-libstdc++ -static-libgcc -Wl,--as-needed -Wl,--gc-sections
  -Wl,-z,defs -Wl,--undefined=SHA256Init -Wl,--undefined=crc32_z
  -Wl,--version-script=${PROJECT_SOURCE_DIR}/src/fmu/exports.map
  $<$<CONFIG:Release>:-s>)
target_link_libraries(photocoag_fmu_library PRIVATE ${LIBMD_ARCHIVE} ${ZLIB_ARCHIVE} photocoag_fmu tomlplusplus::tomlplusplus)
install(TARGETS photocoag_fmu_library DESTINATION ${CMAKE_INSTALL_LIBDIR}/photocoag COMPONENT program)
