// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/options/option_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <random>
#include <set>
#include <sstream>

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
  reader.readText(text, "rig.ini");
  return reader.options();
}

/// The message of the error that reading a text gives.
std::string errorOf(std::string_view text) {
  try {
    optionsOf(text);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "no error";
}

std::string errorOfSet(std::string_view assignment) {
  try {
    OptionReader reader;
    reader.set(assignment);
    reader.options();
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "no error";
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
  EXPECT_EQ(listed(optionsOf("")), listed(EventFusionOptions{}));
}

TEST(OptionReader, EveryKeyReachesItsField) {
  const EventFusionOptions options = optionsOf(R"(
[rig]
calibration = a.yaml
hand_eye = /b.yaml
cameras = 0, 2
time_offsets_s = 0, 0.001
pose_source = wheels
max_pose_gap_s = 0.5
exclude_silent = true
[filter]
hot_pixels = false
hot_pixel_ratio = 7.5
hot_pixel_period_s = 2
hot_pixel_min_events = 9
background_activity_s = 0.02
[keyframes]
policy = baseline
window_s = 0.25
stride_s = 1e-1
window_events = 5000000000
min_baseline_ratio = 0.3
min_visible_share = 0.25
reference = end
[dsi]
min_depth_m = 1
max_depth_m = 20
num_planes = 64
spacing = linear
reference_camera = 2
fov_deg = 100.5
width = 800
height = 1
rv_offset_m = -0.5, 1e-3,2
[fusion]
across_cameras = geometric
across_time = rms
order = time_then_cameras
subintervals = 8
split = count
shuffle = random
shuffle_seed = 4294967295
late = true
[depth]
extraction = paper
threshold_kernel = 7
threshold_c = -2.5
max_confidence = 31.5
median_size = 3
dilate = true
subplane = false
[output]
camera_maps = true
event_images = true
[map]
voxel_size_m = 0.05
min_keyframes = 3
consistency = support
consistency_tolerance = 0.2
consistency_cell_deg = 1.5
max_contradictions = 2
[refinement]
correct_motion = true
motion_sigma_m_s = 0.02
motion_sigma_deg_s = 3
motion_rounds = 4
enabled = true
background = true
window = 5
map_keyframes = 2
max_points = 100
max_map_points = 300
tracker_noise_m = 0.03
tracker_noise_deg = 90
tracker_drift = 0.04
tracker_drift_deg_per_m = 180
adapt_tracker = false
robust_sigmas = 4
first_distance_px = 8
last_distance_px = 1.5
loops = false
loop_min_overlap = 0.6
loop_min_inliers = 0.7
loop_max_sigma_m = 0.08
loop_max_sigma_deg = 45
loop_checks = 9
[performance]
threads = 2
kernel = plain
packet_error_px = 0
)");

  const FusionMapperOptions& mapper = options.mapper;
  EXPECT_EQ(options.rig.calibration, "a.yaml");
  EXPECT_EQ(options.rig.hand_eye, "/b.yaml");
  EXPECT_EQ(options.rig.time_offsets_ns, (std::vector<std::int64_t>{0, 1'000'000}));
  EXPECT_EQ(options.rig.pose_source, "wheels");
  EXPECT_EQ(mapper.cameras, (std::vector<int>{0, 2}));
  EXPECT_EQ(mapper.trajectory.max_pose_gap_s, 0.5);
  EXPECT_TRUE(mapper.keyframe.exclude_silent);
  EXPECT_FALSE(mapper.filter.hot_pixels);
  EXPECT_EQ(mapper.filter.hot_pixel.ratio, 7.5);
  EXPECT_EQ(mapper.filter.hot_pixel.period_s, 2);
  EXPECT_EQ(mapper.filter.hot_pixel.min_events, 9);
  EXPECT_EQ(mapper.filter.background_activity_s, 0.02);
  EXPECT_TRUE(mapper.keyframe.motion.correct_motion);
  EXPECT_EQ(mapper.keyframe.motion.motion_sigma_m_s, 0.02);
  EXPECT_EQ(mapper.keyframe.motion.motion_sigma_deg_s, 3);
  EXPECT_EQ(mapper.keyframe.motion.motion_rounds, 4);
  EXPECT_EQ(mapper.keyframes.policy, KeyframePolicyKind::kBaseline);
  EXPECT_EQ(mapper.keyframes.window_events, 5'000'000'000);
  EXPECT_EQ(mapper.keyframes.min_baseline_ratio, 0.3);
  EXPECT_EQ(mapper.keyframes.min_visible_share, 0.25);
  EXPECT_EQ(mapper.keyframes.window_s, 0.25);
  EXPECT_EQ(mapper.keyframes.stride_s, 0.1);
  EXPECT_EQ(mapper.keyframes.reference, ReferenceTime::kEnd);
  EXPECT_EQ(mapper.keyframe.planes.min_depth_m, 1);
  EXPECT_EQ(mapper.keyframe.planes.max_depth_m, 20);
  EXPECT_EQ(mapper.keyframe.planes.num_planes, 64);
  EXPECT_EQ(mapper.keyframe.planes.spacing, PlaneSpacing::kLinear);
  EXPECT_EQ(mapper.keyframe.reference_camera, 2);
  EXPECT_EQ(mapper.keyframe.view.fov_deg, 100.5);
  EXPECT_EQ(mapper.keyframe.view.width, 800);
  EXPECT_EQ(mapper.keyframe.view.height, 1);
  EXPECT_EQ(mapper.keyframe.view.offset_m, Eigen::Vector3d(-0.5, 1e-3, 2));
  EXPECT_EQ(mapper.keyframe.sweep.fusion.across_cameras, FusionRule::kGeometric);
  EXPECT_EQ(mapper.keyframe.sweep.fusion.across_time, FusionRule::kRms);
  EXPECT_EQ(mapper.keyframe.sweep.fusion.order, FusionOrder::kTimeThenCameras);
  EXPECT_EQ(mapper.keyframe.subintervals.count, 8);
  EXPECT_EQ(mapper.keyframe.subintervals.split, SubintervalSplit::kCount);
  EXPECT_EQ(mapper.keyframe.subintervals.shuffle, SubintervalShuffle::kRandom);
  EXPECT_EQ(mapper.keyframe.subintervals.shuffle_seed, 4'294'967'295U);
  EXPECT_TRUE(options.late_fusion);
  EXPECT_EQ(mapper.keyframe.extraction.extraction, ExtractionMethod::kPaper);
  EXPECT_EQ(mapper.keyframe.extraction.threshold_kernel, 7);
  EXPECT_EQ(mapper.keyframe.extraction.threshold_c, -2.5);
  EXPECT_EQ(mapper.keyframe.extraction.max_confidence.level, WhiteLevel::kFixed);
  EXPECT_EQ(mapper.keyframe.extraction.max_confidence.fixed, 31.5);
  EXPECT_EQ(mapper.keyframe.extraction.median_size, 3);
  EXPECT_TRUE(mapper.keyframe.extraction.dilate);
  EXPECT_TRUE(mapper.keyframe.camera_maps);
  EXPECT_TRUE(mapper.keyframe.event_images);
  EXPECT_FALSE(mapper.keyframe.extraction.subplane);
  EXPECT_EQ(options.cloud.voxel_size_m, 0.05);
  EXPECT_EQ(options.cloud.min_keyframes, 3);
  EXPECT_EQ(options.cloud.consistency.consistency, Consistency::kSupport);
  EXPECT_EQ(options.cloud.consistency.consistency_tolerance, 0.2);
  EXPECT_EQ(options.cloud.consistency.consistency_cell_deg, 1.5);
  EXPECT_EQ(options.cloud.consistency.max_contradictions, 2);
  EXPECT_TRUE(options.refinement.enabled);
  EXPECT_TRUE(options.refinement.background);
  const RefinementOptions& refiner = options.refinement.refiner;
  EXPECT_EQ(refiner.window, 5);
  EXPECT_EQ(refiner.map_keyframes, 2);
  EXPECT_EQ(refiner.points.max_points, 100);
  EXPECT_EQ(refiner.points.max_map_points, 300);
  EXPECT_EQ(refiner.tracker.noise_m, 0.03);
  EXPECT_DOUBLE_EQ(refiner.tracker.noise_rad, M_PI / 2);
  EXPECT_EQ(refiner.tracker.drift_m, 0.04);
  EXPECT_DOUBLE_EQ(refiner.tracker.drift_rad, M_PI);
  EXPECT_FALSE(refiner.adapt_tracker);
  EXPECT_EQ(refiner.registration.alignment.robust_sigmas, 4);
  EXPECT_EQ(refiner.registration.first_distance_px, 8);
  EXPECT_EQ(refiner.registration.last_distance_px, 1.5);
  EXPECT_FALSE(refiner.loop.loops);
  EXPECT_EQ(refiner.loop.loop_min_overlap, 0.6);
  EXPECT_EQ(refiner.loop.loop_min_inliers, 0.7);
  EXPECT_EQ(refiner.loop.loop_max_sigma_m, 0.08);
  EXPECT_DOUBLE_EQ(refiner.loop.loop_max_sigma_rad, M_PI / 4);
  EXPECT_EQ(refiner.loop.loop_checks, 9);
  EXPECT_EQ(mapper.keyframe.sweep.threads, 2);
  EXPECT_EQ(mapper.keyframe.sweep.kernel, VotingKernel::kPlain);
  EXPECT_EQ(mapper.keyframe.packets.packet_error_px, 0);
}

TEST(OptionReader, WhatIsListedReadsBackTheSame) {
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

TEST(OptionReader, UnknownSectionsAndKeysAreErrorsThatNameTheLine) {
  EXPECT_THAT(errorOf("\n[dsii]\n"), AllOf(StartsWith("rig.ini:2: "), HasSubstr("[dsii]"),
                                           HasSubstr("known: [rig], [keyframes], [dsi]")));
  EXPECT_THAT(errorOf("[dsi]\nplanes = 3\n"),
              AllOf(StartsWith("rig.ini:2: [dsi] planes: unknown key"), HasSubstr("num_planes")));
}

TEST(OptionReader, LinesThatAreNeitherSectionNorKeyAreErrors) {
  EXPECT_THAT(errorOf("num_planes = 3\n"), StartsWith("rig.ini:1: 'num_planes = 3': expected"));
  EXPECT_THAT(errorOf("[dsi]\nnum_planes 3\n"), StartsWith("rig.ini:2: 'num_planes 3': expected"));
  EXPECT_THAT(errorOf("[dsi\nnum_planes = 3\n"), StartsWith("rig.ini:1: '[dsi': expected"));
}

TEST(OptionReader, ValuesOfTheWrongKindAreErrorsThatSayWhatWasExpected) {
  const auto error = [](const std::string& key_and_value) {
    return errorOf("[dsi]\n" + key_and_value + "\n");
  };
  EXPECT_EQ(error("num_planes = abc"), "rig.ini:2: [dsi] num_planes = abc: must be a whole number");
  EXPECT_THAT(error("num_planes = 1e3"), HasSubstr("must be a whole number"));
  EXPECT_THAT(error("num_planes = 0x10"), HasSubstr("must be a whole number"));
  EXPECT_THAT(error("num_planes = 100 planes"), HasSubstr("must be a whole number"));
  EXPECT_THAT(error("num_planes = 99999999999"), HasSubstr("must be a whole number"));
  EXPECT_THAT(error("num_planes ="), HasSubstr("must be a whole number"));
  EXPECT_THAT(error("min_depth_m = 1,5"), HasSubstr("must be a number"));
  EXPECT_THAT(error("min_depth_m = 1.5m"), HasSubstr("must be a number"));
  EXPECT_THAT(error("min_depth_m = nan"), HasSubstr("must be a number"));
  EXPECT_THAT(error("min_depth_m = inf"), HasSubstr("must be a number"));
  EXPECT_THAT(error("spacing = cubic"), HasSubstr("'cubic' is not one of: inverse, linear"));
  EXPECT_THAT(errorOf("[depth]\nsubplane = yes\n"), HasSubstr("must be true or false"));
  EXPECT_THAT(errorOf("[depth]\nmax_confidence = most\n"),
              HasSubstr("must be a number, keyframe or sequence"));
  EXPECT_THAT(error("fov_deg = wide"), HasSubstr("must be a number, or auto"));
  for (const std::string offset : {"1", "1,2", "1,2,3,4", "1,2,", "1 2 3", "a,b,c", ""}) {
    EXPECT_THAT(error("rv_offset_m = " + offset), HasSubstr("three numbers separated by commas"))
        << offset;
  }
  EXPECT_THAT(errorOf("[fusion]\nshuffle_seed = -1\n"), HasSubstr("0 to 4294967295"));
  EXPECT_THAT(errorOf("[fusion]\norder = time\n"),
              HasSubstr("'time' is not one of: cameras_then_time, time_then_cameras"));
  EXPECT_THAT(errorOf("[performance]\nthreads = many\n"),
              HasSubstr("must be a whole number, or auto"));
  for (const std::string list : {"0,", ",1", "0,,1", "0 1", "a"}) {
    EXPECT_THAT(errorOf("[rig]\ncameras = " + list + "\n"), HasSubstr("separated by commas"))
        << list;
  }
}

TEST(OptionReader, ValuesOutOfRangeAreErrorsThatNameSectionKeyValueAndRange) {
  EXPECT_THAT(errorOf("[dsi]\n\nnum_planes = 0\n"),
              StartsWith("rig.ini:3: [dsi] num_planes = 0: must be"));
  EXPECT_THAT(errorOf("[map]\nvoxel_size_m = -1\n"),
              StartsWith("rig.ini:2: [map] voxel_size_m = -1: must be"));
  EXPECT_THAT(errorOf("[keyframes]\nwindow_s = 0\n"),
              StartsWith("rig.ini:2: [keyframes] window_s = 0: must be"));
  EXPECT_THAT(errorOf("[rig]\nmax_pose_gap_s = 0\n"),
              StartsWith("rig.ini:2: [rig] max_pose_gap_s = 0: must be"));
  EXPECT_THAT(errorOf("[depth]\nthreshold_kernel = 4\n"),
              StartsWith("rig.ini:2: [depth] threshold_kernel = 4: must be"));
  EXPECT_THAT(errorOf("[depth]\nmax_confidence = 0\n"),
              StartsWith("rig.ini:2: [depth] max_confidence = 0: must be"));
  EXPECT_THAT(errorOf("[dsi]\nfov_deg = 180\n"),
              StartsWith("rig.ini:2: [dsi] fov_deg = 180: must be"));
  EXPECT_THAT(errorOf("[dsi]\nheight = 0\n"), StartsWith("rig.ini:2: [dsi] height = 0: must be"));
  EXPECT_THAT(errorOf("[dsi]\nwidth = 65535\nheight = 65535\n"),
              AllOf(StartsWith("rig.ini:2: [dsi] width = 65535: must be at most"),
                    HasSubstr("height of 65535")));
  EXPECT_THAT(errorOf("[dsi]\nrv_offset_m = 0,inf,0\n"), HasSubstr("three numbers"));
  EXPECT_THAT(errorOf("[fusion]\nsubintervals = 1001\n"),
              StartsWith("rig.ini:2: [fusion] subintervals = 1001: must be"));
  EXPECT_THAT(errorOf("[keyframes]\nwindow_events = 0\n"),
              StartsWith("rig.ini:2: [keyframes] window_events = 0: must be"));
  EXPECT_THAT(errorOf("[performance]\nthreads = 0\n"),
              StartsWith("rig.ini:2: [performance] threads = 0: must be"));
  // No processor has both.
  const std::string missing = isAvailable(VotingKernel::kNeon) ? "avx2" : "neon";
  EXPECT_THAT(errorOf("[performance]\nkernel = " + missing + "\n"),
              AllOf(StartsWith("rig.ini:2: [performance] kernel = " + missing + ": must be"),
                    HasSubstr(": plain, ")));
  EXPECT_THAT(errorOf("[performance]\npacket_error_px = 11\n"),
              StartsWith("rig.ini:2: [performance] packet_error_px = 11: must be"));
}

TEST(OptionReader, ValuesOfTheRefinementOutOfRangeAreErrorsInTheUnitsOfTheFile) {
  const std::vector<std::pair<std::string, std::string>> wrong = {
      {"window = 0", "from 1 to 1000"},
      {"window = 1001", "from 1 to 1000"},
      {"map_keyframes = 0", "from 1 to 100"},
      {"max_points = 9", "from 10 to 100000"},
      {"max_map_points = 1999", "from max_points to 1000000"},
      {"tracker_noise_m = -1", "from 0 to 1000"},
      {"tracker_noise_deg = -0.5", "from 0 to 1000"},
      {"tracker_noise_deg = 1001", "from 0 to 1000"},
      {"tracker_drift = 1001", "from 0 to 1000"},
      {"tracker_drift_deg_per_m = -2", "from 0 to 1000"},
      {"robust_sigmas = 0", "above 0"},
      {"first_distance_px = 1", "from last_distance_px"},
      {"last_distance_px = 0", "above 0"},
      {"loop_min_overlap = 0", "above 0"},
      {"loop_min_inliers = 1.5", "0 to 1"},
      {"loop_max_sigma_m = 0", "above 0"},
      {"loop_max_sigma_deg = -1", "above 0"},
      {"loop_checks = 101", "0 to 100"}};
  for (const auto& [option, range] : wrong) {
    EXPECT_THAT(
        errorOf("[refinement]\n" + option + "\n"),
        AllOf(StartsWith("rig.ini:2: [refinement] " + option + ": must be"), HasSubstr(range)));
  }
  EXPECT_THAT(errorOf("[refinement]\nenabled = 1\n"), HasSubstr("must be true or false"));
  EXPECT_THAT(
      errorOf("[refinement]\nenable = true\n"),
      AllOf(HasSubstr("rig.ini:2: [refinement] enable: unknown key"), HasSubstr("background")));
}

TEST(OptionReader, DegreesAreGivenBackAsTheyWereWritten) {
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

TEST(OptionReader, TheLargestDegreesAreInRange) {
  EXPECT_NO_THROW(
      optionsOf("[refinement]\ntracker_noise_deg = 1000\ntracker_drift_deg_per_m = 1000\n"));
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

TEST(OptionReader, LimitsThatContradictADefaultAreErrors) {
  // The far limit is not in the file: its default is 5.
  EXPECT_THAT(errorOf("[dsi]\nmin_depth_m = 6\n"), AllOf(HasSubstr("[dsi]"), HasSubstr("must be")));
}

TEST(OptionReader, AKeyGivenTwiceIsAnErrorThatNamesBothLines) {
  EXPECT_EQ(errorOf("[dsi]\nnum_planes = 3\n[rig]\n[dsi]\nnum_planes = 3\n"),
            "rig.ini:5: [dsi] num_planes: given twice, first in line 2");
}

TEST(OptionReader, SetOverridesTheFileAndTheLastOneCounts) {
  OptionReader reader;
  reader.readText("[dsi]\nnum_planes = 3\n", "rig.ini");
  reader.set("dsi.num_planes=4");
  reader.set("dsi.num_planes = 5");

  EXPECT_EQ(reader.options().mapper.keyframe.planes.num_planes, 5);
}

TEST(OptionReader, LimitsMaySetEachOtherRightBeforeTheyAreChecked) {
  OptionReader reader;
  reader.set("dsi.min_depth_m=6");
  reader.set("dsi.max_depth_m=10");

  EXPECT_EQ(reader.options().mapper.keyframe.planes.min_depth_m, 6);
}

TEST(OptionReader, PathsAreRelativeToTheFileThatSaysThem) {
  const auto folder = std::filesystem::temp_directory_path() /
                      ("efm_option_paths_" + std::to_string(std::random_device()()));
  std::filesystem::create_directories(folder);
  std::ofstream(folder / "rig.ini") << "[rig]\ncalibration = rigs/a.yaml\nhand_eye = /b.yaml\n";
  OptionReader reader;
  reader.readFile(folder / "rig.ini");
  EXPECT_EQ(reader.options().rig.calibration, folder / "rigs" / "a.yaml");
  EXPECT_EQ(reader.options().rig.hand_eye, "/b.yaml");
  reader.set("rig.calibration=c.yaml");
  EXPECT_EQ(reader.options().rig.calibration, "c.yaml") << "typed, not said by a file";
  reader.set("rig.calibration=");
  EXPECT_EQ(reader.options().rig.calibration, "") << "the recording's own";
  std::filesystem::remove_all(folder);
}

class OptionReaderFile : public TemporaryFolder {};

TEST_F(OptionReaderFile, AfterAnErrorPathsAreNotRelativeToTheFileThatHadIt) {
  std::ofstream(folder() / "wrong.ini") << "[dsi]\nnum_planes = x\n";
  OptionReader reader;
  EXPECT_THROW(reader.readFile(folder() / "wrong.ini"), std::invalid_argument);
  reader.set("rig.calibration=c.yaml");
  EXPECT_EQ(reader.options().rig.calibration, "c.yaml");

  EXPECT_THROW(reader.set("dsi", "num_planes", "x", {"host.ini", folder()}), std::invalid_argument);
  reader.set("rig.calibration=d.yaml");
  EXPECT_EQ(reader.options().rig.calibration, "d.yaml");
}

TEST(OptionReader, TimeOffsetsAreExactToTheNanosecond) {
  const auto offsets = [](const std::string& text) {
    return optionsOf("[rig]\ntime_offsets_s = " + text + "\n").rig.time_offsets_ns;
  };
  EXPECT_EQ(offsets("0, -0.042, 1600000000.123456789"),
            (std::vector<std::int64_t>{0, -42'000'000, 1'600'000'000'123'456'789}));
  EXPECT_TRUE(offsets("").empty());
  for (const std::string list : {"0,", "0 1", "a", "0,,1", "5e9", "nan"}) {
    EXPECT_THAT(errorOf("[rig]\ntime_offsets_s = " + list + "\n"), HasSubstr("must be seconds"))
        << list;
  }
}

TEST(OptionReader, WrongSetsAreErrorsThatNameThem) {
  EXPECT_THAT(errorOfSet("dsi.num_planes"), StartsWith("--set dsi.num_planes: expected"));
  EXPECT_THAT(errorOfSet("num_planes=3"), StartsWith("--set num_planes=3: expected"));
  EXPECT_THAT(errorOfSet("dsii.num_planes=3"), HasSubstr("unknown section [dsii]"));
  EXPECT_THAT(errorOfSet("dsi.planes=3"), StartsWith("--set: [dsi] planes: unknown key"));
  EXPECT_THAT(errorOfSet("dsi.num_planes=x"), StartsWith("--set: [dsi] num_planes = x: must be"));
  EXPECT_THAT(errorOfSet("dsi.num_planes=0"), StartsWith("--set: [dsi] num_planes = 0: must be"));
}

TEST(OptionReader, ErrorsShowNothingThatATerminalWouldObey) {
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

TEST(OptionReader, FilesThatCannotBeReadAreErrorsThatNameThem) {
  for (const std::string path : {"/nowhere/rig.ini", "/"}) {
    try {
      OptionReader().readFile(path);
      ADD_FAILURE() << "no error for " << path;
    } catch (const std::runtime_error& error) {
      EXPECT_THAT(error.what(), HasSubstr(path));
    }
  }
}

TEST(ConfigFolder, DefaultFileEqualsTheDefaultsAndNamesEveryKey) {
  OptionReader reader;
  reader.readFile(kConfigFolder / "default.ini");
  EXPECT_EQ(listed(reader.options()), listed(EventFusionOptions{}));

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
    EXPECT_NO_THROW(readRigSetup(reader.options().rig)) << entry.path();
    ++files;
  }
  EXPECT_GE(files, 6);
}

}  // namespace
}  // namespace efm
