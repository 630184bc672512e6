// SPDX-License-Identifier: BSD-3-Clause
// Tests the properties that every option must have.
#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <type_traits>
#include <vector>

#include "mapping/base/option.h"
#include "mapping/base/text.h"
#include "maps/metrics/depth_metrics.h"
#include "plugin/options/option_keys.h"
#include "plugin/options/tracker_fault_keys.h"
#include "test/plugin/temporary_folder.h"

namespace efm {
namespace {

template <typename Field>
struct NumberOf {
  using Type = Field;
};
template <typename Value>
struct NumberOf<std::optional<Value>> {
  using Type = Value;
};

/// Returns the ends of a range and the next values outside it.
template <typename Value>
struct Ends {
  std::vector<Value> allowed;
  std::vector<Value> rejected;

  explicit Ends(const Allowed& range) {
    add(range.lowest * range.unit, range.without_lowest, -1);
    add(range.highest * range.unit, range.without_highest, 1);
    if (range.or_zero) allowed.push_back(0);
    if (range.only_odd) rejected.push_back(allowed.front() + 1);
    if (std::is_floating_point_v<Value>) rejected.push_back(static_cast<Value>(NAN));
  }

 private:
  void add(double end, bool is_open, int outwards) {
    if (!std::isfinite(end)) return;
    if constexpr (std::is_floating_point_v<Value>) {
      const double beyond = std::nextafter(end, outwards * INFINITY);
      allowed.push_back(is_open ? std::nextafter(end, -outwards * INFINITY) : end);
      rejected.push_back(is_open ? end : beyond);
    } else {
      allowed.push_back(static_cast<Value>(end));
      rejected.push_back(static_cast<Value>(end) + outwards);
    }
  }
};

template <typename Options>
OptionError rejectionOf(const Options& options) {
  try {
    options.validate();
  } catch (const OptionError& error) {
    return error;
  }
  return {"", "", ""};
}

/// Returns the numbers of a sentence: 1e6 of "1e6 (metres)", 10000 of "10,000,".
std::vector<double> numbersIn(std::string_view sentence) {
  std::vector<double> numbers;
  for (const std::string_view word : splitWords(sentence)) {
    std::string digits(word);
    digits.erase(std::remove(digits.begin(), digits.end(), ','), digits.end());
    if (const auto number = parseFinite(digits)) numbers.push_back(*number);
  }
  return numbers;
}

void expectWordsToNameTheEnds(const Allowed& range) {
  const std::string words = range.expected;
  for (const double end : {range.lowest, range.highest}) {
    if (!std::isfinite(end)) continue;
    if (end == Allowed::kFinite) {
      EXPECT_THAT(words, testing::HasSubstr("finite"));
    } else {
      EXPECT_THAT(numbersIn(words), testing::Contains(end)) << words;
    }
  }
  EXPECT_EQ(words.find("odd") != std::string::npos, range.only_odd) << words;
  if (range.or_zero) {
    EXPECT_THAT(numbersIn(words), testing::Contains(0)) << words;
  }
}

/// Checks the limits of each option that it visits.
template <typename Options>
struct LimitsOfLines {
  Options& options;
  int& lines;

  template <typename Field>
  void operator()(std::string_view key, Field& field, const Allowed& range = {}) const {
    using Value = typename NumberOf<Field>::Type;
    if constexpr (std::is_arithmetic_v<Value>) {
      if (!range.expected) return;
      ++lines;
      expectWordsToNameTheEnds(range);
      const Field before = field;
      const Ends<Value> ends(range);
      for (const Value value : ends.allowed) {  // the value may contradict another option
        field = value;
        EXPECT_NE(rejectionOf(options).expected, range.expected) << key << " = " << value;
      }
      for (const Value value : ends.rejected) {
        field = value;
        NumberText text(15);
        if (range.unit == 1) text << value;
        if (range.unit != 1) text << static_cast<double>(value) / range.unit;
        const OptionError error = rejectionOf(options);
        EXPECT_EQ(error.key, key);
        EXPECT_EQ(error.value, text.str());
        EXPECT_EQ(error.expected, range.expected);
        EXPECT_EQ(error.what(), error.key + " = " + error.value + ": must be " + error.expected);
      }
      field = before;
    }
  }
};

TEST(OptionFields, TheEndsOfARangeAreAllowedAndTheNextValuesAreRejected) {
  int lines = 0;
  EventFusionOptions options;
  const LimitsOfLines<EventFusionOptions> check{options, lines};
  visitOptions(options, [&](std::string_view /*section*/, std::string_view key, auto& field,
                            const Allowed& range) { check(key, field, range); });
  EXPECT_GT(lines, 50);
  DepthPairingOptions pairing;
  DepthPairingOptions::fields(pairing, LimitsOfLines<DepthPairingOptions>{pairing, lines});
}

/// Values that differ from the defaults. `otherValue` changes numbers by adding to them.
const std::map<std::string, std::string> kOtherValues = {
    {"calibration", "a.yaml"},
    {"hand_eye", "/b.yaml"},
    {"cameras", "0,2"},
    {"time_offsets_s", "0.000000000,0.001000000"},
    {"pose_source", "wheels"},
    {"policy", "baseline"},
    {"reference", "end"},
    {"spacing", "linear"},
    {"rv_offset_m", "-0.5,0.1,2"},
    {"across_cameras", "geometric"},
    {"across_time", "rms"},
    {"order", "time_then_cameras"},
    {"split", "count"},
    {"shuffle", "random"},
    {"extraction", "paper"},
    {"max_confidence", "sequence"},
    {"consistency", "support"},
    {"kernel", "plain"},
    {"correct_motion", "true"},
};

std::string otherValue(const NamedOption& option) {
  const auto known = kOtherValues.find(std::string(option.key));
  if (known != kOtherValues.end()) return known->second;
  if (const auto* flag = std::get_if<bool>(&option.value)) return *flag ? "false" : "true";
  if (const auto* whole = std::get_if<std::int64_t>(&option.value)) return textOf(*whole + 2);
  if (const auto* number = std::get_if<double>(&option.value)) return textOf(*number + 0.5);
  return "3";  // the option is auto
}

TEST(OptionFields, AnOptionReadsBackWhatItPrintsAndChangesNoOther) {
  const std::vector<NamedOption> defaults = listOptions(defaultOptions());
  for (std::size_t i = 0; i < defaults.size(); ++i) {
    const auto& [section, key, value] = defaults[i];
    EventFusionOptions options = defaultOptions();
    ASSERT_TRUE(setOption(options, section, key, otherValue(defaults[i]), {}));
    const std::vector<NamedOption> changed = listOptions(options);
    for (std::size_t other = 0; other < defaults.size(); ++other) {
      EXPECT_EQ(textOf(changed[other].value),
                other == i ? otherValue(defaults[i]) : textOf(defaults[other].value))
          << key << ", " << defaults[other].key;
    }
    ASSERT_TRUE(setOption(options, section, key, textOf(value), {})) << key;
    EXPECT_EQ(textOf(listOptions(options)[i].value), textOf(value)) << key;
  }
}

/// Tests options whose keys or units differ from the fields' names or units.
TEST(OptionFields, KeysReachTheirFields) {
#define EFM_ROW(section, key, text, field, value)                                    \
  {                                                                                  \
    section, key, text, [](const EventFusionOptions& o) { return o.field == value; } \
  }
  const struct {
    const char* section;
    const char* key;
    const char* text;
    bool (*holds)(const EventFusionOptions&);
  } rows[] = {
      EFM_ROW("rig", "time_offsets_s", "0, 0.001", rig.time_offsets_ns,
              (std::vector<std::int64_t>{0, 1'000'000})),
      EFM_ROW("dsi", "rv_offset_m", "-0.5, 1e-3,2", mapper.keyframe.view.offset_m,
              Eigen::Vector3d(-0.5, 1e-3, 2)),
      EFM_ROW("fusion", "subintervals", "8", mapper.keyframe.subintervals.count, 8),
      EFM_ROW("fusion", "split_polarity", "false", mapper.keyframe.split.polarity, false),
      EFM_ROW("fusion", "late", "true", late_fusion, true),
      EFM_ROW("depth", "max_confidence", "31.5", mapper.keyframe.extraction.max_confidence.fixed,
              31.5),
      EFM_ROW("filter", "hot_pixel_ratio", "7.5", mapper.filter.hot_pixel.ratio, 7.5),
      EFM_ROW("filter", "hot_pixel_period_s", "2", mapper.filter.hot_pixel.period_s, 2),
      EFM_ROW("filter", "hot_pixel_min_events", "9", mapper.filter.hot_pixel.min_events, 9),
      EFM_ROW("refinement", "tracker_noise_m", "0.03", refinement.refiner.tracker.noise_m, 0.03),
      EFM_ROW("refinement", "tracker_noise_deg", "90", refinement.refiner.tracker.noise_rad,
              90 * kRadiansPerDegree),
      EFM_ROW("refinement", "tracker_drift", "0.04", refinement.refiner.tracker.drift_m, 0.04),
      EFM_ROW("refinement", "tracker_drift_deg_per_m", "180", refinement.refiner.tracker.drift_rad,
              180 * kRadiansPerDegree),
      EFM_ROW("refinement", "loop_max_sigma_deg", "45", refinement.refiner.loop.loop_max_sigma_rad,
              45 * kRadiansPerDegree),
  };
#undef EFM_ROW
  for (const auto& row : rows) {
    EventFusionOptions options;
    EXPECT_FALSE(row.holds(options)) << row.key << " has this value by default: it shows nothing";
    setOption(options, row.section, row.key, row.text, {});
    EXPECT_TRUE(row.holds(options)) << row.key;
  }
}

TEST(TrackerFaultKeys, TheEndsOfARangeAreAllowedAndTheNextValuesAreRejected) {
  TrackerFaults lines;
  int ranges = 0;
  TrackerFaults::fields(lines, [&](std::string_view key, auto& field, const Allowed& range = {}) {
    if (!range.expected) return;
    ++ranges;
    expectWordsToNameTheEnds(range);
    const auto error = [&](double value) {
      return messageOf([&] {
        TrackerFaults faults;
        setTrackerFault(std::string(key) + "=" + textOf(value), faults);
      });
    };
    const Ends<double> ends(range.in(1));
    for (const double value : ends.allowed) EXPECT_EQ(error(value), "no error") << key;
    for (const double value : ends.rejected) {
      EXPECT_EQ(error(value),
                std::string(key) + " = " + textOf(value) + ": must be " + range.expected);
    }
    using Number = typename NumberOf<std::decay_t<decltype(field)>>::Type;
    if constexpr (std::is_arithmetic_v<Number>) {
      const auto before = field;
      for (const Number value : Ends<Number>(range).rejected) {
        field = value;
        EXPECT_THROW(lines.validate(), OptionError) << key << " = " << value;
      }
      field = before;
    }
  });
  EXPECT_EQ(ranges, 12);
}

}  // namespace
}  // namespace efm
