# SPDX-License-Identifier: BSD-3-Clause
# PCL gives variables, not targets: wrapped here once, as efm::pcl.

# Without its component io, which needs VTK and Qt.
find_package(PCL 1.12 REQUIRED COMPONENTS common kdtree)
find_library(LZ4_LIBRARY lz4 REQUIRED)  # of FLANN's templates

# Of PCL's libraries only `common`: sources that use its other templates define PCL_NO_PRECOMPILE.
# The relocations of its libraries of filters and registration took half of the start of a program.
add_library(efm_pcl INTERFACE)
add_library(efm::pcl ALIAS efm_pcl)
target_include_directories(efm_pcl SYSTEM INTERFACE ${PCL_INCLUDE_DIRS})
target_compile_definitions(efm_pcl INTERFACE ${PCL_DEFINITIONS})
target_link_libraries(efm_pcl INTERFACE ${PCL_COMMON_LIBRARIES} "${LZ4_LIBRARY}")
