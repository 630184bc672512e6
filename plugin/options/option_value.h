// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
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

namespace efm {

/// An option's value, of any kind of field.
using OptionValue = std::variant<bool, std::int64_t, double, std::string>;

/// The text for a file: numbers have the fewest digits that read back the same.
std::string textOf(const OptionValue& value);

/// Reads a field from the text of a file.
/// @throws std::invalid_argument saying the expected kind: "must be a number".
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

}  // namespace efm
