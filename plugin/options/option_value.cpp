// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/options/option_value.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <optional>
#include <stdexcept>

#include "mapping/geometry/timestamp.h"
#include "mapping/options/quoted_text.h"

namespace efm {
namespace {

template <typename Number>
bool parsesWhole(std::string_view text, Number& number) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  return error == std::errc() && end == text.data() + text.size();
}

/// Items separated by commas, each read by `parses(text, item)`. @return whether each is one.
template <typename Item, typename Parse>
bool parsesList(std::string_view text, std::vector<Item>& items, const Parse& parses) {
  items.clear();
  while (!text.empty()) {
    const std::size_t comma = text.find(',');
    if (!parses(trimmed(text.substr(0, comma)), items.emplace_back()) || comma + 1 == text.size()) {
      return false;
    }
    text = comma == std::string_view::npos ? std::string_view{} : text.substr(comma + 1);
  }
  return true;
}

/// Seconds, exact to the nanosecond.
bool parsesTime(std::string_view text, std::int64_t& t_ns) {
  const std::optional<std::int64_t> parsed = parseSeconds(text);
  if (!parsed || *parsed >= kEndOfTimeNs || *parsed <= -kEndOfTimeNs) return false;
  t_ns = *parsed;
  return true;
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

std::string_view trimmed(std::string_view text) {
  constexpr std::string_view kBlanks = " \t\r\n";
  const std::size_t first = text.find_first_not_of(kBlanks);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kBlanks) - first + 1);
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

void parseInto(std::string_view text, std::string& field) { field = text; }
void parseInto(std::string_view text, std::filesystem::path& field) { field = text; }

void parseInto(std::string_view text, std::vector<int>& field) {
  if (!parsesList(text, field, parsesWhole<int>)) {
    throw std::invalid_argument("must be whole numbers separated by commas, or nothing");
  }
}

void parseInto(std::string_view text, Eigen::Vector3d& field) {
  std::vector<double> items;
  if (!parsesList(text, items, parsesWhole<double>) || items.size() != 3 ||
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

void parseInto(std::string_view text, std::vector<std::int64_t>& field) {
  if (!parsesList(text, field, parsesTime)) {
    throw std::invalid_argument(
        "must be seconds within 4.6e9 of 0, separated by commas, or nothing");
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
void parseInto(std::string_view text, Consistency& field) {
  field = consistencyFromName(printable(text));
}

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
