// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>

#include <fstream>

#include "plugin/evaluation/depth_evaluation.h"
#include "plugin/evaluation/depth_file.h"
#include "test/plugin/temporary_folder.h"

namespace efm {
namespace {

using testing::AllOf;
using testing::HasSubstr;

class EvaluateDepth : public TemporaryFolder {
 protected:
  std::filesystem::path tiff(const std::string& name, float depth_m, cv::Size size = {4, 3}) {
    const auto path = folder() / name;
    std::filesystem::create_directories(path.parent_path());
    cv::imwrite(path.string(), cv::Mat1f(size, depth_m));
    return path;
  }

  std::string errorOf(const std::filesystem::path& estimate, const std::filesystem::path& truth) {
    return messageOf([&] { evaluateDepth(estimate, truth, {}); });
  }
};

TEST_F(EvaluateDepth, PairsFoldersByTimeAndAveragesMaps) {
  for (const char* name : {"1.000000000", "2.000000000", "3.000000000"}) {
    tiff("out/keyframes/" + std::string(name) + "/depth.tiff", 2);
  }
  tiff("out/keyframes/4.000000000/depth.tiff", 0);  // without points: does not count in the mean
  tiff("data/depth/cam0_a.tiff", 3);
  tiff("data/depth/cam0_b.tiff", 4);
  std::ofstream(folder() / "data/depth/index.txt")
      << "# t file\n2.0005 cam0_b.tiff\n0.9995 cam0_a.tiff\n3.002 cam0_a.tiff\n4 cam0_a.tiff\n";
  DepthEvaluationOptions options;
  options.thresholds_m = {0.25, 1};
  const auto evaluation = evaluateDepth(folder() / "out", folder() / "data", options);

  ASSERT_EQ(evaluation.maps.size(), 3U);
  EXPECT_EQ(evaluation.maps[0].name, "1.000000000");
  EXPECT_EQ(evaluation.maps[0].errors.mean_abs_m, 1);
  EXPECT_EQ(evaluation.maps[1].errors.mean_abs_m, 2);
  EXPECT_EQ(evaluation.mean.median_abs_m, 1.5);
  EXPECT_EQ(evaluation.all.points, 24U);
  EXPECT_EQ(evaluation.detection.truths, 36U) << "over all pixels of all maps";
  EXPECT_EQ(evaluation.detection.precision(0), 0);
  EXPECT_EQ(evaluation.detection.precision(1), 0.5);
  EXPECT_THAT(evaluationTable(evaluation),
              AllOf(HasSubstr("1 depth maps have no truth within 1 ms"), HasSubstr("  -"),
                    HasSubstr("1 true maps have no estimate")));
  const std::string text = evaluationJson(evaluation);
  EXPECT_THAT(text, HasSubstr("\"points\": 0,\n      \"name\""));
  const auto json = nlohmann::json::parse(text);
  EXPECT_EQ(json["maps"].size(), 3U);
  EXPECT_EQ(json["mean"]["mean_abs_m"], 1.5);
  EXPECT_EQ(json["curve"][1]["recall"], 12.0 / 36);
}

TEST_F(EvaluateDepth, AMaskAndAScaleApplyToAllMaps) {
  cv::Mat1b mask(3, 4, uchar{0});
  mask.row(1).setTo(255);
  cv::imwrite((folder() / "mask.png").string(), mask);
  cv::imwrite((folder() / "gt.png").string(), cv::Mat_<std::uint16_t>(3, 4, std::uint16_t{512}));
  DepthEvaluationOptions options;
  options.mask = folder() / "mask.png";
  options.png_scale = 256;
  const auto evaluation = evaluateDepth(tiff("a.tiff", 3), folder() / "gt.png", options);
  EXPECT_EQ(evaluation.all.points, 4U);
  EXPECT_EQ(evaluation.all.mean_abs_m, 1);
  EXPECT_EQ(evaluation.detection.truths, 4U);
}

TEST_F(EvaluateDepth, BadPixelsNeedFocalLengthTimesBaseline) {
  DepthEvaluationOptions options;
  options.focal_baseline = 40;  // disparities of 20 px and 10 px
  const auto evaluation = evaluateDepth(tiff("a.tiff", 2), tiff("b.tiff", 4), options);
  EXPECT_EQ(evaluation.mean.bad_pix_5px, 1);
  const auto json =
      nlohmann::json::parse(evaluationJson(evaluation, StereoBaseline{400, 0.1, "as given"}));
  for (const auto& part : {json, json["maps"][0], json["curve"][0]}) {
    for (const auto& [key, value] : part.items()) {
      EXPECT_THAT(depthEvaluationKeys(), HasSubstr(key));
    }
  }
  EXPECT_EQ(json["focal_px"], 400);
  const auto without = evaluateDepth(folder() / "a.tiff", folder() / "b.tiff", {});
  EXPECT_THAT(evaluationTable(without), HasSubstr("no bad-pix: it needs"));
  EXPECT_FALSE(nlohmann::json::parse(evaluationJson(without))["all"].contains("bad_pix_5px"));
}

TEST_F(EvaluateDepth, TheTablesOfManyMapsHaveALinePerMapAndAllMeasuresBelow) {
  tiff("out/1600000000.100000000/depth.tiff", 2);
  tiff("out/1600000000.200000000/depth.tiff", 3);
  std::ofstream(folder() / "index.txt") << "1600000000.1 a.tiff\n1600000000.2 a.tiff\n";
  tiff("a.tiff", 2.2F);
  DepthEvaluationOptions options;
  options.focal_baseline = 40;
  options.thresholds_m = {0.1, 0.3};
  EXPECT_EQ(evaluationTable(evaluateDepth(folder() / "out", folder(), options),
                            StereoBaseline{400, 0.1, "as given"}),
            R"(map                   points    mean  median   bad-pix  AErrR  delta<1.25
                              |dZ| m  |dZ| m  5px,5% %      %           %
1600000000.100000000      12  0.2000  0.2000      0.00   9.09      100.00
1600000000.200000000      12  0.8000  0.8000      0.00  36.36        0.00

                      mean of maps  all points
points                                      24
mean |dZ|, m                0.5000      0.5000
median |dZ|, m              0.5000      0.5000
median |d(1/Z)|, 1/m       0.08333     0.08333
bad-pix 5px,5%, %             0.00        0.00
bad-pix 3px,5%, %            50.00       50.00
SILog, x100                  0.000       4.110
AErrR, %                     22.73       22.73
AErrR by estimate, %         18.33       18.33
log RMSE, x100              20.273      22.943
delta<1.25, %                50.00       50.00
delta<1.25^2, %             100.00      100.00
delta<1.25^3, %             100.00      100.00
beyond 10%, %                50.00       50.00

error up to m  precision %  recall %   F1 %
0.100                 0.00      0.00   0.00
0.300                50.00     50.00  50.00
24 estimates with a truth, 0 without
24 pixels with a truth
bad-pix with focal length 400.00 px and baseline 0.1000 m
(as given)
)");
}

TEST_F(EvaluateDepth, AWrongInputIsAnErrorThatNamesIt) {
  const auto a = tiff("a.tiff", 2);
  EXPECT_THAT(errorOf(folder() / "nowhere.tiff", a), HasSubstr("nowhere.tiff"));
  EXPECT_THAT(errorOf(folder(), a), HasSubstr("two files or two folders"));
  EXPECT_THAT(errorOf(tiff("none.tif", 0), a), HasSubstr("no pixel"));
  EXPECT_THAT(errorOf(folder(), folder()), HasSubstr("no depth maps in"));
  EXPECT_THAT(errorOf(a, tiff("wide.tiff", 2, {8, 3})), HasSubstr("wide.tiff"));
  std::ofstream(folder() / "index.txt") << "1.0 a.tiff\n";
  tiff("one/depth.tiff", 1);
  EXPECT_THAT(errorOf(folder() / "one", folder()), HasSubstr("one holds one depth map without"));
  DepthEvaluationOptions wide;
  wide.mask = folder() / "wide.png";
  cv::imwrite(wide.mask.string(), cv::Mat1b(3, 8, uchar{1}));
  EXPECT_THROW(evaluateDepth(a, a, wide), std::runtime_error);
  wide.mask = folder() / "nowhere.png";
  EXPECT_THROW(evaluateDepth(a, a, wide), std::runtime_error);
  tiff("7.0/depth.tiff", 1);
  EXPECT_THAT(errorOf(folder(), folder()), HasSubstr("within 1 ms"));
}

/// Writes and finds text files in a folder.
class TextFolder : public TemporaryFolder {
 protected:
  void write(const std::string& file, const std::string& text = "") const {
    writeFile(folder() / file, text);
  }
};

using FindStereoBaseline = TextFolder;

TEST_F(FindStereoBaseline, IsInTheRunsReportOrElseInTheDatasetsCalibration) {
  const std::string camera =
      "  camera_model: pinhole\n  intrinsics: [300, 301, 50, 40]\n  distortion_model: none\n"
      "  resolution: [100, 80]\n";
  const std::string one = "cam0:\n" + camera;
  const std::string two =
      one + "cam1:\n" + camera +
      "  T_cn_cnm1: [[1, 0, 0, -0.3], [0, 1, 0, 0], [0, 0, 1, 0.4], [0, 0, 0, 1]]\n";
  const std::string full = R"({"reference_view": {"fx": 200.5}, "baseline_m": 0.1})";
  write("out/keyframes/1.5/depth.tiff");
  write("data/depth/a.tiff");
  struct Case {
    std::string report, camchain;  // empty: the file is missing
    const char *estimate, *truth;
    double focal_px, baseline_m;  // 0 if not found
  };
  for (const Case& each : std::vector<Case>{
           {full, two, "out", "data", 200.5, 0.1},
           {full, two, "out/keyframes/1.5/depth.tiff", "data", 200.5, 0.1},
           {full, one, "out/a/b/c/d", "data", 0, 0},  // a run's result has fewer folder levels
           {"{}", two, "out", "data", 300, 0.5},
           {"[1]", two, "out", "data/depth", 300, 0.5},
           {"{", two, "out", "data/depth/a.tiff", 300, 0.5},
           {R"({"reference_view": 3, "baseline_m": 1})", two, "out", "data", 300, 0.5},
           {R"({"reference_view": {"fx": 200}})", two, "out", "data", 300, 0.5},
           {R"({"reference_view": {"fx": 200}, "baseline_m": 0})", two, "out", "data", 300, 0.5},
           {"", two, "out", "data/a/b", 300, 0.5},
           {"", two, "out", "data/a/b/c", 0, 0},
           {"", one, "out", "data", 0, 0},
           {"", "", "out", "data", 0, 0}}) {
    for (const auto& [name, text] :
         {std::pair{"out/report.json", each.report}, {"data/camchain.yaml", each.camchain}}) {
      std::filesystem::remove(folder() / name);
      if (!text.empty()) write(name, text);
    }
    const auto found = findStereoBaseline(folder() / each.estimate, folder() / each.truth)
                           .value_or(StereoBaseline());
    EXPECT_EQ(found.focal_px, each.focal_px) << each.report << each.estimate << each.truth;
    EXPECT_NEAR(found.baseline_m, each.baseline_m, 1e-12);
    EXPECT_THAT(found.source, HasSubstr(each.focal_px == 0     ? ""
                                        : each.focal_px == 300 ? "camchain.yaml"
                                                               : "report.json"));
  }
}

using testing::ElementsAre;

class DepthSeries : public TextFolder {
 protected:
  /// Returns the files of a series as paths inside the test's folder.
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
  const auto maps = ElementsAre("both/keyframes/9.5/depth.tiff", "both/keyframes/10.5/depth.tiff");
  const auto listed = ElementsAre("both/depth/a.tiff", "both/depth/b.tiff");
  EXPECT_THAT(filesOf("both", DepthSeriesRole::kEstimate), maps);
  EXPECT_THAT(filesOf("both", DepthSeriesRole::kTruth), listed);
  // If a folder has one kind of file only, this kind serves both roles.
  EXPECT_THAT(filesOf("both/keyframes", DepthSeriesRole::kTruth), maps);
  EXPECT_THAT(filesOf("both/depth", DepthSeriesRole::kEstimate), listed);
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
