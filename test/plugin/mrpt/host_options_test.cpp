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
  try {
    optionsOf(text, prefix);
  } catch (const std::exception& error) {
    return error.what();
  }
  return "no error";
}

std::string listed(const EventFusionOptions& options) {
  std::string list;
  for (const NamedOption& option : listOptions(options)) {
    list += std::string(option.key) + "=" + textOf(option.value) + "\n";
  }
  return list;
}

TEST(HostOptions, SectionsHaveThePrefixAndOtherSectionsAreIgnored) {
  const std::string text =
      "[dsi]\nmax_depth_m = not ours\n[camera]\nfps = x\n"
      "[front_dsi]\nmax_depth_m = 9 ; a comment\n[front_map]\nvoxel_size_m = 0.5 // another\n";
  const EventFusionOptions options = optionsOf(text, "front");
  EXPECT_EQ(options.mapper.keyframe.planes.max_depth_m, 9);
  EXPECT_EQ(options.cloud.voxel_size_m, 0.5);
}

TEST(HostOptions, AHostWithAMapOfItsOwnNeedsNoPrefix) {
  const EventFusionOptions options = optionsOf(
      "[map]\nfile = not_ours\n[output]\nlog = x\n[event_fusion_map]\nvoxel_size_m = 0.5\n", "");
  EXPECT_EQ(options.cloud.voxel_size_m, 0.5);
  EXPECT_THAT(errorOf("[map]\nfile = x\n[event_fusion_map]\nvoxel = 1\n", ""),
              HasSubstr("section event_fusion_map: voxel"));
}

TEST(HostOptions, TheRefinementHasThePrefixToo) {
  const EventFusionOptions options =
      optionsOf("[front_refinement]\nenabled = true\ntracker_noise_deg = 90\n", "front");
  EXPECT_TRUE(options.refinement.enabled);
  EXPECT_DOUBLE_EQ(options.refinement.refiner.tracker.noise_rad, M_PI / 2);
  EXPECT_THAT(errorOf("[front_refinement]\nwindow = 0\n", "front"),
              HasSubstr("section front_refinement: window = 0: must be from 1 to 1000"));
  EXPECT_THAT(errorOf("[front_refinement]\nenable = true\n", "front"),
              HasSubstr("section front_refinement: enable: unknown key"));
}

TEST(HostOptions, WithoutPrefixTheSectionsHaveTheirOwnNames) {
  const EventFusionOptions options =
      optionsOf("[camera]\nfps = x\n[dsi]\nmax_depth_m = 9\n[front_dsi]\nmax_depth_m = 8\n", "");
  EXPECT_EQ(options.mapper.keyframe.planes.max_depth_m, 9);
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
  EXPECT_THAT(errorOf("[dsi]\nnum_planes = 10\n", "a"), HasSubstr("no section begins with a_"));
}

class HostOptionsFile : public TemporaryFolder {};

TEST_F(HostOptionsFile, ErrorsNameTheFile) {
  const std::string file = (folder() / "host.ini").string();
  std::ofstream(file) << "[a_dsi]\nnum_planes = ten\n";
  CEventFusionMapBuilder builder;
  try {
    builder.loadFromConfigFileName(file, "a");
    FAIL() << "no error";
  } catch (const std::invalid_argument& error) {
    EXPECT_EQ(error.what(),
              file + ", section a_dsi: num_planes = ten: must be a whole number, or auto");
  }
}

TEST_F(HostOptionsFile, PathsAreRelativeToTheFile) {
  const std::string file = (folder() / "host.ini").string();
  std::ofstream(file) << "[a_rig]\ncalibration = rig/cams.yaml\n";
  OptionReader reader;
  readHostOptions(mrpt::config::CConfigFile(file), "a", reader);
  EXPECT_EQ(reader.options().rig.calibration, folder() / "rig" / "cams.yaml");
  EXPECT_EQ(optionsOf("[rig]\ncalibration = cams.yaml\n", "").rig.calibration, "cams.yaml");
}

TEST_F(HostOptionsFile, AMissingFileIsAnError) {
  CEventFusionMapBuilder builder;
  EXPECT_THROW(builder.loadFromConfigFileName((folder() / "none.ini").string(), ""),
               std::runtime_error);
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
