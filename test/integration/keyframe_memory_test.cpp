// SPDX-License-Identifier: BSD-3-Clause
// Measures the memory of a keyframe beyond its events. It is a separate program because a process
// has only one peak.
#include <gtest/gtest.h>
#include <malloc.h>

#include <cstdint>
#include <fstream>
#include <random>
#include <string>
#include <vector>

#include "mapping/keyframes/keyframe_mapper.h"
#include "test/mapping/keyframes/random_scene.h"

namespace efm {
namespace {

constexpr std::int64_t kWindow_ns = 200'000'000;
constexpr double kMegabyte = 1e6;

/// Returns a value of /proc/self/status, in bytes.
double memoryBytes(const std::string& key) {
  std::ifstream status("/proc/self/status");
  std::string word;
  while (status >> word) {
    double kibibytes = 0;
    if (word == key + ":" && status >> kibibytes) return 1024 * kibibytes;
  }
  return 0;
}

RigCamera hdCamera(double x_m) {
  RigCamera camera;
  camera.model = {1280, 720, 900, 900, 639.5, 359.5, DistortionModel::kNone, {}};
  camera.T_rig_cam.translation.x() = x_m;
  return camera;
}

/// Returns events all over the sensor, in time order. Their pixels do not change the memory.
std::vector<Event> eventsEverywhere(std::size_t count, std::uint32_t seed) {
  std::mt19937 random(seed);
  std::vector<Event> events(count);
  for (std::size_t i = 0; i < count; ++i) {
    events[i].t_ns = static_cast<std::int64_t>(i) * kWindow_ns / static_cast<std::int64_t>(count);
    events[i].x = static_cast<std::uint16_t>(random() % 1280);
    events[i].y = static_cast<std::uint16_t>(random() % 720);
    events[i].polarity = random() % 2 == 0;
  }
  return events;
}

double megabytesAbove(double before_bytes) {
  return (memoryBytes("VmHWM") - before_bytes) / kMegabyte;
}

/// Rays of events take 32 MB. Cases in ascending order of memory, as a process has one peak.
TEST(KeyframeMemory, OfAStereoPairAtHdHasBoundsAboveTheEventsWhateverTheSubintervals) {
  // Heaps of single threads keep freed memory: some 50 MB if other programs use the cores, too.
  mallopt(M_ARENA_MAX, 1);
  const std::vector<std::vector<Event>> events = {eventsEverywhere(2'000'000, 1),
                                                  eventsEverywhere(2'000'000, 2)};
  // Fast hand-held motion gives many pose packets.
  const Trajectory trajectory = test::RandomScene(1).motion(0, 1e-9 * kWindow_ns, 2, 2);
  const double before = memoryBytes("VmRSS");
  const auto map = [&](ExtractionMethod method, int subintervals) {
    KeyframeMapperOptions options;
    options.planes.num_planes = 100;
    options.subintervals.count = subintervals;
    options.extraction.extraction = method;
    options.sweep.threads = 2;
    KeyframeMapper mapper({{hdCamera(0), hdCamera(0.1)}}, {0, 1}, options);
    return mapper.map({0, kWindow_ns, kWindow_ns / 2}, {events[0], events[1]}, trajectory);
  };
  for (const int subintervals : {1, 8}) {
    const auto keyframe = map(ExtractionMethod::kPaper, subintervals);
    ASSERT_TRUE(keyframe);
    ASSERT_EQ(keyframe->events[1], 2'000'000U);
    ASSERT_GT(megabytesAbove(before), 0);
    EXPECT_LT(megabytesAbove(before), 150) << subintervals << " sub-intervals";
  }
  // Aggregation keeps one byte per plane for each pixel that stands out. Events in random order let
  // every second pixel stand out: 45 MB here.
  for (const int subintervals : {1, 8}) {
    ASSERT_TRUE(map(ExtractionMethod::kAggregated, subintervals));
    EXPECT_LT(megabytesAbove(before), 200) << subintervals << " sub-intervals";
  }
  RecordProperty("megabytes", std::to_string(megabytesAbove(before)));
}

}  // namespace
}  // namespace efm
