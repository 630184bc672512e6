// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/recordings/open/joined_recording.h"

#include <fmt/format.h>
#include <gmock/gmock.h>

#include "mapping/geometry/timestamp.h"
#include "plugin/recordings/text/event_text.h"
#include "test/plugin/temporary_folder.h"

namespace efm {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;

constexpr std::int64_t kMs = 1'000'000;

/// Returns in short: the sample's label, its time in ms and, for a packet, its number of events.
std::string shortly(const Sample& sample) {
  if (const auto* pose = std::get_if<PoseSample>(&sample)) {
    return pose->source.label + "@" + std::to_string(pose->t_ns / kMs);
  }
  if (const auto* other = std::get_if<OtherSample>(&sample)) return other->type;
  const auto& packet = std::get<EventPacket>(sample);
  return "cam" + std::to_string(packet.camera) + "@" +
         std::to_string(packet.events.front().t_ns / kMs) + ":" +
         std::to_string(packet.events.size());
}

std::vector<Sample> readAll(Recording& recording) {
  std::vector<Sample> samples;
  while (auto sample = recording.next()) samples.push_back(std::move(*sample));
  EXPECT_FALSE(recording.next());
  return samples;
}

std::vector<std::string> shortly(const std::vector<Sample>& samples) {
  std::vector<std::string> texts;
  for (const Sample& sample : samples) texts.push_back(shortly(sample));
  return texts;
}

/// Returns the samples before the error.
std::vector<std::string> readToError(Recording& recording, std::string& error) {
  std::vector<std::string> given;
  error = errorOf([&] {
    while (const auto sample = recording.next()) given.push_back(shortly(*sample));
  });
  return given;
}

class ListedOthers : public OtherStream {
 public:
  explicit ListedOthers(std::vector<OtherSample> others) : others_(std::move(others)) {}
  std::optional<OtherSample> next() override {
    return at_ < others_.size() ? std::optional(others_[at_++]) : std::nullopt;
  }

 private:
  std::vector<OtherSample> others_;
  std::size_t at_ = 0;
};

class JoinedRecordingTest : public TemporaryFolder {
 protected:
  /// @param texts each camera's events. Camera n is n metres to the right; its clock is n * 100 ns
  /// behind.
  JoinedParts parts(const std::vector<std::string>& texts, std::vector<PoseSample> poses = {}) {
    JoinedParts parts;
    for (std::size_t n = 0; n < texts.size(); ++n) {
      RigCamera& camera = parts.rig.cameras.emplace_back();
      camera.model.width = 240;
      camera.model.height = 180;
      camera.model.fx = camera.model.fy = 200 + static_cast<double>(n);
      camera.T_rig_cam.translation.x() = static_cast<double>(n);
      camera.time_offset_ns = static_cast<std::int64_t>(n) * 100;
      const std::filesystem::path file = folder() / ("cam" + std::to_string(n)) / "events.txt";
      writeFile(file, texts[n]);
      parts.cameras.emplace_back(std::make_unique<EventTextStream>(file), CameraSize{240, 180});
    }
    parts.poses = std::move(poses);
    return parts;
  }

  std::unique_ptr<Recording> open(const std::vector<std::string>& texts,
                                  std::vector<PoseSample> poses = {}) {
    return join(parts(texts, std::move(poses)), {});
  }
};

PoseSample poseAt(std::int64_t t_ns, const std::string& label = "pose") {
  PoseSample pose;
  pose.source.label = label;
  pose.t_ns = t_ns;
  pose.T_world_body.translation = {static_cast<double>(t_ns), 2, 3};
  return pose;
}

TEST_F(JoinedRecordingTest, IsInTheOrderOfTimeWithPosesBeforePacketsOfTheSameTime) {
  const auto recording = open(
      {"0.012 0 0 0\n0.018 0 0 0\n0.031 0 0 0\n", "0.015 0 0 0\n0.022 0 0 0\n"},
      {poseAt(31 * kMs), poseAt(5 * kMs), poseAt(12 * kMs), poseAt(16 * kMs), poseAt(90 * kMs)});
  EXPECT_THAT(shortly(readAll(*recording)),
              ElementsAre("pose@5", "pose@12", "cam0@12:2", "cam1@15:1", "pose@16", "cam1@22:1",
                          "pose@31", "cam0@31:1", "pose@90"));
}

TEST_F(JoinedRecordingTest, APacketHasItsCameraAndItsEvents) {
  const auto recording =
      open({"0.1 1 2 0\n", "0.100000049 3 4 1\n0.099 5 6 0\n", "0.205 0 0 0\n0.204 0 0 0\n"});
  const std::vector<Event> expected[] = {{{99'000'000, 5, 6, false}}, {{100'000'049, 3, 4, true}}};
  const auto samples = readAll(*recording);
  ASSERT_EQ(samples.size(), 4U);
  for (const std::size_t i : {0, 2}) {
    const auto& packet = std::get<EventPacket>(samples[i]);
    EXPECT_EQ(packet.camera, 1);
    EXPECT_EQ(packet.events.all(), expected[i / 2]);
  }
  const std::vector<RecordedCamera> cameras = recording->cameras();
  ASSERT_EQ(cameras.size(), 3U);
  EXPECT_EQ(cameras[1].label, "cam1");
  EXPECT_EQ(cameras[1].first_ns, 99'000'000);
  EXPECT_EQ(recording->counts().sorted_events, 2U);
  EXPECT_THAT(errorOf([&] {
                open({"", "\n"}, {poseAt(0)});
              }),
              AllOf(HasSubstr("cam0/events.txt, "), HasSubstr("cam1/events.txt: no events")));
}

TEST_F(JoinedRecordingTest, DamageOfThePosesComesLast) {
  JoinedParts torn =
      parts({"0.012 0 0 0\n0.023 0 0 0\n"}, {poseAt(12 * kMs), poseAt(50 * kMs), poseAt(7 * kMs)});
  torn.poses_damage = "torn";
  const auto recording = join(std::move(torn), {});
  std::string error;
  EXPECT_THAT(readToError(*recording, error),
              ElementsAre("pose@7", "pose@12", "cam0@12:1", "cam0@23:1", "pose@50"));
  EXPECT_EQ(error, "torn");
  EXPECT_EQ(recording->position(), "the poses");
}

TEST_F(JoinedRecordingTest, LatencyDelaysPosesBehindTheEventsOfItsTime) {
  JoinedParts late = parts({"0.012 0 0 0\n0.023 0 0 0\n0.034 0 0 0\n"},
                           {poseAt(5 * kMs), poseAt(12 * kMs), poseAt(30 * kMs)});
  late.latency_ns = 11 * kMs;
  EXPECT_THAT(shortly(readAll(*join(std::move(late), {}))),
              ElementsAre("cam0@12:1", "pose@5", "pose@12", "cam0@23:1", "cam0@34:1", "pose@30"));
}

TEST_F(JoinedRecordingTest, AnIntervalHasItsEventsAndOfEachSourceAPoseOnEitherSide) {
  const std::vector<std::string> events = {"0.012 0 0 0\n0.018 0 0 0\n0.031 0 0 0\n0.04 0 0 0\n",
                                           "0.0179999 0 0 0\n0.022 0 0 0\n"};
  std::vector<PoseSample> poses;
  for (const std::int64_t t_ms : {3, 13, 23, 33, 43, 53}) poses.push_back(poseAt(t_ms * kMs));
  for (const std::int64_t t_ms : {5, 50}) poses.push_back(poseAt(t_ms * kMs, "slow"));
  const auto cut = [&](std::optional<std::int64_t> t0_ns, std::optional<std::int64_t> t1_ns) {
    JoinedParts all = parts(events, poses);
    std::vector<OtherSample> others;
    for (const std::int64_t t_ms : {10, 18, 40}) {
      others.push_back({"other" + std::to_string(t_ms), t_ms * kMs, nullptr});
    }
    others.push_back({"timeless", std::nullopt, nullptr});
    all.others = std::make_unique<ListedOthers>(others);
    return shortly(readAll(*join(std::move(all), {t0_ns, t1_ns})));
  };
  // The event of camera 1 is at 18 ms on the poses' clock, but earlier on its own clock.
  EXPECT_THAT(cut(18 * kMs, 40 * kMs),
              ElementsAre("slow@5", "pose@13", "cam1@17:1", "other18", "timeless", "cam0@18:1",
                          "cam1@22:1", "pose@23", "cam0@31:1", "pose@33", "pose@43", "slow@50"));
  EXPECT_THAT(cut(std::nullopt, 12 * kMs),
              ElementsAre("pose@3", "slow@5", "pose@13", "slow@50", "other10", "timeless"));
  EXPECT_THAT(cut(60 * kMs, std::nullopt), ElementsAre("slow@50", "pose@53", "timeless"));
  EXPECT_EQ(cut({}, {}).size(), 5U + 8 + 4) << "without limits";
  EXPECT_THROW(cut(kMs, kMs), std::invalid_argument);
}

TEST_F(JoinedRecordingTest, APacketIsCoveredUntilItsCamerasNextEvent) {
  const auto recording = open({"0.012 0 0 0\n0.018 0 0 0\n5 0 0 0\n", "0.015 0 0 0\n"});
  std::vector<std::optional<std::int64_t>> covered;
  for (const Sample& sample : readAll(*recording)) {
    covered.push_back(std::get<EventPacket>(sample).complete_until_ns);
  }
  EXPECT_THAT(covered, ElementsAre(5000 * kMs,      // cam0's packet of 10 to 20 ms
                                   kEndOfTimeNs,    // cam1's last packet
                                   std::nullopt));  // the recording's last packet
}

TEST_F(JoinedRecordingTest, EventsBeforeAWrongLineComeBeforeTheError) {
  const auto recording = open({"0.012 0 0 0\n0.018 0 0 0\n0.019 0 0\n0.025 0 0 0\n",
                               "0.011 0 0 0\n0.015 0 0 0\n0.022 0 0 0\n"},
                              {poseAt(5 * kMs), poseAt(17 * kMs), poseAt(90 * kMs)});
  std::string error;
  EXPECT_THAT(readToError(*recording, error),
              ElementsAre("pose@5", "cam1@11:2", "cam0@12:2", "pose@17", "pose@90"));
  EXPECT_THAT(error, HasSubstr("cam0/events.txt:3: '0.019 0 0'"));
}

TEST_F(JoinedRecordingTest, DamageBehindTheIntervalIsNone) {
  std::string text;
  for (int i = 0; i < 200; ++i) text += fmt::format("{:.3f} 1 2 0\n", 1e-3 * i);
  const auto recording = join(parts({text + "damage\n"}), {std::nullopt, 50 * kMs});
  std::uint64_t events = 0;
  for (const Sample& sample : readAll(*recording)) {
    events += std::get<EventPacket>(sample).events.size();
  }
  EXPECT_EQ(events, 50U);
  EXPECT_EQ(recording->damage(), "");
}

/// A camera whose file reports lost events.
struct LossyStream : EventStream {
  explicit LossyStream(std::uint64_t packets) : lost(packets) {}
  bool decode(std::vector<Event>&) override { return false; }
  std::string positionOf(std::size_t) const override { return ""; }
  std::string name() const override { return ""; }
  double progress() const override { return 1; }
  std::uint64_t lostPackets() const override { return lost; }
  std::uint64_t undatedEvents() const override { return 10 * lost; }
  std::vector<Warning> warnings() const override { return {{"", std::to_string(lost)}}; }
  std::uint64_t lost;
};

TEST_F(JoinedRecordingTest, ItsLossesAreThoseOfAllCameras) {
  JoinedParts parts;
  parts.rig.cameras.resize(2);
  for (const std::uint64_t lost : {2, 3}) {
    parts.cameras.emplace_back(std::make_unique<LossyStream>(lost), CameraSize{240, 180});
  }
  const RecordingCounts counts = join(std::move(parts), {0, std::nullopt})->counts();
  EXPECT_EQ(counts.lost_packets, 5U);
  EXPECT_EQ(counts.undated_events, 50U);
  EXPECT_EQ(counts.warnings.at(1).text, "3");
}

TEST_F(JoinedRecordingTest, ProgressGoesFromTheBeginningToOne) {
  std::string text;
  for (int i = 0; i < 400'000; ++i) text += fmt::format("{:.3f} 1 2 0\n", 1e-3 * i);  // 6 MB
  const auto recording = open({text, "1 0 0 0\n"});
  recording->next();
  double before = recording->progress();
  EXPECT_LT(before, 0.5);
  while (recording->next()) {
    EXPECT_GE(recording->progress(), before);
    before = recording->progress();
  }
  EXPECT_EQ(recording->progress(), 1.0);
}

}  // namespace
}  // namespace efm
