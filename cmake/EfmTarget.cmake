# SPDX-License-Identifier: BSD-3-Clause
# What every target of the project has in common.

# efm_target_defaults(<target>): C++17, warnings, position-independent code.
function(efm_target_defaults target)
  target_compile_features(${target} PUBLIC cxx_std_17)
  set_target_properties(${target} PROPERTIES
    CXX_EXTENSIONS OFF
    POSITION_INDEPENDENT_CODE ON)
  target_compile_options(${target} PRIVATE
    -Wall -Wextra -Wpedantic -Wshadow -Wnon-virtual-dtor -Woverloaded-virtual
    $<$<BOOL:${EFM_WARNINGS_AS_ERRORS}>:-Werror>)
endfunction()

# efm_unity_folders(<target>): where unity builds are on (CMAKE_UNITY_BUILD), the files of a folder are
# compiled together. Kernel files stay alone: Highway includes each once per instruction set.
# EFM_SPLIT_LIBRARIES: only those of tests are, so that a change of one file compiles no other, and
# the libraries' headers are compiled before.
function(efm_unity_folders target)
  set_target_properties(${target} PROPERTIES UNITY_BUILD_MODE GROUP)
  get_target_property(sources ${target} SOURCES)
  string(FIND "${CMAKE_CURRENT_SOURCE_DIR}/" "${PROJECT_SOURCE_DIR}/test/" in_test)
  set(split OFF)
  if(EFM_SPLIT_LIBRARIES AND in_test LESS 0)
    set(split ON)
    target_precompile_headers(${target} PRIVATE
      <algorithm> <cmath> <deque> <filesystem> <fstream> <functional> <map> <memory> <optional>
      <set> <sstream> <stdexcept> <string> <vector> <Eigen/Geometry> <opencv2/core.hpp>)
    if(target STREQUAL "mrpt-event-fusion")
      target_precompile_headers(${target} PRIVATE
        <fmt/format.h> <mrpt/obs/CObservation.h> <mrpt/serialization/CArchive.h>)
    endif()
  endif()
  foreach(source IN LISTS sources)
    get_filename_component(folder ${source} DIRECTORY)
    if(split AND folder STREQUAL "kernels")  # with options of their own
      set_source_files_properties(${source} PROPERTIES SKIP_PRECOMPILE_HEADERS ON)
    elseif(folder AND NOT folder STREQUAL "kernels" AND NOT split)
      string(REPLACE "/" "_" group "${folder}")
      set_source_files_properties(${source} PROPERTIES UNITY_GROUP "${group}")
    endif()
  endforeach()
endfunction()

# efm_library(<name> SOURCES … HEADERS …): a static library efm_<name> with the alias efm::<name>,
# included as "<folder>/<header>.h" from the project's root. Headers are verified to be
# self-contained by the target all_verify_interface_header_sets.
function(efm_library name)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "" "SOURCES;HEADERS")
  set(target efm_${name})
  add_library(${target} STATIC ${arg_SOURCES})
  add_library(efm::${name} ALIAS ${target})
  target_sources(${target} PUBLIC
    FILE_SET HEADERS BASE_DIRS "${PROJECT_SOURCE_DIR}" FILES ${arg_HEADERS})
  set_target_properties(${target} PROPERTIES VERIFY_INTERFACE_HEADER_SETS ON)
  efm_target_defaults(${target})
  efm_unity_folders(${target})
endfunction()
