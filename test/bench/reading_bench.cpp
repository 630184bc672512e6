// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <memory>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "plugin/formats/open_recording.h"
#include "plugin/formats/rawlog_writer.h"
#include "plugin/mrpt/CObservationEvents.h"
#include "test/bench/benches.h"
#include "test/bench/synthetic_window.h"

namespace efm::bench {
namespace {

namespace fs = std::filesystem;

/// Sets irregular times like a sensor's, about one event per microsecond.
void makeIrregular(std::vector<Event>& events, std::int64_t tick_ns) {
  std::mt19937_64 random(1);
  const auto end_tick = static_cast<std::int64_t>(events.size()) * 1000 / tick_ns;
  std::uniform_int_distribution<std::int64_t> tick(0, end_tick);
  for (Event& event : events) event.t_ns = 1'000'000'000 + tick_ns * tick(random);
  std::sort(events.begin(), events.end(),
            [](const Event& a, const Event& b) { return a.t_ns < b.t_ns; });
}

/// A folder in the UZH layout: one camera, decimal seconds with nine digits.
void writeTextFolder(const fs::path& folder, const SyntheticWindow& made) {
  fs::create_directories(folder);
  const CameraModel& camera = made.rig.cameras.front().model;
  std::vector<double> coefficients = camera.coefficients;
  coefficients.resize(5);
  std::ofstream calibration(folder / "calib.txt");
  calibration << camera.fx << ' ' << camera.fy << ' ' << camera.cx << ' ' << camera.cy;
  for (const double coefficient : coefficients) calibration << ' ' << coefficient;
  calibration << '\n';
  std::ofstream(folder / "groundtruth.txt") << "1 0 0 0 0 0 0 1\n";
  std::ofstream events(folder / "events.txt");
  constexpr std::int64_t kNanoseconds = 1'000'000'000;
  std::array<char, 64> line{};
  for (const Event& event : made.events.front()) {
    std::snprintf(line.data(), line.size(), "%lld.%09lld %d %d %d\n",
                  static_cast<long long>(event.t_ns / kNanoseconds),
                  static_cast<long long>(event.t_ns % kNanoseconds), event.x, event.y,
                  event.polarity ? 1 : 0);
    events << line.data();
  }
}

/// Imports that folder.
void writeRawlog(const fs::path& file, const fs::path& folder) {
  RecordingSource source;
  source.files = {folder};
  const std::unique_ptr<Recording> recording = openRecording(source);
  RawlogWriter writer(file);
  while (const auto observation = recording->next()) writer.write(*observation);
  writer.close();
}

/// Reads a recording from beginning to end.
void readAll(benchmark::State& state, const fs::path& path) {
  RecordingSource source;
  source.files = {path};
  std::size_t events = 0;
  for (auto _ : state) {
    events = 0;
    const std::unique_ptr<Recording> recording = openRecording(source);
    while (const auto observation = recording->next()) {
      const auto* packet = dynamic_cast<const CObservationEvents*>(observation.get());
      if (packet != nullptr) events += packet->events.size();
    }
  }
  countRate(state, "events/s", static_cast<double>(events));
}

}  // namespace

void benchReading(BenchSession& session) {
  // The sensor of a UZH folder without images has 240x180 pixels.
  SyntheticWindowOptions options = session.plan().sensors.back().window(1);
  options.width = 240;
  options.height = 180;
  SyntheticWindow made = makeSyntheticWindow(options);
  const auto add = [&](const char* name, const fs::path& path) {
    session.add({"reading", name, ""}, [path](benchmark::State& state) { readAll(state, path); });
  };
  const fs::path& scratch = session.plan().scratch;
  for (const auto& [unit, tick_ns] : {std::pair("us", 1000), std::pair("ns", 1)}) {
    makeIrregular(made.events.front(), tick_ns);
    writeTextFolder(scratch / unit, made);
    const std::string rawlog = std::string("rawlog of ") + unit;  // the bytes per event differ
    writeRawlog(scratch / rawlog, scratch / unit);
    add(rawlog.c_str(), scratch / rawlog);
  }
  add("text", scratch / "us");
  session.run();
}

}  // namespace efm::bench
