// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <initializer_list>
#include <limits>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "mapping/base/text.h"

namespace efm {

/// Section and key of an option: ("dsi", "num_planes").
using OptionId = std::pair<std::string, std::string>;

/// The value that was chosen for an option, and the reason in words.
struct ChosenOption {
  std::string key;  ///< For example "min_depth_m".
  double value = 0;
  std::string reason;
};

/// Name of a value in an error message. Most code does not know the section.
struct OptionName {
  template <typename Text, typename = std::enable_if_t<std::is_convertible_v<Text, std::string>>>
  OptionName(const Text& name) : key(name) {}
  explicit OptionName(std::string_view name) : key(name) {}
  OptionName(const char* in, const char* name, const char* what = "")
      : section(in), key(name), remark(what) {}

  std::string section;
  std::string key;
  std::string remark;  ///< Text after the key: " (how many)".
};

/// Error of a value out of range: "key = value: must be …", after "[section] " if it is known.
struct OptionError : std::invalid_argument {
  /// @param others keys of the same section, if the range depends on their values.
  OptionError(const OptionName& name, const std::string& wrong, const std::string& range,
              std::vector<std::string> others = {})
      : std::invalid_argument((name.section.empty() ? "" : "[" + name.section + "] ") +
                              sentenceOf(name, wrong, range)),
        section(name.section),
        key(name.key),
        value(wrong),
        expected(range),
        other_keys(std::move(others)),
        sentence(sentenceOf(name, wrong, range)) {}

  std::string section;
  std::string key;
  std::string value;
  std::string expected;                 ///< "1 to 1000"
  std::vector<std::string> other_keys;  ///< Keys of the same section: the range depends on them.
  std::string sentence;                 ///< The message without the section.

 private:
  static std::string sentenceOf(const OptionName& name, const std::string& wrong,
                                const std::string& range) {
    return name.key + name.remark + " = " + wrong + ": must be " + range;
  }
};

/// An error that options may cause. The text names the options as "[section] key".
struct OptionHint : std::invalid_argument {
  OptionHint(const std::string& text, std::vector<OptionId> named = {})
      : std::invalid_argument(text), options(std::move(named)) {}

  std::vector<OptionId> options;
};

/// Rejects an option whose value is out of range.
/// @param holds the condition of a valid value, so that NaN is rejected too.
/// @param others keys of the same section, if the range depends on their values.
/// @throws OptionError.
template <typename Name, typename Value>
void requireOption(bool holds, const Name& name, const Value& value, std::string_view expected,
                   std::initializer_list<const char*> others = {}) {
  if (holds) return;
  NumberText text(15);  // as the user types it: 0.1, not 0.10000000000000001
  text << value;
  throw OptionError(OptionName(name), text.str(), std::string(expected),
                    {others.begin(), others.end()});
}

/// The allowed values of a number.
struct Allowed {
  double lowest = -std::numeric_limits<double>::infinity();
  double highest = std::numeric_limits<double>::infinity();
  const char* expected = nullptr;  ///< The range as text, for errors.
  bool without_lowest = false;     ///< `lowest` itself is not allowed.
  bool without_highest = false;    ///< `highest` itself is not allowed.
  bool or_zero = false;            ///< 0 is allowed, too.
  bool only_odd = false;
  double unit = 1;  ///< The field's value for 1 in an option file. Limits have the file's unit.
  bool in_files = true;  ///< False if no option file has this key.

  static Allowed from(double lowest, double highest, const char* expected) {
    return {lowest, highest, expected};
  }
  static Allowed above(double lowest, double highest, const char* expected) {
    return {lowest, highest, expected, true};
  }
  static Allowed above(double lowest, const char* expected) {
    return above(lowest, std::numeric_limits<double>::infinity(), expected);
  }
  static Allowed atLeast(double lowest, const char* expected) {
    return from(lowest, std::numeric_limits<double>::infinity(), expected);
  }
  static constexpr double kFinite = std::numeric_limits<double>::max();

  Allowed below() const { return with(&Allowed::without_highest, true); }
  Allowed orZero() const { return with(&Allowed::or_zero, true); }
  Allowed odd() const { return with(&Allowed::only_odd, true); }
  Allowed in(double units) const { return with(&Allowed::unit, units); }
  Allowed notInFiles() const { return with(&Allowed::in_files, false); }

  template <typename Number>
  bool hold(Number number) const {
    const auto value = static_cast<double>(number);
    if (or_zero && value == 0) return true;
    if (only_odd && static_cast<std::int64_t>(number) % 2 == 0) return false;
    const double low = lowest * unit, high = highest * unit;
    return (without_lowest ? value > low : value >= low) &&
           (without_highest ? value < high : value <= high);
  }

 private:
  template <typename Field>
  Allowed with(Field Allowed::*field, Field value) const {
    Allowed changed = *this;
    changed.*field = value;
    return changed;
  }
};

/// A check of the ranges. An options struct has one line per option, in the order of option files:
///
///     template <typename Self, typename Visit>
///     static void fields(Self& self, Visit&& visit) {
///       visit("window", self.window, Allowed::from(1, 1000, "from 1 to 1000 (keyframes)"));
///       visit("adapt_tracker", self.adapt_tracker);  // any value
///       visit(self.points);                          // a struct with lines of its own
///     }
///
/// The code that reads, checks, sets and lists options visits these lines, as this struct does.
struct OptionCheck {
  template <typename Value>
  void operator()(const char* key, const Value& value, const Allowed& allowed = {}) const {
    if constexpr (std::is_arithmetic_v<Value>) {
      if (!allowed.expected || allowed.hold(value)) return;
      if (allowed.unit == 1) requireOption(false, key, value, allowed.expected);
      requireOption(false, key, static_cast<double>(value) / allowed.unit, allowed.expected);
    }
  }
  template <typename Value>
  void operator()(const char* key, const std::optional<Value>& value,
                  const Allowed& allowed = {}) const {
    if (value) (*this)(key, *value, allowed);
  }
  template <typename Part>
  void operator()(const Part& part) const {
    part.validate();
  }
};

/// Checks all fields. @throws OptionError at the first field whose value is out of range.
template <typename Options>
void requireFields(const Options& options) {
  Options::fields(options, OptionCheck());
}

}  // namespace efm
