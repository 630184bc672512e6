// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/checks/health_checks.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>
#include <numeric>

#include "mapping/geometry/lens.h"
#include "mapping/geometry/rigid3.h"
#include "mapping/geometry/timestamp.h"

namespace efm {
namespace {

using Cameras = RecordingStatistics::Cameras;
using Warnings = std::vector<Warning>;

constexpr std::uint64_t kEnoughEvents = 1000;  // fewer events are no evidence

void checkBaselines(const Cameras& cameras, Warnings& warnings) {
  // From a stereo microscope to a train. A confusion of metres and millimetres is a factor of 1000.
  constexpr double kMinBaselineM = 0.005;
  constexpr double kMaxBaselineM = 20;
  for (auto a = cameras.begin(); a != cameras.end(); ++a) {
    for (auto b = std::next(a); b != cameras.end(); ++b) {
      const double baseline_m = baselineOf(a->second.camera, b->second.camera);
      if (baseline_m >= kMinBaselineM && baseline_m <= kMaxBaselineM) continue;
      if (!isCalibrated(a->second.camera.model)) continue;  // its pose is unknown, too
      addWarning(warnings, "baseline",
                 "cameras {} and {} are {:g} m apart: expected {:g} to {:g} m; "
                 "are the translations of the calibration in metres? "
                 "(--calibration)",
                 a->first, b->first, baseline_m, kMinBaselineM, kMaxBaselineM);
    }
  }
}

void checkFieldOfView(int camera, const CameraModel& model, Warnings& warnings) {
  // Limits: a telescope, and a pinhole image. A fisheye lens sees up to 220 degrees.
  constexpr double kMinDeg = 5;
  const double max_deg = model.distortion == DistortionModel::kEquidistant ? 220 : 170;
  const double view_deg = fieldOfView(model).x() / kRadiansPerDegree;
  if (view_deg >= kMinDeg && view_deg <= max_deg) return;
  addWarning(warnings, "focal-length",
             "camera {}: a focal length of {:g} px and {} columns are a field of view of "
             "{:.3g} degrees: expected {:g} to {:g}; is the calibration in pixels, and of "
             "this resolution? (--calibration)",
             camera, model.fx, model.width, view_deg, kMinDeg, max_deg);
}

void checkPrincipalPoint(int camera, const CameraModel& model, Warnings& warnings) {
  // Lenses are mounted within a few per cent of the centre. A cropped sensor has a larger offset.
  const auto in_middle = [](double center, int size) {
    return center >= 0.25 * size && center <= 0.75 * size;
  };
  if (in_middle(model.cx, model.width) && in_middle(model.cy, model.height)) return;
  addWarning(warnings, "principal-point",
             "camera {}: the principal point ({:g}, {:g}) lies outside the middle half of "
             "the {}x{} pixels; is the calibration of this resolution, and in the order fx "
             "fy cx cy? (--calibration)",
             camera, model.cx, model.cy, model.width, model.height);
}

/// Returns the fraction of a grid's pixels without a viewing ray.
double fractionWithoutRay(const CameraModel& model) {
  constexpr int kGrid = 64;  // fast, and fine enough for a fraction of 5 %
  const LensInverse lens(model);
  int without = 0;
  for (int row = 0; row < kGrid; ++row) {
    for (int column = 0; column < kGrid; ++column) {
      const double x = (model.width - 1) * (column / (kGrid - 1.0));
      const double y = (model.height - 1) * (row / (kGrid - 1.0));
      without += std::isnan(lens.rayThrough(x, y).x()) ? 1 : 0;
    }
  }
  return static_cast<double>(without) / (kGrid * kGrid);
}

void checkLens(int camera, const CameraModel& model, Warnings& warnings) {
  constexpr double kMaxFraction = 0.05;  // the corners of a wide lens may have no ray
  const double fraction = fractionWithoutRay(model);
  if (fraction <= kMaxFraction) return;
  addWarning(warnings, "lens",
             "camera {}: the lens model has no viewing ray for {:.0f} % of the pixels; are "
             "the coefficients in the order of the model '{}'? (--calibration)",
             camera, 100 * fraction, nameOf(model.distortion));
}

void checkActivity(const Cameras& cameras, Warnings& warnings) {
  std::uint64_t most = 0;
  for (const auto& [index, camera] : cameras) most = std::max(most, camera.events.count);
  for (const auto& [index, camera] : cameras) {
    const std::uint64_t count = camera.events.count;
    if (count == 0 && most > 0) {
      addWarning(warnings, "silent-camera",
                 "camera {} has no event; [rig] cameras "
                 "leaves it out",
                 index);
    } else if (most >= kEnoughEvents &&
               count < most / 10) {  // equal cameras differ by a factor of 2
      addWarning(warnings, "few-events",
                 "camera {} has {} events, another one {}: is its lens covered "
                 "or its sensitivity lower? ([rig] cameras leaves it out)",
                 index, count, most);
    }
    if (count >= kEnoughEvents && (camera.positive == 0 || camera.positive == count)) {
      addWarning(warnings, "polarity",
                 "all {} events of camera {} have the polarity {}: is it the "
                 "right column? (--event-columns; [fusion] split_polarity = "
                 "false does without)",
                 count, index, camera.positive == 0 ? 0 : 1);
    }
  }
}

/// Returns the fraction of a camera's events that come from its busiest 1 % of pixels.
double fractionOfBusiest(const CameraStatistics& camera) {
  std::vector<std::uint32_t> pixels = camera.pixels;
  const auto busiest = static_cast<std::ptrdiff_t>(pixels.size() / 100);
  std::nth_element(pixels.begin(), pixels.begin() + busiest, pixels.end(), std::greater<>());
  const auto events = std::accumulate(pixels.begin(), pixels.begin() + busiest, std::uint64_t{0});
  return static_cast<double>(events) / static_cast<double>(camera.events.count);
}

void checkHotPixels(const Cameras& cameras, Warnings& warnings) {
  // Edges sweep over most of the image. A single hot pixel is left to the filter.
  constexpr double kMaxFraction = 0.9;
  for (const auto& [index, camera] : cameras) {
    // With fewer events, 1 % of the pixels may have all events by chance.
    if (camera.pixels.empty() || camera.events.count < camera.pixels.size() / 10) continue;
    const double fraction = fractionOfBusiest(camera);
    if (fraction <= kMaxFraction) continue;
    addWarning(warnings, "hot-pixels",
               "{:.0f} % of the events of camera {} come from 1 % of its pixels: hot pixels, "
               "a blinking light or a wrong column ([filter] hot_pixel_ratio, "
               "--event-columns)",
               100 * fraction, index);
  }
}

void checkCameraClocks(const Cameras& cameras, Warnings& warnings) {
  // Cameras of a rig are started together. If they share less than half of the shorter stream's
  // time, their clocks have different zeros, or the files are from two recordings.
  constexpr double kMinShared = 0.5;
  for (auto a = cameras.begin(); a != cameras.end(); ++a) {
    for (auto b = std::next(a); b != cameras.end(); ++b) {
      const StreamStatistics& one = a->second.events;
      const StreamStatistics& other = b->second.events;
      if (std::min(one.count, other.count) < kEnoughEvents) continue;
      const std::int64_t begin_ns = std::max(*one.first_ns, *other.first_ns);
      const std::int64_t end_ns = std::min(*one.last_ns, *other.last_ns);
      const double shorter_s = std::min(one.seconds(), other.seconds());
      if (secondsBetween(begin_ns, end_ns) >= kMinShared * shorter_s) continue;
      addWarning(warnings, "camera-clocks",
                 "camera {} has events from {} to {} s, camera {} from {} to {} s: have they "
                 "one clock, and are they of one recording? ([rig] time_offsets_s)",
                 a->first, formatSeconds(*one.first_ns), formatSeconds(*one.last_ns), b->first,
                 formatSeconds(*other.first_ns), formatSeconds(*other.last_ns));
    }
  }
}

void checkTwins(const Cameras& cameras, Warnings& warnings) {
  for (auto a = cameras.begin(); a != cameras.end(); ++a) {
    for (auto b = std::next(a); b != cameras.end(); ++b) {
      const CameraStatistics& one = a->second;
      const CameraStatistics& other = b->second;
      if (one.events.count < kEnoughEvents || one.pixels.empty()) continue;
      if (one.positive != other.positive || one.pixels != other.pixels) continue;
      addWarning(warnings, "same-events",
                 "cameras {} and {} have the same events in every pixel: is "
                 "one file given twice?",
                 a->first, b->first);
    }
  }
}

}  // namespace

Warnings calibrationWarnings(int camera, const CameraModel& model) {
  Warnings warnings;
  if (!isCalibrated(model)) return warnings;
  checkFieldOfView(camera, model, warnings);
  checkPrincipalPoint(camera, model, warnings);
  checkLens(camera, model, warnings);
  return warnings;
}

void checkCameras(const Findings& findings, Warnings& warnings) {
  const Cameras& cameras = findings.recording.cameras();
  checkBaselines(cameras, warnings);
  for (const auto& [index, camera] : cameras) {
    append(warnings, calibrationWarnings(index, camera.camera.model));
  }
  checkActivity(cameras, warnings);
  checkHotPixels(cameras, warnings);
  checkCameraClocks(cameras, warnings);
  checkTwins(cameras, warnings);
}

}  // namespace efm
