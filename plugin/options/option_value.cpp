// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/options/option_value.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <optional>
#include <stdexcept>

#include "mapping/base/text.h"
#include "mapping/geometry/timestamp.h"

namespace efm {
namespace {

/// @throws std::invalid_argument saying what is expected, where there is no value.
template <typename Value>
Value valueOr(const std::optional<Value>& value, const char* expected) {
  if (!value) throw std::invalid_argument(expected);
  return *value;
}

/// Items separated by commas, each read by `parse`; nothing where one is none.
template <typename Parse>
auto parseList(std::string_view text, const Parse& parse) {
  using Item = typename decltype(parse(text))::value_type;
  std::optional<std::vector<Item>> items(std::in_place);
  while (!text.empty()) {
    const std::size_t comma = text.find(',');
    const std::optional<Item> item = parse(trimmed(text.substr(0, comma)));
    if (!item || comma + 1 == text.size()) return std::optional<std::vector<Item>>();
    items->push_back(*item);
    text = comma == std::string_view::npos ? std::string_view{} : text.substr(comma + 1);
  }
  return items;
}

/// Nanoseconds from seconds, exactly.
std::optional<std::int64_t> parseTime(std::string_view text) {
  const std::optional<std::int64_t> t_ns = parseSeconds(text);
  const bool in_range = t_ns && -kEndOfTimeNs < *t_ns && *t_ns < kEndOfTimeNs;
  return in_range ? t_ns : std::nullopt;
}

/// Items separated by commas.
template <typename Item, typename Text>
std::string listText(const std::vector<Item>& items, const Text& text_of) {
  std::string list;
  for (const Item& item : items) list += (list.empty() ? "" : ",") + text_of(item);
  return list;
}

/// The fewest digits that read back the same.
std::string shortestText(double number) {
  std::array<char, 32> digits{};
  const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), number).ptr;
  return {digits.data(), end};
}

}  // namespace

void parseInto(std::string_view text, double& field) {
  field = valueOr(parseFinite(text), "must be a number");
}
void parseInto(std::string_view text, int& field) {
  field = valueOr(parseNumber<int>(text), "must be a whole number");
}
void parseInto(std::string_view text, std::int64_t& field) {
  field = valueOr(parseNumber<std::int64_t>(text), "must be a whole number");
}
void parseInto(std::string_view text, std::uint32_t& field) {
  field = valueOr(parseNumber<std::uint32_t>(text), "must be a whole number, 0 to 4294967295");
}

void parseInto(std::string_view text, bool& field) {
  if (text != "true" && text != "false") throw std::invalid_argument("must be true or false");
  field = text == "true";
}

void parseInto(std::string_view text, std::string& field) { field = text; }
void parseInto(std::string_view text, std::filesystem::path& field) { field = text; }

void parseInto(std::string_view text, std::vector<int>& field) {
  field = valueOr(parseList(text, parseNumber<int>),
                  "must be whole numbers separated by commas, or nothing");
}

void parseInto(std::string_view text, Eigen::Vector3d& field) {
  const auto items = parseList(text, parseFinite);
  if (!items || items->size() != 3) {
    throw std::invalid_argument("must be three numbers separated by commas");
  }
  field = Eigen::Vector3d::Map(items->data());
}

void parseInto(std::string_view text, MaxConfidence& field) {
  if (text == "keyframe" || text == "sequence") {
    field = {text == "keyframe" ? WhiteLevel::kKeyframe : WhiteLevel::kSequence, 0};
  } else {
    field = MaxConfidence::of(valueOr(parseFinite(text), "must be a number, keyframe or sequence"));
  }
}

void parseInto(std::string_view text, std::vector<std::int64_t>& field) {
  field = valueOr(parseList(text, parseTime),
                  "must be seconds within 4.6e9 of 0, separated by commas, or nothing");
}

// The error shows an unknown name; known names are printable.
#define EFM_PARSE_CHOICE(Choice, fromName) \
  void parseInto(std::string_view text, Choice& field) { field = fromName(printable(text)); }
EFM_PARSE_CHOICE(KeyframePolicyKind, keyframePolicyFromName)
EFM_PARSE_CHOICE(ReferenceTime, referenceTimeFromName)
EFM_PARSE_CHOICE(PlaneSpacing, planeSpacingFromName)
EFM_PARSE_CHOICE(FusionRule, fusionRuleFromName)
EFM_PARSE_CHOICE(FusionOrder, fusionOrderFromName)
EFM_PARSE_CHOICE(SubintervalSplit, subintervalSplitFromName)
EFM_PARSE_CHOICE(SubintervalShuffle, subintervalShuffleFromName)
EFM_PARSE_CHOICE(ExtractionMethod, extractionMethodFromName)
EFM_PARSE_CHOICE(VotingKernel, votingKernelFromName)
EFM_PARSE_CHOICE(Consistency, consistencyFromName)
#undef EFM_PARSE_CHOICE

OptionValue valueOf(double field) { return field; }
OptionValue valueOf(int field) { return std::int64_t{field}; }
OptionValue valueOf(std::int64_t field) { return field; }
OptionValue valueOf(std::uint32_t field) { return std::int64_t{field}; }
OptionValue valueOf(bool field) { return field; }
OptionValue valueOf(const std::vector<int>& field) {
  return listText(field, [](int item) { return std::to_string(item); });
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
  return listText(times_ns, formatSeconds);
}

std::string textOf(const OptionValue& value) {
  if (const auto* flag = std::get_if<bool>(&value)) return *flag ? "true" : "false";
  if (const auto* text = std::get_if<std::string>(&value)) return *text;
  if (const auto* whole = std::get_if<std::int64_t>(&value)) return std::to_string(*whole);
  return shortestText(std::get<double>(value));
}

}  // namespace efm
