// SPDX-License-Identifier: BSD-3-Clause
#include "test/studies/recordings/recording_cache.h"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <fstream>
#include <iostream>
#include <limits>
#include <stdexcept>
#include <type_traits>
#include <utility>

#include "mapping/geometry/timestamp.h"
#include "tracking_stub/rendering/frame_renderer.h"

namespace efm::studies {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kMagic = 0x32'59'44'55'54'53'4d'45;  // "EMSTUDY2", little-endian

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
  // The textures, in the first image of the first camera.
  const RigCamera& camera = simulation.rig.cameras.front();
  const FrameRenderer renderer(camera.model);
  const Rigid3 T_world_cam = simulation.motion->poseAt(simulation.start_ns) * camera.T_rig_cam;
  Frame frame;
  renderer.render(renderer.viewFrom(simulation.scene, T_world_cam), frame);
  print.addImage(frame.log_intensity);
}

/// Reads numbers and arrays of plain values.
class RecordingReader {
 public:
  explicit RecordingReader(const fs::path& file) : file_(file), stream_(file, std::ios::binary) {
    if (number() != kMagic) {
      throw std::runtime_error(file.string() + ": not a recording of studies: remove it");
    }
  }
  std::uint64_t number() {
    std::uint64_t value = 0;
    stream_.read(reinterpret_cast<char*>(&value), sizeof value);
    return value;
  }
  template <typename Value>
  std::vector<Value> array() {
    std::vector<Value> values(number());
    stream_.read(reinterpret_cast<char*>(values.data()),
                 static_cast<std::streamsize>(values.size() * sizeof(Value)));
    if (!stream_) throw std::runtime_error(file_.string() + ": ends too soon: remove it");
    return values;
  }

 private:
  fs::path file_;
  std::ifstream stream_;
};

/// The file gets its name when it is complete.
class RecordingWriter {
 public:
  explicit RecordingWriter(const fs::path& file)
      : file_(file),
        unfinished_(file.string() + ".unfinished"),
        stream_(unfinished_, std::ios::binary) {
    number(kMagic);
  }
  void number(std::uint64_t value) {
    stream_.write(reinterpret_cast<const char*>(&value), sizeof value);
  }
  template <typename Value>
  void array(const std::vector<Value>& values) {
    number(values.size());
    stream_.write(reinterpret_cast<const char*>(values.data()),
                  static_cast<std::streamsize>(values.size() * sizeof(Value)));
  }
  void finish() {
    stream_.close();
    if (!stream_) throw std::runtime_error(unfinished_.string() + ": cannot be written");
    fs::rename(unfinished_, file_);
  }

 private:
  fs::path file_;
  fs::path unfinished_;
  std::ofstream stream_;
};

void read(const fs::path& file, Recording& recording) {
  RecordingReader reader(file);
  const std::uint64_t cameras = reader.number();
  for (std::uint64_t camera = 0; camera < cameras; ++camera) {
    recording.events.push_back(reader.array<Event>());
    recording.sources.push_back(reader.array<Eigen::Vector3f>());
  }
}

void write(const fs::path& file, const Recording& recording) {
  static_assert(std::is_trivially_copyable_v<Event>);
  RecordingWriter writer(file);
  writer.number(recording.events.size());
  for (std::size_t camera = 0; camera < recording.events.size(); ++camera) {
    writer.array(recording.events[camera]);
    writer.array(recording.sources[camera]);
  }
  writer.finish();
}

std::vector<Eigen::Vector3f> pointsOf(const std::vector<SurfacePoint>& sources,
                                      const Scene& scene) {
  std::vector<Eigen::Vector3f> points;
  points.reserve(sources.size());
  const Eigen::Vector3f none = Eigen::Vector3f::Constant(std::numeric_limits<float>::quiet_NaN());
  for (const SurfacePoint& source : sources) {
    points.push_back(none);
    if (source.surface >= 0) points.back() = scene.pointAt(source).cast<float>();
  }
  return points;
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

std::vector<EventSpan> Recording::eventsOf(const Window& window) const {
  std::vector<EventSpan> spans;
  for (std::size_t c = 0; c < events.size(); ++c) spans.push_back(eventsOf(c, window));
  return spans;
}

double Recording::meanEventsIn(const std::vector<Window>& windows) const {
  std::size_t count = 0;
  for (const Window& window : windows) {
    for (const EventSpan& span : eventsOf(window)) count += span.size();
  }
  return static_cast<double>(count) / static_cast<double>(windows.size());
}

std::uint64_t fingerprintOf(const Simulation& simulation) {
  constexpr std::int64_t kSampleNs = 20'000'000;
  Fingerprint print;
  for (const RigCamera& camera : simulation.rig.cameras) addCamera(camera, print);
  for (std::int64_t t_ns = simulation.start_ns; t_ns < simulation.endNs(); t_ns += kSampleNs) {
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
  print.add(simulation.noise.hot_fraction);
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
    read(file, recording);
    return recording;
  }
  std::cout << "  simulating " << name << std::flush;
  const auto began = std::chrono::steady_clock::now();
  for (CameraRecording& camera : simulateEvents(simulation)) {
    recording.sources.push_back(pointsOf(camera.sources, simulation.scene));
    recording.events.push_back(std::move(camera.events));
  }
  write(file, recording);
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - began;
  std::cout << ": " << took.count() << " s\n";
  return recording;
}

}  // namespace efm::studies
