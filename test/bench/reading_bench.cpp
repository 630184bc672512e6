// SPDX-License-Identifier: BSD-3-Clause
#include <unistd.h>

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
#include <system_error>
#include <vector>

#include "mapping/keyframes/keyframe_mapper.h"
#include "maps/cloud/global_cloud.h"
#include "maps/cloud/keyframe_cloud.h"
#include "plugin/recordings/open/mrpt_library.h"
#include "plugin/recordings/open/open_recording.h"
#include "plugin/recordings/open/recording_formats.h"
#include "test/bench/benches.h"
#include "test/bench/synthetic_window.h"
#include "test/plugin/recordings/sensors/evt_words.h"

namespace efm::bench {
namespace {

constexpr std::uint64_t kInsertedKeyframe = 1'000'000;  // an unused number

std::vector<CloudPoint> keyframeCloud(const SensorSize& sensor) {
  const SyntheticWindow made = makeSyntheticWindow(sensor.window(2));
  KeyframeMapper mapper(made.rig, {0, 1}, made.options);
  const auto keyframe =
      mapper.map(made.window, {made.events.begin(), made.events.end()}, made.trajectory);
  if (!keyframe) return {};
  return pointsInWorld(viewPoints(*keyframe), keyframe->T_world_ref);
}

/// Returns random points in a hall, in keyframes of 100,000 points.
GlobalCloud hallOf(std::uint64_t points) {
  constexpr std::uint64_t kPerKeyframe = 100'000;
  std::mt19937 random(1);
  std::uniform_real_distribution<double> side_m(-20, 20);
  std::uniform_real_distribution<double> height_m(0, 5);
  GlobalCloud map;
  for (std::uint64_t keyframe = 0; points > 0; ++keyframe) {
    std::vector<CloudPoint> cloud(std::min(points, kPerKeyframe));
    for (CloudPoint& point : cloud) {
      point.p_world = {side_m(random), side_m(random), height_m(random)};
      point.confidence = 1;
    }
    map.insert(keyframe, cloud);
    points -= cloud.size();
  }
  return map;
}

}  // namespace

void addGlobalCloud(const Sensors& sensors) {
  const auto cloud = lazily([sensor = sensors.front()] { return keyframeCloud(sensor); });
  for (const std::uint64_t points : {1'000, 100'000, 10'000'000}) {
    const auto map = lazily([=] { return hallOf(points); });  // all maps stay in memory
    add("global_cloud/insertion/into " + std::to_string(points) + " points",
        [=](benchmark::State& state) {
          GlobalCloud& into = map();
          const std::vector<CloudPoint>& inserted = cloud();
          for (auto _ : state) {
            into.insert(kInsertedKeyframe, inserted);
            state.PauseTiming();
            into.remove(kInsertedKeyframe);
            state.ResumeTiming();
          }
          countRate(state, "points/s", static_cast<double>(inserted.size()));
        });
  }
}

namespace {

namespace fs = std::filesystem;

/// Sets irregular times as of a sensor, about one event per microsecond.
void makeIrregular(std::vector<Event>& events, std::int64_t tick_ns) {
  std::mt19937_64 random(1);
  const auto end_tick = static_cast<std::int64_t>(events.size()) * 1000 / tick_ns;
  std::uniform_int_distribution<std::int64_t> tick(0, end_tick);
  for (Event& event : events) event.t_ns = 1'000'000'000 + tick_ns * tick(random);
  std::sort(events.begin(), events.end(),
            [](const Event& a, const Event& b) { return a.t_ns < b.t_ns; });
}

/// Writes a folder in the UZH layout: one camera, decimal seconds with nine digits.
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

/// Imports a text folder into a rawlog.
void writeRawlog(const fs::path& file, const fs::path& folder) {
  RecordingSource source;
  source.files = {folder};
  const std::unique_ptr<Recording> recording = openRecording(source);
  const auto writer = mrptLibrary("rawlog").writeRawlog(file, RawlogCompression::kGzip, *recording);
  while (const auto sample = recording->next()) writer->write(*sample);
  writer->close();
}

/// Reads a recording from beginning to end.
void readAll(benchmark::State& state, const fs::path& path) {
  RecordingSource source;
  source.files = {path};
  std::size_t events = 0;
  for (auto _ : state) {
    events = 0;
    const std::unique_ptr<Recording> recording = openRecording(source);
    while (const auto sample = recording->next()) {
      const auto* packet = std::get_if<EventPacket>(&*sample);
      if (packet != nullptr) events += packet->events.size();
    }
  }
  countRate(state, "events/s", static_cast<double>(events));
}

/// Only decodes the events of a recording's first camera.
void decodeAll(benchmark::State& state, const fs::path& path) {
  const RecordingFormat& format = *detectFormat(path);
  std::vector<Event> block;
  std::size_t events = 0;
  for (auto _ : state) {
    events = 0;
    RecordingParts parts = format.open({path}, {});
    while (parts.cameras.front()->read(block)) events += block.size();
  }
  countRate(state, "events/s", static_cast<double>(events));
}

/// Returns events of an edge that adjacent pixels see at once: runs of eight in a row.
std::vector<Event> runsOf(const std::vector<Event>& events, int width) {
  constexpr std::size_t kRun = 8;
  std::vector<Event> runs;
  for (std::size_t i = 0; i < events.size(); i += kRun) {
    Event event = events[i];
    event.x = static_cast<std::uint16_t>(std::min<int>(event.x, width - static_cast<int>(kRun)));
    for (std::size_t k = 0; k < kRun; ++k, ++event.x) runs.push_back(event);
  }
  return runs;
}

void writeRaw(const fs::path& file, const std::string& version, EvtEncoding encoding,
              const std::vector<Event>& events) {
  std::ofstream(file, std::ios::binary) << "% evt " << version << "\n% geometry 240x180\n% end\n"
                                        << evtBytes(encoding, events);
}

/// A folder with the lifetime of this object.
class ScratchFolder {
 public:
  ScratchFolder()
      : path_(fs::temp_directory_path() / ("event_fusion_bench." + std::to_string(getpid()))) {
    fs::create_directories(path_);
  }
  ~ScratchFolder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;
  const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

/// @param tick_ns resolution of the times, nanoseconds.
SyntheticWindow irregularWindow(std::size_t count, std::int64_t tick_ns) {
  // The sensor of a UZH folder without images has 240x180 pixels.
  SyntheticWindow made = makeSyntheticWindow({240, 180, count, 1});
  makeIrregular(made.events.front(), tick_ns);
  return made;
}

}  // namespace

void addReading(const Sensors& sensors) {
  const std::size_t count = sensors.back().events;
  const auto scratch = lazily([] { return ScratchFolder(); });
  const auto us = lazily([=] { return irregularWindow(count, 1000); });
  const auto file = [=](const char* name, const auto& write) {
    return lazily([=] {
      const fs::path path = scratch().path() / name;
      write(path);
      return path;
    });
  };
  const auto text = file("us", [=](const fs::path& path) { writeTextFolder(path, us()); });
  const auto text_ns =
      file("ns", [=](const fs::path& path) { writeTextFolder(path, irregularWindow(count, 1)); });

  const auto add_reading = [](const std::string& name, const auto& path) {
    add("reading/recording/" + name, [=](benchmark::State& state) { readAll(state, path()); });
  };
  // The number of bytes per event differs.
  add_reading("rawlog of us",
              file("us.rawlog", [=](const fs::path& path) { writeRawlog(path, text()); }));
  add_reading("rawlog of ns",
              file("ns.rawlog", [=](const fs::path& path) { writeRawlog(path, text_ns()); }));
  add_reading("text", text);

  const auto add_decoding = [](const std::string& name, const auto& path) {
    add("reading/decoding/" + name, [=](benchmark::State& state) { decodeAll(state, path()); });
  };
  const auto add_raw = [&](const std::string& name, const char* version, EvtEncoding encoding,
                           bool runs) {
    add_decoding(name, file(runs ? "runs.raw" : version, [=](const fs::path& path) {
                   const std::vector<Event>& events = us().events.front();
                   writeRaw(path, version, encoding, runs ? runsOf(events, 240) : events);
                 }));
  };
  add_decoding("text", text);
  add_raw("EVT 2.0", "2.0", EvtEncoding::kEvt2, false);
  add_raw("EVT 3.0", "3.0", EvtEncoding::kEvt3, false);
  add_raw("EVT 3.0, runs of 8 pixels", "3.0", EvtEncoding::kEvt3, true);
}

}  // namespace efm::bench
