// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/evaluation/depth_series.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "test/plugin/temporary_folder.h"

namespace efm {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

class DepthSeries : public TemporaryFolder {
 protected:
  void write(const std::string& file, const std::string& text = "") const {
    std::filesystem::create_directories((folder() / file).parent_path());
    std::ofstream(folder() / file) << text;
  }
  /// The files of a series, as paths inside the test's folder.
  std::vector<std::string> filesOf(const std::string& name, DepthSeriesRole role) const {
    std::vector<std::string> files;
    for (const TimedFile& file : depthSeries(folder() / name, role)) {
      files.push_back(file.file.lexically_relative(folder()).string());
    }
    return files;
  }
  std::string errorOf(const std::string& name) const {
    return messageOf([&] { depthSeries(folder() / name, DepthSeriesRole::kTruth); });
  }
};

TEST_F(DepthSeries, AFolderWithBothKindsReturnsTheMapsOfTheRole) {
  write("both/keyframes/10.5/depth.tiff");
  write("both/keyframes/9.5/depth.tiff");
  write("both/keyframes/notes/depth.tiff");
  write("both/keyframes/11.5/confidence.tiff");
  write("both/depth/index.txt", "# t file\n2 b.tiff\n1 a.tiff # the first\n\n");
  EXPECT_THAT(filesOf("both", DepthSeriesRole::kEstimate),
              ElementsAre("both/keyframes/9.5/depth.tiff", "both/keyframes/10.5/depth.tiff"));
  EXPECT_THAT(filesOf("both", DepthSeriesRole::kTruth),
              ElementsAre("both/depth/a.tiff", "both/depth/b.tiff"));
}

TEST_F(DepthSeries, EachRoleReadsTheOnlyKindOfAFolder) {
  write("map/keyframes/1/depth.tiff");
  write("data/depth/index.txt", "1 a.tiff\n");
  EXPECT_THAT(filesOf("map", DepthSeriesRole::kTruth), ElementsAre("map/keyframes/1/depth.tiff"));
  EXPECT_THAT(filesOf("map/keyframes", DepthSeriesRole::kTruth),
              ElementsAre("map/keyframes/1/depth.tiff"));
  EXPECT_THAT(filesOf("data", DepthSeriesRole::kEstimate), ElementsAre("data/depth/a.tiff"));
  EXPECT_THAT(filesOf("data/depth", DepthSeriesRole::kEstimate), ElementsAre("data/depth/a.tiff"));
}

TEST_F(DepthSeries, ReadsTheTimeFromTheNameWithoutAnIndex) {
  for (const char* file : {"cam0_2.25.tiff", "a_b_1.5.pfm", "0.75.npy", "mask.png", "3.txt",
                           "x_y.tif", "4.tif", "5.png"}) {
    write(std::string("named/") + file);
  }
  const auto series = depthSeries(folder() / "named", DepthSeriesRole::kEstimate);
  std::vector<std::int64_t> times_ms;
  for (const TimedFile& file : series) times_ms.push_back(file.t_ns / 1'000'000);
  EXPECT_THAT(times_ms, ElementsAre(750, 1500, 2250, 4000, 5000));
  EXPECT_EQ(series[1].file.filename(), "a_b_1.5.pfm");
}

TEST_F(DepthSeries, AFolderWithoutASeriesIsAnErrorThatNamesIt) {
  write("empty/notes.txt");
  EXPECT_THAT(errorOf("empty"), HasSubstr("empty: expected keyframes/<t>/depth.tiff"));
  write("bad/index.txt", "1 a.tiff\nsoon b.tiff\n");
  EXPECT_THAT(errorOf("bad"), HasSubstr("index.txt:2: 'soon b.tiff': expected a time"));
  write("none/index.txt", "# nothing\n");
  EXPECT_THAT(errorOf("none"), HasSubstr("lists no depth maps"));
  write("cut/index.txt", "1\n");
  EXPECT_THAT(errorOf("cut"), HasSubstr("index.txt:1: '1': expected a time"));
}

TEST_F(DepthSeries, TheNearestFileIsTheOneWithinTheLimit) {
  const std::vector<TimedFile> series = {{100, "a"}, {200, "b"}, {300, "c"}};
  const auto nearest = [&](std::int64_t t_ns) {
    const TimedFile* file = nearestFile(series, t_ns, 50);
    return file == nullptr ? std::string("none") : file->file.string();
  };
  EXPECT_EQ(nearest(49), "none");
  EXPECT_EQ(nearest(50), "a") << "the limit belongs to it";
  EXPECT_EQ(nearest(149), "a");
  EXPECT_EQ(nearest(150), "a") << "the earlier of two";
  EXPECT_EQ(nearest(151), "b");
  EXPECT_EQ(nearest(350), "c");
  EXPECT_EQ(nearest(351), "none");
  EXPECT_EQ(nearestFile({}, 0, 50), nullptr);
}

}  // namespace
}  // namespace efm
