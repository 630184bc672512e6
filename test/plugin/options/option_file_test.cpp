// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/options/option_file.h"

#include <gmock/gmock.h>

#include <cmath>
#include <fstream>
#include <random>
#include <set>
#include <sstream>

#include "event_fusion/engine.h"
#include "mapping/geometry/rigid3.h"
#include "plugin/options/option_keys.h"
#include "test/paths.h"
#include "test/plugin/temporary_folder.h"

namespace efm {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

const std::filesystem::path kConfigFolder = EFM_SOURCE_DIR "/config";

EventFusionOptions optionsOf(std::string_view text) {
  OptionReader reader;
  reader.readText(text, {"rig.ini", {}});
  return reader.options();
}

std::string errorOf(std::string_view text) {
  return messageOf([&] { optionsOf(text); });
}

std::string errorOfSet(std::string_view assignment) {
  return messageOf([&] {
    OptionReader reader;
    reader.set(assignment);
    reader.options();
  });
}

std::string listed(const EventFusionOptions& options) {
  std::string list;
  for (const NamedOption& option : listOptions(options)) {
    list += std::string(option.section) + "." + std::string(option.key) + "=" +
            textOf(option.value) + "\n";
  }
  return list;
}

TEST(OptionReader, KeysThatAreNotGivenKeepTheirDefaults) {
  EXPECT_EQ(listed(optionsOf("")), listed(defaultOptions()));
}

TEST(OptionReader, ListedOptionsReadBackTheSame) {
  EventFusionOptions options;
  options.rig.hand_eye = "rigs/b.yaml";
  options.rig.time_offsets_ns = {-1, 1'600'000'000'000'000'001};
  options.mapper.cameras = {1, 0};
  options.mapper.trajectory.max_pose_gap_s = 0.1 + 0.2;  // 0.30000000000000004
  options.mapper.keyframe.extraction.max_confidence = MaxConfidence::of(1e-7);
  options.mapper.keyframe.view.offset_m = {0.1, -0.2, 1.0 / 3};
  options.mapper.keyframe.sweep.threads = 3;
  options.mapper.keyframe.planes.spacing = PlaneSpacing::kLinear;

  OptionReader reader;
  for (const NamedOption& option : listOptions(options)) {
    reader.set(std::string(option.section) + "." + std::string(option.key) + "=" +
               textOf(option.value));
  }

  EXPECT_EQ(listed(reader.options()), listed(options));
  EXPECT_EQ(reader.options().mapper.trajectory.max_pose_gap_s, 0.1 + 0.2);
}

TEST(OptionReader, CommentsAndBlanksAreLeftOut) {
  const EventFusionOptions options = optionsOf(
      "; a comment\r\n"
      "# another\n"
      "   // and another\n"
      "  [dsi]   ; the volume\r\n"
      "\tnum_planes\t=\t50 // fifty\r\n"
      "[rig]\n"
      "cameras = ; all\n");

  EXPECT_EQ(options.mapper.keyframe.planes.num_planes, 50);
  EXPECT_TRUE(options.mapper.cameras.empty());
}

TEST(OptionReader, AByteOrderMarkAndLineEndsOfWindowsDoNotMatter) {
  const EventFusionOptions options = optionsOf(
      "\xEF\xBB\xBF[dsi]\r\nnum_planes = 50\r\n\r\nspacing = linear\r\n[rig]\r\ncameras = 0,1\r");
  EXPECT_EQ(options.mapper.keyframe.planes.num_planes, 50);
  EXPECT_EQ(options.mapper.keyframe.planes.spacing, PlaneSpacing::kLinear);
  EXPECT_EQ(options.mapper.cameras, (std::vector<int>{0, 1}));
  EXPECT_TRUE(optionsOf("\xEF\xBB\xBF").mapper.cameras.empty());
}

TEST(OptionReader, AnErrorNamesTheLine) {
  const struct {
    std::string text;
    const char* begin;
    const char* part = "";
  } cases[] = {
      {"\n[dsii]\n", "rig.ini:2: unknown section [dsii]", "did you mean [dsi]?"},
      {"[camera]\n", "rig.ini:1: unknown section [camera]: expected one of [rig], [keyframes], "},
      {"[dsi]\nwindow_s = 3\n", "rig.ini:2: [dsi] window_s: unknown key: it is one of [keyframes]"},
      {"[dsi]\nplanes = 3\n", "rig.ini:2: [dsi] planes: unknown key", "num_planes"},
      {"[refinement]\nenable = true\n", "rig.ini:2: [refinement] enable: unknown key",
       "did you mean enabled?"},
      {"num_planes = 3\n", "rig.ini:1: 'num_planes = 3': expected [section] or, below a section"},
      {"[dsi]\nnum_planes 3\n", "rig.ini:2: 'num_planes 3': expected"},
      {"[dsi\nnum_planes = 3\n", "rig.ini:1: '[dsi': expected"},
      {"[dsi]\nnum_planes = 3\n[rig]\n[dsi]\nnum_planes = 3\n",
       "rig.ini:5: [dsi] num_planes: given twice, first in line 2"},
      // Former keys have errors of their own.
      {"[fusion]\nrevote = true\n", "rig.ini:2: [fusion] revote: was removed with re-voting"},
      {"[fusion]\nrevote_power = 2\n", "rig.ini:2: [fusion] revote_power: was removed"},
      {"[keyframes]\nmin_visible_share = 1\n",
       "rig.ini:2: [keyframes] min_visible_share: is called min_visible_fraction now"},
      {"[depth]\nmin_excess = 1\n",
       "rig.ini:2: [depth] min_excess: is called min_local_contrast now"},
      {"[depth]\nmin_quality = 0.1\n",
       "rig.ini:2: [depth] min_quality: was replaced by min_probability (0 to below 1"},
  };
  for (const auto& row : cases) {
    EXPECT_THAT(errorOf(row.text), AllOf(StartsWith(row.begin), HasSubstr(row.part))) << row.text;
  }
}

TEST(OptionReader, AnErrorSaysTheExpectedKindOfAValue) {
  const struct {
    std::string section;
    std::string key;
    std::vector<std::string> values;
    std::string expected;
  } cases[] = {
      {"dsi",
       "num_planes",
       {"abc", "1e3", "0x10", "100 planes", "99999999999", ""},
       "must be a whole number, or auto"},
      {"keyframes", "window_events", {"many"}, "must be a whole number"},
      {"dsi", "min_depth_m", {"1,5", "1.5m", "nan", "inf"}, "must be a number, or auto"},
      {"depth", "min_probability", {"1,5", "1.5m", "nan", "inf"}, "must be a number"},
      {"dsi", "spacing", {"cubic"}, "'cubic' is unknown: expected one of inverse, linear"},
      {"dsi", "fov_deg", {"wide"}, "must be a number, or auto"},
      {"dsi",
       "rv_offset_m",
       {"1", "1,2", "1,2,3,4", "1,2,", "1 2 3", "a,b,c", "", "0,inf,0"},
       "must be three numbers separated by commas"},
      {"map",
       "consistency",
       {"some"},
       "'some' is unknown: expected one of none, support, visibility"},
      {"depth", "subplane", {"yes", "1"}, "must be true or false"},
      {"depth", "max_confidence", {"most"}, "must be a number, keyframe or sequence"},
      {"fusion", "shuffle_seed", {"-1"}, "must be a whole number, 0 to 4294967295"},
      {"fusion",
       "order",
       {"time"},
       "'time' is unknown: expected one of cameras_then_time, time_then_cameras"},
      {"performance", "threads", {"many"}, "must be a whole number, or auto"},
      {"rig",
       "cameras",
       {"0,", ",1", "0,,1", "0 1", "a"},
       "must be whole numbers separated by commas, or nothing"},
      {"rig",
       "time_offsets_s",
       {"0,", "0 1", "a", "0,,1", "5e9", "nan"},
       "must be seconds within 4.6e9 of 0, separated by commas, or nothing"},
  };
  for (const auto& row : cases) {
    for (const std::string& value : row.values) {
      EXPECT_EQ(
          errorOf("[" + row.section + "]\n" + row.key + " = " + value + "\n"),
          "rig.ini:2: [" + row.section + "] " + row.key + " = " + value + ": " + row.expected);
    }
  }
}

TEST(OptionReader, AnErrorSaysTheRangeOfAValueInTheUnitsOfTheFile) {
  EXPECT_EQ(errorOf("[keyframes]\nwindow_s = 0\n"),
            "rig.ini:2: [keyframes] window_s = 0: must be 1e-6 to 1e6");
  for (const char* const option :
       {"tracker_noise_deg = -0.5", "tracker_noise_deg = 1001", "tracker_drift_deg_per_m = -2"}) {
    EXPECT_EQ(errorOf(std::string("[refinement]\n") + option + "\n"),
              std::string("rig.ini:2: [refinement] ") + option + ": must be from 0 to 1000");
  }
  EXPECT_NO_THROW(
      optionsOf("[refinement]\ntracker_noise_deg = 1000\ntracker_drift_deg_per_m = 1000\n"));
  // No processor has both kernels.
  const std::string missing = isAvailable(VotingKernel::kNeon) ? "avx2" : "neon";
  EXPECT_THAT(errorOf("[performance]\nkernel = " + missing + "\n"),
              AllOf(StartsWith("rig.ini:2: [performance] kernel = " + missing + ": must be one"),
                    HasSubstr(": plain, ")));
  EXPECT_EQ(errorOf("[depth]\nmax_confidence = 0\n"),
            "rig.ini:2: [depth] max_confidence = 0: must be finite and above 0");
}

TEST(OptionReader, DegreesAreListedAsWritten) {
  for (const char* key : {"tracker_noise_deg", "tracker_drift_deg_per_m", "loop_max_sigma_deg"}) {
    const auto value_of = [&](const EventFusionOptions& options) -> std::string {
      for (const NamedOption& option : listOptions(options)) {
        if (option.key == key) return textOf(option.value);
      }
      return "none";
    };
    for (int i = 1; i < 2000; ++i) {
      std::string written = std::to_string(i / 100) + "." + std::to_string(100 + i % 100).substr(1);
      while (written.back() == '0') written.pop_back();
      if (written.back() == '.') written.pop_back();
      const auto options = optionsOf("[refinement]\n" + std::string(key) + " = " + written + "\n");
      ASSERT_EQ(value_of(options), written) << key;
    }
  }
}

TEST(OptionReader, DegreesOfAnyNumberReadBackTheSame) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> exponent(-12, 0);
  for (int i = 0; i < 300; ++i) {
    EventFusionOptions options;
    options.refinement.refiner.tracker.noise_rad = std::pow(10.0, exponent(random));
    OptionReader reader;
    for (const NamedOption& option : listOptions(options)) {
      if (option.key != "tracker_noise_deg") continue;
      reader.set("refinement.tracker_noise_deg=" + textOf(option.value));
    }
    const double read = reader.options().refinement.refiner.tracker.noise_rad;
    EXPECT_NEAR(read / options.refinement.refiner.tracker.noise_rad, 1, 4e-16);
  }
}

class OptionReaderFile : public TemporaryFolder {};

TEST_F(OptionReaderFile, PathsAreRelativeToTheirFile) {
  std::ofstream(folder() / "rig.ini") << "[rig]\ncalibration = rigs/a.yaml\nhand_eye = /b.yaml\n";
  OptionReader reader;
  reader.readFile(folder() / "rig.ini");
  EXPECT_EQ(reader.options().rig.calibration, folder() / "rigs" / "a.yaml");
  EXPECT_EQ(reader.options().rig.hand_eye, "/b.yaml");
  reader.set("rig", "hand_eye", "c.yaml ; a comment", {"host.ini", "host"});
  EXPECT_EQ(reader.options().rig.hand_eye, "host/c.yaml");
  reader.set("rig.calibration=c.yaml");
  EXPECT_EQ(reader.options().rig.calibration, "c.yaml") << "typed, not said by a file";
  reader.set("rig.calibration=");
  EXPECT_EQ(reader.options().rig.calibration, "") << "the recording's own";
}

TEST(OptionReader, TimeOffsetsAreExactToTheNanosecond) {
  const auto offsets = [](const std::string& text) {
    return optionsOf("[rig]\ntime_offsets_s = " + text + "\n").rig.time_offsets_ns;
  };
  EXPECT_EQ(offsets("0, -0.042, 1600000000.123456789"),
            (std::vector<std::int64_t>{0, -42'000'000, 1'600'000'000'123'456'789}));
  EXPECT_TRUE(offsets("").empty());
}

TEST(OptionReader, AnErrorNamesAWrongSet) {
  EXPECT_THAT(errorOfSet("dsi.num_planes"), StartsWith("--set dsi.num_planes: expected"));
  EXPECT_THAT(errorOfSet("num_planes=3"), StartsWith("--set num_planes=3: expected"));
  EXPECT_THAT(errorOfSet("dsii.num_planes=3"), HasSubstr("unknown section [dsii]"));
  EXPECT_THAT(errorOfSet("dsi.planes=3"),
              StartsWith("--set dsi.planes: unknown key: expected one"));
  EXPECT_THAT(errorOfSet("dsi.num_planes = 0"), StartsWith("--set dsi.num_planes=0: must be"));
}

TEST(OptionReader, AnErrorOfTwoValuesBeginsWithTheOneThatWasGivenLast) {
  const std::string must = "must be finite and above min_depth_m";
  const auto error = [](const std::string& text, const std::vector<std::string>& sets) {
    return messageOf([&] {
      OptionReader reader;
      reader.readText(text, {"rig.ini", {}});
      for (const std::string& assignment : sets) reader.set(assignment);
      reader.options();
    });
  };
  const std::string file = "[dsi]\nmax_depth_m = 10\nmin_depth_m = 1\n";
  EXPECT_EQ(error(file, {"dsi.max_depth_m=0.1"}),
            "--set dsi.max_depth_m=0.1: " + must + " (rig.ini:3: [dsi] min_depth_m = 1)");
  EXPECT_EQ(
      error(file, {"dsi.min_depth_m=20"}),
      "--set dsi.min_depth_m=20: contradicts rig.ini:2: [dsi] max_depth_m = 10, which " + must);
  EXPECT_EQ(error(file, {"dsi.min_depth_m=20", "dsi.max_depth_m=15"}),
            "--set dsi.max_depth_m=15: " + must + " (--set dsi.min_depth_m=20)");
  EXPECT_THAT(error("[dsi]\nwidth = 65535\nheight = 65535\n", {}),
              AllOf(StartsWith("rig.ini:3: [dsi] height = 65535: contradicts rig.ini:2: [dsi] "
                               "width = 65535, which must be at most"),
                    HasSubstr("height of 65535")));
  EXPECT_EQ(error("[keyframes]\npolicy = baseline\n",
                  {"keyframes.window_s=0.1", "keyframes.stride_s=0.2"}),
            "--set keyframes.stride_s=0.2: must be at most window_s with the policy 'baseline' "
            "(rig.ini:2: [keyframes] policy = baseline) (--set keyframes.window_s=0.1)");
  EXPECT_EQ(error("", {"refinement.first_distance_px=1"}),
            "--set refinement.first_distance_px=1: must be from last_distance_px to 10000 (pixels) "
            "(last_distance_px = 2 by default)");
  EXPECT_EQ(error("", {"refinement.max_points=7000", "dsi.num_planes=9"}),
            "--set refinement.max_points=7000: contradicts default: [refinement] max_map_points = "
            "6000, which must be from max_points to 1000000");
  // The error does not name the other limit, which is auto.
  for (const char* const value : {"-3", "0", "0.0001", "0.001"}) {
    const std::string set = std::string("dsi.max_depth_m=") + value;
    EXPECT_EQ(error("", {set}), "--set " + set + ": must be finite and above 0.001");
    EXPECT_EQ(error("", {set, "dsi.min_depth_m=1"}),
              "--set " + set + ": must be finite and above 0.001");
  }
  for (const char* const value : {"-3", "0"}) {
    const std::string set = std::string("dsi.min_depth_m=") + value;
    EXPECT_EQ(error("", {set}), "--set " + set + ": must be finite and above 0");
    EXPECT_EQ(error("", {set, "dsi.max_depth_m=-4"}),
              "--set " + set + ": must be finite and above 0");
  }
  EXPECT_NO_THROW(optionsOf("[dsi]\nmax_depth_m = 0.0011\n"));
  // An option that is not given has its default.
  EXPECT_EQ(error("", {"refinement.last_distance_px=0"}),
            "--set refinement.last_distance_px=0: must be above 0, at most 10000 (pixels)");
}

TEST(OptionReader, OneOfTwoLimitsMayBeChosenFromTheData) {
  // Outside the built-in value of the other limit, which holds until the limit is chosen.
  for (const char* const text : {"[dsi]\nmin_depth_m = 20\n", "[dsi]\nmax_depth_m = 0.1\n",
                                 "[keyframes]\npolicy = baseline\nwindow_s = 0.01\n"}) {
    EXPECT_NO_THROW(optionsOf(text)) << text;
  }
  const EventFusionOptions options = optionsOf("[dsi]\nmin_depth_m = 20\nmax_depth_m = auto\n");
  EXPECT_FALSE(options.automatic.min_depth_m);
  EXPECT_TRUE(options.automatic.max_depth_m);
  EXPECT_EQ(options.mapper.keyframe.planes.min_depth_m, 20);
}

TEST(OptionReader, AnErrorOfARecordingSaysHowItsOptionsWereGiven) {
  OptionReader reader;
  reader.readText("[rig]\ncameras = 0,5\n", {"rig.ini", {}});
  reader.set("dsi.reference_camera=2");
  EXPECT_EQ(reader.wrongOption({{"rig", "cameras", " (how many)"}, "5", "a camera"}),
            "rig.ini:2: [rig] cameras = 0,5: cameras (how many) = 5: must be a camera");
  EXPECT_EQ(reader.wrongOption({"reference_camera", "2", "a camera"}),
            "--set dsi.reference_camera=2: reference_camera = 2: must be a camera");
  EXPECT_EQ(reader.wrongOption({{"dsi", "cameras"}, "5", "a camera"}), std::nullopt);
  EXPECT_EQ(reader.wrongOption({"width", "5", "a camera"}), std::nullopt) << "it was not given";
  EXPECT_EQ(reader.origins({{"rig", "cameras"}, {"dsi", "width"}, {"dsi", "reference_camera"}}),
            " (--set dsi.reference_camera=2) (rig.ini:2: [rig] cameras = 0,5)");
  EXPECT_EQ(reader.given("rig", "cameras"), "rig.ini:2: [rig] cameras = 0,5");
  EXPECT_EQ(reader.given("rig", "calibration"), "");
}

TEST(OptionReader, ErrorsHoldNoControlCharacters) {
  const std::string wild = "\x1b[2J" + std::string(10'000, 'x');
  for (const std::string& text :
       {wild + "\n", "[" + wild + "]\n", "[dsi]\n" + wild + " = 1\n", "[dsi]\nspacing = " + wild,
        "[dsi]\nnum_planes = " + wild + "\n"}) {
    const std::string error = errorOf(text);
    EXPECT_THAT(error,
                AllOf(StartsWith("rig.ini:"), HasSubstr("\\x1b[2J"), Not(HasSubstr("\x1b"))));
    EXPECT_LT(error.size(), 400U);
  }
  for (const std::string& assignment :
       {wild, wild + ".a=b", "dsi." + wild + "=1", "dsi.spacing=" + wild}) {
    const std::string error = errorOfSet(assignment);
    EXPECT_THAT(error, AllOf(HasSubstr("\\x1b[2J"), Not(HasSubstr("\x1b"))));
    EXPECT_LT(error.size(), 400U);
  }
}

TEST(OptionReader, AnErrorNamesAnUnreadableFile) {
  for (const std::string path : {"/nowhere/rig.ini", "/"}) {
    EXPECT_EQ(messageOf([&] { OptionReader().readFile(path); }),
              "cannot read the option file " + path);
  }
}

TEST(ConfigFolder, DefaultFileEqualsTheDefaultsAndNamesEveryKey) {
  OptionReader reader;
  reader.readFile(kConfigFolder / "default.ini");
  EXPECT_EQ(listed(reader.options()), listed(defaultOptions()));

  std::ifstream file(kConfigFolder / "default.ini");
  std::multiset<std::string> named;
  std::string section;
  for (std::string line; std::getline(file, line);) {
    if (line.empty() || line[0] == ';') continue;
    if (line[0] == '[') section = line.substr(1, line.size() - 2);
    if (line[0] != '[') named.insert(section + "." + line.substr(0, line.find(' ')));
  }
  std::multiset<std::string> known;
  for (const NamedOption& option : listOptions({})) {
    known.insert(std::string(option.section) + "." + std::string(option.key));
  }
  EXPECT_EQ(named, known);
}

TEST(ConfigFolder, EveryFileIsRead) {
  int files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(kConfigFolder)) {
    if (entry.path().extension() != ".ini") continue;
    OptionReader reader;
    EXPECT_NO_THROW(reader.readFile(entry.path())) << entry.path();
    EXPECT_NO_THROW(reader.options()) << entry.path();
    EXPECT_NO_THROW(readRigSetup(reader.options().rig.calibration, reader.options().rig.hand_eye))
        << entry.path();
    ++files;
  }
  EXPECT_GE(files, 6);
}

TEST(Options, ErrorsNameTheKeyTheValueAndTheRange) {
  const struct {
    const char* key;
    const char* value;
    const char* error;
  } kCases[] = {
      {"num_planes", "4", "option 'num_planes': expected section.key"},
      {"dsi.planes", "4", "options: [dsi] planes: unknown key: expected"},
      {"dis.num_planes", "4", "options: [dis] unknown section: did you mean [dsi]?"},
      {"dsi.num_planes", "many", "options: [dsi] num_planes = many: must be a whole number"},
      {"dsi.num_planes", "0", "options: [dsi] num_planes = 0: must be 1 to 100000"},
  };
  for (const auto& wrong : kCases) {
    EXPECT_THAT(messageOf([&] {
                  Options options;
                  options.set(wrong.key, wrong.value);
                  options.values();
                }),
                StartsWith(wrong.error));
  }
}

TEST(Options, ANameIsAnInstalledFileAndACopyIsIndependent) {
  Options options;
  options.read("davis346_mvsec");
  OptionReader reader;
  reader.readFile(kConfigFolder / "davis346_mvsec.ini");
  EXPECT_EQ(listed(options.values()), listed(reader.options()));
  const Options copy = options;
  options.set("dsi.num_planes", "7");
  EXPECT_EQ(options.values().mapper.keyframe.planes.num_planes, 7);
  EXPECT_EQ(listed(copy.values()), listed(reader.options()));
  EXPECT_THAT(messageOf([&] { options.read("davis346"); }),
              StartsWith("'davis346': no such option file: expected"));
}

}  // namespace
}  // namespace efm
