// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <opencv2/core.hpp>
#include <vector>

#include "mapping/geometry/reference_view.h"
#include "mapping/geometry/rig.h"
#include "mapping/geometry/rigid3.h"

namespace efm::studies {

/// An undistorted image and the pose of its camera.
struct PosedFrame {
  std::int64_t t_ns = 0;
  Rigid3 T_world_cam;
  cv::Mat1f image;  ///< Grey values of any scale.
  cv::Mat1b seen;   ///< 255 at pixels inside of the raw image, else 0.
};

/// The images of one camera, in order of time and in one pinhole view.
struct PosedFrames {
  ReferenceView view;
  std::vector<PosedFrame> frames;

  /// Index of the frame with the nearest time. There must be at least one frame.
  std::size_t nearestTo(std::int64_t t_ns) const;
};

/// Undistorts images to `ReferenceView::of(camera)` by cubic interpolation.
class FrameUndistortion {
 public:
  explicit FrameUndistortion(const CameraModel& camera);

  /// Without time and pose.
  PosedFrame operator()(const cv::Mat1f& raw) const;

 private:
  cv::Mat2f source_;  // per pixel of the view: the raw pixel
};

/// The camera of a folder in the UZH layout.
CameraModel uzhCamera(const std::filesystem::path& folder);

/// The frames with a pose of a folder in the UZH layout (images.txt: a line `t file` per image).
/// @throws std::runtime_error naming the missing or invalid file (and line).
PosedFrames readUzhFrames(const std::filesystem::path& folder);

}  // namespace efm::studies
