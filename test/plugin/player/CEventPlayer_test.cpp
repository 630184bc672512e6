// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/player/CEventPlayer.h"

#include <gmock/gmock.h>
#include <mrpt/config/CConfigFile.h>
#include <mrpt/obs/CObservationComment.h>
#include <mrpt/obs/CObservationRobotPose.h>
#include <sys/stat.h>

#include <array>
#include <fstream>
#include <functional>
#include <thread>

#include "plugin/mrpt/CObservationEvents.h"
#include "plugin/mrpt/pose_observation.h"
#include "plugin/recordings/open/rawlog.h"
#include "test/plugin/mrpt/observations.h"
#include "test/plugin/session/synthetic_recording.h"
#include "test/plugin/temporary_folder.h"

namespace efm {
namespace {

using mrpt::hwdrivers::CGenericSensor;
using mrpt::obs::CObservation;
using mrpt::obs::CObservationComment;
using testing::HasSubstr;
using Clock = std::chrono::steady_clock;
using Observations = std::vector<CObservation::Ptr>;

class EventPlayer : public TemporaryFolder {
 protected:
  EventPlayer() {
    writeDataset(recording_, folder() / "data");
    RawlogWriter rawlog(folder() / "data.rawlog");
    for (const auto& observation : expected()) rawlog.write(*observation);
    rawlog.close();
  }

  Observations expected() const {
    RecordingSource source;
    source.files = {folder() / "data"};
    const auto recording = openRecording(source);
    Observations all;
    while (auto observation = recording->next()) all.push_back(observation);
    return all;
  }

  /// A sensor as a host makes it: by name, with a section of its .ini.
  CGenericSensor::Ptr sensor(const std::string& keys) const {
    const auto file = folder() / "host.ini";
    std::ofstream(file) << "[global]\nfps = x\n[player]\ndriver = CEventPlayer\n" << keys;
    auto made = CGenericSensor::createSensorPtr("CEventPlayer");
    dynamic_cast<CEventPlayer&>(*made).setMinLoggingLevel(mrpt::system::LVL_ERROR);
    made->loadConfig(mrpt::config::CConfigFile(file.string()), "player");
    return made;
  }
  std::string errorOf(const std::string& keys) const {
    return messageOf([&] { sensor(keys)->initialize(); });
  }

  /// The play begins with the first event.
  std::int64_t firstNs() const {
    return std::min(recording_.events[0].front().t_ns, recording_.events[1].front().t_ns);
  }

  SyntheticRecording recording_;
};

Observations taken(CGenericSensor& sensor) {
  Observations all;
  for (const auto& [time, object] : sensor.getObservations()) {
    all.push_back(std::dynamic_pointer_cast<CObservation>(object));
  }
  return all;
}

/// Plays to the end. @param use receives the observations as they come.
void playToTheEnd(CGenericSensor& sensor,
                  const std::function<void(const CObservation::Ptr&)>& use) {
  const auto deadline = Clock::now() + std::chrono::seconds(60);
  while (!dynamic_cast<const CEventPlayer&>(sensor).ended()) {
    if (Clock::now() > deadline) throw std::runtime_error("it does not end");
    sensor.doProcess();
    for (const auto& observation : taken(sensor)) use(observation);
  }
}

Observations playToTheEnd(CGenericSensor& sensor) {
  Observations all;
  playToTheEnd(sensor, [&](const CObservation::Ptr& observation) { all.push_back(observation); });
  return all;
}

std::string textOf(const CObservation& observation) {
  return dynamic_cast<const CObservationComment&>(observation).text;
}

TEST_F(EventPlayer, PlaysAllInRealTimeAndNothingEarly) {
  const auto player = sensor("process_rate = 100\nrecording = data\nspeed = 2\n");
  player->initialize();
  const auto start = Clock::now();
  Observations all;
  while (!dynamic_cast<const CEventPlayer&>(*player).ended()) {
    ASSERT_LT(Clock::now() - start, std::chrono::seconds(60));
    player->doProcess();
    const std::chrono::duration<double> elapsed = Clock::now() - start;
    for (const auto& observation : taken(*player)) {
      all.push_back(observation);
      const auto* packet = dynamic_cast<const CObservationEvents*>(observation.get());
      const std::int64_t t_ns = packet != nullptr && !packet->events.empty()
                                    ? packet->events.back().t_ns
                                    : nanosecondsFrom(observation->timestamp);
      EXPECT_LE(secondsBetween(firstNs(), t_ns), 2 * elapsed.count() + 1e-6);
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  EXPECT_EQ(player->getState(), CGenericSensor::ssWorking);
  ASSERT_FALSE(all.empty());
  const std::string text = textOf(*all.back());
  EXPECT_THAT(text, HasSubstr("the end of data: "));
  const double late_s = std::stod(text.substr(text.find("at most ") + 8));
  EXPECT_LE(late_s, std::chrono::duration<double>(Clock::now() - start).count());
  const auto end = all.back()->timestamp;
  all.pop_back();
  for (const auto& observation : all) EXPECT_LT(observation->timestamp, end);
  EXPECT_EQ(all.size(), expected().size());
  player->doProcess();
  EXPECT_TRUE(taken(*player).empty()) << "nothing follows the end";
}

TEST_F(EventPlayer, FeedsALiveMapBuilder) {
  CEventFusionMapBuilder playback(syntheticOptions());
  play(playback, expected());
  EventFusionOptions options = syntheticOptions();
  options.live.enabled = true;
  CEventFusionMapBuilder live(options);
  const auto player = sensor("process_rate = 100\nrecording = data\nspeed = 2\n");
  player->initialize();
  playToTheEnd(*player,
               [&](const CObservation::Ptr& observation) { live.processObservation(observation); });
  live.finish();

  ASSERT_FALSE(playback.points()->empty());
  expectSameBits(live.points(), playback.points());
  EXPECT_EQ(live.status().live->dropRatio(), 0);
  EXPECT_EQ(live.status().live->errors, 0U) << live.status().live->last_error;
}

TEST_F(EventPlayer, TheQueueOfASlowHostHasALimitAndNothingIsLost) {
  const auto player =
      sensor("process_rate = 100\nmax_queue_len = 8\nrecording = data.rawlog\nspeed = 1000\n");
  player->initialize();
  Observations all;
  while (!dynamic_cast<const CEventPlayer&>(*player).ended()) {
    for (int i = 0; i < 5; ++i) {
      player->doProcess();
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    const Observations queue = taken(*player);
    ASSERT_TRUE(queue.size() >= 8 || dynamic_cast<const CEventPlayer&>(*player).ended());
    EXPECT_LE(queue.size(), 8U + 1) << "and the comment";
    all.insert(all.end(), queue.begin(), queue.end());
  }
  EXPECT_EQ(all.size(), expected().size() + 1);
  EXPECT_THAT(textOf(*all.back()), testing::Not(HasSubstr("0.000 s late")));
}

TEST_F(EventPlayer, StopsInTheMiddleAndBeginsAgain) {
  const auto player = sensor("process_rate = 100\nrecording = data\nspeed = 0.1\n");
  for (int i = 0; i < 2; ++i) {
    player->initialize();
    player->doProcess();
    const Observations begin = taken(*player);
    EXPECT_GE(begin.size(), 3U) << "the announcements of two cameras, the first pose";
    EXPECT_LT(begin.size(), expected().size() / 2);
  }
}

TEST_F(EventPlayer, RestampedObservationsBeginNowAndKeepTheirDistances) {
  const auto player = sensor("process_rate = 100\nrecording = data\nspeed = 1000\nrestamp = now\n");
  player->initialize();
  const auto before = mrpt::Clock::now();
  player->doProcess();
  const auto after = mrpt::Clock::now();
  Observations all = taken(*player);
  for (const auto& observation : playToTheEnd(*player)) all.push_back(observation);

  const auto first = std::find_if(all.begin(), all.end(), [](const auto& observation) {
    return observation->sensorLabel == "cam0";
  });
  ASSERT_NE(first, all.end());
  EXPECT_GE((*first)->timestamp, before);
  EXPECT_LE((*first)->timestamp, after);
  const std::int64_t shift_ns = nanosecondsFrom((*first)->timestamp) - firstNs();
  std::size_t poses = 0;
  for (const auto& observation : all) {
    if (const auto* packet = dynamic_cast<const CObservationEvents*>(observation.get())) {
      for (const Event& event : packet->events) EXPECT_GE(event.t_ns, firstNs() + shift_ns);
    } else if (observation->sensorLabel == "pose") {
      EXPECT_EQ(nanosecondsFrom(observation->timestamp) - shift_ns, recording_.poses[poses++].t_ns);
    }
  }
  EXPECT_EQ(poses, recording_.poses.size());
}

/// Poses on another clock would otherwise look like a sensor that hangs.
TEST_F(EventPlayer, ALongPauseIsLoggedOnce) {
  std::ofstream(folder() / "late.txt") << "10 0 0 0 0 0 0 1\n1700000000 0 0 0 0 0 0 1\n";
  const auto player =
      sensor("process_rate = 100\nrecording = data\nspeed = 1000\nposes = late.txt\n");
  auto& logger = dynamic_cast<CEventPlayer&>(*player);
  std::vector<std::string> warnings;
  logger.setMinLoggingLevel(mrpt::system::LVL_WARN);
  logger.logging_enable_console_output = false;
  logger.logRegisterCallback([&](std::string_view text, const mrpt::system::VerbosityLevel,
                                 std::string_view,
                                 const mrpt::Clock::time_point) { warnings.emplace_back(text); });
  player->initialize();
  for (int i = 0; i < 100; ++i) {
    player->doProcess();
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  EXPECT_FALSE(logger.ended());
  ASSERT_EQ(warnings.size(), 1U);
  EXPECT_THAT(warnings[0], HasSubstr("data: nothing comes for 1"));
  EXPECT_THAT(warnings[0], HasSubstr(" s, until 1700000000.000000000 s on"));
}

TEST_F(EventPlayer, APipeIsPlayedToo) {
  ASSERT_EQ(mkfifo((folder() / "pipe").c_str(), 0600), 0);
  std::thread writer([&] {
    std::ofstream(folder() / "pipe", std::ios::binary)
        << std::ifstream(folder() / "data.rawlog", std::ios::binary).rdbuf();
  });
  const auto player = sensor("process_rate = 100\nrecording = pipe\nspeed = 100\n");
  player->initialize();
  EXPECT_EQ(playToTheEnd(*player).size(), expected().size() + 1);
  writer.join();
}

TEST_F(EventPlayer, ADamagedRecordingIsAnErrorAfterAllBeforeIt) {
  std::filesystem::resize_file(folder() / "data.rawlog",
                               std::filesystem::file_size(folder() / "data.rawlog") / 2);
  const auto player = sensor("process_rate = 100\nrecording = data.rawlog\nspeed = 1000\n");
  player->initialize();
  EXPECT_THAT(messageOf([&] { playToTheEnd(*player); }),
              testing::AllOf(HasSubstr("stopped at entry "), HasSubstr("data.rawlog: ")));
  EXPECT_EQ(player->getState(), CGenericSensor::ssError);
}

TEST_F(EventPlayer, ErrorsNameTheKeyTheValueAndWhatWasExpected) {
  const std::string good = "process_rate = 100\nrecording = data\n";
  EXPECT_EQ(errorOf(good), "no error");
  struct Case {
    std::string keys;
    std::string error;
  };
  for (const Case& c : std::vector<Case>{
           {"recording = data\n", "process_rate: must be given"},
           {"process_rate = 100\n", "recording: must be given"},
           {"process_rate = 100\nrecording = nothing\n",
            "recording = nothing: no such file or folder"},
           {"process_rate = 100\nrecording = host.ini\n",
            "host.ini: an .ini file among the sources"},
           {good + "sped = 2\n", "sped = 2: unknown key: did you mean speed?"},
           {good + "packet_s = 2 ; too long\n", "packet_s = 2: must be 1e-4 to 1 (seconds)"},
           {good + "restamp = later\n", "restamp = later: 'later' is unknown: expected one of"},
           {good + "format = rawlgo\n", "format = rawlgo: did you mean rawlog?"},
           {good + "poses = no.txt\n", "poses = no.txt: no such file or folder"},
           {good + "calibration = data/poses.txt\n", "poses.txt"},
           {good + "perturb = latency_s=0.1, noise=1\n", "noise=1: unknown key"},
           {good + "perturb = latency_s = 20\n", "latency_s = 20: must be a number, 0 to 10"},
           {good + "perturb = keyframe_noise_m=0.1\n", "perturb: keyframe_s: must be given"},
       }) {
    EXPECT_THAT(errorOf(c.keys), HasSubstr(c.error)) << c.keys;
  }
  // Both ends of each range.
  const auto loaded = [&](const std::string& keys) {
    return messageOf([&] { sensor("process_rate = 1\nrecording = data\n" + keys); });
  };
  const std::array<const char*, 5> ranges[] = {
      {"process_rate", "0.01", "1e5", "0.0099", "1.01e5"},
      {"max_queue_len", "1", "1000000", "0", "1000001"},
      {"grab_decimation", "0", "1", "-1", "2"},
      {"skip_bad_events", "0", "9223372036854775807", "-1", "9223372036854775808"},
      {"packet_s", "1e-4", "1", "0.9e-4", "1.01"},
      {"speed", "0.001", "1000", "0.0009", "1001"}};
  for (const auto& [key, lowest, highest, below, above] : ranges) {
    const std::string name = key;
    for (const char* value : {lowest, highest}) {
      EXPECT_EQ(loaded(name + " = " + value + "\n"), "no error") << name << value;
    }
    for (const char* value : {below, above, "nan"}) {
      EXPECT_THAT(loaded(name + " = " + value + "\n"),
                  HasSubstr(name + " = " + value + ": must be"));
    }
  }
  EXPECT_THAT(errorOf(good + "speed = x\n"),
              HasSubstr((folder() / "host.ini").string() + ", section player: speed = x: must be"));
}

}  // namespace
}  // namespace efm
