// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/recordings/streams/time_unit.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <stdexcept>

namespace efm {
namespace {

constexpr std::array<int, 4> kExponents = {0, -3, -6, -9};

/// Returns the events or poses per second if the unit is 10^exponent seconds; 0 if unknown.
double rateOf(const TimeSample& sample, int exponent) {
  const double seconds = (sample.latest - sample.earliest) * std::pow(10.0, exponent);
  return seconds > 0 ? (sample.count - 1) / seconds : 0;
}

bool fitsTime(const TimeSample& sample, int exponent) {
  return sample.max * std::pow(10.0, exponent) < 1e-9 * static_cast<double>(kEndOfTimeNs);
}

/// Returns the unit whose rate is usual and nearest to the middle of the usual rates.
std::optional<int> likelyExponent(const TimeSample& sample, const UsualRate& usual) {
  std::optional<int> likely;
  double least = std::log(usual.max / usual.min) / 2;
  for (const int exponent : kExponents) {
    const double rate = rateOf(sample, exponent);
    if (rate <= 0 || !fitsTime(sample, exponent)) continue;
    const double distance = std::abs(std::log(rate / std::sqrt(usual.min * usual.max)));
    if (distance > least) continue;
    least = distance;
    likely = exponent;
  }
  return likely;
}

/// Returns the unit in which the times are dates of today: at most one, as units differ by 1000.
std::optional<int> datedExponent(const TimeSample& sample) {
  constexpr double kYear2000S = 946'684'800;
  constexpr double kYear2050S = 2'524'608'000;
  for (const int exponent : kExponents) {
    const double seconds = sample.max * std::pow(10.0, exponent);
    if (seconds >= kYear2000S && seconds < kYear2050S) return exponent;
  }
  return std::nullopt;
}

/// Describes the likely unit: "probably us, where 1000 events take 0.01 s".
std::string guessOf(const TimeSample& sample, const UsualRate& usual) {
  const std::optional<int> likely = likelyExponent(sample, usual);
  if (!likely) return fmt::format("expected decimal seconds, or {} s, ms, us or ns", usual.option);
  const double seconds = (sample.latest - sample.earliest) * std::pow(10.0, *likely);
  const std::string unit = timeUnitOf(*likely);
  return fmt::format(
      "probably {}, where {} {} take {:.2g} s: expected {} {}, or the right one of s, ms, us and "
      "ns",
      unit, sample.count, usual.things, seconds, usual.option, unit);
}

}  // namespace

std::optional<int> timeExponentOf(std::string_view unit) {
  constexpr struct {
    int exponent;
    std::string_view names;  // each between blanks
  } kUnits[] = {{0, " s sec secs second seconds "},
                {-3, " ms msec msecs millis millisec millisecond milliseconds "},
                {-6, " us µs μs usec usecs micros microsec microsecond microseconds "},
                {-9, " ns nsec nsecs nanos nanosec nanosecs nanosecond nanoseconds "}};
  if (unit.empty() || unit.find(' ') != std::string_view::npos) return std::nullopt;
  for (const auto& [exponent, names] : kUnits) {
    if (names.find(fmt::format(" {} ", unit)) != std::string_view::npos) return exponent;
  }
  return std::nullopt;
}

std::string timeUnitOf(int exponent) {
  return exponent == 0 ? "s" : exponent == -3 ? "ms" : exponent == -6 ? "us" : "ns";
}

std::int64_t nanosecondsPer(int exponent) {
  std::int64_t unit_ns = 1;
  for (int k = exponent; k > -9; --k) unit_ns *= 10;
  return unit_ns;
}

void TimeSample::add(double t, bool is_whole) {
  earliest = count == 0 ? t : std::min(earliest, t);
  latest = count == 0 ? t : std::max(latest, t);
  rising = rising && (count == 0 || t > last);
  has_parts = has_parts || std::floor(t) != t;
  last = t;
  ++count;
  whole = whole && is_whole;
  float32 = float32 && static_cast<double>(static_cast<float>(t)) == t;
  max = std::max(max, std::abs(t));
}

void TimeSample::add(double t) {
  if (std::isfinite(t)) add(t, std::floor(t) == t);
}

TimeUnit findTimeUnit(const ReaderOptions& options, const TimeSample& sample,
                      const UsualRate& usual, const std::string& where) {
  constexpr int kEnough = 10;
  constexpr int kMany = 1000;
  constexpr double kFarTooRare = 0.03;  // a sensor at rest has noise
  constexpr double kEndOfTimeUs = static_cast<double>(kEndOfTimeNs) * 1e-3;
  if (!options.time_unit.empty()) return {timeExponentOf(options.time_unit).value_or(0), {}};
  const int exponent = sample.whole ? datedExponent(sample).value_or(-9) : 0;
  const double step_s = stepAt(static_cast<float>(sample.max)) * std::pow(10.0, exponent);
  if (sample.float32 && sample.count >= kEnough && step_s > 1e-9 * kMaxTimeStepNs) {
    throw std::runtime_error(
        fmt::format("{}: the times are float32 numbers, which are {:.3g} s apart at {:.16g}: "
                    "expected float64, or whole numbers of us or ns",
                    where, step_s, sample.max));
  }
  if (sample.max >= kEndOfTimeUs) return {-9, {}};
  if (!sample.whole) {
    const bool too_rare = sample.count >= kMany && sample.latest > sample.earliest &&
                          rateOf(sample, 0) < kFarTooRare * usual.min;
    if (!too_rare && fitsTime(sample, 0)) return {0, {}};
    throw std::runtime_error(
        fmt::format("{}: {} {} from {:.17g} on take {:.3g} of a unit that is "
                    "not seconds: {}",
                    where, sample.count, usual.things, sample.earliest,
                    sample.latest - sample.earliest, guessOf(sample, usual)));
  }
  if (sample.count < kEnough) return {0, {}};
  const std::optional<int> dated = datedExponent(sample);
  if (dated && dated == likelyExponent(sample, usual)) {
    const std::string unit = timeUnitOf(*dated);
    return {*dated,
            Warning{"time-unit",
                    fmt::format("{}: the times are whole numbers without a unit; as {} they are of "
                                "our years and their rate is usual ({} {})",
                                where, unit, usual.option, unit)}};
  }
  throw std::runtime_error(fmt::format("{}: all times are whole numbers, of an unknown unit: {}",
                                       where, guessOf(sample, usual)));
}

void requireSecondsOfPoses(const TimeSample& sample, const std::string& where,
                           const ReaderOptions& options) {
  constexpr int kEnough = 10;
  constexpr double kFarTooRare = 0.01;  // poses per second
  const bool too_rare =
      sample.count >= kEnough && sample.latest > sample.earliest && rateOf(sample, 0) < kFarTooRare;
  if (!too_rare && fitsTime(sample, 0)) return;
  throw std::runtime_error(fmt::format("{}: {} poses take {:.3g} of a unit that is not seconds: {}",
                                       where, sample.count, sample.latest - sample.earliest,
                                       guessOf(sample, usualPoseRate(options))));
}

void requireTimesOfPoses(const TimeSample& sample, const std::string& where,
                         const ReaderOptions& options, const std::string& renumber) {
  constexpr int kEnough = 3;
  constexpr double kMostFrames = 1e6;
  if (sample.count < kEnough) return;
  if (sample.earliest == sample.latest) {
    throw std::runtime_error(
        fmt::format("{}: the first {} poses have one time, {:.9g}: expected a time of its own for "
                    "each pose (were they written with six digits? numpy.savetxt(FILE, poses, "
                    "fmt='%.9f') writes all)",
                    where, sample.count, sample.latest));
  }
  const bool consecutive = sample.latest - sample.earliest == sample.count - 1;
  const bool from_start = sample.earliest == 0 || sample.earliest == 1;
  if (!sample.rising || sample.has_parts || !from_start || sample.latest >= kMostFrames ||
      (sample.whole && !consecutive)) {
    return;
  }
  throw std::runtime_error(fmt::format(
      "{}: the times are whole numbers from {} on, {}: numbers of frames? Expected times{}; if "
      "they "
      "are times, {} s, ms, us or ns",
      where, sample.earliest, consecutive ? "each one more than the last" : "at least 1 apart",
      renumber.empty() ? "" : " (" + renumber + ")", options.pose_unit_option));
}

int poseTimeExponent(const ReaderOptions& options, const TimeSample& sample,
                     const std::string& where) {
  if (!options.pose_time_unit.empty()) return timeExponentOf(options.pose_time_unit).value_or(0);
  const TimeUnit unit = findTimeUnit(options, sample, usualPoseRate(options), where);
  if (unit.warning) throw std::runtime_error(unit.warning->text);
  return unit.exponent;
}

}  // namespace efm
