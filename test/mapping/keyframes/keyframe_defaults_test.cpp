// SPDX-License-Identifier: BSD-3-Clause
// The keyframe mapper as it comes: split fusion and aggregated depth.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>
#include <tbb/task_scheduler_observer.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <opencv2/core.hpp>

#include "mapping/keyframes/keyframe_mapper.h"
#include "test/mapping/depth/same_image.h"
#include "test/mapping/kernels/fast_kernels.h"
#include "test/mapping/keyframes/random_scene.h"
#include "test/mapping/motion/moving_edges.h"

namespace efm::keyframe_defaults_test {
namespace {

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

template <typename Recording>
KeyframeDepthMap map(const Recording& recording, const std::vector<int>& cameras,
                     const KeyframeMapperOptions& options) {
  KeyframeMapper mapper(recording.rig, cameras, options);
  const auto keyframe = mapper.map(Recording::kWindow, recording.spans(), recording.trajectory);
  EXPECT_TRUE(keyframe);
  return keyframe.value_or(KeyframeDepthMap());
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

/// Counts the workers that come to the thread that it is made on.
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
  // Then the slices of the single remaining camera are fused like cameras.
  KeyframeMapperOptions options = defaults();
  options.exclude_silent = true;
  options.camera_maps = true;
  const KeyframeDepthMap excluded = map(recording, options);
  options.split.time_slices = 2;  // as of the two that were selected
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
  // The second camera sees nothing in the third and fourth of six parts.
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
