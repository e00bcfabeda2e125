# Debian packages (./photocoag package): the program, its static libraries, and what others need to build against them.
# What is installed is built before; cpack builds nothing.
set(CMAKE_SKIP_INSTALL_ALL_DEPENDENCY ON)
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME photocoag)
set(CPACK_PACKAGE_CONTACT "photocoag <photocoag@localhost>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "${PROJECT_DESCRIPTION}")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_PACKAGE_DIRECTORY ${PROJECT_BINARY_DIR}/packages)
set(CPACK_STRIP_FILES ON)
set(CPACK_COMPONENTS_ALL program library dev)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_NAME photocoag)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_SHLIBDEPS ON)
set(CPACK_COMPONENT_PROGRAM_DESCRIPTION "The program, its configurations and studies, drivers, list of parts and licences.
 Research software, not a medical device.")
set(CPACK_DEBIAN_LIBRARY_PACKAGE_NAME libphotocoag)
set(CPACK_COMPONENT_LIBRARY_DESCRIPTION "Static libraries: reduced models, estimator, model predictive control, supervisor.
 Research software, not a medical device.")
set(CPACK_DEBIAN_DEV_PACKAGE_NAME libphotocoag-dev)
set(CPACK_DEBIAN_DEV_PACKAGE_DEPENDS "libphotocoag (= ${PROJECT_VERSION}), libeigen3-dev (>= 3.4), libfmt-dev, \
nlohmann-json3-dev, libtomlplusplus-dev, libmd-dev, zlib1g-dev, pkg-config")
set(CPACK_COMPONENT_DEV_DESCRIPTION "Headers and CMake package (find_package(photocoag)).
 Research software, not a medical device.")
# What goes into the program: the bill of materials asks dpkg for the packages of these places.
set(PHOTOCOAG_PARTS "{\n \"name\": \"photocoag\",\n \"version\": \"${PROJECT_VERSION}\",\n \"headers\": [\n\
  \"${EIGEN3_INCLUDE_DIRS}/Eigen/Core\",\n  \"${RANDOM123_INCLUDE_DIR}/Random123/philox.h\",\n\
  \"${nlohmann_json_DIR}\",\n  \"${tomlplusplus_DIR}\",\n  \"${CLI11_DIR}\"\n ],\n\
 \"osqp\": \"${osqp_DIR}\"\n}\n")
file(WRITE ${PROJECT_BINARY_DIR}/parts.json "${PHOTOCOAG_PARTS}")
# Written by ./photocoag package.
install(FILES ${PROJECT_BINARY_DIR}/photocoag.cdx.json ${PROJECT_BINARY_DIR}/THIRD-PARTY.txt
  DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/photocoag COMPONENT program OPTIONAL)
install(FILES LICENSE README.md DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/photocoag COMPONENT program)
include(CPack)
