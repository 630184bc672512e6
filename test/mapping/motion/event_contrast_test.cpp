// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

#include <cmath>
#include <vector>

#include "mapping/motion/event_contrast.h"
#include "test/mapping/keyframes/random_scene.h"

namespace efm::event_contrast_test {
namespace {

using test::RandomRecording;

constexpr std::int64_t kMs = 1'000'000;

void expectNear(const Rigid3& a, const Rigid3& b, double tolerance) {
  EXPECT_LT((a.translation - b.translation).norm(), tolerance);
  EXPECT_LT((a.rotation.conjugate() * b.rotation).vec().norm(), tolerance);
}

TEST(VelocityCorrection, ADisplacementIsManySmallOnes) {
  const VelocityCorrection correction{{0.3, -0.2, 0.5}, {-1.2, 0.4, 0.7}};
  constexpr int kSteps = 1000;
  Rigid3 T_rig_true;
  for (int i = 0; i < kSteps; ++i) {
    T_rig_true = T_rig_true * correction.displacement(0.8 / kSteps);
  }
  expectNear(correction.displacement(0.8), T_rig_true, 1e-10);
  expectNear(correction.displacement(-0.8), T_rig_true.inverse(), 1e-10);
}

TEST(VelocityCorrection, SmallRotationsAreAsExactAsLargeOnes) {
  const Eigen::Vector3d linear_m_s(1, 2, 3);
  for (const double rate : {0.999e-4, 1.001e-4}) {  // on both sides of the end of the series
    const Rigid3 T_rig_true = VelocityCorrection{linear_m_s, {rate, 0, 0}}.displacement(1);
    EXPECT_NEAR(T_rig_true.rotation.x(), std::sin(rate / 2), 1e-18);
    EXPECT_NEAR(T_rig_true.translation.y(), 2 - 3 * rate / 2, 1e-8);
  }
}

TEST(VelocityCorrection, PosesMoveByTheDisplacementSinceTheReference) {
  const RandomRecording recording(2, 1, 10);
  const Window window = RandomRecording::kWindow;
  const VelocityCorrection correction{{0.05, -0.03, 0.02}, {0.1, -0.05, 0.08}};
  const Trajectory corrected = correctedTrajectory(recording.trajectory, window, correction);
  EXPECT_TRUE(isSame(corrected.poseAt(window.t_ref_ns).value(),
                     recording.trajectory.poseAt(window.t_ref_ns).value()));
  for (std::int64_t t_ns = window.t0_ns; t_ns < window.t1_ns; t_ns += 3 * kMs) {
    const double since_s = 1e-9 * static_cast<double>(t_ns - window.t_ref_ns);
    // Between poses (5 ms, up to 0.01 rad), interpolation differs a little from a screw motion.
    expectNear(corrected.poseAt(t_ns).value(),
               recording.trajectory.poseAt(t_ns).value() * correction.displacement(since_s), 2e-6);
  }
}

TEST(NearestDepths, EachPixelHasTheDepthOfTheNearestWithinTheRadius) {
  cv::Mat1f depth = cv::Mat1f::zeros(20, 30);
  depth(10, 5) = 2;
  depth(10, 11) = 4;
  const NearestDepths depths(depth, 4);
  EXPECT_FALSE(depths.empty());
  EXPECT_EQ(depths.inverseDepth({5, 10}), 0.5F);
  EXPECT_EQ(depths.distancePx({5, 10}), 0);
  EXPECT_EQ(depths.inverseDepth({7, 10}), 0.5F);
  EXPECT_EQ(depths.distancePx({7, 10}), 2);
  EXPECT_EQ(depths.inverseDepth({9, 10}), 0.25F);
  EXPECT_EQ(depths.inverseDepth({15, 10}), 0.25F);
  EXPECT_EQ(depths.inverseDepth({16, 10}), 0);
  EXPECT_EQ(depths.inverseDepth({5, 16}), 0);
}

TEST(NearestDepths, WithoutADepthThereIsNone) {
  const NearestDepths depths(cv::Mat1f::zeros(6, 7), 4);
  EXPECT_TRUE(depths.empty());
  EXPECT_EQ(depths.inverseDepth({3, 3}), 0);
}

/// A recording, one of its cameras, and depths in the reference view.
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

  /// Returns the intersection of an event's ray with a plane of the reference view, in pixels.
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
  for (const double right : {1.0, 0.0, -1.0}) {  // offset of the pixel of the nearer depth
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

constexpr int kPatchPx = 16;
const cv::Size kView(60, 45);

std::vector<std::vector<WarpedEvent>> randomEvents(std::uint32_t seed, int cameras, int count) {
  test::RandomScene random(seed);
  std::vector<std::vector<WarpedEvent>> events(static_cast<std::size_t>(cameras));
  for (auto& some : events) {
    for (int i = 0; i < count; ++i) {
      WarpedEvent event;
      event.pixel = Eigen::Vector2d(random.uniform(2, 57), random.uniform(2, 42)).cast<float>();
      for (int j = 0; j < 12; ++j) {
        event.by_velocity(j / 6, j % 6) = static_cast<float>(random.uniform(-1, 1));
      }
      event.by_inverse_depth =
          Eigen::Vector2d(random.uniform(-1, 1), random.uniform(-1, 1)).cast<float>();
      some.push_back(event);
    }
  }
  return events;
}

TEST(EventContrast, TheGradientIsTheNumericOne) {
  for (int cameras = 1; cameras <= 3; ++cameras) {
    const auto events = randomEvents(7, cameras, 300);
    EventContrast contrast(events, kView, kPatchPx);
    contrast.setBlur(1.5);
    Eigen::VectorXd gradient;
    Eigen::VectorXd unused;
    const Eigen::VectorXd place = Eigen::VectorXd::Constant(contrast.variables(), 0.01);
    contrast.at(place, gradient);
    for (Eigen::Index i = 0; i < contrast.variables(); ++i) {
      // The step is large against the rounding of floats. It is small against a pixel, because
      // bilinear images have kinks at pixels; smoothing nearly removes the kinks.
      constexpr double kStep = 5e-3;
      Eigen::VectorXd step = Eigen::VectorXd::Zero(contrast.variables());
      step[i] = kStep;
      const double numeric =
          (contrast.at(place + step, unused) - contrast.at(place - step, unused)) / (2 * kStep);
      EXPECT_NEAR(gradient[i], numeric, 0.02 * gradient.head<6>().norm())
          << cameras << " cameras, variable " << i;
    }
  }
}

TEST(EventContrast, IsTheSquareOfTheHarmonicMeanOfSmoothImages) {
  // Three cameras have one, two and three events at one point: inside and in corners of the view.
  WarpedEvent event;
  event.by_velocity.setZero();
  event.by_inverse_depth.setZero();
  for (const cv::Point& pixel : {cv::Point(30, 20), {0, 0}, {kView.width - 2, kView.height - 2}}) {
    event.pixel = {static_cast<float>(pixel.x) + 0.25F, static_cast<float>(pixel.y) + 0.5F};
    const std::vector<std::vector<WarpedEvent>> events = {
        {event}, std::vector<WarpedEvent>(2, event), std::vector<WarpedEvent>(3, event)};
    cv::Mat1f image = cv::Mat1f::zeros(kView);
    image.col(pixel.x).rowRange(pixel.y, pixel.y + 2) = 0.375F;
    image.col(pixel.x + 1).rowRange(pixel.y, pixel.y + 2) = 0.125F;
    for (const double blur_px : {1.0, 2.0}) {
      EventContrast contrast(events, kView, kPatchPx);
      contrast.setBlur(blur_px);
      const int side = blur_px == 1 ? 7 : 13;  // three standard deviations on each side
      cv::Mat1f smooth;
      cv::GaussianBlur(image, smooth, {side, side}, blur_px, blur_px, cv::BORDER_CONSTANT);
      Eigen::VectorXd gradient;
      const double mean = 3 / (1.0 + 1.0 / 2 + 1.0 / 3);
      EXPECT_NEAR(contrast.at(Eigen::VectorXd::Zero(contrast.variables()), gradient),
                  mean * mean * smooth.dot(smooth), 1e-3 * smooth.dot(smooth))
          << pixel;
      EXPECT_TRUE(gradient.isZero());
    }
  }
}

TEST(EventContrast, OnlyPatchesWithEventsAreVariables) {
  auto events = randomEvents(10, 2, 8);
  const Eigen::Vector2f pixels[] = {{5, 5},   {15.9F, 5}, {16, 5},  {5, 16},
                                    {-3, -3}, {99, 99},   {59, 44}, {46, 44}};
  for (std::size_t i = 0; i < 8; ++i) {
    events[0][i].pixel = pixels[i];
    events[1][i].pixel = {20, 5};
  }
  const EventContrast contrast(events, kView, kPatchPx);
  EXPECT_EQ(contrast.variables(), 6 + 5);
  EXPECT_EQ(contrast.eventsInPatch(), (std::vector<std::size_t>{3, 1 + 8, 1, 2, 1}));
}

}  // namespace

}  // namespace efm::event_contrast_test
