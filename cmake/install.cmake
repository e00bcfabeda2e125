include(CMakePackageConfigHelpers)
install(EXPORT photocoag_targets FILE photocoagTargets.cmake NAMESPACE photocoag::
  DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/photocoag COMPONENT dev)
configure_package_config_file(cmake/photocoagConfig.cmake.in
  ${PROJECT_BINARY_DIR}/photocoagConfig.cmake
  INSTALL_DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/photocoag
  PATH_VARS CMAKE_INSTALL_LIBDIR)
write_basic_package_version_file(${PROJECT_BINARY_DIR}/photocoagConfigVersion.cmake
  COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/photocoagConfig.cmake
  ${PROJECT_BINARY_DIR}/photocoagConfigVersion.cmake
  DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/photocoag COMPONENT dev)
# OSQP's own library goes along: the package needs neither the build tree nor the system's.
if(PHOTOCOAG_HAS_OSQP)
  install(FILES $<TARGET_FILE:osqp::osqpstatic> DESTINATION ${CMAKE_INSTALL_LIBDIR}/photocoag COMPONENT library)
  install(DIRECTORY ${osqp_DIR}/../../../share/licenses/osqp DESTINATION ${CMAKE_INSTALL_DATADIR}/licenses/photocoag
    COMPONENT program OPTIONAL)
endif()
install(DIRECTORY studies DESTINATION ${CMAKE_INSTALL_DATADIR}/photocoag COMPONENT program)
install(DIRECTORY configs DESTINATION ${CMAKE_INSTALL_DATADIR}/photocoag COMPONENT program)
