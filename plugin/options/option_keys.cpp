// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/options/option_keys.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <charconv>
#include <optional>
#include <stdexcept>

#include "mapping/base/text.h"
#include "mapping/geometry/rigid3.h"
#include "mapping/geometry/timestamp.h"

namespace efm {
namespace {

/// @throws std::invalid_argument with the expected kind if there is no value.
template <typename Value>
Value valueOr(const std::optional<Value>& value, const char* expected) {
  if (!value) throw std::invalid_argument(expected);
  return *value;
}

/// Reads items separated by commas. @return std::nullopt if `parse` reads one as std::nullopt.
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

/// Reads seconds as nanoseconds, exactly.
std::optional<std::int64_t> parseTime(std::string_view text) {
  const std::optional<std::int64_t> t_ns = parseSeconds(text);
  const bool in_range = t_ns && -kEndOfTimeNs < *t_ns && *t_ns < kEndOfTimeNs;
  return in_range ? t_ns : std::nullopt;
}

/// Returns the items, separated by commas.
template <typename Item, typename Text>
std::string listText(const std::vector<Item>& items, const Text& text_of) {
  std::string list;
  for (const Item& item : items) list += (list.empty() ? "" : ",") + text_of(item);
  return list;
}

/// Returns the fewest digits that give the same value when read.
std::string shortestText(double number) {
  std::array<char, 32> digits{};
  const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), number).ptr;
  return {digits.data(), end};
}

/// Returns the degrees with the fewest digits that are equal to these radians when read: the
/// written degrees, if they had no more than 15 digits.
double degreesThatReadAs(double angle_rad) {
  const double angle_deg = angle_rad / kRadiansPerDegree;
  for (const int decimals : {14, 15, 16}) {
    const double rounded_deg =
        parseFinite(fmt::format("{:.{}e}", angle_deg, decimals)).value_or(angle_deg);
    if (rounded_deg * kRadiansPerDegree == angle_rad) return rounded_deg;
  }
  return angle_deg;
}

template <typename Field>
constexpr bool kIsOptional = false;
template <typename Value>
constexpr bool kIsOptional<std::optional<Value>> = true;

/// Reads a field from the text of a file.
/// @param unit the field's value for 1 in the file.
template <typename Field>
void parseInto(std::string_view text, double unit, Field& field) {
  if constexpr (kIsOptional<Field>) {
    parseInto(text, unit, field.emplace());
  } else if constexpr (std::is_enum_v<Field>) {
    field = fromName<Field>(printable(text));
  } else if constexpr (std::is_same_v<Field, bool>) {
    if (text != "true" && text != "false") throw std::invalid_argument("must be true or false");
    field = text == "true";
  } else if constexpr (std::is_integral_v<Field>) {
    field = valueOr(parseNumber<Field>(text), std::is_unsigned_v<Field>
                                                  ? "must be a whole number, 0 to 4294967295"
                                                  : "must be a whole number");
  } else if constexpr (std::is_same_v<Field, double>) {
    field = unit * valueOr(parseFinite(text), "must be a number");
  } else if constexpr (std::is_same_v<Field, MaxConfidence>) {
    if (text == "keyframe" || text == "sequence") {
      field = {text == "keyframe" ? WhiteLevel::kKeyframe : WhiteLevel::kSequence, 0};
    } else {
      field =
          MaxConfidence::of(valueOr(parseFinite(text), "must be a number, keyframe or sequence"));
    }
  } else if constexpr (std::is_same_v<Field, Eigen::Vector3d>) {
    const auto items = parseList(text, parseFinite);
    if (!items || items->size() != 3) {
      throw std::invalid_argument("must be three numbers separated by commas");
    }
    field = Eigen::Vector3d::Map(items->data());
  } else if constexpr (std::is_same_v<Field, std::vector<int>>) {
    field = valueOr(parseList(text, parseNumber<int>),
                    "must be whole numbers separated by commas, or nothing");
  } else if constexpr (std::is_same_v<Field, std::vector<std::int64_t>>) {
    field = valueOr(parseList(text, parseTime),
                    "must be seconds within 4.6e9 of 0, separated by commas, or nothing");
  } else {
    field = text;
  }
}

/// Returns the value of a field. Reading it gives the same field.
template <typename Field>
OptionValue valueOf(const Field& field, double unit) {
  if constexpr (kIsOptional<Field>) {
    return field ? valueOf(*field, unit) : OptionValue(std::string("auto"));
  } else if constexpr (std::is_enum_v<Field>) {
    return std::string(nameOf(field));
  } else if constexpr (std::is_integral_v<Field> && !std::is_same_v<Field, bool>) {
    return std::int64_t{field};
  } else if constexpr (std::is_same_v<Field, double>) {
    return unit == 1 ? field : degreesThatReadAs(field);
  } else if constexpr (std::is_same_v<Field, MaxConfidence>) {
    if (field.level == WhiteLevel::kFixed) return field.fixed;
    return std::string(field.level == WhiteLevel::kKeyframe ? "keyframe" : "sequence");
  } else if constexpr (std::is_same_v<Field, Eigen::Vector3d>) {
    return shortestText(field.x()) + "," + shortestText(field.y()) + "," + shortestText(field.z());
  } else if constexpr (std::is_same_v<Field, std::vector<int>>) {
    return listText(field, [](int item) { return std::to_string(item); });
  } else if constexpr (std::is_same_v<Field, std::vector<std::int64_t>>) {
    return listText(field, formatSeconds);
  } else if constexpr (std::is_same_v<Field, std::filesystem::path>) {
    return field.string();
  } else {
    return field;
  }
}

/// Returns the flag that an option's value is chosen from the data; null if it cannot be.
template <typename Automatic>
auto* isChosen(Automatic& automatic, std::string_view key) {
  decltype(&automatic.window_s) chosen = nullptr;
  AutomaticOptions::fields(automatic, [&](std::string_view name, auto& flag) {
    if (name == key) chosen = &flag;
  });
  return chosen;
}

}  // namespace

std::string textOf(const OptionValue& value) {
  if (const auto* flag = std::get_if<bool>(&value)) return *flag ? "true" : "false";
  if (const auto* text = std::get_if<std::string>(&value)) return *text;
  if (const auto* whole = std::get_if<std::int64_t>(&value)) return std::to_string(*whole);
  return shortestText(std::get<double>(value));
}

bool setOption(EventFusionOptions& options, std::string_view section, std::string_view key,
               std::string_view text, const std::filesystem::path& folder) {
  bool found = false;
  visitOptions(options, [&](std::string_view its_section, std::string_view its_key, auto& field,
                            const Allowed& allowed) {
    using Field = std::decay_t<decltype(field)>;
    if (its_section != section || its_key != key || !allowed.in_files) return;
    found = true;
    bool* const chosen = isChosen(options.automatic, key);
    if (chosen) *chosen = text == "auto";
    if constexpr (kIsOptional<Field>) field.reset();
    if constexpr (std::is_same_v<Field, std::filesystem::path>) {
      field = text.empty() ? std::filesystem::path() : folder / text;
    } else if (!chosen && !kIsOptional<Field>) {
      parseInto(text, allowed.unit, field);
    } else if (text != "auto") {
      try {
        parseInto(text, allowed.unit, field);
      } catch (const std::invalid_argument& error) {
        throw std::invalid_argument(error.what() + std::string(", or auto"));
      }
    }
  });
  return found;
}

std::vector<NamedOption> listOptions(const EventFusionOptions& options) {
  std::vector<NamedOption> list;
  visitOptions(options, [&](std::string_view section, std::string_view key, auto& field,
                            const Allowed& allowed) {
    if (!allowed.in_files) return;
    const bool* const chosen = isChosen(options.automatic, key);
    list.push_back(
        {section, key,
         chosen && *chosen ? OptionValue(std::string("auto")) : valueOf(field, allowed.unit)});
  });
  return list;
}

nlohmann::ordered_json asJson(const EventFusionOptions& options) {
  auto json = nlohmann::ordered_json::object();
  for (const NamedOption& option : listOptions(options)) {
    std::visit(
        [&](const auto& value) {
          json[std::string(option.section)][std::string(option.key)] = value;
        },
        option.value);
  }
  return json;
}

nlohmann::ordered_json asJson(const std::vector<ChosenOption>& chosen) {
  auto json = nlohmann::ordered_json::array();
  for (const ChosenOption& option : chosen) {
    json.push_back({{"key", option.key}, {"value", option.value}, {"reason", option.reason}});
  }
  return json;
}

bool isOptionSection(std::string_view section) {
  const std::vector<NamedOption> all = listOptions({});
  return std::any_of(all.begin(), all.end(),
                     [&](const NamedOption& option) { return option.section == section; });
}

}  // namespace efm
