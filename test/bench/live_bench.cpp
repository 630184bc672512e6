// SPDX-License-Identifier: BSD-3-Clause
// Simulates a live host: one thread feeds a recording to the map builder at the sensor's speed,
// another thread asks for every result 50 times a second. Prints the durations of the calls, the
// lost data and the growth of memory.
#include <fmt/format.h>
#include <malloc.h>
#include <mrpt/maps/CSimpleMap.h>
#include <mrpt/obs/CObservationRobotPose.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <deque>
#include <fstream>
#include <map>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "mapping/geometry/timestamp.h"
#include "maps/io/point_cloud_file.h"
#include "plugin/mrpt/CEventFusionMapBuilder.h"
#include "plugin/mrpt/CObservationEvents.h"
#include "plugin/mrpt/pose_observation.h"
#include "plugin/mrpt/rawlog.h"
#include "plugin/options/option_file.h"
#include "plugin/recordings/open/open_recording.h"

namespace efm {
namespace {

using Clock = std::chrono::steady_clock;
using mrpt::obs::CObservation;

struct Arguments {
  std::string recording;
  std::string config;
  std::vector<std::string> set;
  std::string pcd;
  double seconds = 0;
  double speed = 1;
  int rate = 1;
  std::vector<double> lost;         // from and to: the tracker is silent
  std::vector<double> silent;       // from and to: camera 1 is silent
  std::vector<double> jumps;        // times: the tracker jumps
  std::vector<double> ahead;        // times: an event is 100 s ahead
  std::vector<double> ahead_poses;  // times: a pose is 100 s ahead
  std::vector<double> back;         // times: all clocks go back by 100 s
  bool late = false;                // one event per packet of camera 1 is 20 ms late
  bool throwing_log = false;        // the host's log throws
};

double millisecondsSince(Clock::time_point begin) {
  return std::chrono::duration<double, std::milli>(Clock::now() - begin).count();
}

/// Durations of one kind of call.
class Latencies {
 public:
  void add(double ms) { all_ms_.push_back(ms); }
  std::string text() {
    if (all_ms_.empty()) return "no call";
    std::sort(all_ms_.begin(), all_ms_.end());
    const auto at = [&](double fraction) {
      return all_ms_[static_cast<std::size_t>(fraction * static_cast<double>(all_ms_.size() - 1))];
    };
    return fmt::format("{:>7} calls, median {:.3f} ms, 99 % {:.3f} ms, max {:.3f} ms",
                       all_ms_.size(), at(0.5), at(0.99), at(1));
  }

 private:
  std::vector<double> all_ms_;
};

/// Returns the memory of the process and the part in use; the rest is kept for later allocations.
std::string memory() {
  std::ifstream status("/proc/self/statm");
  double pages = 0;
  status >> pages >> pages;
  const auto heap = ::mallinfo2();
  return fmt::format("{:.0f} MB, {:.0f} MB in use", pages * 4096e-6,
                     static_cast<double>(heap.uordblks + heap.hblkhd) * 1e-6);
}

std::string refinementOf(const SessionStatus& status) {
  const auto& state = status.refinement;
  if (!state) return "";
  return fmt::format("; refined in {:.1f} s, at most {:.2f} s for a keyframe, {} loops, {} wait",
                     state->seconds, state->most_seconds, state->counts.loops, state->waiting);
}

/// An endless recording: forward, backward in time, forward again. Each event comes `rate` times.
class EndlessRecording {
 public:
  EndlessRecording(std::vector<CObservation::Ptr> forward, int rate)
      : forward_(std::move(forward)), rate_(rate) {
    for (const CObservation::Ptr& observation : forward_) {
      const std::int64_t t_ns = nanosecondsFrom(observation->timestamp);
      first_ns_ = std::min(first_ns_, t_ns);
      const auto packet = std::dynamic_pointer_cast<CObservationEvents>(observation);
      last_ns_ =
          std::max(last_ns_, packet && !packet->events.empty() ? packet->events.back().t_ns : t_ns);
    }
    last_ns_ += 1'000'000;
  }

  std::int64_t firstNs() const { return first_ns_; }
  CObservation::Ptr next() {
    if (at_ == forward_.size()) {
      at_ = 0;
      ++repetition_;
    }
    const bool backward = repetition_ % 2 == 1;
    const std::size_t index = backward ? forward_.size() - 1 - at_ : at_;
    ++at_;
    const std::int64_t span_ns = last_ns_ - first_ns_;
    const std::int64_t shift_ns = repetition_ * span_ns;
    const auto moved = [&](std::int64_t t_ns) {
      return (backward ? first_ns_ + (last_ns_ - t_ns) : t_ns) + shift_ns;
    };
    const CObservation::Ptr& original = forward_[index];
    auto copy = std::dynamic_pointer_cast<CObservation>(original->duplicateGetSmartPtr());
    const auto packet = std::dynamic_pointer_cast<CObservationEvents>(copy);
    if (!packet) {
      copy->timestamp = mrptTimeFrom(moved(nanosecondsFrom(original->timestamp)));
      return copy;
    }
    if (backward) std::reverse(packet->events.begin(), packet->events.end());
    std::vector<Event> events;
    events.reserve(packet->events.size() * static_cast<std::size_t>(rate_));
    for (Event event : packet->events) {
      event.t_ns = moved(event.t_ns);
      if (backward) event.polarity = !event.polarity;
      events.insert(events.end(), static_cast<std::size_t>(rate_), event);
    }
    packet->events = std::move(events);
    packet->covered_until_ns.reset();
    if (!packet->events.empty()) packet->timestamp = mrptTimeFrom(packet->events.front().t_ns);
    return copy;
  }

 private:
  std::vector<CObservation::Ptr> forward_;
  int rate_;
  std::int64_t first_ns_ = kMaxTimeNs;
  std::int64_t last_ns_ = kMinTimeNs;
  std::size_t at_ = 0;
  std::int64_t repetition_ = 0;
};

std::vector<CObservation::Ptr> readAll(const std::string& path) {
  RecordingSource source;
  source.files = {path};
  const std::unique_ptr<Recording> recording = openRecording(source);
  std::vector<CObservation::Ptr> observations;
  while (auto sample = recording->next()) observations.push_back(observationOf(std::move(*sample)));
  return observations;
}

/// A thread that asks for every result 50 times a second until this object is destroyed.
class Poller {
 public:
  explicit Poller(CEventFusionMapBuilder& builder) : builder_(builder) {
    thread_ = std::thread([this] { run(); });
  }
  ~Poller() {
    stop_ = true;
    thread_.join();
    for (auto& [name, latencies] : latencies_) {
      fmt::print("  {:<28} {}\n", name, latencies.text());
    }
  }

 private:
  template <typename Call>
  void time(const char* name, Call call) {
    const Clock::time_point begin = Clock::now();
    call();
    latencies_[name].add(millisecondsSince(begin));
  }
  void run() {
    Clock::time_point next = Clock::now();
    while (!stop_) {
      next += std::chrono::milliseconds(20);
      time("getCurrentPoseEstimation", [&] { builder_.getCurrentPoseEstimation(); });
      time("getCurrentlyBuiltMap", [&] {
        mrpt::maps::CSimpleMap map;
        builder_.getCurrentlyBuiltMap(map);
      });
      time("getCurrentlyBuiltMetricMap", [&] { builder_.getCurrentlyBuiltMetricMap(); });
      time("snapshot", [&] { builder_.snapshot(); });
      time("status", [&] { builder_.status(); });
      std::this_thread::sleep_until(next);
    }
  }

  CEventFusionMapBuilder& builder_;
  std::map<std::string, Latencies> latencies_;
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

std::uint64_t hashOf(const MapCloud& cloud) {
  std::uint64_t hash = 1469598103934665603ULL;  // FNV-1a
  for (const MapPoint& point : cloud) {
    const auto* bytes = reinterpret_cast<const unsigned char*>(point.data);
    for (std::size_t i = 0; i < 3 * sizeof(float); ++i) hash = (hash ^ bytes[i]) * 1099511628211ULL;
  }
  return hash;
}

void printCounts(const SessionStatus& status) {
  for (const auto& [camera, queue] : status.live->cameras) {
    const EventCounts& counts = status.counts.cameras.at(static_cast<std::size_t>(camera));
    const std::uint64_t before = queue.held + queue.queued + queue.fates.total();
    fmt::print(
        "camera {}: received {}, thinned {}, dropped {}, used {}, without pose {}, the sums {}\n",
        camera, queue.received, queue.fates[EventFate::kSubsampled],
        queue.fates[EventFate::kQueueFull], counts[EventFate::kUsed],
        counts[EventFate::kWithoutPose],
        queue.received == before + queue.taken ? "agree" : "DIFFER");
  }
  fmt::print("{} keyframes, {}, {} jumps, {} clock resets, {} errors {}; drop ratio {:.3f}\n",
             status.counts.keyframes, asText(status.counts.dropped_windows),
             status.live->pose_jumps, status.live->clock_resets, status.live->errors,
             status.live->last_error, status.live->dropRatio());
}

void run(const Arguments& arguments) {
  OptionReader reader;
  if (!arguments.config.empty()) reader.readFile(arguments.config);
  reader.set("live.enabled=true");
  for (const std::string& assignment : arguments.set) reader.set(assignment);
  EndlessRecording recording(readAll(arguments.recording), arguments.rate);
  CEventFusionMapBuilder builder(reader.options());
  if (arguments.throwing_log) {
    builder.logging_enable_console_output = false;
    builder.logRegisterCallback([](auto&&...) { throw std::runtime_error("the log is full"); });
  }

  std::mutex mutex;
  std::deque<std::pair<std::int64_t, Clock::time_point>> fed;  // newest time of the events
  Latencies of_keyframes;
  builder.setKeyframeCallback([&](const KeyframeDepthMap& keyframe) {
    const std::lock_guard<std::mutex> lock(mutex);
    while (fed.size() > 1 && fed.front().first < keyframe.window.t1_ns) fed.pop_front();
    of_keyframes.add(millisecondsSince(fed.front().second));
  });

  std::size_t ahead = 0;
  std::size_t ahead_poses = 0;
  Latencies of_observations;
  double next_memory_s = 0;
  {
    const Poller poller(builder);
    const Clock::time_point begin = Clock::now();
    while (true) {
      const CObservation::Ptr observation = recording.next();
      const auto packet = std::dynamic_pointer_cast<CObservationEvents>(observation);
      const std::int64_t t_ns = packet && !packet->events.empty()
                                    ? packet->events.back().t_ns
                                    : nanosecondsFrom(observation->timestamp);
      const double t_s = secondsBetween(recording.firstNs(), t_ns);
      if (t_s > arguments.seconds) break;
      const auto during = [&](const std::vector<double>& span) {
        return span.size() == 2 && t_s >= span[0] && t_s < span[1];
      };
      if (!packet && during(arguments.lost)) continue;
      if (packet && packet->camera_index == 1 && during(arguments.silent)) continue;
      if (arguments.late && packet && packet->camera_index == 1 && !packet->events.empty()) {
        packet->events.push_back(packet->events.back());
        packet->events.back().t_ns -= 20'000'000;
      }
      if (const auto pose =
              std::dynamic_pointer_cast<mrpt::obs::CObservationRobotPose>(observation)) {
        const auto jumps = std::count_if(arguments.jumps.begin(), arguments.jumps.end(),
                                         [&](double jump_s) { return t_s >= jump_s; });
        pose->pose.mean.y_incr(10 * static_cast<double>(jumps));
      }
      constexpr std::int64_t kFarNs = 100 * kNanosecondsPerSecond;
      if (packet && !packet->events.empty() && ahead < arguments.ahead.size() &&
          t_s >= arguments.ahead[ahead]) {
        ++ahead;
        packet->events.push_back(packet->events.back());
        packet->events.back().t_ns += kFarNs;
      }
      const bool pose_ahead = !packet && ahead_poses < arguments.ahead_poses.size() &&
                              t_s >= arguments.ahead_poses[ahead_poses];
      if (pose_ahead) {
        ++ahead_poses;
        observation->timestamp = mrptTimeFrom(t_ns + kFarNs);
      }
      for (const double back_s : arguments.back) {
        if (t_s < back_s) continue;
        observation->timestamp = mrptTimeFrom(nanosecondsFrom(observation->timestamp) - kFarNs);
        if (!packet) continue;
        for (Event& event : packet->events) event.t_ns -= kFarNs;
      }
      if (arguments.speed > 0) {
        std::this_thread::sleep_until(begin +
                                      std::chrono::duration_cast<Clock::duration>(
                                          std::chrono::duration<double>(t_s / arguments.speed)));
      }
      if (packet && packet->camera_index == 0) {
        const std::lock_guard<std::mutex> lock(mutex);
        fed.emplace_back(t_ns, Clock::now());
      }
      const Clock::time_point call = Clock::now();
      builder.processObservation(observation);
      of_observations.add(millisecondsSince(call));
      if (t_s >= next_memory_s) {
        const SessionStatus status = builder.status();
        fmt::print("{:6.0f} s: {}, {} keyframes{}\n", t_s, memory(), status.counts.keyframes,
                   refinementOf(status));
        std::fflush(stdout);
        next_memory_s += std::max(1.0, arguments.seconds / 20);
      }
    }
    fmt::print("duration of calls:\n  {:<28} {}\n", "processObservation", of_observations.text());
  }
  builder.finish();
  const auto points = builder.points();
  fmt::print("from the last event of a window to its keyframe: {}\n", of_keyframes.text());
  printCounts(builder.status());
  fmt::print("{} at the end{}; {} points, hash {:016x}\n", memory(), refinementOf(builder.status()),
             points->size(), hashOf(*points));
  if (!arguments.pcd.empty()) writePcd(arguments.pcd, *points);
}

}  // namespace
}  // namespace efm

int main(int argc, char** argv) {
  efm::Arguments arguments;
  CLI::App app("Feeds a recording to a live map builder at the sensor's speed and measures it");
  app.add_option("recording", arguments.recording, "A recording of two cameras")->required();
  app.add_option("--seconds", arguments.seconds,
                 "Length; the recording is played forward, backward, forward, ...")
      ->required();
  app.add_option("--config", arguments.config, "An option file");
  app.add_option("--set", arguments.set, "SECTION.KEY=VALUE")->allow_extra_args(false);
  app.add_option("--speed", arguments.speed, "Times real time; 0: without a wait");
  app.add_option("--rate", arguments.rate, "How often each event comes");
  app.add_option("--lost", arguments.lost, "The tracker is silent FROM TO, seconds")->expected(2);
  app.add_option("--silent", arguments.silent, "Camera 1 is silent FROM TO, seconds")->expected(2);
  app.add_option("--jumps", arguments.jumps, "The tracker jumps by 10 m at these times, seconds");
  app.add_option("--ahead", arguments.ahead, "An event comes 100 s ahead at these times, seconds");
  app.add_option("--ahead-poses", arguments.ahead_poses, "A pose comes 100 s ahead");
  app.add_option("--back", arguments.back, "All clocks go back by 100 s at these times, seconds");
  app.add_flag("--late", arguments.late, "An event of each packet of camera 1 comes 20 ms late");
  app.add_flag("--throwing-log", arguments.throwing_log, "The host's log throws");
  app.add_option("--pcd", arguments.pcd, "Writes the map");
  CLI11_PARSE(app, argc, argv);
  try {
    efm::run(arguments);
  } catch (const std::exception& error) {
    fmt::print(stderr, "live_bench: error: {}\n", error.what());
    return 1;
  }
  return 0;
}
