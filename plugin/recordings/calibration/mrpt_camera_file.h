// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string_view>

#include "mapping/geometry/rig.h"

namespace efm {

/// Whether a text begins, comments aside, with a section of an .ini file: "[NAME]".
bool looksLikeIni(std::string_view text);

/// Reads a camera, or two, from an .ini file as MRPT's camera calibration writes it (`TCamera`,
/// `TStereoCamera`): one section of any name, or the sections NAME_LEFT, NAME_RIGHT and
/// NAME_LEFT2RIGHT_POSE. The keys of a camera:
///   resolution        [width height]
///   fx fy cx cy       pixels
///   distortion_model  none | plumb_bob (radtan) | kannala_brandt (equidistant); also `distortion`
///   dist              [k1 k2 p1 p2 k3 …], more than five only if they are 0 | [k1 k2 k3 k4]
/// and of the pose of the right camera on the left one:
///   pose_quaternion   [x y z qw qx qy qz]
/// Other keys and sections are ignored. The left camera is camera 0.
/// @throws std::runtime_error naming file, section, key, value and what was expected.
Rig readMrptCameras(std::string_view text, const std::filesystem::path& file);

}  // namespace efm
