// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// MRPT's point maps. Where a header of PCL comes before them, they define functions that need PCL's
// input and output, which brings VTK. This macro is the sign that they look for.
#pragma push_macro("PCL_LINEAR_VERSION")
#undef PCL_LINEAR_VERSION
#include <mrpt/maps/CPointsMapXYZI.h>
#include <mrpt/maps/CSimplePointsMap.h>
#include <mrpt/obs/CObservationPointCloud.h>
#pragma pop_macro("PCL_LINEAR_VERSION")
