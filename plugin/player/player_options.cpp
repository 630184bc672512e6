// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/player/player_options.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <functional>
#include <limits>
#include <optional>
#include <stdexcept>
#include <string_view>
#include <vector>

#include "mapping/base/named_choice.h"
#include "mapping/base/text.h"
#include "mapping/geometry/timestamp.h"
#include "plugin/mrpt/host_options.h"
#include "plugin/options/option_file.h"
#include "plugin/options/tracker_fault_keys.h"

namespace efm {
namespace {

using Path = std::filesystem::path;

constexpr NamedChoice<Restamp> kRestamps[] = {
    {Restamp::kNone, "none"},
    {Restamp::kNow, "now"},
};

/// A value in the file.
struct Value {
  std::string_view text;
  const OptionOrigin& origin;
  std::string given;  // with its place, for errors
};

struct PlayerKey {
  std::string_view key;
  std::function<void(PlayerOptions&, const Value&)> read;
};

std::vector<std::string> partsOf(std::string_view list) {
  std::vector<std::string> parts;
  while (!list.empty()) {
    const std::size_t comma = std::min(list.find(','), list.size());
    parts.emplace_back(trimmed(list.substr(0, comma)));
    list.remove_prefix(std::min(comma + 1, list.size()));
  }
  return parts;
}

Path existing(std::string_view name, const Value& value) {
  Path path = value.origin.folder / std::string(name);
  if (!name.empty() && std::filesystem::exists(path)) return path;
  throw std::invalid_argument("no such file or folder");
}

double numberIn(const Value& value, double min, double max, const char* expected) {
  const std::optional<double> number = parseFinite(value.text);
  if (number && *number >= min && *number <= max) return *number;
  throw std::invalid_argument(fmt::format("must be {}", expected));
}

std::int64_t countIn(const Value& value, std::int64_t min, std::int64_t max, const char* expected) {
  const std::optional<std::int64_t> count = parseNumber<std::int64_t>(value.text);
  if (count && *count >= min && *count <= max) return *count;
  throw std::invalid_argument(fmt::format("must be {}", expected));
}

std::string oneOf(const Value& value, const std::vector<std::string>& names) {
  std::string name(value.text);
  if (std::find(names.begin(), names.end(), name) != names.end()) return name;
  throw std::invalid_argument(expectedName(name, names));
}

void ignore(PlayerOptions&, const Value&) {}

const std::vector<PlayerKey>& keys() {
  static const std::vector<PlayerKey> all = {
      // MRPT's own.
      {"driver", ignore},
      {"sensorLabel", ignore},
      {"rawlog-grabber-ignore", ignore},
      {"process_rate",
       [](PlayerOptions&, const Value& v) { numberIn(v, 0.01, 1e5, "0.01 to 1e5 (hertz)"); }},
      {"max_queue_len",
       [](PlayerOptions&, const Value& v) { countIn(v, 1, 1'000'000, "1 to 1000000"); }},
      {"grab_decimation",
       [](PlayerOptions&, const Value& v) {
         countIn(v, 0, 1, "0 or 1: a recording without some of its packets has gaps");
       }},
      // What is played.
      {"recording",
       [](PlayerOptions& o, const Value& v) {
         o.recording = std::string(v.text);
         for (const std::string& name : partsOf(v.text)) {
           o.source.files.push_back(existing(name, v));
         }
       }},
      {"format",
       [](PlayerOptions& o, const Value& v) { o.source.format = oneOf(v, recordingFormats()); }},
      {"poses", [](PlayerOptions& o, const Value& v) { o.source.poses = existing(v.text, v); }},
      {"calibration",
       [](PlayerOptions& o, const Value& v) {
         o.source.calibration = existing(v.text, v);
         o.source.calibration_given = v.given;
       }},
      {"hand_eye",
       [](PlayerOptions& o, const Value& v) {
         o.source.hand_eye = existing(v.text, v);
         o.source.hand_eye_given = v.given;
       }},
      {"topics",
       [](PlayerOptions& o, const Value& v) { o.source.reader.topics = partsOf(v.text); }},
      {"event_columns", [](PlayerOptions& o, const Value& v) { o.source.reader.columns = v.text; }},
      {"time_unit",
       [](PlayerOptions& o, const Value& v) {
         o.source.reader.time_unit = oneOf(v, {"s", "ms", "us", "ns"});
       }},
      {"skip_bad_events",
       [](PlayerOptions& o, const Value& v) {
         o.source.skip_bad_events = static_cast<std::uint64_t>(
             countIn(v, 0, std::numeric_limits<std::int64_t>::max(), "a whole number from 0"));
       }},
      // How.
      {"packet_s",
       [](PlayerOptions& o, const Value& v) {
         o.source.packet_ns = durationFromSeconds(numberIn(v, 1e-4, 1, "1e-4 to 1 (seconds)"));
       }},
      {"speed",
       [](PlayerOptions& o, const Value& v) {
         o.speed = numberIn(v, 0.001, 1000, "0.001 to 1000 (times as fast as it was recorded)");
       }},
      {"restamp", [](PlayerOptions& o, const Value& v) { o.restamp = valueIn(kRestamps, v.text); }},
      {"perturb",
       [](PlayerOptions& o, const Value& v) {
         for (const std::string& fault : partsOf(v.text)) setTrackerFault(fault, o.source.faults);
       }},
  };
  return all;
}

void read(const std::string& key, const Value& value, PlayerOptions& options) {
  std::vector<std::string> known;
  for (const PlayerKey& entry : keys()) {
    if (entry.key == key) return entry.read(options, value);
    known.emplace_back(entry.key);
  }
  throw std::invalid_argument("unknown key: " + expectedName(key, known));
}

}  // namespace

PlayerOptions readPlayerOptions(const mrpt::config::CConfigFileBase& source,
                                const std::string& section) {
  PlayerOptions options;
  options.source.allow_pipe = true;
  const OptionOrigin origin = originIn(source, section);
  std::vector<std::string> given_keys;
  source.getAllKeys(section, given_keys);
  for (const std::string& key : given_keys) {
    const std::string text = source.read_string(section, key, "");
    const std::string_view value = trimmed(withoutComment(text));
    const std::string given = fmt::format("{} {} = {}", origin.name, key, printable(value, 200));
    try {
      read(key, {value, origin, given}, options);
    } catch (const std::invalid_argument& error) {
      throw std::invalid_argument(given + ": " + error.what());
    }
  }
  for (const char* required : {"recording", "process_rate"}) {
    if (std::find(given_keys.begin(), given_keys.end(), required) != given_keys.end()) continue;
    throw std::invalid_argument(fmt::format("{} {}: must be given", origin.name, required));
  }
  try {
    requireKeyframeLength(options.source.faults);
  } catch (const std::invalid_argument& error) {
    throw std::invalid_argument(origin.name + " perturb: " + error.what());
  }
  return options;
}

}  // namespace efm
