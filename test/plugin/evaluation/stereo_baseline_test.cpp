// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/evaluation/depth_evaluation.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "test/plugin/temporary_folder.h"

namespace efm {
namespace {

using testing::HasSubstr;

class FindStereoBaseline : public TemporaryFolder {
 protected:
  void write(const std::string& file, const std::string& text = "") const {
    std::filesystem::create_directories((folder() / file).parent_path());
    std::ofstream(folder() / file) << text;
  }
  void writeReport(const std::string& text) const { write("out/report.json", text); }
  void writeCamchain(bool stereo) const {
    const std::string camera =
        "  camera_model: pinhole\n  intrinsics: [300, 301, 50, 40]\n  distortion_model: none\n"
        "  resolution: [100, 80]\n";
    write("data/camchain.yaml",
          "cam0:\n" + camera +
              (stereo ? "cam1:\n" + camera +
                            "  T_cn_cnm1: [[1, 0, 0, -0.3], [0, 1, 0, 0], [0, 0, 1, 0.4], "
                            "[0, 0, 0, 1]]\n"
                      : ""));
  }
  std::optional<StereoBaseline> find(const std::string& estimate, const std::string& truth) const {
    return findStereoBaseline(folder() / estimate, folder() / truth);
  }
};

TEST_F(FindStereoBaseline, TheRunsReportComesFirst) {
  writeReport(R"({"reference_view": {"fx": 200.5}, "baseline_m": 0.1})");
  writeCamchain(true);
  write("out/keyframes/1.5/depth.tiff");
  for (const char* estimate : {"out", "out/keyframes", "out/keyframes/1.5/depth.tiff"}) {
    const auto base = find(estimate, "data");
    ASSERT_TRUE(base) << estimate;
    EXPECT_EQ(base->focal_px, 200.5);
    EXPECT_NEAR(base->focalBaseline(), 20.05, 1e-12);
    EXPECT_THAT(base->source, HasSubstr("report.json"));
  }
}

TEST_F(FindStereoBaseline, TheDatasetsCalibrationIsTheSecond) {
  writeCamchain(true);
  write("data/depth/a.tiff");
  // Reports that say nothing of it.
  for (const char* report : {"{}", "[1]", "{", R"({"reference_view": 3, "baseline_m": 1})",
                             R"({"reference_view": {"fx": 200}})",
                             R"({"reference_view": {"fx": 200}, "baseline_m": 0})"}) {
    writeReport(report);
    for (const char* truth : {"data", "data/depth", "data/depth/a.tiff"}) {
      const auto base = find("out", truth);
      ASSERT_TRUE(base) << truth << " " << report;
      EXPECT_EQ(base->focal_px, 300);
      EXPECT_NEAR(base->baseline_m, 0.5, 1e-12);
    }
  }
}

TEST_F(FindStereoBaseline, OneCameraHasNoBaseline) {
  EXPECT_FALSE(find("out", "data"));
  writeCamchain(false);
  EXPECT_FALSE(find("out", "data"));
}

TEST_F(FindStereoBaseline, IsNotSearchedHigherThanARunHasFolders) {
  writeReport(R"({"reference_view": {"fx": 200.5}, "baseline_m": 0.1})");
  EXPECT_TRUE(find("out/a/b/c", "data"));
  EXPECT_FALSE(find("out/a/b/c/d", "data"));
  writeCamchain(true);
  EXPECT_TRUE(find("none", "data/a/b"));
  EXPECT_FALSE(find("none", "data/a/b/c"));
}

}  // namespace
}  // namespace efm
