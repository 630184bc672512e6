// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <opencv2/core.hpp>
#include <vector>

#include "mapping/geometry/camera.h"
#include "mapping/geometry/reference_view.h"
#include "mapping/geometry/rigid3.h"

namespace efm::studies {

/// An ordinary image, undistorted, and where it was taken.
struct PosedFrame {
  std::int64_t t_ns = 0;
  Rigid3 T_world_cam;
  cv::Mat1f image;  ///< Grey values, of any scale.
  cv::Mat1b seen;   ///< 255 where the lens saw, else 0.
};

/// What one camera saw on its way, by time; all images in one pinhole.
struct PosedFrames {
  ReferenceView view;
  std::vector<PosedFrame> frames;

  /// Index of the frame whose time is nearest. There is at least one.
  std::size_t nearestTo(std::int64_t t_ns) const;
};

/// Makes images of a lens what `ReferenceView::of(camera)` sees, by cubic interpolation.
class FrameUndistortion {
 public:
  explicit FrameUndistortion(const CameraModel& camera);

  /// Without its time and pose.
  PosedFrame operator()(const cv::Mat1f& raw) const;

 private:
  cv::Mat2f source_;  // per pixel of the view: the raw pixel
};

/// The frames of a folder in the UZH layout (images.txt: `t file` a line) that have a pose.
/// @throws std::runtime_error naming the file (and line) that is missing or not understood.
PosedFrames readUzhFrames(const std::filesystem::path& folder);

}  // namespace efm::studies
