// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/session_file/session_file.h"

#include <gmock/gmock.h>
#include <sys/resource.h>
#include <sys/wait.h>

#include <csignal>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "event_fusion/engine.h"
#include "plugin/recordings/writers/recording_writer.h"
#include "plugin/session_file/keyframe_record.h"
#include "plugin/session_file/run_record.h"
#include "test/paths.h"
#include "test/plugin/temporary_folder.h"

namespace efm {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;
using testing::StartsWith;
using Json = nlohmann::ordered_json;

constexpr int kKeyframes = 4;
const Json kRun = {
    {"version", "1.2.3"}, {"options", Json::object()}, {"given", {{"dsi", {{"num_planes", 100}}}}}};

class Draws {
 public:
  explicit Draws(unsigned seed) : random_(seed) {}
  double operator()(double low, double high) {
    return std::uniform_real_distribution<>(low, high)(random_);
  }
  int below(int end) { return std::uniform_int_distribution<>(0, end - 1)(random_); }
  Rigid3 pose() {
    const Eigen::Quaterniond q(operator()(-1, 1), operator()(-1, 1), operator()(-1, 1), 0.5);
    return {q.normalized(), {operator()(-1e6, 1e6), operator()(-9, 9), operator()(-9, 9)}};
  }
  DepthMap map(cv::Size size, bool has_probability) {
    DepthMap map;
    for (cv::Mat1f* image : {&map.depth, &map.confidence, &map.variance, &map.probability}) {
      if (image != &map.probability || has_probability) *image = cv::Mat1f::zeros(size);
    }
    for (int i = 0; i < 9; ++i) {
      const cv::Point pixel(below(size.width), below(size.height));
      map.depth(pixel) = static_cast<float>(operator()(0.1, 99));
      map.confidence(pixel) = static_cast<float>(operator()(0.1, 99));
      map.variance(pixel) =
          i == 0 ? std::numeric_limits<float>::infinity() : static_cast<float>(operator()(0, 1));
      if (has_probability) map.probability(pixel) = static_cast<float>(operator()(0, 1));
    }
    return map;
  }

 private:
  std::mt19937 random_;
};

/// Returns a keyframe with all that can be there, or at odd numbers with little.
KeyframeDepthMap keyframeOf(int number) {
  const bool is_rich = number % 2 == 0;
  Draws draw(static_cast<unsigned>(number));
  const cv::Size size(31, 17);
  KeyframeDepthMap keyframe;
  const std::int64_t t_ns = is_rich ? 1'700'000'000'123'456'789 + number : -5'000'000'001;
  keyframe.window = {t_ns - 7, t_ns + 11, t_ns};
  keyframe.T_world_ref = draw.pose();
  keyframe.T_odom_ref = draw.pose();
  keyframe.T_rig_ref = draw.pose();
  keyframe.view = {size.width, size.height, draw(1, 99), draw(1, 99), draw(1, 20), draw(1, 20)};
  keyframe.planes = {draw(0.1, 1), draw(2, 99), 77 + number,
                     is_rich ? PlaneSpacing::kLinear : PlaneSpacing::kInverse};
  keyframe.map = draw.map(size, is_rich);
  keyframe.map.pixels = {5, 4, 3, 2, static_cast<std::uint64_t>(number)};
  keyframe.parallax_px_m = draw(0, 9);
  keyframe.max_confidence = draw(0, 99);
  keyframe.sharpness_gain = draw(1, 2);
  keyframe.blur_watch = {{}, number};
  keyframe.events = {1, static_cast<std::uint64_t>(number) << 40};
  keyframe.without_pose = 6;
  keyframe.outside_lens = 7;
  keyframe.over_budget = 8;
  keyframe.votes = {9, 10, 11, 12};
  keyframe.silent_subintervals = 13;
  if (!is_rich) return keyframe;
  keyframe.motion_correction = MotionCorrection{draw(0.01, 1), 1, {}};
  for (int i = 0; i < 3; ++i) {
    keyframe.motion_correction->knots.emplace_back(Vector6d::Constant(draw(-1, 1)));
  }
  keyframe.blur_px = draw(0, 1);
  keyframe.blur_watch.last_px = {draw(0, 1), draw(0, 1)};
  keyframe.pose_noise = PoseNoise{draw(0, 1), draw(0, 1)};
  keyframe.after_stop = true;
  keyframe.kernel = "sse4";
  keyframe.silent_cameras = {1};
  keyframe.camera_maps = {{2, draw.map(size, true)}, {0, draw.map(size, true)}};
  keyframe.view_events = cv::Mat_<cv::Vec2i>(size, cv::Vec2i());
  keyframe.view_events(3, 5) = {2, 300};
  return keyframe;
}

void expectSame(const cv::Mat& a, const cv::Mat& b) {
  ASSERT_EQ(a.size(), b.size());
  EXPECT_TRUE(a.empty() || cv::norm(a, b, cv::NORM_L1) == 0);
}

void expectSame(const DepthMap& a, const DepthMap& b) {
  expectSame(a.depth, b.depth);
  expectSame(a.confidence, b.confidence);
  expectSame(1 / (1 + a.variance), 1 / (1 + b.variance));  // one is infinite
  expectSame(a.probability, b.probability);
}

/// Compares all members but `evidence` and `event_images`, which are not stored.
void expectSame(const KeyframeDepthMap& a, const KeyframeDepthMap& b) {
  EXPECT_EQ(a.window.t0_ns, b.window.t0_ns);
  EXPECT_EQ(a.window.t1_ns, b.window.t1_ns);
  EXPECT_EQ(a.window.t_ref_ns, b.window.t_ref_ns);
  EXPECT_TRUE(isSame(a.T_world_ref, b.T_world_ref));
  EXPECT_TRUE(isSame(a.T_odom_ref, b.T_odom_ref));
  EXPECT_TRUE(isSame(a.T_rig_ref, b.T_rig_ref));
  EXPECT_EQ(a.view.fx + 3 * a.view.fy + 5 * a.view.cx + 7 * a.view.cy,
            b.view.fx + 3 * b.view.fy + 5 * b.view.cx + 7 * b.view.cy);
  EXPECT_EQ(a.planes.min_depth_m, b.planes.min_depth_m);
  EXPECT_EQ(a.planes.max_depth_m, b.planes.max_depth_m);
  EXPECT_EQ(a.planes.num_planes, b.planes.num_planes);
  EXPECT_EQ(a.planes.spacing, b.planes.spacing);
  expectSame(a.map, b.map);
  EXPECT_EQ(a.map.pixels.candidates, b.map.pixels.candidates);
  EXPECT_EQ(a.map.pixels.at_nearest, b.map.pixels.at_nearest);
  EXPECT_EQ(a.map.pixels.at_farthest, b.map.pixels.at_farthest);
  EXPECT_EQ(a.map.pixels.ambiguous, b.map.pixels.ambiguous);
  EXPECT_EQ(a.map.pixels.neighbours, b.map.pixels.neighbours);
  EXPECT_EQ(a.parallax_px_m, b.parallax_px_m);
  EXPECT_EQ(a.max_confidence, b.max_confidence);
  ASSERT_EQ(a.motion_correction.has_value(), b.motion_correction.has_value());
  if (a.motion_correction) {
    EXPECT_EQ(a.motion_correction->spacing_s, b.motion_correction->spacing_s);
    EXPECT_EQ(a.motion_correction->reference, b.motion_correction->reference);
    EXPECT_EQ(a.motion_correction->knots, b.motion_correction->knots);
    EXPECT_EQ(a.motion_correction->walk_m, b.motion_correction->walk_m);
    EXPECT_EQ(a.motion_correction->walk_rad, b.motion_correction->walk_rad);
  }
  EXPECT_EQ(a.blur_px, b.blur_px);
  EXPECT_EQ(a.sharpness_gain, b.sharpness_gain);
  EXPECT_EQ(a.blur_watch.last_px, b.blur_watch.last_px);
  EXPECT_EQ(a.blur_watch.since_look, b.blur_watch.since_look);
  ASSERT_EQ(a.pose_noise.has_value(), b.pose_noise.has_value());
  if (a.pose_noise) {
    EXPECT_EQ(a.pose_noise->noise_m, b.pose_noise->noise_m);
    EXPECT_EQ(a.pose_noise->noise_rad, b.pose_noise->noise_rad);
  }
  EXPECT_EQ(a.after_stop, b.after_stop);
  EXPECT_EQ(a.kernel, b.kernel);
  EXPECT_EQ(a.events, b.events);
  EXPECT_EQ(a.without_pose, b.without_pose);
  EXPECT_EQ(a.outside_lens, b.outside_lens);
  EXPECT_EQ(a.over_budget, b.over_budget);
  EXPECT_EQ(a.votes.cast, b.votes.cast);
  EXPECT_EQ(a.votes.interpolated, b.votes.interpolated);
  EXPECT_EQ(a.votes.outside_view, b.votes.outside_view);
  EXPECT_EQ(a.votes.behind_camera, b.votes.behind_camera);
  EXPECT_EQ(a.silent_cameras, b.silent_cameras);
  EXPECT_EQ(a.silent_subintervals, b.silent_subintervals);
  ASSERT_EQ(a.camera_maps.size(), b.camera_maps.size());
  for (std::size_t i = 0; i < a.camera_maps.size(); ++i) {
    EXPECT_EQ(a.camera_maps[i].camera, b.camera_maps[i].camera);
    expectSame(a.camera_maps[i].map, b.camera_maps[i].map);
  }
  expectSame(a.view_events, b.view_events);
}

/// Tests a small session file.
class SessionFileTest : public TemporaryFolder {
 protected:
  static void write(SessionWriter& writer, int from) {
    for (int i = from; i < kKeyframes; ++i) writer.add(keyframeOf(i));
    std::vector<StampedPose> poses;
    for (int i = 0; i < kKeyframes; ++i) poses.push_back({i, Draws(90U + i).pose()});
    writer.addPoses(poses);
    writer.finish("{\"points\": 7}\n");
  }
  std::string wholeBytes() const {
    const fs::path file = folder() / "whole.mcap";
    SessionWriter writer(file, kRun);
    write(writer, 0);
    return readText(file);
  }
  fs::path with(const std::string& bytes) const {
    writeFile(folder() / "session.mcap", bytes);
    return folder() / "session.mcap";
  }
};

TEST_F(SessionFileTest, EachKeyframeComesBackExactly) {
  const SessionFile session(with(wholeBytes()));
  ASSERT_EQ(session.keyframes(), std::size_t{kKeyframes});
  for (int i = 0; i < kKeyframes; ++i) {
    SCOPED_TRACE(i);
    expectSame(session.keyframe(static_cast<std::size_t>(i)), keyframeOf(i));
    EXPECT_TRUE(isSame(session.poses(false).at(i).T_world_rig, keyframeOf(i).T_odom_ref));
    EXPECT_TRUE(isSame(session.poses(true).at(i).T_world_rig, Draws(90U + i).pose()));
    EXPECT_EQ(session.poses(true).at(i).t_ns, keyframeOf(i).window.t_ref_ns);
  }
  EXPECT_EQ(session.report(), "{\"points\": 7}\n");
  EXPECT_EQ(session.damage(), "");
  EXPECT_EQ(session.run().at("session"), 1);
  EXPECT_EQ(session.run().at("version"), "1.2.3");
}

TEST_F(SessionFileTest, CutAtAnyByteItHasTheKeyframesBeforeAndGoesOnToTheSameBytes) {
  const std::string whole = wholeBytes();
  ASSERT_LT(whole.size(), 50'000U);
  std::size_t before = 0;
  for (std::size_t size = 0; size <= whole.size(); ++size) {
    const fs::path file = with(whole.substr(0, size));
    std::size_t keyframes = 0;
    bool has_run = false;
    {
      const SessionFile session(file);
      keyframes = session.keyframes();
      has_run = !session.run().empty();
      if (keyframes > 0) {
        EXPECT_EQ(session.keyframe(keyframes - 1).events,
                  keyframeOf(static_cast<int>(keyframes) - 1).events);
      }
      EXPECT_TRUE(!session.damage().empty() || !session.report().empty()) << size;
      if (!has_run || size % 61 != 0) continue;
      SessionWriter writer(session, keyframes);
      write(writer, static_cast<int>(keyframes));
      ASSERT_EQ(readText(file), whole) << size;
    }
    EXPECT_GE(keyframes, before) << size;
    before = keyframes;
  }
  EXPECT_EQ(before, std::size_t{kKeyframes});
  for (std::size_t kept = 0; kept <= kKeyframes; ++kept) {  // of a whole file
    const fs::path file = with(whole);
    SessionWriter writer(SessionFile(file), kept);
    write(writer, static_cast<int>(kept));
    EXPECT_EQ(readText(file), whole) << kept;
  }
}

TEST_F(SessionFileTest, ADamagedByteChangesNoKeyframe) {
  const std::string whole = wholeBytes();
  std::vector<std::string> messages;
  for (int i = 0; i < kKeyframes; ++i) messages.push_back(keyframeMessage(keyframeOf(i)));
  for (std::size_t at = 0; at < whole.size(); at += 3) {
    for (const bool has_index : {true, false}) {
      std::string bytes = whole.substr(0, has_index ? whole.size() : whole.size() - 9);
      if (at >= bytes.size()) continue;
      bytes[at] = static_cast<char>(bytes[at] ^ (1 << at % 8));
      const fs::path file = with(bytes);
      try {
        const SessionFile session(file);
        for (std::size_t i = 0; i < session.keyframes(); ++i) {
          const std::string read = keyframeMessage(session.keyframe(i));
          EXPECT_EQ(std::count(messages.begin(), messages.end(), read), 1) << at;
        }
      } catch (const std::runtime_error& error) {
        EXPECT_THAT(error.what(), StartsWith(file.string() + ": ")) << at;
      }
    }
  }
}

TEST_F(SessionFileTest, AFullDiskIsAnErrorAndKeepsWhatIsStored) {
  const fs::path file = folder() / "session.mcap";
  const pid_t child = fork();
  if (child == 0) {
    std::signal(SIGXFSZ, SIG_IGN);
    SessionWriter writer(file, kRun);
    writer.add(keyframeOf(0));
    const rlimit limit{writer.bytes() + 1000, writer.bytes() + 1000};
    setrlimit(RLIMIT_FSIZE, &limit);
    const std::string error = errorOf([&] { writer.add(keyframeOf(2)); });
    std::ofstream(folder() / "error.txt") << error;
    _exit(error.find("cannot write " + file.string() + ": ") == 0 ? 0 : 1);
  }
  int status = -1;
  waitpid(child, &status, 0);
  EXPECT_EQ(status, 0) << readText(folder() / "error.txt");
  const SessionFile session(file);
  EXPECT_EQ(session.keyframes(), 1U);
  expectSame(session.keyframe(0), keyframeOf(0));
  EXPECT_THAT(session.damage(), HasSubstr("the run did not end"));
}

TEST_F(SessionFileTest, OtherFilesAreNamed) {
  const auto message = [](const fs::path& file) {
    return messageOf([&] { const SessionFile session(file); });
  };
  const fs::path missing = folder() / "missing.mcap";
  EXPECT_THAT(message(missing), AllOf(HasSubstr("cannot read "), HasSubstr(missing.string())));
  EXPECT_THAT(message(with("text")), HasSubstr("no session file: expected the magic word of MCAP"));
  CameraModel model;
  model.width = model.height = 9;
  const auto recording = openMcapWriter(folder() / "recording.mcap", {{{model, {}, 0}}});
  recording->addPose({1, {}});
  recording->close();
  EXPECT_THAT(message(folder() / "recording.mcap"),
              HasSubstr("no session file: expected the topic /efm/run"));
  const fs::path newer = folder() / "newer.mcap";
  const auto file = std::make_unique<FileHandle>(newer, O_RDWR | O_CREAT);
  McapFile mcap({{"std_msgs/msg/String", ros_schema::kString, "/efm/run"}},
                [&](std::uint64_t at, const std::string& bytes) { file->append(at, bytes); });
  mcap.begin();
  mcap.add(1, 0, textMessage("{\"session\": 2, \"options\": {}}"));
  mcap.end();
  EXPECT_THAT(message(newer), HasSubstr(newer.string() + ": a session of version 2: expected"));
}

TEST_F(SessionFileTest, AFileOfVersion1StaysReadable) {
  const fs::path fixture = EFM_SOURCE_DIR "/test/plugin/session_file/version1.mcap";
  if (std::getenv("EFM_WRITE_FIXTURE") != nullptr) writeFile(fixture, wholeBytes());
  const SessionFile session(fixture);
  ASSERT_EQ(session.keyframes(), std::size_t{kKeyframes});
  for (int i = 0; i < kKeyframes; ++i) {
    expectSame(session.keyframe(static_cast<std::size_t>(i)), keyframeOf(i));
  }
  EXPECT_EQ(session.generations(), 1U);
  EXPECT_EQ(session.report(), "{\"points\": 7}\n");
}

TEST_F(SessionFileTest, DifferencesOfRunsAreNamed) {
  const auto run = [&](const fs::path& file) {
    return Json{
        {"version", "1"},
        {"given", {{"dsi", {{"max_depth_m", 8.0}}}, {"performance", {{"threads", "auto"}}}}},
        {"limits", {{"t0", nullptr}, {"t1", "2.5"}}},
        {"files", fingerprintOf({file})}};
  };
  writeFile(folder() / "a.raw", std::string(3'000'000, 'x'));
  const Json before = run(folder() / "a.raw");
  EXPECT_EQ(differencesOf(before, before), std::vector<std::string>());
  Json now = before;
  now["given"]["performance"]["threads"] = 3;
  EXPECT_EQ(differencesOf(before, now), std::vector<std::string>()) << "the result is the same";
  now["given"]["dsi"]["max_depth_m"] = 5.0;
  now["limits"]["t0"] = "1.5";
  EXPECT_THAT(differencesOf(before, now),
              testing::ElementsAre("dsi.max_depth_m was 8.0, now 5.0",
                                   "limits.t0 was not given, now \"1.5\""));
  std::string other(3'000'000, 'x');
  other.back() = 'y';
  writeFile(folder() / "b.raw", other);
  EXPECT_THAT(differencesOf(before, run(folder() / "b.raw")),
              testing::ElementsAre("the recording's file \"b.raw\" has other content"));
  writeFile(folder() / "c.raw", "short");
  EXPECT_THAT(differencesOf(before, run(folder() / "c.raw")),
              testing::ElementsAre("the recording's file \"c.raw\" had 3000000 bytes, now 5"));
}

TEST_F(SessionFileTest, TheHashDependsOnThePointsAlone) {
  MapCloud cloud;
  for (int i = 0; i < 9; ++i) {
    MapPoint point;
    point.x = static_cast<float>(i % 3);
    point.intensity = static_cast<float>(i);
    cloud.push_back(point);
  }
  const std::string hash = mapHash(cloud);
  EXPECT_EQ(hash.size(), 64U);
  std::reverse(cloud.begin(), cloud.end());
  EXPECT_EQ(mapHash(cloud), hash);
  cloud.sensor_origin_ = {-1, 0, 0, 0};
  for (MapPoint& point : cloud) point.x += 1;
  EXPECT_EQ(mapHash(cloud), hash) << "in the world they are the same";
  cloud.front().sigma = 0.5F;
  EXPECT_NE(mapHash(cloud), hash);
  // The SHA-256 of nothing.
  MapHasher in_parts;
  std::sort(cloud.begin(), cloud.end(),
            [](const MapPoint& a, const MapPoint& b) { return a.x < b.x; });
  for (std::size_t begin = 0; begin < cloud.size(); begin += 2) {
    MapCloud part;
    part.sensor_origin_ = cloud.sensor_origin_;
    for (std::size_t i = begin; i < std::min(begin + 2, cloud.size()); ++i)
      part.push_back(cloud[i]);
    in_parts.add(part);
  }
  EXPECT_EQ(in_parts.finish(), mapHash(cloud));
  EXPECT_EQ(mapHash({}), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
}

}  // namespace
}  // namespace efm
