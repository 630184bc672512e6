// SPDX-License-Identifier: BSD-3-Clause
#include "test/studies/frames/frame_depth.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "maps/metrics/depth_metrics.h"
#include "test/paths.h"
#include "test/studies/frames/rendered_frames.h"
#include "tracking_stub/rendering/frame_renderer.h"
#include "tracking_stub/scenes/furnishing.h"

namespace efm::studies {
namespace {

using Eigen::Vector3d;

CameraModel smallCamera() {
  CameraModel camera;
  camera.width = 120;
  camera.height = 90;
  camera.fx = camera.fy = 160;
  camera.cx = 59.5;
  camera.cy = 44.5;
  camera.distortion = DistortionModel::kRadtan;
  camera.coefficients = {-0.12, 0.05, 0, 0};
  return camera;
}

/// A camera that moves to the right takes a frame every 2 cm.
PosedFrames framesOf(const Scene& scene) {
  std::vector<StampedPose> poses;
  for (int i = -5; i <= 5; ++i) {
    StampedPose pose;
    pose.t_ns = i;
    pose.T_world_rig.translation.x() = 0.02 * i;
    poses.push_back(pose);
  }
  return renderedFrames(scene, smallCamera(), poses, {60, 0, 1});
}

FrameDepthOptions fewPlanes() {
  FrameDepthOptions options;
  options.planes = {0.4, 2.5, 72, PlaneSpacing::kInverse};
  return options;
}

/// The view stands between two frames.
Rigid3 somewhere() {
  Rigid3 T_world_ref;
  T_world_ref.translation.x() = 0.007;
  return T_world_ref;
}

TEST(FrameDepth, LiesOnTheSurfaces) {
  PaintingOptions painted;
  painted.seed = 4;
  painted.focal_px = 160;
  painted.coverage = 0.6;
  Painting painting(painted);
  Scene scene;
  scene.addRectangle({{-1.5, 1.2, 1.6}, Vector3d::UnitX(), -Vector3d::UnitY(), 3, 2.4},
                     painting.clutter(1.6, 0.12));
  scene.addRectangle({{-0.12, 0.15, 0.7}, Vector3d::UnitX(), -Vector3d::UnitY(), 0.3, 0.25},
                     painting.clutter(0.7, 0.05));
  const PosedFrames sequence = framesOf(scene);
  const FrameDepth depth =
      frameDepth(sequence, sequence.nearestTo(0), sequence.view, somewhere(), fewPlanes());

  DepthPairingOptions pairing;
  pairing.tolerance_px = 1;  // silhouettes are as wide as the lens' blur
  std::vector<double> errors;
  for (const DepthPair& pair :
       pairDepths({depth.depth, renderDepth(scene, somewhere(), sequence.view)}, pairing)) {
    errors.push_back(std::abs(pair.estimate_m / pair.truth_m - 1));
  }
  ASSERT_GT(errors.size(), 500U);
  std::sort(errors.begin(), errors.end());
  EXPECT_LT(errors[errors.size() / 2], 0.005);
  EXPECT_LT(errors[errors.size() * 95 / 100], 0.03);
}

TEST(FrameDepth, IsUnsureOfEdgesAlongTheMotion) {
  Scene scene;
  scene.addRectangle({{-1.5, 1.2, 1}, Vector3d::UnitX(), -Vector3d::UnitY(), 3, 2.4},
                     [](double width_m, double height_m) {
                       constexpr double kTexelM = 0.003;
                       cv::Mat1f stripes(static_cast<int>(height_m / kTexelM),
                                         static_cast<int>(width_m / kTexelM));
                       for (int row = 0; row < stripes.rows; ++row) {
                         stripes.row(row) = row / 30 % 2 == 0 ? 0.5F : -0.5F;
                       }
                       return Texture(stripes, kTexelM);
                     });
  const PosedFrames sequence = framesOf(scene);
  const FrameDepth depth =
      frameDepth(sequence, sequence.nearestTo(0), sequence.view, somewhere(), fewPlanes());
  EXPECT_EQ(cv::countNonZero(depth.depth), 0);
  EXPECT_GT(cv::countNonZero(depth.likely), 5000);
}

TEST(FrameDepth, RejectsOptionsThatMakeNoSense) {
  FrameDepthOptions options;
  options.max_baseline_m = options.min_baseline_m;
  EXPECT_THROW(options.validate(), std::invalid_argument);
  options = {};
  options.window_sigmas_px.clear();
  EXPECT_THROW(options.validate(), std::invalid_argument);
}

TEST(PosedFrames, OfTheRealSliderAreThoseWithAPose) {
  const std::filesystem::path folder = std::filesystem::path(EFM_SHARED_DATA) / "slider_depth";
  if (!exists(folder)) GTEST_SKIP() << "there is no real recording at " << folder;
  const PosedFrames sequence = readUzhFrames(folder);
  // Of 87 frames the first lies before the first pose.
  ASSERT_EQ(sequence.frames.size(), 86U);
  EXPECT_EQ(sequence.frames[0].t_ns, 38'766'001);
  EXPECT_EQ(sequence.frames[0].image.size(), cv::Size(240, 180));
  EXPECT_EQ(sequence.nearestTo(97'000'000), 2U);
}

}  // namespace
}  // namespace efm::studies
