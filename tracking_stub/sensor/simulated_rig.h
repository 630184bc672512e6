// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "mapping/events/event.h"
#include "mapping/geometry/rig.h"
#include "mapping/geometry/trajectory.h"
#include "tracking_stub/motion/motion.h"
#include "tracking_stub/random/random_numbers.h"
#include "tracking_stub/scenes/scene.h"

namespace efm {

/// Noise events. The default is none.
struct EventNoiseOptions {
  static constexpr double kMaxHz = 1e5;

  /// Rate of every pixel in Hz, 0 to 1e5. Real sensors have 0.1 to 10 Hz, and more in the dark.
  double background_hz = 0;
  double hot_fraction = 0;  ///< Fraction of hot pixels, 0 to 1. Hot pixels are chosen at random.
  double hot_hz = 1000;     ///< Additional rate of a hot pixel in Hz, 0 to 1e5.

  void validate() const;
};

/// The noise of an event camera's pixels: a Poisson process in each pixel, with equal probabilities
/// of both polarities. Noise does not change the pixels' memory. Each pixel has its own seed, so
/// its events do not depend on the times of the calls.
class EventNoise {
 public:
  struct Start {
    std::uint64_t seed = 0;
    std::int64_t t_ns = 0;  ///< Time of the first possible event.
  };
  EventNoise(int width, int height, const EventNoiseOptions& options, const Start& start);

  /// Appends the row's events from the last call to `until_ns`, inclusive, by column and then by
  /// time. Times are whole microseconds. Different threads may call this for different rows.
  void fireRow(int y, std::int64_t until_ns, std::vector<Event>& events);

 private:
  struct Pixel {
    RandomNumbers random;
    double rate_hz;
    std::int64_t next_ns;
  };
  static void draw(Pixel& pixel);

  std::size_t width_;
  std::vector<Pixel> pixels_;  // row-major; empty without noise
};

/// The time interval between two frames.
struct FrameStep {
  std::int64_t t0_ns = 0;
  std::int64_t t1_ns = 0;
};

/// Options of the pixels. The default is an ideal pixel.
struct EventPixelOptions {
  /// Minimum of both thresholds. Real sensors have 0.1 or more. Lower thresholds make more events
  /// and need more time.
  static constexpr double kMinThreshold = 0.01;

  double threshold_on = 0.3;   ///< Increase of log intensity for an event, 0.01 or more.
  double threshold_off = 0.3;  ///< Decrease of log intensity for an event, 0.01 or more.
  /// Standard deviation of a factor on both thresholds of each pixel, 0 to 0.5. Real sensors have
  /// 0.02 to 0.1. The minimum factor is 0.2.
  double mismatch = 0;
  /// Time for which a pixel is blind after an event, 0 to 1 s. After this time the pixel's memory
  /// is the current intensity.
  std::int64_t refractory_ns = 0;

  void validate() const;
};

/// The pixels of an event camera. Each pixel remembers the log intensity of its last event. It
/// fires when log intensity has changed by the contrast threshold (Ghosh and Gallego 2022, Eq. 1).
class EventPixels {
 public:
  /// @param seed seed of the mismatch.
  EventPixels(int width, int height, const EventPixelOptions& options, std::uint64_t seed = 0);

  /// Sets the pixels' memory at the start of the recording. With a seed the memory is random within
  /// the threshold of the current intensity, as in a running camera. Without a seed it is the
  /// current intensity.
  void start(const cv::Mat1f& log_intensity);
  void start(const cv::Mat1f& log_intensity, std::uint64_t seed);

  /// Appends the events of one row, by column and then by time. Log intensity changes linearly in
  /// the step. Times are rounded to whole microseconds. A step begins at the end of the previous
  /// step. Different threads may call this for different rows.
  void fireRow(int y, const FrameStep& step, const cv::Mat1f& before, const cv::Mat1f& after,
               std::vector<Event>& events);

 private:
  float thresholdAt(int y, int x, bool brighter) const {
    return factor_.empty() ? (brighter ? on_ : off_) : (brighter ? on_ : off_) * factor_(y, x);
  }

  float on_;
  float off_;
  std::int64_t refractory_ns_;
  cv::Mat1f factor_;                       // of both thresholds; empty if all factors are 1
  cv::Mat1f last_;                         // log intensity at each pixel's last event
  std::vector<std::int64_t> blind_until_;  // row-major; empty without a refractory period
};

/// All inputs of a simulated recording.
struct Simulation {
  Scene scene;
  Rig rig;  ///< Time offsets are 0. In a dataset folder the rig's frame is camera 0.
  std::shared_ptr<const Motion> motion;
  std::int64_t start_ns = 0;     ///< Start time in the clock of the recording.
  std::int64_t duration_ns = 0;  ///< Duration, above 0.
  EventPixelOptions pixels;
  EventNoiseOptions noise;
  /// Maximum motion in the image between two frames, in pixels, above 0. Between frames log
  /// intensity changes linearly. With a blur of half a pixel, the default misplaces an edge by at
  /// most 0.02 pixels.
  double max_step_px = 0.35;
  /// Seed of the pixels' initial memory, mismatch and noise.
  std::uint64_t seed = 0;
  double truth_cell_m = 0.01;  ///< Side of a surface's cells. Truth clouds have one point per cell.

  std::int64_t endNs() const { return start_ns + duration_ns; }
};

/// The events of a camera and the surface point that each event's pixel saw (none for noise).
struct CameraRecording {
  std::vector<Event> events;  ///< Sorted by time, then row, then column; start <= t <= end.
  std::vector<SurfacePoint> sources;
};

struct SimulationRun {
  std::optional<int> threads;  ///< 1 to 1024. Default: the number of cores.
  /// Called repeatedly with the completed fraction, 0 to 1, in the caller's thread.
  std::function<void(double)> progress;
};

/// Moves the rig through the scene and returns a recording per camera. The events do not depend on
/// the number of threads.
std::vector<CameraRecording> simulateEvents(const Simulation& simulation,
                                            const SimulationRun& run = {});

/// Returns the true motion, sampled from start to end, inclusive. With the default period, the
/// error of interpolating a hand-held motion is far below 0.01 pixels.
std::vector<StampedPose> samplePoses(const Simulation& simulation,
                                     std::int64_t period_ns = 1'000'000);

}  // namespace efm
