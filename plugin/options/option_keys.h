// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <type_traits>
#include <variant>
#include <vector>

#include "mapping/depth/depth_extraction.h"
#include "mapping/events/window.h"
#include "mapping/keyframes/keyframe_policy.h"
#include "mapping/sweep/space_sweep.h"
#include "maps/cloud/visibility_grid.h"
#include "plugin/session/event_fusion_options.h"

namespace efm {

/// An option's value, of any kind of field.
using OptionValue = std::variant<bool, std::int64_t, double, std::string>;

/// The text for a file: numbers have the fewest digits that read back the same.
std::string textOf(const OptionValue& value);

/// Reads a field from the text of a file.
void parseInto(std::string_view text, double& field);
void parseInto(std::string_view text, int& field);
void parseInto(std::string_view text, std::int64_t& field);
void parseInto(std::string_view text, std::uint32_t& field);
void parseInto(std::string_view text, bool& field);
void parseInto(std::string_view text, std::string& field);
void parseInto(std::string_view text, std::filesystem::path& field);
void parseInto(std::string_view text, std::vector<int>& field);
void parseInto(std::string_view text, Eigen::Vector3d& field);
void parseInto(std::string_view text, MaxConfidence& field);
/// Nanoseconds from seconds, exactly.
void parseInto(std::string_view text, std::vector<std::int64_t>& field);
void parseInto(std::string_view text, KeyframePolicyKind& field);
void parseInto(std::string_view text, ReferenceTime& field);
void parseInto(std::string_view text, PlaneSpacing& field);
void parseInto(std::string_view text, FusionRule& field);
void parseInto(std::string_view text, FusionOrder& field);
void parseInto(std::string_view text, SubintervalSplit& field);
void parseInto(std::string_view text, SubintervalShuffle& field);
void parseInto(std::string_view text, ExtractionMethod& field);
void parseInto(std::string_view text, VotingKernel& field);
void parseInto(std::string_view text, Consistency& field);

/// The value of a field, which reads back the same.
OptionValue valueOf(double field);
OptionValue valueOf(int field);
OptionValue valueOf(std::int64_t field);
OptionValue valueOf(std::uint32_t field);
OptionValue valueOf(bool field);
OptionValue valueOf(const std::vector<int>& field);
OptionValue valueOf(const std::string& field);
OptionValue valueOf(const Eigen::Vector3d& field);
OptionValue valueOf(const MaxConfidence& field);
OptionValue valueOf(const std::filesystem::path& field);
OptionValue valueOf(const std::vector<std::int64_t>& times_ns);
template <typename Enum, typename = std::enable_if_t<std::is_enum_v<Enum>>>
OptionValue valueOf(Enum field) {
  return std::string(nameOf(field));
}

/// One key: the functions that read its field from text and return its value.
struct OptionKey {
  std::string_view section;
  std::string_view key;
  std::function<void(EventFusionOptions&, std::string_view)> read;
  std::function<OptionValue(const EventFusionOptions&)> value;
  bool is_path = false;
};

/// The table of all options. Reading, overriding and reporting use it alone, and so cannot differ.
const std::vector<OptionKey>& optionKeys();

/// One option as the files name it.
struct NamedOption {
  std::string_view section;
  std::string_view key;
  OptionValue value;
};

/// All options, in the order of the table.
std::vector<NamedOption> listOptions(const EventFusionOptions& options);
/// Whether an option file may have a section of this name.
bool isOptionSection(std::string_view section);

/// The error for a key that an earlier version had: its new name, or that it is gone. Empty for
/// other keys.
std::string_view formerOptionError(std::string_view section, std::string_view key);

/// The keys of a section; none of an unknown one.
std::vector<std::string> optionKeysOf(std::string_view section);
/// All sections: "[rig]", …
std::vector<std::string> optionSections();

}  // namespace efm
