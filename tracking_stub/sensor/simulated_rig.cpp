// SPDX-License-Identifier: BSD-3-Clause
#include "tracking_stub/sensor/simulated_rig.h"

#include <tbb/blocked_range.h>
#include <tbb/global_control.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <tuple>
#include <utility>

#include "mapping/base/option.h"
#include "mapping/geometry/timestamp.h"
#include "tracking_stub/rendering/frame_renderer.h"

namespace efm {
namespace {

bool isRate(double hz) { return hz >= 0 && hz <= EventNoiseOptions::kMaxHz; }

std::int64_t roundToMicroseconds(std::int64_t base_ns, double offset_ns) {
  // Only the part below a microsecond is computed as a double, which keeps long times exact.
  constexpr std::int64_t kNanosecondsPerMicrosecond = 1000;
  const std::int64_t whole = base_ns / kNanosecondsPerMicrosecond;
  const auto rest_ns = static_cast<double>(base_ns - whole * kNanosecondsPerMicrosecond);
  return (whole + std::llround((rest_ns + offset_ns) / kNanosecondsPerMicrosecond)) *
         kNanosecondsPerMicrosecond;
}

}  // namespace

void EventNoiseOptions::validate() const {
  requireOption(isRate(background_hz), "background_hz", background_hz, "0 to 1e5");
  requireOption(hot_fraction >= 0 && hot_fraction <= 1, "hot_fraction", hot_fraction, "0 to 1");
  requireOption(isRate(hot_hz), "hot_hz", hot_hz, "0 to 1e5");
}

EventNoise::EventNoise(int width, int height, const EventNoiseOptions& options, const Start& start)
    : width_(static_cast<std::size_t>(width)) {
  constexpr std::uint64_t kFirstStream = 1000;
  options.validate();
  if (options.background_hz == 0 && options.hot_fraction * options.hot_hz == 0) return;
  const std::size_t count = width_ * static_cast<std::size_t>(height);
  pixels_.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    Pixel pixel = {RandomNumbers(start.seed, kFirstStream + i), 0, start.t_ns};
    const bool hot = pixel.random.uniform() < options.hot_fraction;
    pixel.rate_hz = options.background_hz + (hot ? options.hot_hz : 0);
    draw(pixel);
    pixels_.push_back(pixel);
  }
}

void EventNoise::draw(Pixel& pixel) {
  constexpr double kMaxWaitS = 1e9;  // longer than any recording; sums fit 64 bits
  const double wait_s =
      pixel.rate_hz > 0 ? -std::log(1 - pixel.random.uniform()) / pixel.rate_hz : kMaxWaitS;
  pixel.next_ns += durationFromSeconds(std::min(wait_s, kMaxWaitS));
}

void EventNoise::fireRow(int y, std::int64_t until_ns, std::vector<Event>& events) {
  if (pixels_.empty()) return;
  Pixel* row = pixels_.data() + static_cast<std::size_t>(y) * width_;
  for (std::size_t x = 0; x < width_; ++x) {
    Pixel& pixel = row[x];
    while (true) {
      // Rounded up to whole microseconds, the stamps of sensors.
      constexpr std::int64_t kTickNs = 1000;
      const std::int64_t whole = pixel.next_ns / kTickNs;
      const std::int64_t t_ns = (whole + (whole * kTickNs < pixel.next_ns ? 1 : 0)) * kTickNs;
      if (t_ns > until_ns) break;
      events.push_back({t_ns, static_cast<std::uint16_t>(x), static_cast<std::uint16_t>(y),
                        pixel.random.below(2) == 0});
      draw(pixel);
    }
  }
}

void EventPixelOptions::validate() const {
  requireOption(threshold_on >= kMinThreshold && std::isfinite(threshold_on), "threshold_on",
                threshold_on, "0.01 or more");
  requireOption(threshold_off >= kMinThreshold && std::isfinite(threshold_off), "threshold_off",
                threshold_off, "0.01 or more");
  requireOption(mismatch >= 0 && mismatch <= 0.5, "mismatch", mismatch, "0 to 0.5");
  requireOption(refractory_ns >= 0 && refractory_ns <= kNanosecondsPerSecond, "refractory_ns",
                refractory_ns, "0 to 1e9");
}

EventPixels::EventPixels(int width, int height, const EventPixelOptions& options,
                         std::uint64_t seed)
    : on_(static_cast<float>(options.threshold_on)),
      off_(static_cast<float>(options.threshold_off)),
      refractory_ns_(options.refractory_ns),
      last_(height, width, 0.0F) {
  constexpr std::uint64_t kMismatchStream = 1;
  constexpr double kMinFactor = 0.2;
  options.validate();
  if (options.mismatch > 0) {
    factor_.create(height, width);
    RandomNumbers random(seed, kMismatchStream);
    for (float& factor : factor_) {
      factor = static_cast<float>(std::max(kMinFactor, 1 + options.mismatch * random.normal()));
    }
  }
  if (refractory_ns_ > 0) blind_until_.assign(last_.total(), -kEndOfTimeNs);
}

void EventPixels::start(const cv::Mat1f& log_intensity) { log_intensity.copyTo(last_); }

void EventPixels::start(const cv::Mat1f& log_intensity, std::uint64_t seed) {
  start(log_intensity);
  RandomNumbers random(seed);
  for (int y = 0; y < last_.rows; ++y) {
    for (int x = 0; x < last_.cols; ++x) {
      const auto offset = static_cast<float>(random.uniform(-1, 1));
      // If the memory is below the current intensity, the threshold of ON events limits the offset.
      last_(y, x) += thresholdAt(y, x, offset < 0) * offset;
    }
  }
}

void EventPixels::fireRow(int y, const FrameStep& step, const cv::Mat1f& before,
                          const cv::Mat1f& after, std::vector<Event>& events) {
  const float* from = before.ptr<float>(y);
  const float* to = after.ptr<float>(y);
  float* last = last_.ptr<float>(y);
  const auto duration_ns = static_cast<double>(step.t1_ns - step.t0_ns);
  std::int64_t* blind_until =
      blind_until_.empty() ? nullptr
                           : blind_until_.data() + static_cast<std::ptrdiff_t>(y) * last_.cols;
  for (int x = 0; x < last_.cols; ++x) {
    const double change = static_cast<double>(to[x]) - from[x];
    double earliest = 0;  // the pixel sees from this fraction of the step
    // Returns whether the pixel sees within this step. After a blind time its memory is the current
    // intensity.
    const auto sees = [&] {
      if (blind_until == nullptr || blind_until[x] <= step.t0_ns) return true;
      if (blind_until[x] >= step.t1_ns) return false;
      earliest = static_cast<double>(blind_until[x] - step.t0_ns) / duration_ns;
      last[x] = static_cast<float>(from[x] + earliest * change);
      return true;
    };
    if (!sees()) {
      last[x] = to[x];
      continue;
    }
    while (true) {
      const bool brighter = to[x] > last[x];
      const float threshold = thresholdAt(y, x, brighter);
      if (!(std::abs(to[x] - last[x]) >= threshold)) break;
      last[x] += brighter ? threshold : -threshold;
      // A pixel whose memory starts a threshold away fires immediately, also without a change.
      const double fraction = change == 0 ? 0.0 : (static_cast<double>(last[x]) - from[x]) / change;
      // Due to rounding, such a pixel may cross the threshold slightly outside of the step.
      const double offset_ns = std::clamp(fraction, earliest, 1.0) * duration_ns;
      const std::int64_t t_ns = roundToMicroseconds(step.t0_ns, offset_ns);
      events.push_back(
          {t_ns, static_cast<std::uint16_t>(x), static_cast<std::uint16_t>(y), brighter});
      if (blind_until == nullptr) continue;
      blind_until[x] = t_ns + refractory_ns_;
      if (!sees()) {
        last[x] = to[x];
        break;
      }
    }
  }
}

namespace {

/// The frame rate is set for each interval of this length.
constexpr std::int64_t kIntervalNs = 10'000'000;
/// Distance in pixels between the rays that measure the speed of the image.
constexpr int kSpeedGridPx = 12;

struct AttributedEvent {
  Event event;
  SurfacePoint source;
};

void validate(const Simulation& simulation) {
  requireOption(simulation.motion != nullptr, "motion", "none", "given");
  requireOption(simulation.duration_ns > 0, "duration_ns", simulation.duration_ns, "above 0");
  simulation.pixels.validate();
  simulation.noise.validate();
  requireOption(simulation.max_step_px > 0, "max_step_px", simulation.max_step_px, "above 0");
  for (const RigCamera& camera : simulation.rig.cameras) {
    camera.model.validate();
    requireOption(camera.time_offset_ns == 0, "time_offset_ns", camera.time_offset_ns,
                  "0: simulated cameras are synchronised");
  }
}

/// Records one camera of the rig.
class CameraRun {
 public:
  CameraRun(const Simulation& simulation, std::size_t camera)
      : simulation_(simulation),
        camera_(simulation.rig.cameras[camera]),
        seed_(simulation.seed * 1024 + camera),
        renderer_(camera_.model),
        pixels_(camera_.model.width, camera_.model.height, simulation.pixels, seed_),
        noise_(camera_.model.width, camera_.model.height, simulation.noise,
               {seed_, simulation.start_ns}),
        rows_(static_cast<std::size_t>(camera_.model.height)) {}

  template <typename Progress>
  CameraRecording record(const Progress& progress) {
    std::int64_t t_ns = simulation_.start_ns;
    renderer_.render(viewAt(t_ns), before_);
    pixels_.start(before_.log_intensity, seed_);
    while (t_ns < simulation_.endNs()) {
      const std::int64_t interval_ns = std::min(kIntervalNs, simulation_.endNs() - t_ns);
      const double motion_px = std::max(imageSpeed(t_ns), imageSpeed(t_ns + interval_ns)) *
                               secondsBetween(0, interval_ns);
      const auto steps =
          static_cast<std::int64_t>(std::max(1.0, std::ceil(motion_px / simulation_.max_step_px)));
      for (std::int64_t i = 0; i < steps; ++i) {
        advance({t_ns + interval_ns * i / steps, t_ns + interval_ns * (i + 1) / steps});
      }
      t_ns += interval_ns;
      progress(secondsBetween(simulation_.start_ns, t_ns) /
               secondsBetween(0, simulation_.duration_ns));
    }
    return inOrderOfTime();
  }

 private:
  SceneView viewAt(std::int64_t t_ns) const {
    return renderer_.viewFrom(simulation_.scene, poseAt(t_ns));
  }
  Rigid3 poseAt(std::int64_t t_ns) const {
    return simulation_.motion->poseAt(t_ns) * camera_.T_rig_cam;
  }

  /// Returns the maximum speed in the undistorted image, pixels per second.
  double imageSpeed(std::int64_t t_ns) const {
    constexpr std::int64_t kStepNs = 500'000;
    const Rigid3 T_world_cam = poseAt(t_ns);
    const Rigid3 T_later_world = poseAt(t_ns + kStepNs).inverse();
    const SceneView view = renderer_.viewFrom(simulation_.scene, T_world_cam);
    double max_px = 0;
    for (int y = 0; y < camera_.model.height; y += kSpeedGridPx) {
      for (int x = 0; x < camera_.model.width; x += kSpeedGridPx) {
        const PixelRay& pixel = renderer_.rays()(x, y);
        const ViewHit hit = view.cast(pixel.ray);
        if (hit.surface < 0) continue;
        const Eigen::Vector3d p_cam = pixel.ray.homogeneous() / hit.inverse_depth;
        const Eigen::Vector3d p_later = T_later_world * (T_world_cam * p_cam);
        max_px = std::max(max_px, (p_later.hnormalized() - pixel.ray).norm() / pixel.pitch);
      }
    }
    return max_px / secondsBetween(0, kStepNs);
  }

  void advance(const FrameStep& step) {
    const SceneView view = viewAt(step.t1_ns);
    renderer_.render(view, after_);
    tbb::parallel_for(tbb::blocked_range<int>(0, camera_.model.height, 8),
                      [&](const tbb::blocked_range<int>& range) {
                        for (int y = range.begin(); y < range.end(); ++y) fireRow(y, step, view);
                      });
    std::swap(before_, after_);
  }

  void fireRow(int y, const FrameStep& step, const SceneView& view) {
    std::vector<Event> fired;
    pixels_.fireRow(y, step, before_.log_intensity, after_.log_intensity, fired);
    for (const Event& event : fired) {
      rows_[static_cast<std::size_t>(y)].push_back(
          {event, renderer_.sourceOf(view, after_, event.x, y)});
    }
    fired.clear();
    noise_.fireRow(y, step.t1_ns, fired);
    for (const Event& event : fired) rows_[static_cast<std::size_t>(y)].push_back({event, {}});
  }

  CameraRecording inOrderOfTime() {
    std::vector<AttributedEvent> all;
    for (std::vector<AttributedEvent>& row : rows_) {
      all.insert(all.end(), row.begin(), row.end());
      row = {};
    }
    std::stable_sort(all.begin(), all.end(),
                     [](const AttributedEvent& a, const AttributedEvent& b) {
                       return std::tie(a.event.t_ns, a.event.y, a.event.x) <
                              std::tie(b.event.t_ns, b.event.y, b.event.x);
                     });
    CameraRecording recording;
    recording.events.reserve(all.size());
    recording.sources.reserve(all.size());
    for (const AttributedEvent& attributed : all) {
      recording.events.push_back(attributed.event);
      recording.sources.push_back(attributed.source);
    }
    return recording;
  }

  const Simulation& simulation_;
  const RigCamera& camera_;
  std::uint64_t seed_;
  FrameRenderer renderer_;
  EventPixels pixels_;
  EventNoise noise_;
  Frame before_;
  Frame after_;
  std::vector<std::vector<AttributedEvent>> rows_;
};

}  // namespace

std::vector<CameraRecording> simulateEvents(const Simulation& simulation,
                                            const SimulationRun& run) {
  validate(simulation);
  const int threads = run.threads.value_or(tbb::this_task_arena::max_concurrency());
  requireOption(threads >= 1 && threads <= 1024, "threads", threads, "1 to 1024");
  // oneTBB prints a warning when more threads than available are requested.
  const auto available = static_cast<int>(
      tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism));
  tbb::task_arena arena(std::min(threads, std::max(available, 1)));
  const std::size_t cameras = simulation.rig.cameras.size();
  std::vector<CameraRecording> recordings;
  arena.execute([&] {
    for (std::size_t camera = 0; camera < cameras; ++camera) {
      recordings.push_back(CameraRun(simulation, camera).record([&](double fraction) {
        if (run.progress) {
          run.progress((static_cast<double>(camera) + fraction) / static_cast<double>(cameras));
        }
      }));
    }
  });
  return recordings;
}

std::vector<StampedPose> samplePoses(const Simulation& simulation, std::int64_t period_ns) {
  requireOption(period_ns > 0, "period_ns", period_ns, "above 0");
  std::vector<StampedPose> poses;
  for (std::int64_t t_ns = simulation.start_ns; t_ns < simulation.endNs(); t_ns += period_ns) {
    poses.push_back({t_ns, simulation.motion->poseAt(t_ns)});
  }
  poses.push_back({simulation.endNs(), simulation.motion->poseAt(simulation.endNs())});
  return poses;
}

}  // namespace efm
