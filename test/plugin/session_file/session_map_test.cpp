// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/playback/session_map.h"

#include <gmock/gmock.h>

#include <cmath>
#include <random>
#include <vector>

#include "event_fusion/engine.h"
#include "maps/cloud/keyframe_cloud.h"
#include "plugin/playback/session_export.h"
#include "test/maps/cloud/cloud_points.h"
#include "test/plugin/temporary_folder.h"

namespace efm {
namespace {

using testing::HasSubstr;

class SessionMapTest : public TemporaryFolder {
 protected:
  static constexpr int kKeyframes = 40;
  /// Keyframes whose depths are not probable.
  static bool isBad(int k) { return k % 3 == 1 && k > 3; }

  /// Writes a session of a wavy wall, along which the camera moves. Some keyframes are improbable.
  /// @param world where it lies.
  std::filesystem::path wall(const Eigen::Vector3d& world) const {
    const std::filesystem::path file = folder() / "wall.mcap";
    SessionWriter session(
        file,
        {{"options", {{"map", {{"voxel_size_m", 0.01}}}, {"depth", {{"min_probability", 0.1}}}}}});
    std::mt19937 random(1);
    std::uniform_real_distribution<float> noise(-0.02F, 0.02F);
    for (int k = 0; k < kKeyframes; ++k) {
      KeyframeDepthMap keyframe;
      keyframe.window = {k * 10, k * 10 + 10, k * 10 + 5};
      keyframe.T_world_ref.translation = world + Eigen::Vector3d(0.1 * k, 0, 0);
      keyframe.T_odom_ref = keyframe.T_world_ref;
      keyframe.view = {173, 130, 110, 110, 86, 65};
      const cv::Size size(keyframe.view.width, keyframe.view.height);
      keyframe.map.depth = cv::Mat1f(size);
      keyframe.map.confidence = cv::Mat1f(size, 3.0F);
      keyframe.map.variance = cv::Mat1f(size, 1e-4F);
      keyframe.map.probability = cv::Mat1f(size, isBad(k) ? 0.2F : 0.95F);
      for (int y = 0; y < size.height; ++y) {
        for (int x = 0; x < size.width; ++x) {
          keyframe.map.depth(y, x) =
              2 + 0.3F * std::sin(0.1F * static_cast<float>(x + k)) + noise(random);
        }
      }
      session.add(keyframe);
    }
    session.finish("{}");
    return file;
  }
};

TEST_F(SessionMapTest, SlabsAreTheMapOfAllKeyframesAtOnceWithoutTheBadOnes) {
  for (const auto& [far_m, consistency] : {std::pair{0.0, "visibility"}, {5.4e6, "none"}}) {
    {
      SessionExport what;
      what.sessions = {wall({far_m / 12, far_m, 100})};
      what.sets = {"map.min_keyframe_quality=0.5", std::string("map.consistency=") + consistency};
      const SessionMap map(what);
      std::vector<CloudPoint> points;
      CloudOrigin origin(0.01);
      int slabs = 0;
      const std::set<std::size_t> left_out =
          map.visitSlabs(100'000, {}, [&](const std::vector<CloudPoint>& slab) {
            points.insert(points.end(), slab.begin(), slab.end());
            origin.add(slab);
            ++slabs;
          });
      EXPECT_GT(slabs, 2);
      for (int k = 0; k < kKeyframes; ++k) {
        EXPECT_EQ(left_out.count(static_cast<std::size_t>(k)) > 0, isBad(k)) << k;
      }

      GlobalCloud naive(map.options().cloud);  // nothing is finalized
      for (std::size_t k = 0; k < kKeyframes; ++k) {
        const bool has_points = left_out.count(k) == 0;
        const Rigid3& T_world_ref = map.trajectory()[k].T_world_rig;
        naive.insert(k,
                     has_points ? pointsInWorld(viewPoints(map.keyframe(k)), T_world_ref)
                                : std::vector<CloudPoint>(),
                     T_world_ref);
      }
      EXPECT_TRUE(test::sameBits(*mapCloudAt(origin.origin(), points), *naive.points()))
          << consistency << " at " << far_m;
      const ExportedMap exported = exportSession(map, folder() / "map.pcd");
      EXPECT_EQ(exported.hash, mapHash(*naive.points()));
      EXPECT_EQ(exported.points, points.size());
    }
  }
}

TEST_F(SessionMapTest, ASessionIsNeverDamaged) {
  const std::filesystem::path file = wall({0, 0, 0});
  SessionExport what;
  what.sessions = {file};
  const SessionMap map(what);
  std::filesystem::create_symlink(file, folder() / "other.mcap");
  const auto message_of = [](const auto& call) -> std::string {
    try {
      call();
    } catch (const std::exception& error) {
      return error.what();
    }
    return "no error";
  };
  for (const char* name : {"wall.mcap", "other.mcap"}) {
    EXPECT_THAT(message_of([&] { exportSession(map, folder() / name); }),
                HasSubstr("the session itself"));
  }
  EXPECT_THAT(message_of([&] { map.storePoses(); }),
              HasSubstr("0 poses: expected one for each of"));
  {
    const SessionWriter other(SessionFile(file), kKeyframes);
    EXPECT_THAT(message_of([&] { SessionWriter::addGeneration(file, map.trajectory()); }),
                HasSubstr("another program writes it"));
  }
  // A part without points is a session, but no map.
  what.limits = {0, 10};
  what.sets = {"map.min_keyframes=9"};
  const SessionMap part(what);
  EXPECT_THAT(message_of([&] { exportSession(part, folder() / "part.ply"); }),
              HasSubstr("there is no point: 1 keyframes are chosen"));
  EXPECT_EQ(exportSession(part, folder() / "part.mcap").points, 0U);
  EXPECT_EQ(SessionFile(folder() / "part.mcap").keyframes(), 1U);
}

}  // namespace
}  // namespace efm
