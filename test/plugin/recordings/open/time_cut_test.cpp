// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/recordings/open/time_cut.h"

#include <gmock/gmock.h>
#include <mrpt/obs/CObservationComment.h>

#include "plugin/mrpt/pose_observation.h"
#include "test/plugin/mrpt/observations.h"
#include "test/plugin/temporary_folder.h"

namespace efm {
namespace {

using mrpt::obs::CObservation;
using mrpt::obs::CObservationRobotPose;
using testing::ElementsAre;
using testing::HasSubstr;

CObservation::Ptr pose(std::int64_t t_ns) {
  auto observation = CObservationRobotPose::Create();
  observation->timestamp = mrptTimeFrom(t_ns);
  return observation;
}

CObservation::Ptr packet(int camera, std::int64_t begin_ns, std::int64_t covered_until_ns,
                         const std::vector<std::int64_t>& times_ns) {
  auto observation = CObservationEvents::Create();
  observation->camera_index = camera;
  observation->timestamp = mrptTimeFrom(begin_ns);
  observation->covered_until_ns = covered_until_ns;
  for (const std::int64_t t_ns : times_ns) observation->events.push_back({t_ns, 0, 0, true});
  return observation;
}

/// "pose 100", "cam0 200 (210 250) 300": begin, events, until where it is covered.
std::string describe(const CObservation& observation) {
  const bool timed = observation.timestamp != INVALID_TIMESTAMP;
  const std::string begin = timed ? std::to_string(nanosecondsFrom(observation.timestamp)) : "?";
  const auto* events = dynamic_cast<const CObservationEvents*>(&observation);
  if (!events) return (poseSourceOf(observation) ? "pose " : "other ") + begin;
  std::string text = "cam" + std::to_string(events->camera_index) + " " + begin + " (";
  for (const Event& event : events->events) {
    text += (text.back() == '(' ? "" : " ") + std::to_string(event.t_ns);
  }
  return text + ") " + std::to_string(*events->covered_until_ns);
}

std::vector<std::string> cut(const std::vector<CObservation::Ptr>& observations,
                             std::optional<std::int64_t> t0_ns, std::optional<std::int64_t> t1_ns) {
  const auto recording = cutTime(std::make_unique<ListedRecording>(observations), t0_ns, t1_ns);
  std::vector<std::string> given;
  while (const auto observation = recording->next()) given.push_back(describe(*observation));
  return given;
}

std::vector<CObservation::Ptr> threePackets() {
  return {pose(100),  packet(0, 100, 1100, {100, 1000}),
          pose(600),  packet(0, 1100, 2100, {1100, 2000}),
          pose(1600), packet(0, 2100, 9900, {2100, 3000}),
          pose(2600), pose(3600)};
}

TEST(TimeCut, HasTheEventsOfTheIntervalAndAPoseOnEitherSide) {
  EXPECT_EQ(cut(threePackets(), std::nullopt, std::nullopt).size(), 8U) << "without limits";
  EXPECT_THAT(cut(threePackets(), 10'000, 20'000), ElementsAre());
  EXPECT_THAT(cut(threePackets(), 1100, 2100),
              ElementsAre("pose 600", "cam0 1100 (1100 2000) 2100", "pose 1600", "pose 2600"));
  EXPECT_THAT(cut(threePackets(), 1101, 2001),
              ElementsAre("pose 600", "cam0 2000 (2000) 2001", "pose 1600", "pose 2600"));
  EXPECT_THAT(cut(threePackets(), 2500, std::nullopt),
              ElementsAre("pose 1600", "cam0 3000 (3000) 9900", "pose 2600", "pose 3600"));
  EXPECT_THAT(cut(threePackets(), std::nullopt, 1000),
              ElementsAre("pose 100", "cam0 100 (100) 1000", "pose 600", "pose 1600"));
}

TEST(TimeCut, KeepsPacketsThatSayACameraIsSilent) {
  EXPECT_THAT(cut({pose(0), packet(1, 100, 50'000, {}), packet(0, 100, 300, {200}), pose(200),
                   packet(0, 1000, 2000, {1500}), pose(1600)},
                  1200, 1550),
              ElementsAre("pose 200", "cam1 1500 () 1550", "cam0 1500 (1500) 1550", "pose 1600"));
}

TEST(TimeCut, AnnouncesTheRigBeforeItsFirstEvent) {
  // Three cameras; the first packet's camera must be covered until exactly its first event.
  EXPECT_THAT(cut({packet(0, 100, 100, {}), packet(1, 100, 200, {}), packet(2, 100, 50'000, {}),
                   packet(0, 100, 400, {100, 300}), packet(1, 200, 900, {200, 500})},
                  250, 1500),
              ElementsAre("cam0 300 () 300", "cam1 300 () 250", "cam2 300 () 1500",
                          "cam0 300 (300) 400", "cam1 500 (500) 900"));
  EXPECT_THAT(cut({packet(0, 100, 100, {}), packet(1, 100, 200, {}),
                   packet(1, 100, 400, {100, 300}), packet(0, 200, 900, {200, 500})},
                  50, 1500),
              ElementsAre("cam0 100 () 100", "cam1 100 () 100", "cam1 100 (100 300) 400",
                          "cam0 200 (200 500) 900"));
}

TEST(TimeCut, HasAPoseOfItsFirstTimeAndTheOneBefore) {
  EXPECT_THAT(cut({pose(100), pose(200), packet(0, 200, 300, {200}), pose(300)}, 200, 250),
              ElementsAre("pose 100", "pose 200", "cam0 200 (200) 250", "pose 300"));
}

/// Three packets of which none says when it begins, but all this.
std::vector<CObservation::Ptr> threePacketsAt(const mrpt::Clock::time_point& time) {
  std::vector<CObservation::Ptr> observations = threePackets();
  for (const auto& observation : observations) {
    if (IS_CLASS(*observation, CObservationEvents)) observation->timestamp = time;
  }
  return observations;
}

TEST(TimeCut, UsesTheTimesOfEventsWhereAPacketHasNone) {
  EXPECT_THAT(cut(threePacketsAt(INVALID_TIMESTAMP), 1100, 2100),
              ElementsAre("pose 600", "cam0 ? (1100 2000) 2100", "pose 1600", "pose 2600"));
  EXPECT_THAT(cut(threePacketsAt(INVALID_TIMESTAMP), 2500, std::nullopt),
              ElementsAre("pose 1600", "cam0 ? (3000) 9900", "pose 2600", "pose 3600"));
  const CObservation::Ptr across = packet(0, 0, 9000, {900, 2000});
  across->timestamp = INVALID_TIMESTAMP;
  EXPECT_THAT(cut({pose(100), across, pose(1100), pose(1300)}, 1200, 2500),
              ElementsAre("pose 1100", "cam0 ? (2000) 2500", "pose 1300"));
  // MRPT gives an observation the time at which it was made where nobody says another.
  const auto now = mrptTimeFrom(1'700'000'000'000'000'000);
  EXPECT_EQ(cut(threePacketsAt(now), 100, 3000).size(), 8U);
}

TEST(TimeCut, HasOtherObservationsOfTheIntervalOrWithoutATime) {
  std::vector<CObservation::Ptr> observations = {pose(100)};
  for (const std::int64_t t_ns : {0, 100, 200, 1000, 1100}) {  // MRPT's ticks are 100 ns
    observations.push_back(mrpt::obs::CObservationComment::Create());
    observations.back()->timestamp = t_ns == 0 ? INVALID_TIMESTAMP : mrptTimeFrom(t_ns);
  }
  observations.push_back(packet(0, 200, 1100, {200}));
  EXPECT_THAT(cut(observations, 200, 1100),
              ElementsAre("pose 100", "other ?", "other 200", "other 1000", "cam0 200 (200) 1100"));
}

TEST(TimeCut, AnErrorNamesTheSourceOfAPoseWithoutATime) {
  const CObservation::Ptr timeless = pose(0);
  timeless->timestamp = INVALID_TIMESTAMP;
  timeless->sensorLabel = "tracker";
  EXPECT_THAT(messageOf([&] { cut({timeless}, 100, 1100); }),
              HasSubstr("'tracker' has no time stamp"));
}

TEST(TimeCut, EndsOnceEachCameraHasPassedT1) {
  // Camera 1's packets are longer, and come when they end.
  EXPECT_THAT(cut({pose(0), packet(0, 100, 200, {100}), packet(0, 200, 300, {200}),
                   packet(1, 100, 300, {150, 200, 250}), packet(0, 300, 400, {300}),
                   packet(0, 400, 500, {400}), pose(500), packet(1, 300, 500, {310, 390}),
                   packet(0, 500, 600, {500}), pose(700)},
                  200, 350),
              ElementsAre("pose 0", "cam0 200 (200) 300", "cam1 200 (200 250) 300",
                          "cam0 300 (300) 350", "pose 500", "cam1 300 (310) 350"));
}

TEST(TimeCut, IncludesACameraThatFirstAppearsAfterAnotherPassedT1) {
  EXPECT_THAT(cut({pose(0), packet(0, 100, 200, {100}), packet(0, 200, 300, {200}), pose(300),
                   packet(1, 100, 300, {150, 250})},
                  100, 200),
              ElementsAre("pose 0", "cam0 100 (100) 200", "pose 300", "cam1 100 (150) 200"));
}

TEST(TimeCut, WaitsASecondForACamera) {
  constexpr std::int64_t kSecond = 1'000'000'000;
  for (const bool silent : {true, false}) {
    std::vector<CObservation::Ptr> observations = {pose(0), packet(1, 0, 1, {0})};
    for (int i = 0; i < 100; ++i) {
      const std::int64_t t_ns = i * kSecond / 4;
      observations.push_back(packet(0, t_ns, t_ns + 1, {t_ns}));
      if (!silent) observations.push_back(packet(1, t_ns, t_ns + 1, {t_ns}));
      observations.push_back(pose(t_ns));
    }
    auto playback = std::make_unique<ListedRecording>(observations);
    const ListedRecording& played = *playback;
    const auto recording = cutTime(std::move(playback), 0, silent ? kSecond : kSecond / 4);
    std::size_t given = 0;
    while (recording->next()) ++given;
    // Beyond t1, and where all cameras are beyond it, from the first begin on: others may come.
    EXPECT_EQ(played.read(), silent ? 2U + 2 * 8 + 1 : 2U + 3 * 4 + 1);
    EXPECT_EQ(given, silent ? 1U + 1 + 4 + 5 : 1U + 1 + 2 + 2);
  }
}

TEST(TimeCut, MustEndAfterItBegins) {
  EXPECT_THROW(cut(threePackets(), 1000, 1000), std::invalid_argument);
}

}  // namespace
}  // namespace efm
