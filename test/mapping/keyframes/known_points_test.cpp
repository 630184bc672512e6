// SPDX-License-Identifier: BSD-3-Clause
// The keyframe mapper: default options (split fusion, aggregated depth) and known points.
#include <gmock/gmock.h>
#include <tbb/global_control.h>
#include <tbb/task_scheduler_observer.h>
#include <opencv2/core.hpp>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "mapping/keyframes/keyframe_mapper.h"
#include "mapping/keyframes/keyframe_policy.h"
#include "test/mapping/depth/same_image.h"
#include "test/mapping/kernels/fast_kernels.h"
#include "test/mapping/keyframes/played_recording.h"
#include "test/mapping/keyframes/random_scene.h"
#include "test/mapping/motion/moving_edges.h"

namespace efm::keyframe_defaults_test {
namespace {

using test::map;
using test::MovingEdges;
using test::same;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

constexpr DepthPlanesOptions kPlanes{0.7, 5.0, 60, PlaneSpacing::kInverse};

KeyframeMapperOptions defaults() {
  KeyframeMapperOptions options;
  options.planes = kPlanes;
  options.sweep.threads = 1;
  return options;
}

KeyframeDepthMap map(const MovingEdges& recording, const KeyframeMapperOptions& options) {
  return map(recording, recording.cameras(), options);
}

class KeyframeDefaultsOn : public ::testing::TestWithParam<VotingKernel> {};

INSTANTIATE_TEST_SUITE_P(Kernels, KeyframeDefaultsOn, ::testing::ValuesIn(availableKernels()),
                         test::nameOfKernel);

TEST_P(KeyframeDefaultsOn, EdgesHaveTheirDepthWithOneToThreeCameras) {
  const double step = DepthPlanes(kPlanes).inverseDepthStep();
  for (int cameras = 1; cameras <= 3; ++cameras) {
    const MovingEdges recording(cameras);
    KeyframeMapperOptions options = defaults();
    options.sweep.kernel = GetParam();
    const DepthMap depths = map(recording, options).map;
    int kept = 0;
    int right = 0;
    for (int y = 0; y < depths.depth.rows; ++y) {
      for (int x = 0; x < depths.depth.cols; ++x) {
        if (depths.depth(y, x) == 0) continue;
        ++kept;
        right += recording.offEdge(x, y, depths.depth(y, x), step) <= 1.5 ? 1 : 0;
        ASSERT_GT(depths.variance(y, x), 0);
        ASSERT_TRUE(std::isfinite(depths.variance(y, x)));
      }
    }
    EXPECT_GT(kept, 400) << cameras << " cameras";
    EXPECT_GE(right, kept * 97 / 100) << "within a plane, of " << kept << ", " << cameras;
  }
}

TEST_P(KeyframeDefaultsOn, TheNumberOfThreadsChangesNoBit) {
  const tbb::global_control as_if_eight_cores(tbb::global_control::max_allowed_parallelism, 8);
  for (int cameras = 1; cameras <= 3; ++cameras) {
    const MovingEdges recording(cameras);
    KeyframeMapperOptions options = defaults();
    options.sweep.kernel = GetParam();
    options.camera_maps = true;
    const KeyframeDepthMap one = map(recording, options);
    for (const int threads : {2, 8}) {
      options.sweep.threads = threads;
      const KeyframeDepthMap many = map(recording, options);
      EXPECT_TRUE(same(one.map, many.map)) << threads << " threads";
      ASSERT_EQ(one.camera_maps.size(), many.camera_maps.size());
      for (std::size_t c = 0; c < one.camera_maps.size(); ++c) {
        EXPECT_TRUE(same(one.camera_maps[c].map, many.camera_maps[c].map)) << "camera " << c;
      }
    }
  }
}

TEST(KeyframeDefaults, SweepCoarsePlanesFirstWhereColumnsOfInversePlanesAreFused) {
  const MovingEdges recording(2);
  KeyframeMapperOptions options = defaults();
  options.planes.num_planes = 200;
  const KeyframeDepthMap coarse = map(recording, options);
  EXPECT_GT(coarse.votes.interpolated, coarse.votes.cast / 10);
  const struct {
    const char* name;
    std::function<void(KeyframeMapperOptions&)> change;
  } kAllPlanes[] = {
      {"option", [](auto& of) { of.sweep.coarse_to_fine = false; }},
      {"paper", [](auto& of) { of.extraction.extraction = ExtractionMethod::kPaper; }},
      {"linear", [](auto& of) { of.planes.spacing = PlaneSpacing::kLinear; }},
      {"plain", [](auto& of) { of.sweep.kernel = VotingKernel::kPlain; }},
  };
  for (const auto& [name, change] : kAllPlanes) {
    KeyframeMapperOptions changed = options;
    change(changed);
    EXPECT_EQ(map(recording, changed).votes.interpolated, 0U) << name;
  }
  options.camera_maps = true;
  EXPECT_TRUE(same(map(recording, options).map, coarse.map));
  options.camera_maps = false;
  options.sweep.coarse_to_fine = false;
  const KeyframeDepthMap all = map(recording, options);
  EXPECT_EQ(all.votes.total(), coarse.votes.total());
  const double step = DepthPlanes(kPlanes).inverseDepthStep();
  int kept[2] = {0, 0};
  int right[2] = {0, 0};
  for (const int i : {0, 1}) {
    const cv::Mat1f& depth = (i == 0 ? coarse : all).map.depth;
    for (int y = 0; y < depth.rows; ++y) {
      for (int x = 0; x < depth.cols; ++x) {
        if (depth(y, x) == 0) continue;
        ++kept[i];
        right[i] += recording.offEdge(x, y, depth(y, x), step) <= 1.5 ? 1 : 0;
      }
    }
  }
  EXPECT_GE(kept[0], kept[1] * 97 / 100);
  EXPECT_GE(right[0] * kept[1], right[1] * kept[0] * 0.99);
}

/// Counts the workers that join the arena of the thread that constructs this object.
class WorkersThatCome : public tbb::task_scheduler_observer {
 public:
  WorkersThatCome() { observe(true); }
  ~WorkersThatCome() override { observe(false); }
  void on_scheduler_entry(bool is_worker) override { count_ += is_worker ? 1 : 0; }
  int count() const { return count_; }

 private:
  std::atomic<int> count_ = 0;
};

TEST(KeyframeDefaults, OneThreadHasNoWorkersInAnyStep) {
  const tbb::global_control as_if_eight_cores(tbb::global_control::max_allowed_parallelism, 8);
  const MovingEdges recording(2);
  KeyframeMapper mapper(recording.rig, recording.cameras(), defaults());
  const WorkersThatCome workers;
  for (int i = 0; i < 20; ++i) {
    ASSERT_TRUE(mapper.map(MovingEdges::kWindow, recording.spans(), recording.trajectory));
  }
  EXPECT_EQ(workers.count(), 0);
}

TEST(KeyframeDefaults, ASilentCameraSilencesTheMapUnlessItIsExcluded) {
  MovingEdges recording(2);
  recording.events[1].clear();
  const KeyframeDepthMap keyframe = map(recording, defaults());
  EXPECT_THAT(keyframe.silent_cameras, ElementsAre(1));
  EXPECT_EQ(keyframe.max_confidence, 0);
  EXPECT_EQ(cv::countNonZero(keyframe.map.depth), 0);
  EXPECT_EQ(keyframe.silent_subintervals, 0U) << "of the cameras that are not silent";
  // If the silent camera is excluded, the slices of the remaining camera are fused like cameras.
  KeyframeMapperOptions options = defaults();
  options.exclude_silent = true;
  options.camera_maps = true;
  const KeyframeDepthMap excluded = map(recording, options);
  options.split.time_slices = 2;  // as with two selected cameras
  const KeyframeDepthMap alone = map(recording, {0}, options);
  EXPECT_GT(cv::countNonZero(alone.map.depth), 400);
  EXPECT_TRUE(same(excluded.map, alone.map));
  ASSERT_EQ(excluded.camera_maps.size(), 1U);
  EXPECT_EQ(excluded.camera_maps[0].camera, 0);
  EXPECT_TRUE(same(excluded.camera_maps[0].map, excluded.map));
}

TEST(KeyframeDefaults, WithEveryCameraSilentTheMapIsEmpty) {
  MovingEdges recording(2);
  for (auto& events : recording.events) events.clear();
  for (const bool exclude_silent : {false, true}) {
    for (const auto& cameras : {std::vector<int>{0, 1}, {1}}) {
      KeyframeMapperOptions options = defaults();
      options.exclude_silent = exclude_silent;
      options.camera_maps = true;
      const KeyframeDepthMap keyframe = map(recording, cameras, options);
      EXPECT_EQ(keyframe.silent_cameras, cameras);
      EXPECT_EQ(cv::countNonZero(keyframe.map.depth), 0);
      EXPECT_EQ(keyframe.camera_maps.size(), cameras.size());
    }
  }
}

TEST(KeyframeDefaults, SilentSubintervalsAreCountedInAllSlicesButNotByPolarity) {
  test::RandomRecording recording(9, 2, 3000);
  for (Event& event : recording.events[0]) event.polarity = false;
  // The second camera has no events in the third and fourth of six parts.
  auto& events = recording.events[1];
  events.erase(std::remove_if(events.begin(), events.end(),
                              [](const Event& event) {
                                const std::int64_t since_ns =
                                    event.t_ns - test::RandomRecording::kStart_ns;
                                return since_ns * 6 >= 2 * test::RandomRecording::kDuration_ns &&
                                       since_ns * 6 < 4 * test::RandomRecording::kDuration_ns;
                              }),
               events.end());
  KeyframeMapperOptions options = defaults();
  options.planes.num_planes = 4;
  options.subintervals.count = 3;  // in each of two slices
  const KeyframeDepthMap keyframe = map(recording, {0, 1}, options);
  EXPECT_THAT(keyframe.silent_cameras, IsEmpty());
  EXPECT_EQ(keyframe.silent_subintervals, 2U);
  EXPECT_EQ(keyframe.events[0] + keyframe.events[1] + keyframe.without_pose, 3000 + events.size());
  EXPECT_EQ(keyframe.votes.total(), 4 * (keyframe.events[0] + keyframe.events[1]));
}

TEST(KeyframeDefaults, AnyNumberOfPlanesGivesAMapOfDepthsWithinThem) {
  const MovingEdges recording(2);
  for (const auto extraction : {ExtractionMethod::kPaper, ExtractionMethod::kAggregated}) {
    for (const int planes : {1, 2, 3, 500}) {
      SCOPED_TRACE(testing::Message() << nameOf(extraction) << ", " << planes);
      KeyframeMapperOptions options = defaults();
      options.extraction.extraction = extraction;
      options.planes.num_planes = planes;
      const KeyframeDepthMap keyframe = map(recording, options);
      EXPECT_EQ(keyframe.votes.total(), (keyframe.events[0] + keyframe.events[1]) * planes);
      const cv::Mat1f& depth = keyframe.map.depth;
      const auto farthest = static_cast<float>(planes == 1 ? 0.7 : 5.0);
      EXPECT_TRUE(cv::checkRange(depth));
      EXPECT_EQ(cv::countNonZero((depth > 0) & ((depth < 0.7F) | (depth > farthest))), 0);
      if (planes != 3) {
        EXPECT_GT(cv::countNonZero(depth), 100);
      }
    }
  }
}

}  // namespace

}  // namespace efm::keyframe_defaults_test

namespace efm::known_points_test {
namespace {

constexpr std::int64_t kStart_ns = 1'700'000'000'000'000'000;
constexpr std::int64_t kDuration_ns = 300'000'000;

CameraModel camera240() {
  return {240, 180, 200, 198, 121.5, 88.2, DistortionModel::kRadtan, {-0.1, 0.05, 0.0005, -0.0003}};
}

/// Three cameras that move to the right by half a metre in total and turn a little.
struct MovingRig {
  Rig rig;
  Trajectory trajectory;

  MovingRig() {
    test::RandomScene random(1);
    for (std::int64_t t_ns = kStart_ns; t_ns <= kStart_ns + kDuration_ns; t_ns += 5'000'000) {
      const double share = static_cast<double>(t_ns - kStart_ns) / kDuration_ns;
      const Eigen::Vector3d axis = Eigen::Vector3d(0.2, 1, 0.3).normalized();
      trajectory.add({t_ns,
                      {Eigen::Quaterniond(Eigen::AngleAxisd(0.1 * (share - 0.5), axis)),
                       {0.5 * (share - 0.5), 0.05 * std::sin(6 * share), 0.1 * share}}});
    }
    rig.cameras.push_back({camera240(), {}, 0});
    rig.cameras.push_back({camera240(), {random.pose(0.01, 0.02).rotation, {0.1, 0, 0}}, 0});
    rig.cameras.push_back({camera240(), {random.pose(0.01, 0.1).rotation, {0.05, -0.1, 0}}, 0});
  }

  Rigid3 T_world_cam(std::size_t camera, std::int64_t t_ns) const {
    return *trajectory.poseAt(t_ns) * rig.cameras[camera].T_rig_cam;
  }
  /// Returns the raw pixel of a point; std::nullopt outside the sensor.
  std::optional<cv::Point> pixelOf(std::size_t camera, std::int64_t t_ns,
                                   const Eigen::Vector3d& p_world) const {
    const CameraModel& model = rig.cameras[camera].model;
    const Eigen::Vector2d raw = model.project(T_world_cam(camera, t_ns).inverse() * p_world);
    const cv::Point pixel(static_cast<int>(std::lround(raw.x())),
                          static_cast<int>(std::lround(raw.y())));
    if (!cv::Rect(0, 0, model.width, model.height).contains(pixel)) return std::nullopt;
    return pixel;
  }
  bool seesAllTheTime(const Eigen::Vector3d& p_world) const {
    for (const std::int64_t t_ns : {kStart_ns, kStart_ns + kDuration_ns}) {
      if (!pixelOf(0, t_ns, p_world) || !pixelOf(1, t_ns, p_world)) return false;
    }
    return true;
  }
  std::vector<Event> eventsOf(std::size_t camera,
                              const std::vector<Eigen::Vector3d>& points_world) const {
    std::vector<Event> seen;
    for (std::int64_t t_ns = kStart_ns; t_ns < kStart_ns + kDuration_ns; t_ns += 2'500'000) {
      for (const Eigen::Vector3d& p_world : points_world) {
        const auto pixel = pixelOf(camera, t_ns, p_world);
        if (!pixel) continue;
        seen.push_back({t_ns, static_cast<std::uint16_t>(pixel->x),
                        static_cast<std::uint16_t>(pixel->y), true});
      }
    }
    return seen;
  }
};

/// A point behind the centre of a pixel of the reference view.
struct KnownPoint {
  cv::Point pixel;
  double depth_m = 0;
};

/// Draws points with a distance from each other that both cameras always see.
std::vector<KnownPoint> randomPoints(const MovingRig& moving, const ReferenceView& view,
                                     const Rigid3& T_world_ref) {
  test::RandomScene random(2);
  std::vector<KnownPoint> points;
  for (int draw = 0; draw < 300; ++draw) {
    const KnownPoint point{{static_cast<int>(random.uniform(6, view.width - 6)),
                            static_cast<int>(random.uniform(6, view.height - 6))},
                           1 / random.uniform(1 / 3.5, 1 / 1.0)};
    bool good = moving.seesAllTheTime(T_world_ref *
                                      view.pointAt(point.pixel.x, point.pixel.y, point.depth_m));
    for (const KnownPoint& other : points) {
      good = good && cv::norm(point.pixel - other.pixel) > 12;
    }
    if (good && points.size() < 30) points.push_back(point);
  }
  return points;
}

/// Planes are 1.7 pixels of parallax apart over the whole motion: rounding of events to pixels does
/// not move a peak by a plane.
constexpr int kPlanes = 60;
const double kPlaneStep = (1 / 0.8 - 1 / 4.0) / (kPlanes - 1);

struct ViewCase {
  std::string name;
  std::function<void(KeyframeMapperOptions&)> change;
  ReferenceTime reference = ReferenceTime::kMiddle;
};

std::vector<ViewCase> viewCases() {
  return {
      {"the camera's own view", [](auto&) {}},
      {"at the end", [](auto&) {}, ReferenceTime::kEnd},
      {"wider",
       [](auto& o) {
         o.view.fov_deg = 90;
         o.view.width = 400;
         o.view.height = 300;
       }},
      {"finer", [](auto& o) { o.view.width = 360; }},
      {"shifted",
       [](auto& o) {
         o.view.offset_m = {0.1, -0.05, -0.3};
       }},
      {"another, unselected camera's", [](auto& o) { o.reference_camera = 2; }},
      {"all of it",
       [](auto& o) {
         o.reference_camera = 2;
         o.view.fov_deg = 80;
         o.view.width = 380;
         o.view.height = 280;
         o.view.offset_m = {0.05, 0, -0.2};
       },
       ReferenceTime::kEnd},
      {"linear planes", [](auto& o) { o.planes.spacing = PlaneSpacing::kLinear; }},
      {"500 planes", [](auto& o) { o.planes.num_planes = 500; }},
      {"four shifted sub-intervals",
       [](auto& o) {
         o.subintervals.count = 4;
         o.subintervals.shuffle = SubintervalShuffle::kShift;
       }},
  };
}

struct Found {
  std::vector<KnownPoint> points;
  KeyframeDepthMap keyframe;
};

/// Maps known points. The reference view and its pose are computed independently of the mapper.
Found mapPoints(const ViewCase& view_case) {
  const MovingRig moving;
  KeyframeMapperOptions options;
  options.planes = {0.8, 4.0, kPlanes, PlaneSpacing::kInverse};
  // No median is used: in pixels beside an isolated point, its rays cross a little nearer or
  // farther than the point.
  options.extraction.median_size = 1;
  options.extraction.min_probability = 0;  // lone points are no edges
  view_case.change(options);
  const Window window = windowOf(kStart_ns, kStart_ns + kDuration_ns, view_case.reference);
  const auto camera = static_cast<std::size_t>(options.reference_camera);
  Rigid3 T_world_ref = moving.T_world_cam(camera, view_case.reference == ReferenceTime::kEnd
                                                      ? kStart_ns + kDuration_ns
                                                      : kStart_ns + kDuration_ns / 2);
  T_world_ref.translation += T_world_ref.rotation * options.view.offset_m;
  const ReferenceView view = makeReferenceView(moving.rig.cameras[camera].model, options.view);

  Found found{randomPoints(moving, view, T_world_ref), {}};
  std::vector<Eigen::Vector3d> points_world;
  for (const KnownPoint& point : found.points) {
    points_world.push_back(T_world_ref * view.pointAt(point.pixel.x, point.pixel.y, point.depth_m));
  }
  std::vector<std::vector<Event>> events;
  for (std::size_t c = 0; c < 3; ++c) events.push_back(moving.eventsOf(c, points_world));
  KeyframeMapper mapper(moving.rig, {0, 1}, options);
  const auto keyframe = mapper.map(window, {events.begin(), events.end()}, moving.trajectory);
  EXPECT_TRUE(keyframe);
  found.keyframe = keyframe.value_or(KeyframeDepthMap());
  EXPECT_LT((found.keyframe.T_world_ref.translation - T_world_ref.translation).norm(), 1e-12);
  return found;
}

TEST(KnownPoints, AreFoundInAnyReferenceView) {
  for (const ViewCase& view_case : viewCases()) {
    const Found found = mapPoints(view_case);
    EXPECT_GE(found.points.size(), 15U) << view_case.name;
    for (const KnownPoint& point : found.points) {
      const double depth_m = found.keyframe.map.depth(point.pixel);
      ASSERT_GT(depth_m, 0) << view_case.name << ": nothing at " << point.pixel;
      EXPECT_NEAR(1 / depth_m, 1 / point.depth_m, kPlaneStep) << view_case.name << point.pixel;
    }
  }
}

TEST(KnownPoints, HaveErrorsWithinTheirVariance) {
  double squared_errors = 0;
  double variances = 0;
  const Found found = mapPoints(viewCases().front());
  for (const KnownPoint& point : found.points) {
    const double variance = found.keyframe.map.variance(point.pixel);
    EXPECT_TRUE(std::isfinite(variance)) << "no point lies at the limits";
    squared_errors += std::pow(1 / found.keyframe.map.depth(point.pixel) - 1 / point.depth_m, 2);
    variances += variance;
  }
  // The errors of these events are rounding only: real events have larger errors.
  EXPECT_GT(variances, squared_errors);
  EXPECT_LT(variances, 100 * squared_errors);
}

}  // namespace

}  // namespace efm::known_points_test
