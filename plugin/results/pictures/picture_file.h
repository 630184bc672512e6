// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <opencv2/core.hpp>

namespace efm {

/// Writes a picture as PNG. The file appears under its name only when it is complete.
/// @throws std::runtime_error naming the file if its extension is not .png or it cannot be written.
void writePicture(const std::filesystem::path& file, const cv::Mat3b& picture);

}  // namespace efm
