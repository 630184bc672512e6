// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/motion/event_contrast.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "test/mapping/keyframes/random_scene.h"

namespace efm::warped_events_test {
namespace {

using test::RandomRecording;

/// A recording, a camera of it, and depths in its reference view.
struct Warping {
  RandomRecording recording{5, 1, 400};
  const RigCamera& camera = recording.rig.cameras.front();
  UndistortionTable undistortion{camera.model};
  ReferenceView view = ReferenceView::of(camera.model);
  DepthPlanes planes{{0.5, 4.0, 40, PlaneSpacing::kInverse}};
  Window window = RandomRecording::kWindow;
  Rigid3 T_world_ref = recording.trajectory.poseAt(window.t_ref_ns).value() * camera.T_rig_cam;

  std::vector<WarpedEvent> warp(const cv::Mat1f& depth, const Trajectory& trajectory,
                                EventSpan events, std::size_t every = 1,
                                double radius_px = 0.5) const {
    const NearestDepths depths(depth, radius_px);
    return warpEvents(
        {0, &camera, &undistortion, events}, every, trajectory,
        {T_world_ref.inverse(), view, inversePlanes(planes), &depths, window.t_ref_ns});
  }

  /// The point where an event's ray meets a plane of the reference view.
  Eigen::Vector2d pixelAt(const Event& event, double depth_m, const Rigid3& T_world_rig) const {
    const Rigid3 T_ref_cam = T_world_ref.inverse() * T_world_rig * camera.T_rig_cam;
    const Eigen::Vector3d far_ref =
        T_ref_cam * Eigen::Vector3d(undistortion.ray(event.x, event.y).homogeneous());
    const Eigen::Vector3d ray_ref = far_ref - T_ref_cam.translation;
    return view.project(T_ref_cam.translation +
                        (depth_m - T_ref_cam.translation.z()) / ray_ref.z() * ray_ref);
  }
};

cv::Mat1f flat(const ReferenceView& view, float depth_m) {
  return cv::Mat1f(view.height, view.width, depth_m);
}

TEST(WarpedEvents, AnEventLiesWhereItsRayMeetsTheDepth) {
  const Warping warping;
  constexpr float kDepth_m = 1.25F;  // between two planes
  int warped = 0;
  std::vector<Eigen::Vector2f> every_fifth;
  int index = 0;
  for (const Event& event : warping.recording.events.front()) {
    ++index;
    const std::vector<Event> one = {event};
    const auto found =
        warping.warp(flat(warping.view, kDepth_m), warping.recording.trajectory, one);
    if (found.empty()) continue;
    ++warped;
    if (index % 5 == 3) every_fifth.push_back(found.front().pixel);
    const Rigid3 T_world_rig = warping.recording.trajectory.poseAt(event.t_ns).value();
    const Eigen::Vector2d expected = warping.pixelAt(event, kDepth_m, T_world_rig);
    EXPECT_LT((found.front().pixel.cast<double>() - expected).norm(), 1e-4);
  }
  EXPECT_GT(warped, 200);
  const auto some = warping.warp(flat(warping.view, kDepth_m), warping.recording.trajectory,
                                 warping.recording.events.front(), 5);
  ASSERT_EQ(some.size(), every_fifth.size());
  for (std::size_t i = 0; i < some.size(); ++i) EXPECT_EQ(some[i].pixel, every_fifth[i]);
}

TEST(WarpedEvents, OfSeveralDepthsOnItsRayAnEventHasTheNearestToAPixelWithIt) {
  const Warping warping;
  // A camera 0.2 m to the right: the point of a ray moves by 6.2 px per 1/m to the left.
  RigCamera beside = warping.camera;
  beside.T_rig_cam = beside.T_rig_cam * Rigid3{Eigen::Quaterniond::Identity(), {0.2, 0, 0}};
  const Event event{warping.window.t_ref_ns, 16, 18, true};
  const Eigen::Vector2d ray = warping.undistortion.ray(event.x, event.y);
  for (const double right : {1.0, 0.0, -1.0}) {  // the pixel of the nearer depth is off by this
    cv::Mat1f depth = cv::Mat1f::zeros(36, 48);
    for (const double depth_m : {0.8, 2.0}) {
      const Eigen::Vector2d pixel = warping.view.project(
          Eigen::Vector3d(depth_m * ray.homogeneous()) + Eigen::Vector3d(0.2, 0, 0));
      const bool near = depth_m < 1;
      depth(static_cast<int>(std::lround(pixel.y())),
            static_cast<int>(std::lround(pixel.x() + (near ? right : 0)))) =
          static_cast<float>(depth_m);
      if (right == 0 && !near) depth.col(static_cast<int>(std::lround(pixel.x()))) = 0;
    }
    const NearestDepths depths(depth, 2.5);
    const auto found =
        warpEvents({0, &beside, &warping.undistortion, std::vector<Event>{event}}, 1,
                   warping.recording.trajectory,
                   {warping.T_world_ref.inverse(), warping.view, inversePlanes(warping.planes),
                    &depths, warping.window.t_ref_ns});
    ASSERT_EQ(found.size(), 1U);
    const double found_m = right == 0 ? 0.8 : 2.0;
    const Eigen::Vector2d expected = warping.view.project(
        Eigen::Vector3d(found_m * ray.homogeneous()) + Eigen::Vector3d(0.2, 0, 0));
    EXPECT_LT((found.front().pixel.cast<double>() - expected).norm(), 0.01) << right;
  }
}

TEST(WarpedEvents, ADepthBehindTheCameraIsNotOnItsRay) {
  Warping warping;
  const Eigen::Vector3d ahead(0.2, 0, 1);
  Rigid3& T_rig_cam = warping.recording.rig.cameras.front().T_rig_cam;
  T_rig_cam = T_rig_cam * Rigid3{Eigen::Quaterniond::Identity(), ahead};
  warping.view.fy *= 1.6;  // pixels need not be square
  const std::vector<Event> one = {{warping.window.t_ref_ns, 16, 30, true}};
  const Eigen::Vector2d ray = warping.undistortion.ray(16, 30);
  for (const double from_camera_m : {-0.2, 0.6}) {
    const Eigen::Vector2d pixel =
        warping.view.project(Eigen::Vector3d(from_camera_m * ray.homogeneous()) + ahead);
    cv::Mat1f depth = cv::Mat1f::zeros(36, 48);
    depth(static_cast<int>(std::lround(pixel.y())), static_cast<int>(std::lround(pixel.x()))) =
        static_cast<float>(1 + from_camera_m);
    EXPECT_EQ(warping.warp(depth, warping.recording.trajectory, one, 1, 1.5).size(),
              from_camera_m > 0 ? 1U : 0U)
        << from_camera_m;
  }
}

TEST(WarpedEvents, DerivativesAreThoseOfThePlainWarp) {
  const Warping warping;
  constexpr double kDepth_m = 1.25;
  constexpr double kStep = 1e-4;
  for (const Event& event : warping.recording.events.front()) {
    const std::vector<Event> one = {event};
    const auto found = warping.warp(flat(warping.view, static_cast<float>(kDepth_m)),
                                    warping.recording.trajectory, one);
    if (found.empty()) continue;
    const Rigid3 T_world_rig = warping.recording.trajectory.poseAt(event.t_ns).value();
    const double since_s = 1e-9 * static_cast<double>(event.t_ns - warping.window.t_ref_ns);
    for (int i = 0; i < 6; ++i) {
      const auto moved = [&](double by) {
        VelocityCorrection correction;
        (i < 3 ? correction.linear_m_s : correction.angular_rad_s)[i % 3] = by;
        return warping.pixelAt(event, kDepth_m, T_world_rig * correction.displacement(since_s));
      };
      const Eigen::Vector2d numeric = (moved(kStep) - moved(-kStep)) / (2 * kStep);
      EXPECT_LT((found.front().by_velocity.col(i).cast<double>() - numeric).norm(),
                1e-4 * (1 + numeric.norm()))
          << "by number " << i;
    }
    const Eigen::Vector2d numeric =
        (warping.pixelAt(event, 1 / (1 / kDepth_m + kStep), T_world_rig) -
         warping.pixelAt(event, 1 / (1 / kDepth_m - kStep), T_world_rig)) /
        (2 * kStep);
    EXPECT_LT((found.front().by_inverse_depth.cast<double>() - numeric).norm(),
              1e-4 * (1 + numeric.norm()));
  }
}

TEST(WarpedEvents, EventsWithoutDepthAreLeftOut) {
  const Warping warping;
  const auto& events = warping.recording.events.front();
  EXPECT_TRUE(warping.warp(flat(warping.view, 0), warping.recording.trajectory, events).empty());
  EXPECT_TRUE(warping.warp(flat(warping.view, 50), warping.recording.trajectory, events).empty())
      << "beyond the planes";
  EXPECT_TRUE(warping.warp(flat(warping.view, 1), Trajectory(), events).empty()) << "no pose";
}

TEST(WarpedEvents, EventsOutsideTheLensAreLeftOut) {
  const Warping warping;
  RigCamera camera = warping.camera;
  camera.model = test::foldingCamera();
  const UndistortionTable undistortion(camera.model);
  std::vector<Event> outside;
  for (const Event& event : warping.recording.events.front()) {
    if (!undistortion.hasRay(event.x, event.y)) outside.push_back(event);
  }
  ASSERT_GT(outside.size(), 20U);
  const NearestDepths depths(flat(warping.view, 1.25F), 100);
  EXPECT_TRUE(warpEvents({0, &camera, &undistortion, outside}, 1, warping.recording.trajectory,
                         {warping.T_world_ref.inverse(), warping.view,
                          inversePlanes(warping.planes), &depths, warping.window.t_ref_ns})
                  .empty());
}

}  // namespace
}  // namespace efm::warped_events_test
