# SPDX-License-Identifier: BSD-3-Clause
# PCL gives variables, not targets: wrapped here once, as efm::pcl.

# Without its component io, which needs VTK and Qt.
find_package(PCL 1.12 REQUIRED COMPONENTS common filters kdtree)

add_library(efm_pcl INTERFACE)
add_library(efm::pcl ALIAS efm_pcl)
target_include_directories(efm_pcl SYSTEM INTERFACE ${PCL_INCLUDE_DIRS})
target_compile_definitions(efm_pcl INTERFACE ${PCL_DEFINITIONS})
target_link_libraries(efm_pcl INTERFACE
  ${PCL_COMMON_LIBRARIES} ${PCL_FILTERS_LIBRARIES} ${PCL_KDTREE_LIBRARIES})

# ICP: of the program alone, so that hosts of the plugin do not load it. Not as a component of
# find_package, which would look for VTK and Qt.
find_library(PCL_REGISTRATION_LIBRARY pcl_registration REQUIRED)
find_library(PCL_SEARCH_LIBRARY pcl_search REQUIRED)
add_library(efm_pcl_registration INTERFACE)
add_library(efm::pcl_registration ALIAS efm_pcl_registration)
target_link_libraries(efm_pcl_registration INTERFACE
  efm::pcl "${PCL_REGISTRATION_LIBRARY}" "${PCL_SEARCH_LIBRARY}")
