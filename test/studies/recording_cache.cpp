// SPDX-License-Identifier: BSD-3-Clause
#include "test/studies/recording_cache.h"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <fstream>
#include <iostream>
#include <stdexcept>
#include <type_traits>
#include <utility>

#include "mapping/timestamp.h"
#include "tracking_stub/frame_renderer.h"

namespace efm::studies {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kMagic = 0x31'59'44'55'54'53'4d'45;  // "EMSTUDY1", little-endian

/// FNV-1a over the bytes of numbers.
class Fingerprint {
 public:
  template <typename Number>
  void add(Number number) {
    static_assert(std::is_arithmetic_v<Number>);
    addBytes(&number, sizeof number);
  }
  template <typename Derived>
  void addVector(const Eigen::MatrixBase<Derived>& vector) {
    for (Eigen::Index i = 0; i < vector.size(); ++i) add(vector(i));
  }
  void addPose(const Rigid3& T_a_b) {
    addVector(T_a_b.rotation.coeffs());
    addVector(T_a_b.translation);
  }
  void addImage(const cv::Mat1f& image) {
    for (int y = 0; y < image.rows; ++y) {
      addBytes(image.ptr(y), static_cast<std::size_t>(image.cols) * sizeof(float));
    }
  }
  std::uint64_t value() const { return value_; }

 private:
  void addBytes(const void* data, std::size_t size) {
    const auto* bytes = static_cast<const unsigned char*>(data);
    for (std::size_t i = 0; i < size; ++i) value_ = (value_ ^ bytes[i]) * 0x100000001b3U;
  }

  std::uint64_t value_ = 0xcbf29ce484222325U;
};

void addCamera(const RigCamera& camera, Fingerprint& print) {
  print.add(camera.model.width);
  print.add(camera.model.height);
  for (const double value : {camera.model.fx, camera.model.fy, camera.model.cx, camera.model.cy}) {
    print.add(value);
  }
  print.add(static_cast<int>(camera.model.distortion));
  for (const double coefficient : camera.model.coefficients) print.add(coefficient);
  print.addPose(camera.T_rig_cam);
}

void addScene(const Simulation& simulation, Fingerprint& print) {
  for (int surface = 0; surface < simulation.scene.size(); ++surface) {
    const Rectangle& rectangle = simulation.scene.rectangle(surface);
    print.addVector(rectangle.corner);
    print.addVector(rectangle.axis_u);
    print.addVector(rectangle.axis_v);
    print.add(rectangle.width_m);
    print.add(rectangle.height_m);
  }
  // What is painted on them, as the first camera first sees it.
  const RigCamera& camera = simulation.rig.cameras.front();
  const FrameRenderer renderer(camera.model);
  const Rigid3 T_world_cam = simulation.motion->poseAt(simulation.start_ns) * camera.T_rig_cam;
  Frame frame;
  renderer.render(renderer.viewFrom(simulation.scene, T_world_cam), frame);
  print.addImage(frame.log_intensity);
}

std::vector<std::vector<Event>> readEvents(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  const auto number = [&] {
    std::uint64_t value = 0;
    stream.read(reinterpret_cast<char*>(&value), sizeof value);
    return value;
  };
  if (number() != kMagic) throw std::runtime_error(file.string() + ": not a recording of studies");
  std::vector<std::vector<Event>> cameras(number());
  for (std::vector<Event>& events : cameras) {
    events.resize(number());
    stream.read(reinterpret_cast<char*>(events.data()),
                static_cast<std::streamsize>(events.size() * sizeof(Event)));
  }
  if (!stream) throw std::runtime_error(file.string() + ": ends too soon: remove it");
  return cameras;
}

void writeEvents(const fs::path& file, const std::vector<std::vector<Event>>& cameras) {
  static_assert(std::is_trivially_copyable_v<Event>);
  const fs::path unfinished = file.string() + ".unfinished";
  std::ofstream stream(unfinished, std::ios::binary);
  const auto number = [&](std::uint64_t value) {
    stream.write(reinterpret_cast<const char*>(&value), sizeof value);
  };
  number(kMagic);
  number(cameras.size());
  for (const std::vector<Event>& events : cameras) {
    number(events.size());
    stream.write(reinterpret_cast<const char*>(events.data()),
                 static_cast<std::streamsize>(events.size() * sizeof(Event)));
  }
  stream.close();
  if (!stream) throw std::runtime_error(unfinished.string() + ": cannot be written");
  fs::rename(unfinished, file);
}

}  // namespace

std::vector<Window> Recording::windows(double window_s, int count) const {
  const std::int64_t length_ns = std::min(durationFromSeconds(window_s), simulation.duration_ns);
  const std::int64_t room_ns = simulation.duration_ns - length_ns;
  std::vector<Window> windows;
  for (int i = 0; i < count; ++i) {
    const std::int64_t t0_ns = simulation.start_ns + (count > 1 ? room_ns * i / (count - 1) : 0);
    windows.push_back({t0_ns, t0_ns + length_ns, t0_ns + length_ns / 2});
  }
  return windows;
}

EventSpan Recording::eventsOf(std::size_t camera, const Window& window) const {
  const std::vector<Event>& all = events.at(camera);
  const auto earlier = [](const Event& event, std::int64_t t_ns) { return event.t_ns < t_ns; };
  const auto first = std::lower_bound(all.begin(), all.end(), window.t0_ns, earlier);
  const auto last = std::lower_bound(first, all.end(), window.t1_ns, earlier);
  return EventSpan(all).part(static_cast<std::size_t>(first - all.begin()),
                             static_cast<std::size_t>(last - all.begin()));
}

std::uint64_t Recording::eventsIn(const Window& window) const {
  std::uint64_t count = 0;
  for (std::size_t c = 0; c < events.size(); ++c) count += eventsOf(c, window).size();
  return count;
}

std::uint64_t fingerprintOf(const Simulation& simulation) {
  constexpr std::int64_t kLookNs = 20'000'000;
  Fingerprint print;
  for (const RigCamera& camera : simulation.rig.cameras) addCamera(camera, print);
  for (std::int64_t t_ns = simulation.start_ns; t_ns < simulation.endNs(); t_ns += kLookNs) {
    print.addPose(simulation.motion->poseAt(t_ns));
  }
  addScene(simulation, print);
  print.add(simulation.start_ns);
  print.add(simulation.duration_ns);
  print.add(simulation.pixels.threshold_on);
  print.add(simulation.pixels.threshold_off);
  print.add(simulation.pixels.mismatch);
  print.add(simulation.pixels.refractory_ns);
  print.add(simulation.noise.background_hz);
  print.add(simulation.noise.hot_share);
  print.add(simulation.noise.hot_hz);
  print.add(simulation.max_step_px);
  print.add(simulation.seed);
  return print.value();
}

RecordingCache::RecordingCache(fs::path folder) : folder_(std::move(folder)) {
  fs::create_directories(folder_);
}

Recording RecordingCache::make(const std::string& name, const Simulation& simulation) const {
  Recording recording;
  recording.simulation = simulation;
  for (const StampedPose& pose : samplePoses(simulation)) recording.trajectory.add(pose);

  char print[17];
  std::snprintf(print, sizeof print, "%016llx",
                static_cast<unsigned long long>(fingerprintOf(simulation)));
  const fs::path file = folder_ / (name + "_" + print + ".events");
  if (fs::exists(file)) {
    recording.events = readEvents(file);
    return recording;
  }
  std::cout << "  simulating " << name << std::flush;
  const auto began = std::chrono::steady_clock::now();
  for (CameraRecording& camera : simulateEvents(simulation)) {
    recording.events.push_back(std::move(camera.events));
  }
  writeEvents(file, recording.events);
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - began;
  std::cout << ": " << took.count() << " s\n";
  return recording;
}

}  // namespace efm::studies
