// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/options/tracker_fault_keys.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <cstdint>
#include <optional>
#include <stdexcept>
#include <type_traits>

#include "mapping/base/named_choice.h"
#include "mapping/base/text.h"
#include "mapping/geometry/timestamp.h"

namespace efm {
namespace {

/// Reads the value of a fault. @return the expected kind of value if it is wrong, otherwise null.
template <typename Field>
const char* readFault(std::string_view text, const Allowed& allowed, Field& field) {
  if constexpr (std::is_same_v<Field, TrackerClass>) {
    try {
      field = fromName<TrackerClass>(text);
    } catch (const std::invalid_argument&) {
      return "good, typical, poor, car or none";
    }
  } else if constexpr (std::is_same_v<Field, std::uint64_t>) {
    const std::optional<std::int64_t> seed = parseNumber<std::int64_t>(text);
    if (!seed || *seed < 0) return "a whole number from 0";
    field = static_cast<std::uint64_t>(*seed);
  } else if (const auto number = parseFinite(text); allowed.expected) {
    if (!number || !allowed.in(1).hold(*number)) return allowed.expected;
    if constexpr (std::is_same_v<Field, double> || std::is_same_v<Field, std::optional<double>>) {
      field = allowed.unit * *number;
    } else {
      field = durationFromSeconds(*number);
    }
  } else if constexpr (std::is_same_v<Field,
                                      std::optional<std::int64_t>>) {  // a time, read exactly
    const std::optional<std::int64_t> t_ns = parseSeconds(text);
    if (!t_ns || *t_ns >= kEndOfTimeNs || *t_ns <= -kEndOfTimeNs) {
      return "a time in seconds, within 4.6e9 s of 0";
    }
    field = *t_ns;
  }
  return nullptr;
}

/// Returns the value that `readFault` reads as this field, except for the rounding of degrees.
template <typename Field>
std::optional<OptionValue> valueOfFault(const Allowed& allowed, const Field& field) {
  if constexpr (std::is_same_v<Field, TrackerClass>) {
    if (field == TrackerClass::kNone) return std::nullopt;
    return std::string(nameOf(field));
  } else if constexpr (std::is_same_v<Field, std::optional<double>>) {
    return field ? valueOfFault(allowed, *field) : std::nullopt;
  } else if constexpr (std::is_same_v<Field, std::optional<std::int64_t>>) {
    if (!field) return std::nullopt;
    if (!allowed.expected) return formatSeconds(*field);
    return valueOfFault(allowed, *field);
  } else if constexpr (std::is_same_v<Field, std::int64_t>) {
    return secondsBetween(0, field);
  } else if constexpr (std::is_same_v<Field, std::uint64_t>) {
    return static_cast<std::int64_t>(field);
  } else {
    return field / allowed.unit;
  }
}

std::vector<std::string> faultKeys() {
  std::vector<std::string> keys;
  TrackerFaults faults;
  TrackerFaults::fields(
      faults, [&](const char* key, auto&, const Allowed& = {}) { keys.emplace_back(key); });
  return keys;
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
  bool known = false;
  TrackerFaults::fields(faults, [&](const char* name, auto& field, const Allowed& allowed = {}) {
    if (key != name) return;
    known = true;
    const char* const expected = readFault(value, allowed, field);
    if (expected) throw OptionError(name, printable(value), expected);
  });
  if (!known) {
    throw std::invalid_argument(
        fmt::format("{}: unknown key: {}", printable(assignment), expectedName(key, faultKeys())));
  }
  if (key == "seed") faults.dropouts.seed = faults.perturbation.seed;
}

std::vector<std::pair<std::string, OptionValue>> listTrackerFaults(const TrackerFaults& faults) {
  std::vector<std::pair<std::string, OptionValue>> list;
  TrackerFaults::fields(faults, [&](const char* key, auto& field, const Allowed& allowed = {}) {
    if (const auto value = valueOfFault(allowed, field)) list.emplace_back(key, *value);
  });
  return list;
}

nlohmann::ordered_json asJson(const TrackerFaults& faults) {
  auto json = nlohmann::ordered_json::object();
  for (const auto& named : listTrackerFaults(faults)) {
    std::visit([&](const auto& value) { json[named.first] = value; }, named.second);
  }
  return json;
}

std::string knownTrackerFaults() { return fmt::format("{}", fmt::join(faultKeys(), ", ")); }

}  // namespace efm
