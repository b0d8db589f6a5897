# What programs find an installed tree by, itself movable: CMake's package, pkg-config's files, and the Debian packages
# that `cpack` makes, one a component.
include(CMakePackageConfigHelpers)
set(generated ${PROJECT_BINARY_DIR}/package)
set(package ${CMAKE_CURRENT_LIST_DIR}/package)
set(package_folder ${CMAKE_INSTALL_LIBDIR}/cmake/clarus)

install(EXPORT clarusTargets NAMESPACE clarus:: DESTINATION ${package_folder} COMPONENT development)
install(EXPORT clarusStaticTargets NAMESPACE clarus:: DESTINATION ${package_folder} COMPONENT development)
configure_package_config_file(${package}/clarusConfig.cmake.in ${generated}/clarusConfig.cmake
                              INSTALL_DESTINATION ${package_folder})
# While the first number is 0, the second changes with the interface.
write_basic_package_version_file(${generated}/clarusConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${generated}/clarusConfig.cmake ${generated}/clarusConfigVersion.cmake
        DESTINATION ${package_folder} COMPONENT development)

file(RELATIVE_PATH prefix_from_pc ${CMAKE_INSTALL_FULL_LIBDIR}/pkgconfig ${CMAKE_INSTALL_PREFIX})
set(static_libraries "-lclblast -lfmt -lOpenCL -lstdc++ -lm -ldl -pthread")
foreach(name clarus clarus-static clarus-share)
  configure_file(${package}/${name}.pc.in ${generated}/${name}.pc @ONLY)
  install(FILES ${generated}/${name}.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig COMPONENT development)
endforeach()

# What messages of the command refer to.
if(TARGET clarus_tool)
  install(DIRECTORY ${PROJECT_SOURCE_DIR}/docs DESTINATION ${CMAKE_INSTALL_DATAROOTDIR}/doc/clarus COMPONENT tool)
endif()

# A component, its Debian package, and what it is.
set(CPACK_COMPONENTS_ALL "")
function(clarus_package component package summary)
  string(TOUPPER ${component} upper)
  set(CPACK_COMPONENTS_ALL ${CPACK_COMPONENTS_ALL} ${component} PARENT_SCOPE)
  set(CPACK_DEBIAN_${upper}_PACKAGE_NAME ${package} PARENT_SCOPE)
  set(CPACK_COMPONENT_${upper}_DESCRIPTION "${summary}" PARENT_SCOPE)
  install(FILES ${PROJECT_SOURCE_DIR}/LICENSE DESTINATION ${CMAKE_INSTALL_DATAROOTDIR}/doc/${package} RENAME copyright
          COMPONENT ${component})
  install(FILES ${PROJECT_BINARY_DIR}/sbom.spdx.json DESTINATION ${CMAKE_INSTALL_DATAROOTDIR}/doc/${package}
          COMPONENT ${component})
endfunction()
clarus_package(runtime libclarus${PROJECT_VERSION_MAJOR} "Neural supersampling on OpenCL devices, the library")
clarus_package(share libclarus-share${PROJECT_VERSION_MAJOR} "Frames shared with an upscaler in another process")
clarus_package(tool clarus "Neural supersampling on OpenCL devices, the command")
clarus_package(models clarus-models "Trained models for Clarus")
clarus_package(development libclarus-dev "Headers and static library of Clarus")

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME clarus)
set(CPACK_PACKAGE_VENDOR Clarus)
set(CPACK_PACKAGE_CONTACT "Clarus <clarus@localhost>")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
# The packages' own libraries, which dpkg does not know yet.
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS_PRIVATE_DIRS ${PROJECT_BINARY_DIR}/${CMAKE_INSTALL_LIBDIR})
set(CPACK_DEBIAN_PACKAGE_GENERATE_SHLIBS ON)
set(CPACK_DEBIAN_MODELS_PACKAGE_ARCHITECTURE all)
set(CPACK_DEBIAN_MODELS_PACKAGE_SHLIBDEPS OFF)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SHLIBDEPS OFF)
set(same "(= ${PROJECT_VERSION})")
set(CPACK_DEBIAN_RUNTIME_PACKAGE_RECOMMENDS "clarus-models, pocl-opencl-icd | opencl-icd")
set(CPACK_DEBIAN_TOOL_PACKAGE_RECOMMENDS "clarus-models, pocl-opencl-icd | opencl-icd")
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_DEPENDS
    "libclarus${PROJECT_VERSION_MAJOR} ${same}, libclarus-share${PROJECT_VERSION_MAJOR} ${same}")
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_RECOMMENDS "ocl-icd-opencl-dev, libclblast-dev, libfmt-dev")
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_RUNTIME_PACKAGE_SECTION libs)
set(CPACK_DEBIAN_SHARE_PACKAGE_SECTION libs)
set(CPACK_DEBIAN_TOOL_PACKAGE_SECTION graphics)
set(CPACK_DEBIAN_MODELS_PACKAGE_SECTION graphics)
include(CPack)
