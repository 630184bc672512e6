// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/evaluation/depth_evaluation.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>

#include "test/plugin/temporary_folder.h"

namespace efm {
namespace {

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
  tiff("out/keyframes/1.000000000/depth.tiff", 2);
  tiff("out/keyframes/2.000000000/depth.tiff", 2);
  tiff("out/keyframes/3.000000000/depth.tiff", 2);
  tiff("data/depth/cam0_a.tiff", 3);
  tiff("data/depth/cam0_b.tiff", 4);
  std::ofstream(folder() / "data/depth/index.txt")
      << "# t file\n2.0005 cam0_b.tiff\n0.9995 cam0_a.tiff\n3.002 cam0_a.tiff\n";

  const auto evaluation = evaluateDepth(folder() / "out", folder() / "data", {});

  ASSERT_EQ(evaluation.maps.size(), 2U);
  EXPECT_EQ(evaluation.maps[0].name, "1.000000000");
  EXPECT_EQ(evaluation.maps[0].errors.mean_abs_m, 1);
  EXPECT_EQ(evaluation.maps[1].errors.mean_abs_m, 2);
  EXPECT_EQ(evaluation.mean.median_abs_m, 1.5);
  EXPECT_EQ(evaluation.all.points, 24U);
  EXPECT_EQ(evaluation.without_truth, 1U);
  EXPECT_THAT(evaluationTable(evaluation), HasSubstr("1 depth maps have no truth within 1 ms"));
  const auto json = nlohmann::json::parse(evaluationJson(evaluation));
  EXPECT_EQ(json["maps"].size(), 2U);
  EXPECT_EQ(json["mean"]["mean_abs_m"], 1.5);
}

TEST_F(EvaluateDepth, PrecisionAndRecallAreOverAllPixelsOfAllMaps) {
  tiff("out/1/depth.tiff", 2);
  tiff("out/2/depth.tiff", 3);
  tiff("data/a.tiff", 2.5);
  std::ofstream(folder() / "data/index.txt") << "1 a.tiff\n2 a.tiff\n3 a.tiff\n";
  DepthEvaluationOptions options;
  options.thresholds_m = {0.25, 0.5};
  const auto evaluation = evaluateDepth(folder() / "out", folder() / "data", options);
  EXPECT_EQ(evaluation.detection.truths, 24U);
  EXPECT_EQ(evaluation.detection.precision(0), 0);
  EXPECT_EQ(evaluation.detection.f1(1), 1);
  EXPECT_EQ(evaluation.without_estimate, 1U);
  EXPECT_THAT(evaluationTable(evaluation), HasSubstr("1 true maps have no estimate"));
  EXPECT_EQ(nlohmann::json::parse(evaluationJson(evaluation))["curve"][1]["recall"], 1);
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
  options.focal_baseline = 40;  // 20 px and 10 px
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

TEST_F(EvaluateDepth, AMapWithoutPointsIsNotPartOfTheMean) {
  tiff("out/keyframes/1.000000000/depth.tiff", 2);
  tiff("out/keyframes/2.000000000/depth.tiff", 0);
  tiff("data/depth/a.tiff", 3);
  std::ofstream(folder() / "data/depth/index.txt") << "1 a.tiff\n2 a.tiff\n";
  const auto evaluation = evaluateDepth(folder() / "out", folder() / "data", {});
  EXPECT_EQ(evaluation.mean.mean_abs_m, 1) << "of the one that has points";
  EXPECT_THAT(evaluationTable(evaluation), HasSubstr("  -"));
  EXPECT_THAT(evaluationJson(evaluation), HasSubstr("\"points\": 0,\n      \"name\""));
  EXPECT_THAT(errorOf(tiff("none.tiff", 0), tiff("b.tiff", 3)), HasSubstr("no pixel"));
}

TEST_F(EvaluateDepth, AWrongInputIsAnErrorThatNamesIt) {
  const auto a = tiff("a.tiff", 2);
  EXPECT_THAT(errorOf(folder() / "nowhere.tiff", a), HasSubstr("nowhere.tiff"));
  EXPECT_THAT(errorOf(folder(), a), HasSubstr("two files or two folders"));
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

}  // namespace
}  // namespace efm
