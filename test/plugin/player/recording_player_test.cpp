// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/player/recording_player.h"

#include <gmock/gmock.h>
#include <mrpt/obs/CObservationComment.h>

#include <algorithm>
#include <set>

#include "plugin/recordings/open/perturbed_recording.h"
#include "test/plugin/mrpt/observations.h"
#include "test/plugin/temporary_folder.h"

namespace efm {
namespace {

using mrpt::obs::CObservation;
using mrpt::obs::CObservationRobotPose;
using Observations = std::vector<CObservation::Ptr>;

constexpr std::int64_t kMs = 1'000'000;
constexpr std::int64_t kStartNs = SyntheticRecording::kStartNs;

/// When a sensor has an observation: a packet with its last event.
std::int64_t timeOf(const CObservation& observation) {
  const auto* const packet = dynamic_cast<const CObservationEvents*>(&observation);
  if (packet != nullptr && !packet->events.empty()) return packet->events.back().t_ns;
  return nanosecondsFrom(observation.timestamp);
}

bool isPose(const CObservation& observation) {
  return dynamic_cast<const CObservationRobotPose*>(&observation) != nullptr;
}

struct Played {
  CObservation::Ptr observation;
  std::int64_t now_ns = 0;
};

/// Asks once a millisecond.
std::vector<Played> playedBy(RecordingPlayer& player) {
  std::vector<Played> played;
  for (std::int64_t now_ns = player.startNs(); !player.ended(); now_ns += kMs) {
    if (now_ns > player.startNs() + 10'000 * kMs) throw std::runtime_error("it does not end");
    for (const auto& observation : player.observationsUntil(now_ns, 1000)) {
      played.push_back({observation, now_ns});
    }
  }
  return played;
}

TEST(RecordingPlayer, ReturnsEachObservationOnceAtItsTimeInTheOrderOfTimes) {
  const Observations all = observationsOf(SyntheticRecording());
  RecordingPlayer player(std::make_unique<ListedRecording>(all));

  const std::vector<Played> played = playedBy(player);

  std::set<CObservation::Ptr> distinct;
  std::int64_t newest_ns = 0;
  for (const auto& [observation, now_ns] : played) {
    distinct.insert(observation);
    EXPECT_LE(timeOf(*observation), now_ns) << "early";
    // The packets come with the pose at their end, so they are read up to 10 ms after their events.
    EXPECT_LT(now_ns - timeOf(*observation), isPose(*observation) ? kMs : 11 * kMs) << "late";
    if (!isPose(*observation)) continue;
    EXPECT_GT(timeOf(*observation), newest_ns);
    newest_ns = timeOf(*observation);
  }
  EXPECT_EQ(played.size(), all.size());
  EXPECT_EQ(distinct.size(), all.size());
  EXPECT_EQ(player.returned(), all.size());
  EXPECT_TRUE(player.observationsUntil(kEndOfTimeNs, 10).empty());
}

/// A camera sends a packet when it is complete; poses within it come before.
TEST(RecordingPlayer, APacketComesAfterThePosesWithinIt) {
  auto packet = CObservationEvents::Create();
  packet->timestamp = mrptTimeFrom(kStartNs);
  packet->events = {{kStartNs, 1, 2, true}, {kStartNs + 20 * kMs, 1, 2, true}};
  Observations all = {packet};
  for (int i = 0; i < 4; ++i) {
    auto pose = CObservationRobotPose::Create();
    pose->timestamp = mrptTimeFrom(kStartNs + i * 10 * kMs);
    all.push_back(pose);
  }
  auto comment = mrpt::obs::CObservationComment::Create();  // goes with those around it
  comment->timestamp = mrptTimeFrom(kStartNs + 3600'000 * kMs);
  all.insert(all.begin() + 2, comment);
  RecordingPlayer player(std::make_unique<ListedRecording>(all));

  Observations order;
  for (const Played& one : playedBy(player)) order.push_back(one.observation);
  // The packet was read before the pose of the same time.
  EXPECT_THAT(order, testing::ElementsAre(all[1], all[2], all[3], all[0], all[4], all[5]));
}

TEST(RecordingPlayer, PosesComeLaterByTheLatency) {
  TrackerFaults faults;
  faults.latency_ns = 45 * kMs;
  RecordingPlayer player(
      std::make_unique<PerturbedRecording>(
          std::make_unique<ListedRecording>(observationsOf(SyntheticRecording())), faults),
      faults.latency_ns);
  std::size_t poses = 0;
  for (const auto& [observation, now_ns] : playedBy(player)) {
    if (!isPose(*observation)) continue;
    ++poses;
    const std::int64_t delay_ns = now_ns - timeOf(*observation);
    EXPECT_GE(delay_ns, 45 * kMs);
    EXPECT_LE(delay_ns, 50 * kMs);  // a pose of the list every 10 ms lets a late one pass
  }
  EXPECT_EQ(poses, 51U);
}

TEST(RecordingPlayer, ALateCallerGetsAllAndMemoryDoesNotGrow) {
  const Observations all = observationsOf(SyntheticRecording());
  auto recording = std::make_unique<ListedRecording>(all);
  const ListedRecording& list = *recording;
  RecordingPlayer player(std::move(recording));
  const std::int64_t late_ns = player.startNs() + 2000 * kMs;

  std::size_t returned = 0;
  while (!player.ended()) {
    const std::size_t count = player.observationsUntil(late_ns, 7).size();
    ASSERT_GT(count, 0U);
    EXPECT_LE(count, 7U);
    returned += count;
    EXPECT_LE(list.read(), returned + 4) << "two packets and poses around them";
  }
  EXPECT_EQ(returned, all.size());
  EXPECT_EQ(player.maxDelayNs(), 2000 * kMs);  // of what came at the start
}

TEST(RecordingPlayer, AnErrorComesAfterTheObservationsBeforeIt) {
  const Observations all = observationsOf(SyntheticRecording());
  RecordingPlayer player(std::make_unique<ListedRecording>(all, true));
  EXPECT_EQ(messageOf([&] { playedBy(player); }), "the tape is torn");
  EXPECT_EQ(player.returned(), all.size());
  EXPECT_EQ(
      messageOf([] { RecordingPlayer(std::make_unique<ListedRecording>(Observations(), true)); }),
      "the tape is torn");
  auto pose = CObservationRobotPose::Create();
  EXPECT_EQ(
      messageOf([&] { RecordingPlayer(std::make_unique<ListedRecording>(Observations{pose})); }),
      "the recording has no events: expected at least one");
}

TEST(RecordingPlayer, AShiftMovesAllTimesOfAPacketAlike) {
  auto packet = CObservationEvents::Create();
  packet->timestamp = mrptTimeFrom(kStartNs);
  packet->events = {{kStartNs + 17, 1, 2, true}, {kStartNs + kMs, 1, 2, true}};
  packet->covered_until_ns = kStartNs + 2 * kMs;
  shiftTimes(*packet, 500);
  EXPECT_EQ(nanosecondsFrom(packet->timestamp), kStartNs + 500);
  EXPECT_EQ(packet->events[0].t_ns, kStartNs + 517);
  EXPECT_EQ(packet->events[1].t_ns, kStartNs + kMs + 500);
  EXPECT_EQ(packet->covered_until_ns, kStartNs + 2 * kMs + 500);
  packet->covered_until_ns = kEndOfTimeNs;  // covered for good
  shiftTimes(*packet, 500);
  EXPECT_EQ(packet->covered_until_ns, kEndOfTimeNs);
}

}  // namespace
}  // namespace efm
