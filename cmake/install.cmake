include(CMakePackageConfigHelpers)
install(EXPORT photocoag_targets FILE photocoagTargets.cmake NAMESPACE photocoag::
  DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/photocoag)
configure_package_config_file(cmake/photocoagConfig.cmake.in
  ${PROJECT_BINARY_DIR}/photocoagConfig.cmake
  INSTALL_DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/photocoag)
write_basic_package_version_file(${PROJECT_BINARY_DIR}/photocoagConfigVersion.cmake
  COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/photocoagConfig.cmake
  ${PROJECT_BINARY_DIR}/photocoagConfigVersion.cmake
  DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/photocoag)
install(DIRECTORY studies DESTINATION ${CMAKE_INSTALL_DATADIR}/photocoag)
install(DIRECTORY configs DESTINATION ${CMAKE_INSTALL_DATADIR}/photocoag)
