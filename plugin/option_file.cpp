// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/option_file.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <fstream>
#include <functional>
#include <initializer_list>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <type_traits>

#include "mapping/quoted_text.h"
#include "mapping/timestamp.h"

namespace efm {
namespace {

// --- Values and their text -------------------------------------------------------------------

template <typename Number>
bool parsesWhole(std::string_view text, Number& number) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  return error == std::errc() && end == text.data() + text.size();
}

void parseInto(std::string_view text, double& field) {
  if (!parsesWhole(text, field) || !std::isfinite(field)) {
    throw std::invalid_argument("must be a number");
  }
}

void parseInto(std::string_view text, int& field) {
  if (!parsesWhole(text, field)) throw std::invalid_argument("must be a whole number");
}

void parseInto(std::string_view text, std::int64_t& field) {
  if (!parsesWhole(text, field)) throw std::invalid_argument("must be a whole number");
}

void parseInto(std::string_view text, std::uint32_t& field) {
  if (!parsesWhole(text, field)) {
    throw std::invalid_argument("must be a whole number, 0 to 4294967295");
  }
}

void parseInto(std::string_view text, bool& field) {
  if (text != "true" && text != "false") throw std::invalid_argument("must be true or false");
  field = text == "true";
}

std::string_view trimmed(std::string_view text) {
  constexpr std::string_view kBlanks = " \t\r\n";
  const std::size_t first = text.find_first_not_of(kBlanks);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kBlanks) - first + 1);
}

void parseInto(std::string_view text, std::string& field) { field = text; }
void parseInto(std::string_view text, std::filesystem::path& field) { field = text; }

/// Items separated by commas. @return whether each is one.
template <typename Item>
bool parsesList(std::string_view text, std::vector<Item>& items) {
  items.clear();
  while (!text.empty()) {
    const std::size_t comma = text.find(',');
    if (!parsesWhole(trimmed(text.substr(0, comma)), items.emplace_back()) ||
        comma + 1 == text.size()) {
      return false;
    }
    text = comma == std::string_view::npos ? std::string_view{} : text.substr(comma + 1);
  }
  return true;
}

void parseInto(std::string_view text, std::vector<int>& field) {
  if (!parsesList(text, field)) {
    throw std::invalid_argument("must be whole numbers separated by commas, or nothing");
  }
}

void parseInto(std::string_view text, Eigen::Vector3d& field) {
  std::vector<double> items;
  if (!parsesList(text, items) || items.size() != 3 ||
      !std::all_of(items.begin(), items.end(), [](double item) { return std::isfinite(item); })) {
    throw std::invalid_argument("must be three numbers separated by commas");
  }
  field = {items[0], items[1], items[2]};
}

void parseInto(std::string_view text, MaxConfidence& field) {
  if (text == "keyframe" || text == "sequence") {
    field = {text == "keyframe" ? WhiteLevel::kKeyframe : WhiteLevel::kSequence, 0};
  } else if (double votes = 0; parsesWhole(text, votes) && std::isfinite(votes)) {
    field = MaxConfidence::of(votes);
  } else {
    throw std::invalid_argument("must be a number, keyframe or sequence");
  }
}

/// Seconds, exact to the nanosecond.
void parseInto(std::string_view text, std::vector<std::int64_t>& field) {
  field.clear();
  while (!text.empty()) {
    const std::size_t comma = text.find(',');
    const std::optional<std::int64_t> t_ns = parseSeconds(trimmed(text.substr(0, comma)));
    if (!t_ns || *t_ns >= kEndOfTimeNs || *t_ns <= -kEndOfTimeNs || comma + 1 == text.size()) {
      throw std::invalid_argument(
          "must be seconds within 4.6e9 of 0, separated by commas, or nothing");
    }
    field.push_back(*t_ns);
    text = comma == std::string_view::npos ? std::string_view{} : text.substr(comma + 1);
  }
}

// A name that is known is printable, and the error shows one that is not.
void parseInto(std::string_view text, KeyframePolicyKind& field) {
  field = keyframePolicyFromName(printable(text));
}
void parseInto(std::string_view text, ReferenceTime& field) {
  field = referenceTimeFromName(printable(text));
}
void parseInto(std::string_view text, PlaneSpacing& field) {
  field = planeSpacingFromName(printable(text));
}
void parseInto(std::string_view text, FusionRule& field) {
  field = fusionRuleFromName(printable(text));
}
void parseInto(std::string_view text, FusionOrder& field) {
  field = fusionOrderFromName(printable(text));
}
void parseInto(std::string_view text, SubintervalSplit& field) {
  field = subintervalSplitFromName(printable(text));
}
void parseInto(std::string_view text, SubintervalShuffle& field) {
  field = subintervalShuffleFromName(printable(text));
}
void parseInto(std::string_view text, ExtractionMethod& field) {
  field = extractionMethodFromName(printable(text));
}
void parseInto(std::string_view text, VotingKernel& field) {
  field = votingKernelFromName(printable(text));
}

/// The fewest digits that read back the same.
std::string shortestText(double number) {
  std::array<char, 32> digits{};
  const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), number).ptr;
  return {digits.data(), end};
}

OptionValue valueOf(double field) { return field; }
OptionValue valueOf(int field) { return std::int64_t{field}; }
OptionValue valueOf(std::int64_t field) { return field; }
OptionValue valueOf(std::uint32_t field) { return std::int64_t{field}; }
OptionValue valueOf(bool field) { return field; }
OptionValue valueOf(const std::vector<int>& field) {
  std::string text;
  for (const int item : field) text += (text.empty() ? "" : ",") + std::to_string(item);
  return text;
}
OptionValue valueOf(const std::string& field) { return field; }
OptionValue valueOf(const Eigen::Vector3d& field) {
  return shortestText(field.x()) + "," + shortestText(field.y()) + "," + shortestText(field.z());
}
OptionValue valueOf(const MaxConfidence& field) {
  if (field.level == WhiteLevel::kFixed) return field.fixed;
  return std::string(field.level == WhiteLevel::kKeyframe ? "keyframe" : "sequence");
}
OptionValue valueOf(const std::filesystem::path& field) { return field.string(); }
OptionValue valueOf(const std::vector<std::int64_t>& times_ns) {
  std::string text;
  for (const std::int64_t t_ns : times_ns) text += (text.empty() ? "" : ",") + formatSeconds(t_ns);
  return text;
}
template <typename Enum, typename = std::enable_if_t<std::is_enum_v<Enum>>>
OptionValue valueOf(Enum field) {
  return std::string(nameOf(field));
}

// --- The table -------------------------------------------------------------------------------

/// One key: how it is read into its field and how the field is given back.
struct OptionKey {
  std::string_view section;
  std::string_view key;
  std::function<void(EventFusionOptions&, std::string_view)> read;
  std::function<OptionValue(const EventFusionOptions&)> value;
  bool is_path = false;
};

template <typename Field>
OptionKey option(std::string_view section, std::string_view key, Field field) {
  using Value = std::decay_t<std::invoke_result_t<Field, EventFusionOptions&>>;
  return {section, key,
          [field](EventFusionOptions& options, std::string_view text) {
            parseInto(text, field(options));
          },
          [field](const EventFusionOptions& options) { return valueOf(field(options)); },
          std::is_same_v<Value, std::filesystem::path>};
}

/// A key whose field is a std::optional, which a word of its own leaves empty.
template <typename Field>
OptionKey optionOr(std::string_view word, std::string_view section, std::string_view key,
                   Field field) {
  return {section, key,
          [field, word](EventFusionOptions& options, std::string_view text) {
            auto& target = field(options);
            target.reset();
            if (text == word) return;
            try {
              parseInto(text, target.emplace());
            } catch (const std::invalid_argument& error) {
              throw std::invalid_argument(std::string(error.what()) + ", or " + std::string(word));
            }
          },
          [field, word](const EventFusionOptions& options) {
            const auto& source = field(options);
            return source ? valueOf(*source) : OptionValue(std::string(word));
          }};
}

const std::vector<OptionKey>& optionKeys() {
  using std::string_view_literals::operator""sv;
  static const std::vector<OptionKey> keys = {
      option(
          "rig"sv, "calibration"sv, [](auto& o) -> auto& { return o.rig.calibration; }),
      option(
          "rig"sv, "hand_eye"sv, [](auto& o) -> auto& { return o.rig.hand_eye; }),
      option(
          "rig"sv, "cameras"sv, [](auto& o) -> auto& { return o.mapper.cameras; }),
      option(
          "rig"sv, "time_offsets_s"sv, [](auto& o) -> auto& { return o.rig.time_offsets_ns; }),
      option(
          "rig"sv, "pose_source"sv, [](auto& o) -> auto& { return o.rig.pose_source; }),
      option(
          "rig"sv, "max_pose_gap_s"sv,
          [](auto& o) -> auto& { return o.mapper.trajectory.max_pose_gap_s; }),
      option(
          "rig"sv, "exclude_silent"sv,
          [](auto& o) -> auto& { return o.mapper.keyframe.exclude_silent; }),

      option(
          "keyframes"sv, "policy"sv, [](auto& o) -> auto& { return o.mapper.keyframes.policy; }),
      option(
          "keyframes"sv, "window_s"sv,
          [](auto& o) -> auto& { return o.mapper.keyframes.window_s; }),
      option(
          "keyframes"sv, "stride_s"sv,
          [](auto& o) -> auto& { return o.mapper.keyframes.stride_s; }),
      option(
          "keyframes"sv, "window_events"sv,
          [](auto& o) -> auto& { return o.mapper.keyframes.window_events; }),
      option(
          "keyframes"sv, "min_baseline_ratio"sv,
          [](auto& o) -> auto& { return o.mapper.keyframes.min_baseline_ratio; }),
      option(
          "keyframes"sv, "min_visible_share"sv,
          [](auto& o) -> auto& { return o.mapper.keyframes.min_visible_share; }),
      option(
          "keyframes"sv, "reference"sv,
          [](auto& o) -> auto& { return o.mapper.keyframes.reference; }),

      option(
          "dsi"sv, "min_depth_m"sv,
          [](auto& o) -> auto& { return o.mapper.keyframe.planes.min_depth_m; }),
      option(
          "dsi"sv, "max_depth_m"sv,
          [](auto& o) -> auto& { return o.mapper.keyframe.planes.max_depth_m; }),
      option(
          "dsi"sv, "num_planes"sv,
          [](auto& o) -> auto& { return o.mapper.keyframe.planes.num_planes; }),
      option(
          "dsi"sv, "spacing"sv, [](auto& o) -> auto& { return o.mapper.keyframe.planes.spacing; }),
      option(
          "dsi"sv, "reference_camera"sv,
          [](auto& o) -> auto& { return o.mapper.keyframe.reference_camera; }),
      optionOr(
          "auto"sv, "dsi"sv, "fov_deg"sv,
          [](auto& o) -> auto& { return o.mapper.keyframe.view.fov_deg; }),
      optionOr(
          "auto"sv, "dsi"sv, "width"sv,
          [](auto& o) -> auto& { return o.mapper.keyframe.view.width; }),
      optionOr(
          "auto"sv, "dsi"sv, "height"sv,
          [](auto& o) -> auto& { return o.mapper.keyframe.view.height; }),
      option(
          "dsi"sv, "rv_offset_m"sv,
          [](auto& o) -> auto& { return o.mapper.keyframe.view.offset_m; }),

      option(
          "fusion"sv, "across_cameras"sv,
          [](auto& o) -> auto& { return o.mapper.keyframe.sweep.fusion.across_cameras; }),
      option(
          "fusion"sv, "across_time"sv,
          [](auto& o) -> auto& { return o.mapper.keyframe.sweep.fusion.across_time; }),
      option(
          "fusion"sv, "order"sv,
          [](auto& o) -> auto& { return o.mapper.keyframe.sweep.fusion.order; }),
      option(
          "fusion"sv, "subintervals"sv,
          [](auto& o) -> auto& { return o.mapper.keyframe.subintervals.count; }),
      option(
          "fusion"sv, "split"sv,
          [](auto& o) -> auto& { return o.mapper.keyframe.subintervals.split; }),
      option(
          "fusion"sv, "shuffle"sv,
          [](auto& o) -> auto& { return o.mapper.keyframe.subintervals.shuffle; }),
      option(
          "fusion"sv, "shuffle_seed"sv,
          [](auto& o) -> auto& { return o.mapper.keyframe.subintervals.shuffle_seed; }),
      option(
          "fusion"sv, "late"sv, [](auto& o) -> auto& { return o.late_fusion; }),

      option(
          "depth"sv, "extraction"sv,
          [](auto& o) -> auto& { return o.mapper.keyframe.extraction.extraction; }),
      option(
          "depth"sv, "threshold_kernel"sv,
          [](auto& o) -> auto& { return o.mapper.keyframe.extraction.threshold_kernel; }),
      option(
          "depth"sv, "threshold_c"sv,
          [](auto& o) -> auto& { return o.mapper.keyframe.extraction.threshold_c; }),
      option(
          "depth"sv, "max_confidence"sv,
          [](auto& o) -> auto& { return o.mapper.keyframe.extraction.max_confidence; }),
      option(
          "depth"sv, "median_size"sv,
          [](auto& o) -> auto& { return o.mapper.keyframe.extraction.median_size; }),
      option(
          "depth"sv, "dilate"sv,
          [](auto& o) -> auto& { return o.mapper.keyframe.extraction.dilate; }),
      option(
          "depth"sv, "subplane"sv,
          [](auto& o) -> auto& { return o.mapper.keyframe.extraction.subplane; }),

      option(
          "map"sv, "voxel_size_m"sv, [](auto& o) -> auto& { return o.cloud.voxel_size_m; }),
      option(
          "map"sv, "min_keyframes"sv, [](auto& o) -> auto& { return o.cloud.min_keyframes; }),
      option(
          "map"sv, "outlier_radius_m"sv,
          [](auto& o) -> auto& { return o.cloud.outliers.outlier_radius_m; }),
      option(
          "map"sv, "outlier_min_neighbors"sv,
          [](auto& o) -> auto& { return o.cloud.outliers.outlier_min_neighbors; }),

      option(
          "output"sv, "camera_maps"sv,
          [](auto& o) -> auto& { return o.mapper.keyframe.camera_maps; }),
      option(
          "output"sv, "event_images"sv,
          [](auto& o) -> auto& { return o.mapper.keyframe.event_images; }),

      optionOr(
          "auto"sv, "performance"sv, "threads"sv,
          [](auto& o) -> auto& { return o.mapper.keyframe.sweep.threads; }),
      optionOr(
          "auto"sv, "performance"sv, "kernel"sv,
          [](auto& o) -> auto& { return o.mapper.keyframe.sweep.kernel; }),
      option(
          "performance"sv, "packet_error_px"sv,
          [](auto& o) -> auto& { return o.mapper.keyframe.packets.packet_error_px; }),
  };
  return keys;
}

/// The keys of a section, or the sections, for whoever mistyped one.
std::string knownKeys(std::string_view section) {
  std::string known;
  for (const OptionKey& entry : optionKeys()) {
    if (entry.section == section) known += (known.empty() ? "" : ", ") + std::string(entry.key);
  }
  return known;
}

std::string knownSections() {
  std::string known;
  std::string_view last;
  for (const OptionKey& entry : optionKeys()) {
    if (entry.section != last) {
      known += (known.empty() ? "[" : ", [") + std::string(entry.section) + "]";
    }
    last = entry.section;
  }
  return known;
}

// --- The text --------------------------------------------------------------------------------

std::string joined(std::initializer_list<std::string_view> parts) {
  std::string text;
  for (const std::string_view part : parts) text += part;
  return text;
}

/// Where an option stands: "rig.ini:3: [dsi]".
std::string placeOf(std::string_view origin, std::string_view section) {
  return joined({origin, ": [", section, "]"});
}

[[noreturn]] void refuse(std::initializer_list<std::string_view> message) {
  throw std::invalid_argument(joined(message));
}

bool startsComment(std::string_view text) {
  return text.substr(0, 1) == ";" || text.substr(0, 1) == "#" || text.substr(0, 2) == "//";
}

/// The line up to a comment, which starts the line or follows a blank.
std::string_view withoutComment(std::string_view line) {
  for (std::size_t i = 0; i < line.size(); ++i) {
    const bool after_blank = i == 0 || line[i - 1] == ' ' || line[i - 1] == '\t';
    if (after_blank && startsComment(line.substr(i))) return line.substr(0, i);
  }
  return line;
}

}  // namespace

std::vector<NamedOption> listOptions(const EventFusionOptions& options) {
  std::vector<NamedOption> list;
  for (const OptionKey& entry : optionKeys()) {
    list.push_back({entry.section, entry.key, entry.value(options)});
  }
  return list;
}

bool isOptionSection(std::string_view section) { return !knownKeys(section).empty(); }

std::string textOf(const OptionValue& value) {
  if (const auto* flag = std::get_if<bool>(&value)) return *flag ? "true" : "false";
  if (const auto* text = std::get_if<std::string>(&value)) return *text;
  if (const auto* whole = std::get_if<std::int64_t>(&value)) return std::to_string(*whole);
  return shortestText(std::get<double>(value));
}

void OptionReader::readFile(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  // Reading, not opening, is what fails for a folder.
  if (!file || (file.peek() != std::ifstream::traits_type::eof() && !(text << file.rdbuf())) ||
      std::filesystem::is_directory(path)) {
    throw std::runtime_error("cannot read the option file " + path.string());
  }
  folder_ = path.parent_path();
  readText(text.str(), path.string());
  folder_.clear();
}

void OptionReader::readText(std::string_view text, const std::string& name) {
  constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";  // some editors begin files with it
  if (text.substr(0, kByteOrderMark.size()) == kByteOrderMark) {
    text.remove_prefix(kByteOrderMark.size());
  }
  std::map<std::pair<std::string, std::string>, int> lines;  // of this text
  std::string section;
  for (int number = 1; !text.empty(); ++number) {
    const std::size_t end = text.find('\n');
    const std::string_view line = trimmed(withoutComment(text.substr(0, end)));
    text = end == std::string_view::npos ? std::string_view{} : text.substr(end + 1);
    const std::string origin = name + ":" + std::to_string(number);
    if (line.empty()) continue;

    if (line.front() == '[' && line.back() == ']') {
      section = trimmed(line.substr(1, line.size() - 2));
      if (!isOptionSection(section)) {
        refuse({origin, ": unknown section [", printable(section), "]; known: ", knownSections()});
      }
      continue;
    }
    const std::size_t equals = line.find('=');
    if (equals == std::string_view::npos || section.empty()) {
      refuse(
          {origin, ": ", inQuotes(line), ": expected [section] or, below a section, key = value"});
    }
    const std::string key(trimmed(line.substr(0, equals)));
    const auto [first, is_new] = lines.emplace(std::make_pair(section, key), number);
    if (!is_new) {
      refuse({placeOf(origin, section), " ", printable(key), ": given twice, first in line ",
              std::to_string(first->second)});
    }
    assign(section, key, trimmed(line.substr(equals + 1)), placeOf(origin, section));
  }
}

void OptionReader::set(std::string_view assignment) {
  const std::size_t dot = assignment.find('.');
  const std::size_t equals = assignment.find('=');
  if (dot == std::string_view::npos || equals == std::string_view::npos || dot > equals) {
    refuse({"--set ", printable(assignment), ": expected section.key=value"});
  }
  const std::string_view section = trimmed(assignment.substr(0, dot));
  if (!isOptionSection(section)) {
    refuse({"--set ", printable(assignment), ": unknown section [", printable(section),
            "]; known: ", knownSections()});
  }
  assign(section, trimmed(assignment.substr(dot + 1, equals - dot - 1)),
         trimmed(assignment.substr(equals + 1)), placeOf("--set", section));
}

void OptionReader::set(std::string_view section, std::string_view key, std::string_view value,
                       const OptionPlace& place) {
  if (!isOptionSection(section)) refuse({place.name, " unknown section; known: ", knownSections()});
  folder_ = place.folder;
  assign(section, key, trimmed(withoutComment(value)), place.name);
  folder_.clear();
}

void OptionReader::assign(std::string_view section, std::string_view key, std::string_view value,
                          const std::string& place) {
  const auto& keys = optionKeys();
  const auto entry = std::find_if(keys.begin(), keys.end(), [&](const OptionKey& candidate) {
    return candidate.section == section && candidate.key == key;
  });
  if (entry == keys.end()) {
    refuse({place, " ", printable(key), ": unknown key; known: ", knownKeys(section)});
  }
  try {
    const std::filesystem::path path = folder_ / value;
    entry->read(options_, entry->is_path && !value.empty() ? path.native() : value);
  } catch (const std::invalid_argument& error) {
    refuse({place, " ", printable(key), " = ", printable(value), ": ", error.what()});
  }
  places_[{std::string(section), std::string(key)}] = place;
}

EventFusionOptions OptionReader::options() const {
  try {
    options_.mapper.validate();
    options_.cloud.validate();
  } catch (const std::invalid_argument& error) {
    // The structs say "key = value: must be ..."; they know neither sections nor files.
    const std::string message = error.what();
    const std::string key = message.substr(0, message.find(" = "));
    for (const OptionKey& entry : optionKeys()) {
      if (entry.key != key) continue;
      const auto place = places_.find({std::string(entry.section), key});
      refuse({place == places_.end() ? placeOf("default", entry.section) : place->second, " ",
              message});
    }
    throw;
  }
  return options_;
}

}  // namespace efm
