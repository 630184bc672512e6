// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/options/tracker_fault_keys.h"

#include <algorithm>
#include <functional>
#include <optional>
#include <stdexcept>

#include "mapping/geometry/angle.h"
#include "mapping/geometry/timestamp.h"
#include "mapping/options/quoted_text.h"
#include "maps/refinement/tracker_errors.h"

namespace efm {
namespace {

struct FaultKey {
  std::string_view key;
  std::function<void(TrackerFaults&, std::string_view)> read;
  std::function<std::optional<OptionValue>(const TrackerFaults&)> value;
};

/// What a number on the command line may be.
struct Range {
  double least;
  double most;
  std::string expected;
};

double numberIn(std::string_view text, const Range& range) {
  double number = 0;
  const std::string expected = "must be a number, " + range.expected;
  try {
    parseInto(text, number);
  } catch (const std::invalid_argument&) {
    throw std::invalid_argument(expected);
  }
  if (!(number >= range.least && number <= range.most)) throw std::invalid_argument(expected);
  return number;
}

/// @param scale the field's unit in those of the command line: radians per degree.
template <typename Field>
FaultKey number(std::string_view key, const Range& range, Field field, double scale = 1) {
  return {key,
          [=](TrackerFaults& faults, std::string_view text) {
            field(faults) = scale * numberIn(text, range);
          },
          [=](const TrackerFaults& faults) { return valueOf(field(faults) / scale); }};
}

std::vector<FaultKey> makeKeys() {
  using std::string_view_literals::operator""sv;
  const Range metres = {0, 1000, "0 to 1000 (metres)"};
  const Range degrees = {0, 180, "0 to 180 (degrees)"};
  return {
      number(
          "noise_m"sv, metres, [](auto& f) -> auto& { return f.perturbation.noise_m; }),
      number(
          "noise_deg"sv, degrees, [](auto& f) -> auto& { return f.perturbation.noise_rad; },
          kRadiansPerDegree),
      number(
          "keyframe_noise_m"sv, metres,
          [](auto& f) -> auto& { return f.perturbation.keyframe.noise_m; }),
      number(
          "keyframe_noise_deg"sv, degrees,
          [](auto& f) -> auto& { return f.perturbation.keyframe.noise_rad; }, kRadiansPerDegree),
      {"keyframe_s"sv,
       [](TrackerFaults& faults, std::string_view text) {
         faults.perturbation.keyframe.length_ns =
             durationFromSeconds(numberIn(text, {0.001, 1e6, "0.001 to 1e6 (seconds)"}));
       },
       [](const TrackerFaults& faults) -> std::optional<OptionValue> {
         const auto& length_ns = faults.perturbation.keyframe.length_ns;
         if (!length_ns) return std::nullopt;
         return valueOf(secondsBetween(0, *length_ns));
       }},
      {"keyframe_start_s"sv,
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
       }},
      number(
          "drift"sv, {0, 1, "0 to 1 (metres per metre)"},
          [](auto& f) -> auto& { return f.perturbation.drift.share; }),
      number(
          "drift_deg_per_m"sv, {0, 500, "0 to 500 (degrees per metre)"},
          [](auto& f) -> auto& { return f.perturbation.drift.rad_per_m; }, kRadiansPerDegree),
      {"latency_s"sv,
       [](TrackerFaults& faults, std::string_view text) {
         faults.latency_ns = durationFromSeconds(numberIn(text, {0, 10, "0 to 10 (seconds)"}));
       },
       [](const TrackerFaults& faults) { return valueOf(secondsBetween(0, faults.latency_ns)); }},
      number(
          "drop"sv, {0, 1, "0 to 1 (the probability of each pose)"},
          [](auto& f) -> auto& { return f.dropouts.drop_probability; }),
      number(
          "gaps_hz"sv, {0, 1000, "0 to 1000 (gaps per second)"},
          [](auto& f) -> auto& { return f.dropouts.random_gaps_hz; }),
      number(
          "gap_s"sv, {0.001, 1e6, "0.001 to 1e6 (seconds)"},
          [](auto& f) -> auto& { return f.dropouts.random_gap_s; }),
      {"seed"sv,
       [](TrackerFaults& faults, std::string_view text) {
         std::int64_t seed = 0;
         try {
           parseInto(text, seed);
         } catch (const std::invalid_argument&) {
           seed = -1;
         }
         if (seed < 0) throw std::invalid_argument("must be a whole number from 0");
         faults.perturbation.seed = faults.dropouts.seed = static_cast<std::uint64_t>(seed);
       },
       [](const TrackerFaults& faults) {
         return valueOf(static_cast<std::int64_t>(faults.perturbation.seed));
       }},
  };
}

const std::vector<FaultKey>& keys() {
  static const std::vector<FaultKey> all = makeKeys();
  return all;
}

}  // namespace

void setTrackerFault(std::string_view assignment, TrackerFaults& faults) {
  const std::size_t equals = assignment.find('=');
  if (equals == std::string_view::npos) {
    throw std::invalid_argument(inQuotes(assignment) +
                                ": expected key=value; known keys: " + knownTrackerFaults());
  }
  const std::string_view key = trimmed(assignment.substr(0, equals));
  const std::string_view value = trimmed(assignment.substr(equals + 1));
  const auto entry = std::find_if(keys().begin(), keys().end(),
                                  [&](const FaultKey& known) { return known.key == key; });
  if (entry == keys().end()) {
    throw std::invalid_argument(printable(assignment) + ": unknown key " + inQuotes(key) +
                                "; known: " + knownTrackerFaults());
  }
  try {
    entry->read(faults, value);
  } catch (const std::invalid_argument& error) {
    throw std::invalid_argument(std::string(key) + " = " + printable(value) + ": " + error.what());
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
