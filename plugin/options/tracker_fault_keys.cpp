// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/options/tracker_fault_keys.h"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <optional>
#include <stdexcept>

#include "mapping/base/named_choice.h"
#include "mapping/base/text.h"
#include "mapping/geometry/rigid3.h"
#include "mapping/geometry/timestamp.h"

namespace efm {
namespace {

struct FaultKey {
  std::string_view key;
  std::function<void(TrackerFaults&, std::string_view)> read;
  std::function<std::optional<OptionValue>(const TrackerFaults&)> value;
};

/// The range of a number.
struct Range {
  double min;
  double max;
  const char* expected;
};

double numberIn(std::string_view text, const Range& range) {
  const std::optional<double> number = parseFinite(text);
  if (number && *number >= range.min && *number <= range.max) return *number;
  throw std::invalid_argument(fmt::format("must be a number, {}", range.expected));
}

/// A number; the field has `unit` of its units for 1 on the command line.
template <typename Field>
FaultKey number(std::string_view key, const Range& range, Field field, double unit = 1) {
  return {key,
          [=](TrackerFaults& faults, std::string_view text) {
            field(faults) = unit * numberIn(text, range);
          },
          [=](const TrackerFaults& faults) { return valueOf(field(faults) / unit); }};
}

/// Seconds; the field has nanoseconds, or is empty.
template <typename Field>
FaultKey seconds(std::string_view key, const Range& range, Field field) {
  return {key,
          [=](TrackerFaults& faults, std::string_view text) {
            field(faults) = durationFromSeconds(numberIn(text, range));
          },
          [=](const TrackerFaults& faults) -> std::optional<OptionValue> {
            const std::optional<std::int64_t> duration_ns = field(faults);
            if (!duration_ns) return std::nullopt;
            return valueOf(secondsBetween(0, *duration_ns));
          }};
}

FaultKey keyframeStart() {
  return {"keyframe_start_s",
          [](TrackerFaults& faults, std::string_view text) {
            const std::optional<std::int64_t> t_ns = parseSeconds(text);
            if (!t_ns || *t_ns >= kEndOfTimeNs || *t_ns <= -kEndOfTimeNs) {
              throw std::invalid_argument("must be a time in seconds, within 4.6e9 s of 0");
            }
            faults.perturbation.keyframe.start_ns = t_ns;
          },
          [](const TrackerFaults& faults) -> std::optional<OptionValue> {
            const auto& start_ns = faults.perturbation.keyframe.start_ns;
            if (!start_ns) return std::nullopt;
            return OptionValue(formatSeconds(*start_ns));  // exact
          }};
}

FaultKey seed() {
  return {"seed",
          [](TrackerFaults& faults, std::string_view text) {
            const std::optional<std::int64_t> seed = parseNumber<std::int64_t>(text);
            if (!seed || *seed < 0) throw std::invalid_argument("must be a whole number from 0");
            faults.perturbation.seed = faults.dropouts.seed = static_cast<std::uint64_t>(*seed);
          },
          [](const TrackerFaults& faults) {
            return valueOf(static_cast<std::int64_t>(faults.perturbation.seed));
          }};
}

std::vector<FaultKey> makeKeys() {
  const Range metres = {0, 1000, "0 to 1000 (metres)"};
  const Range degrees = {0, 180, "0 to 180 (degrees)"};
  const Range gradient = {0, 1, "0 to 1 (metres per metre)"};
  const Range rotation = {0, 500, "0 to 500 (degrees per metre)"};
  const Range latency = {0, 10, "0 to 10 (seconds)"};
  const Range duration = {0.001, 1e6, "0.001 to 1e6 (seconds)"};
  const Range probability = {0, 1, "0 to 1 (the probability of each pose)"};
  const Range rate = {0, 1000, "0 to 1000 (gaps per second)"};
#define FAULT(path) \
  [](auto& faults) -> auto& { return faults.path; }
  return {
      number("noise_m", metres, FAULT(perturbation.noise_m)),
      number("noise_deg", degrees, FAULT(perturbation.noise_rad), kRadiansPerDegree),
      number("keyframe_noise_m", metres, FAULT(perturbation.keyframe.noise_m)),
      number("keyframe_noise_deg", degrees, FAULT(perturbation.keyframe.noise_rad),
             kRadiansPerDegree),
      seconds("keyframe_s", duration, FAULT(perturbation.keyframe.length_ns)),
      keyframeStart(),
      number("drift", gradient, FAULT(perturbation.drift.fraction)),
      number("drift_deg_per_m", rotation, FAULT(perturbation.drift.rad_per_m), kRadiansPerDegree),
      seconds("latency_s", latency, FAULT(latency_ns)),
      number("drop", probability, FAULT(dropouts.drop_probability)),
      number("gaps_hz", rate, FAULT(dropouts.random_gaps_hz)),
      number("gap_s", duration, FAULT(dropouts.random_gap_s)),
      seed(),
  };
#undef FAULT
}

const std::vector<FaultKey>& keys() {
  static const std::vector<FaultKey> all = makeKeys();
  return all;
}

}  // namespace

void setTrackerFault(std::string_view assignment, TrackerFaults& faults) {
  const std::size_t equals = assignment.find('=');
  if (equals == std::string_view::npos) {
    throw std::invalid_argument(fmt::format("{}: expected key=value; keys: {}",
                                            inQuotes(assignment), knownTrackerFaults()));
  }
  const std::string_view key = trimmed(assignment.substr(0, equals));
  const std::string_view value = trimmed(assignment.substr(equals + 1));
  const auto entry = std::find_if(keys().begin(), keys().end(),
                                  [&](const FaultKey& known) { return known.key == key; });
  if (entry == keys().end()) {
    std::vector<std::string> known;
    for (const FaultKey& one : keys()) known.emplace_back(one.key);
    throw std::invalid_argument(
        fmt::format("{}: unknown key: {}", printable(assignment), expectedName(key, known)));
  }
  try {
    entry->read(faults, value);
  } catch (const std::invalid_argument& error) {
    throw std::invalid_argument(fmt::format("{} = {}: {}", key, printable(value), error.what()));
  }
}

std::vector<std::pair<std::string, OptionValue>> listTrackerFaults(const TrackerFaults& faults) {
  std::vector<std::pair<std::string, OptionValue>> list;
  for (const FaultKey& key : keys()) {
    if (const auto value = key.value(faults)) list.emplace_back(key.key, *value);
  }
  return list;
}

std::string knownTrackerFaults() {
  std::string list;
  for (const FaultKey& key : keys()) list += (list.empty() ? "" : ", ") + std::string(key.key);
  return list;
}

void requireKeyframeLength(const TrackerFaults& faults) {
  const KeyframeNoiseOptions& keyframe = faults.perturbation.keyframe;
  if (!keyframe.any() || keyframe.length_ns) return;
  throw std::invalid_argument(
      "keyframe_s: must be given with keyframe_noise_m and keyframe_noise_deg, 0.001 to 1e6 "
      "(seconds)");
}

}  // namespace efm
