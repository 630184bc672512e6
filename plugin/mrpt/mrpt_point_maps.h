// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// MRPT's point maps. If MRPT's headers find this macro of PCL, they define functions that need
// PCL's input and output, and these need VTK. So the macro is hidden.
#pragma push_macro("PCL_LINEAR_VERSION")
#undef PCL_LINEAR_VERSION
#include <mrpt/maps/CPointsMapXYZI.h>
#include <mrpt/maps/CSimplePointsMap.h>
#include <mrpt/obs/CObservationPointCloud.h>
#pragma pop_macro("PCL_LINEAR_VERSION")
