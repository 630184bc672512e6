// SPDX-License-Identifier: BSD-3-Clause
#include "test/studies/recordings/recording_cache.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "test/plugin/temporary_folder.h"
#include "test/studies/recordings/recording_errors.h"
#include "tracking_stub/presets/simulation_preset.h"

namespace efm::studies {
namespace {

Simulation shortSlider(std::uint64_t seed = 1) {
  SimulationOptions options;
  options.preset = "slider";
  options.duration_s = 0.03;
  options.seed = seed;
  return makeSimulation(options);
}

class RecordingsOnDisk : public TemporaryFolder {
 protected:
  std::size_t files() const {
    std::size_t count = 0;
    for (const auto& entry : std::filesystem::directory_iterator(folder())) {
      count += entry.is_regular_file() ? 1 : 0;
    }
    return count;
  }
};

TEST_F(RecordingsOnDisk, WhatIsReadIsWhatWasSimulated) {
  const RecordingCache cache(folder());
  const Recording made = cache.make("slider", shortSlider());
  ASSERT_FALSE(made.events.at(0).empty());
  const Recording read = cache.make("slider", shortSlider());
  EXPECT_EQ(files(), 1U);
  EXPECT_EQ(read.events, made.events);
}

TEST_F(RecordingsOnDisk, AnotherSimulationIsAnotherFile) {
  const RecordingCache cache(folder());
  cache.make("slider", shortSlider(1));
  cache.make("slider", shortSlider(2));
  EXPECT_EQ(files(), 2U);
}

TEST_F(RecordingsOnDisk, AFileThatEndsTooSoonIsNamed) {
  const RecordingCache cache(folder());
  cache.make("slider", shortSlider());
  const auto file = std::filesystem::directory_iterator(folder())->path();
  std::filesystem::resize_file(file, std::filesystem::file_size(file) - 1);
  try {
    cache.make("slider", shortSlider());
    FAIL() << "read a file that was cut";
  } catch (const std::runtime_error& error) {
    EXPECT_NE(std::string(error.what()).find(file.string()), std::string::npos) << error.what();
  }
}

TEST(FingerprintOfASimulation, ChangesWithAllThatItsEventsFollowFrom) {
  const std::uint64_t same = fingerprintOf(shortSlider());
  EXPECT_EQ(fingerprintOf(shortSlider()), same);
  Simulation other = shortSlider();
  other.pixels.threshold_on *= 2;
  EXPECT_NE(fingerprintOf(other), same) << "threshold";
  other = shortSlider();
  other.noise.background_hz = 1;
  EXPECT_NE(fingerprintOf(other), same) << "noise";
  other = shortSlider();
  other.rig.cameras[0].model.fx += 1;
  EXPECT_NE(fingerprintOf(other), same) << "camera";
  other = shortSlider();
  other.duration_ns += 1;
  EXPECT_NE(fingerprintOf(other), same) << "duration";
}

TEST(WindowsOfARecording, ReachFromItsStartToItsEnd) {
  Recording recording;
  recording.simulation.start_ns = 100;
  recording.simulation.duration_ns = 1000;
  const auto windows = recording.windows(400e-9, 4);
  ASSERT_EQ(windows.size(), 4U);
  EXPECT_EQ(windows.front().t0_ns, 100);
  EXPECT_EQ(windows[1].t0_ns, 300);
  EXPECT_EQ(windows[1].t_ref_ns, 500);
  EXPECT_EQ(windows.back().t1_ns, 1100);
}

TEST_F(RecordingsOnDisk, NoiseAddedAfterwardsIsTheSimulatorsOwn) {
  Simulation noisy = shortSlider();
  noisy.noise.background_hz = 50;
  const RecordingCache cache(folder());
  const Recording simulated = cache.make("noisy", noisy);
  const Recording added = withNoise(cache.make("clean", shortSlider()), noisy.noise);
  ASSERT_EQ(added.events.at(0).size(), simulated.events.at(0).size());
  // In order of time both; of equal times the simulator sorts by row and column.
  std::int64_t differing = 0;
  for (std::size_t i = 0; i < added.events[0].size(); ++i) {
    differing += added.events[0][i].t_ns == simulated.events[0][i].t_ns ? 0 : 1;
  }
  EXPECT_EQ(differing, 0);
}

}  // namespace
}  // namespace efm::studies
