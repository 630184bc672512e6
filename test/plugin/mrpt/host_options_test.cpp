// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/mrpt/host_options.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <mrpt/config/CConfigFile.h>
#include <mrpt/config/CConfigFileMemory.h>

#include <cmath>
#include <fstream>
#include <sstream>

#include "plugin/mrpt/CEventFusionMapBuilder.h"
#include "test/plugin/session/synthetic_recording.h"
#include "test/plugin/temporary_folder.h"

namespace efm {
namespace {

using mrpt::config::CConfigFileMemory;
using testing::HasSubstr;

EventFusionOptions optionsOf(const std::string& text, const std::string& prefix) {
  OptionReader reader;
  readHostOptions(CConfigFileMemory(text), prefix, reader);
  return reader.options();
}

std::string errorOf(const std::string& text, const std::string& prefix) {
  return messageOf([&] { optionsOf(text, prefix); });
}

std::string listed(const EventFusionOptions& options) {
  std::string list;
  for (const NamedOption& option : listOptions(options)) {
    list += std::string(option.key) + "=" + textOf(option.value) + "\n";
  }
  return list;
}

TEST(HostOptions, OfSectionsThePrefixSaysWhichAreOurs) {
  struct Row {
    const char* prefix;
    const char* text;  // 9 is ours
  };
  const Row rows[] = {
      {"front", "[dsi]\nmax_depth_m = x\n[camera]\nfps = x\n[front_dsi]\nmax_depth_m = 9 ; m\n"},
      {"front", "[front_dsi]\nmax_depth_m = 9 // m\n[afront_dsi]\nmax_depth_m = x\n"},
      {"", "[camera]\nfps = x\n[dsi]\nmax_depth_m = 9\n[front_dsi]\nmax_depth_m = 8\n"},
      {"", "[map]\nfile = x\n[dsi]\nmax_depth_m = 8\n[event_fusion_dsi]\nmax_depth_m = 9\n"},
  };
  for (const Row& row : rows) {
    EXPECT_EQ(optionsOf(row.text, row.prefix).mapper.keyframe.planes.max_depth_m, 9) << row.text;
  }
  const EventFusionOptions options =
      optionsOf("[front_refinement]\nenabled = true\ntracker_noise_deg = 90\n", "front");
  EXPECT_TRUE(options.refinement.enabled);
  EXPECT_DOUBLE_EQ(options.refinement.refiner.tracker.noise_rad, M_PI / 2);
}

TEST(HostOptions, WrongSectionsKeysAndValuesAreErrorsThatNameThem) {
  EXPECT_EQ(errorOf("[a_dsi]\nnum_planes = ten\n", "a"),
            "options, section a_dsi: num_planes = ten: must be a whole number, or auto");
  EXPECT_THAT(
      errorOf("[a_dsi]\nplanes = 10\n", "a"),
      HasSubstr("options, section a_dsi: planes: unknown key: expected one of min_depth_m"));
  EXPECT_THAT(errorOf("[a_dsi]\nnum_planes = -3\n", "a"),
              HasSubstr("options, section a_dsi: num_planes = -3: must be"));
  EXPECT_THAT(errorOf("[a_dsi]\nnum_planes = 10\n[a_bsi]\nx = 1\n", "a"),
              HasSubstr("options, section a_bsi: unknown section: did you mean [dsi]?"));
  EXPECT_EQ(errorOf("[dsi]\nnum_planes = 10\n", "a"),
            "options: no section begins with a_: expected sections such as [a_dsi]");
  EXPECT_THAT(errorOf("[a_refinement]\nwindow = 0\n", "a"),
              HasSubstr("section a_refinement: window = 0: must be from 1 to 1000"));
  EXPECT_THAT(errorOf("[map]\nfile = x\n[event_fusion_map]\nvoxel = 1\n", ""),
              HasSubstr("section event_fusion_map: voxel"));
}

class HostOptionsFile : public TemporaryFolder {};

TEST_F(HostOptionsFile, IsNamedInErrorsAndPathsAreRelativeToIt) {
  CEventFusionMapBuilder builder;
  const auto error_of = [&](const std::string& file) {
    return messageOf([&] { builder.loadFromConfigFileName(file, "a"); });
  };
  const std::string wrong = (folder() / "wrong.ini").string();
  std::ofstream(wrong) << "[a_dsi]\nnum_planes = ten\n";
  EXPECT_EQ(error_of(wrong),
            wrong + ", section a_dsi: num_planes = ten: must be a whole number, or auto");
  const std::string none = (folder() / "none.ini").string();
  EXPECT_EQ(error_of(none), "cannot read the option file " + none);

  const std::string file = (folder() / "host.ini").string();
  std::ofstream(file) << "[a_rig]\ncalibration = rig/cams.yaml\n";
  OptionReader reader;
  readHostOptions(mrpt::config::CConfigFile(file), "a", reader);
  EXPECT_EQ(reader.options().rig.calibration, folder() / "rig" / "cams.yaml");
  EXPECT_EQ(optionsOf("[rig]\ncalibration = cams.yaml\n", "").rig.calibration, "cams.yaml");
}

TEST(HostOptions, ABuilderKeepsItsOptionsForMissingAndWrongKeys) {
  CEventFusionMapBuilder builder(syntheticOptions());
  builder.loadFromConfigFile(CConfigFileMemory(std::string("[a_map]\nvoxel_size_m = 0.5\n")), "a");
  EventFusionOptions expected = syntheticOptions();
  expected.cloud.voxel_size_m = 0.5;
  EXPECT_EQ(listed(builder.usedOptions()), listed(expected));

  EXPECT_THROW(builder.loadFromConfigFile(
                   CConfigFileMemory(std::string("[a_map]\nvoxel_size_m = 0\n")), "a"),
               std::invalid_argument);
  EXPECT_EQ(listed(builder.usedOptions()), listed(expected));
}

TEST(HostOptions, SavedOptionsOfABuilderReadBackTheSame) {
  for (const std::string prefix : {"", "front"}) {
    CConfigFileMemory file;
    CEventFusionMapBuilder(syntheticOptions()).saveToConfigFile(file, prefix);
    CEventFusionMapBuilder builder;
    builder.loadFromConfigFile(file, prefix);
    EXPECT_EQ(listed(builder.usedOptions()), listed(syntheticOptions()));
  }
}

TEST(HostOptions, ABuilderDumpsAllOptions) {
  std::ostringstream text;
  CEventFusionMapBuilder(syntheticOptions()).dumpToTextStream(text);
  for (const NamedOption& option : listOptions(syntheticOptions())) {
    EXPECT_THAT(text.str(), HasSubstr(std::string(option.key)));
  }
  EXPECT_THAT(text.str(), testing::ContainsRegex("threshold_c *= *60"));
}

}  // namespace
}  // namespace efm
