# SPDX-License-Identifier: BSD-3-Clause
# What `cmake --install` gives: the program, both libraries with the headers that their users need, the CMake package
# event-fusion-mapper with the targets efm::engine and efm::mrpt, a file for pkg-config, option files and examples.
include(CMakePackageConfigHelpers)
include(CheckCXXSourceCompiles)

foreach(folder IN ITEMS LIBDIR INCLUDEDIR DATADIR)
  if(IS_ABSOLUTE "${CMAKE_INSTALL_${folder}}")
    message(FATAL_ERROR
      "CMAKE_INSTALL_${folder} = ${CMAKE_INSTALL_${folder}}: expected a path relative to the prefix, "
      "because libraries and package find each other by relative paths")
  endif()
endforeach()

set(EFM_INCLUDE_DIR "${CMAKE_INSTALL_INCLUDEDIR}/event-fusion-mapper")
set(EFM_PACKAGE_DIR "${CMAKE_INSTALL_LIBDIR}/cmake/event-fusion-mapper")
set(EFM_DATA_DIR "${CMAKE_INSTALL_DATADIR}/event-fusion-mapper")

# efm_install_headers(<header>…): installs the headers and all of ours that they include, and no more.
function(efm_install_headers)
  set(waiting ${ARGV})
  set(installed)
  while(waiting)
    list(POP_FRONT waiting header)
    if(header IN_LIST installed)
      continue()
    endif()
    list(APPEND installed "${header}")
    set(path "${PROJECT_SOURCE_DIR}/${header}")
    if(NOT EXISTS "${path}")
      set(path "${PROJECT_SOURCE_DIR}/include/${header}")
    endif()
    set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS "${path}")
    set_property(GLOBAL APPEND PROPERTY EFM_PUBLIC_HEADERS "${path}")
    get_filename_component(folder "${header}" DIRECTORY)
    install(FILES "${path}" DESTINATION "${EFM_INCLUDE_DIR}/${folder}")
    file(STRINGS "${path}" includes REGEX "^#include \"")
    foreach(line IN LISTS includes)
      string(REGEX REPLACE "^#include \"(.*)\".*" "\\1" included "${line}")
      list(APPEND waiting "${included}")
    endforeach()
  endwhile()
endfunction()

efm_install_headers(event_fusion/engine.h plugin/mrpt/CObservationEvents.h)

# The libraries that the program loads when they are needed lie beside the engine.
set_target_properties(event-fusion PROPERTIES INSTALL_RPATH "$ORIGIN/../${CMAKE_INSTALL_LIBDIR}")
set_target_properties(mrpt-event-fusion event-fusion-window PROPERTIES INSTALL_RPATH "$ORIGIN")
set_target_properties(efm_engine PROPERTIES EXPORT_NAME engine)
set_target_properties(mrpt-event-fusion PROPERTIES EXPORT_NAME mrpt)
# Eigen's types have another alignment if a program is compiled for another processor: engine.h compares.
set(CMAKE_REQUIRED_LIBRARIES Eigen3::Eigen)
foreach(bytes IN ITEMS 0 16 32 64)
  check_cxx_source_compiles("
    #include <Eigen/Core>
    static_assert(EIGEN_MAX_STATIC_ALIGN_BYTES == ${bytes});
    int main() {}" EFM_EIGEN_ALIGNS_TO_${bytes})
  if(EFM_EIGEN_ALIGNS_TO_${bytes})
    set(EFM_EIGEN_ALIGN ${bytes})
    break()
  endif()
endforeach()
target_compile_definitions(efm_engine INTERFACE
  "$<INSTALL_INTERFACE:EFM_EIGEN_ALIGN=${EFM_EIGEN_ALIGN}>")
foreach(target IN ITEMS efm_engine mrpt-event-fusion)
  target_include_directories(${target} INTERFACE "$<INSTALL_INTERFACE:${EFM_INCLUDE_DIR}>")
endforeach()

install(TARGETS event-fusion)
install(TARGETS event-fusion-window LIBRARY DESTINATION "${CMAKE_INSTALL_LIBDIR}")
install(TARGETS efm_engine EXPORT efm-engine)
install(TARGETS mrpt-event-fusion EXPORT efm-mrpt)
foreach(component IN ITEMS engine mrpt)
  install(EXPORT efm-${component} NAMESPACE efm::
    FILE event-fusion-mapper-${component}.cmake DESTINATION "${EFM_PACKAGE_DIR}")
endforeach()
configure_package_config_file(cmake/event-fusion-mapper-config.cmake.in
  "${PROJECT_BINARY_DIR}/event-fusion-mapper-config.cmake"
  INSTALL_DESTINATION "${EFM_PACKAGE_DIR}" PATH_VARS EFM_DATA_DIR)
write_basic_package_version_file("${PROJECT_BINARY_DIR}/event-fusion-mapper-config-version.cmake"
  COMPATIBILITY SameMinorVersion)
install(FILES
  "${PROJECT_BINARY_DIR}/event-fusion-mapper-config.cmake"
  "${PROJECT_BINARY_DIR}/event-fusion-mapper-config-version.cmake"
  DESTINATION "${EFM_PACKAGE_DIR}")
file(RELATIVE_PATH EFM_PC_TO_PREFIX "/${CMAKE_INSTALL_LIBDIR}/pkgconfig" "/")
configure_file(cmake/event-fusion-mapper.pc.in event-fusion-mapper.pc @ONLY)
install(FILES "${PROJECT_BINARY_DIR}/event-fusion-mapper.pc"
  DESTINATION "${CMAKE_INSTALL_LIBDIR}/pkgconfig")

install(FILES LICENSE README.md CHANGELOG.md CITATION.cff DESTINATION "${CMAKE_INSTALL_DOCDIR}")
install(DIRECTORY config examples DESTINATION "${EFM_DATA_DIR}" USE_SOURCE_PERMISSIONS)

# The reference of the public headers: cmake --build … --target docs writes docs/html in the build folder.
find_package(Doxygen QUIET)
if(DOXYGEN_FOUND AND PROJECT_IS_TOP_LEVEL)
  get_property(headers GLOBAL PROPERTY EFM_PUBLIC_HEADERS)
  list(REMOVE_DUPLICATES headers)
  set(DOXYGEN_OUTPUT_DIRECTORY "${PROJECT_BINARY_DIR}/docs")
  set(DOXYGEN_STRIP_FROM_PATH "${PROJECT_SOURCE_DIR}" "${PROJECT_SOURCE_DIR}/include")
  set(DOXYGEN_STRIP_FROM_INC_PATH ${DOXYGEN_STRIP_FROM_PATH})
  set(DOXYGEN_JAVADOC_AUTOBRIEF YES)
  set(DOXYGEN_EXTRACT_ALL YES)
  set(DOXYGEN_WARN_IF_INCOMPLETE_DOC NO)  # a parameter whose name says all has no line
  set(DOXYGEN_WARN_AS_ERROR FAIL_ON_WARNINGS)
  set(DOXYGEN_MACRO_EXPANSION YES)
  set(DOXYGEN_EXPAND_ONLY_PREDEF YES)
  set(DOXYGEN_PREDEFINED "EIGEN_ALIGN16=" "PCL_MAKE_ALIGNED_OPERATOR_NEW="
    "__extension__=" "DEFINE_SERIALIZABLE(class,namespace)=")
  set(DOXYGEN_EXCLUDE_SYMBOLS pcl)
  set(DOXYGEN_QUIET YES)
  doxygen_add_docs(docs ${headers} COMMENT "The reference of the public headers")
endif()
