// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/evaluation/cloud_evaluation.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>

#include "maps/io/point_cloud_file.h"
#include "test/plugin/temporary_folder.h"
#include "tracking_stub/truth/dataset_writer.h"

namespace efm {
namespace {

using testing::AllOf;
using testing::HasSubstr;

class EvaluateCloud : public TemporaryFolder {
 protected:
  /// Points along x.
  std::filesystem::path cloud(const std::string& name, const std::vector<double>& xs_m) const {
    const auto path = folder() / name;
    std::filesystem::create_directories(path.parent_path());
    std::vector<CloudPoint> points;
    std::vector<Eigen::Vector3f> positions;
    for (const double x : xs_m) {
      points.push_back({{x, 0, 0}, 1, 1});
      positions.push_back(points.back().p_world.cast<float>());
    }
    if (path.extension() == ".ply") {
      writePly(path, positions);
    } else {
      writePcd(path, *mapCloudOf(points, 0.01));
    }
    return path;
  }
  std::string errorOf(const std::filesystem::path& map, const std::filesystem::path& truth) const {
    return messageOf([&] { evaluateCloud(map, truth, {}); });
  }
};

TEST_F(EvaluateCloud, ReadsTheCloudsOfFolders) {
  cloud("out/map.pcd", {0, 1});
  cloud("one/points.pcd", {0, 1});
  cloud("data/gt_cloud.ply", {0, 3});
  const auto edges = cloud("data/gt_edges.ply", {1});
  for (const char* run : {"out", "one"}) {
    const auto evaluation = evaluateCloud(folder() / run, folder() / "data", {{0.5}, edges});
    EXPECT_EQ(evaluation.errors.steps.at(0).outliers, 0.5);
    EXPECT_EQ(evaluation.errors.steps.at(0).completeness, 1) << "of what can be found";
  }
  EXPECT_THAT(errorOf(folder() / "data", folder() / "data"),
              HasSubstr("data: a folder without map.pcd or points.pcd"));
}

TEST_F(EvaluateCloud, TheTableAndTheJsonSayTheSame) {
  const auto evaluation =
      evaluateCloud(cloud("a.pcd", {0, 0.5}), cloud("b.pcd", {0}), {{0.1, 1}, {}});
  const auto json = nlohmann::json::parse(evaluationJson(evaluation));
  EXPECT_EQ(json["accuracy"], nlohmann::json::parse(R"({"points": 2, "mean_m": 0.25,
    "median_m": 0.25, "rms_m": 0.3535533905932738, "max_m": 0.5, "p90_m": 0.5})"));
  EXPECT_EQ(json["completeness_distance"]["points"], 1);
  EXPECT_EQ(json["curve"][0], nlohmann::json::parse(R"({"distance_m": 0.1, "within": 0.5,
    "outliers": 0.5, "completeness": 1, "f1": 0.6666666666666666})"));
  EXPECT_EQ(json["curve"].size(), 2U);
  EXPECT_EQ(json["non_finite"], 0);
  EXPECT_EQ(evaluationTable(evaluation),
            R"(distances in m               points    mean  median    90 %     rms     max
map to truth (accuracy)           2  0.2500  0.2500  0.5000  0.3536  0.5000
truth to map (completeness)       1  0.0000  0.0000  0.0000  0.0000  0.0000

distance m  map within %  outliers %  completeness %    F1 %
0.100              50.00       50.00          100.00   66.67
1.000             100.00        0.00          100.00  100.00
)");
  for (const auto& part : {json, json["accuracy"], json["curve"][0]}) {
    for (const auto& [key, value] : part.items()) {
      EXPECT_THAT(cloudEvaluationKeys(), HasSubstr(key));
    }
  }
}

TEST_F(EvaluateCloud, PointsThatAreNotFiniteAreCounted) {
  std::ofstream(folder() / "nan.pcd")
      << "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 2\nHEIGHT 1\n"
         "VIEWPOINT 0 0 0 1 0 0 0\nPOINTS 2\nDATA ascii\n0 0 0\nnan 0 0\n";
  const auto evaluation = evaluateCloud(folder() / "nan.pcd", cloud("b.pcd", {1}), {});
  EXPECT_EQ(evaluation.non_finite, 1U);
  EXPECT_EQ(evaluation.errors.accuracy.count, 1U);
  EXPECT_THAT(evaluationTable(evaluation), HasSubstr("1 points are not finite"));
}

TEST_F(EvaluateCloud, AlignsAMapWithTheTruthOnlyWhereAsked) {
  // A corner of three squares of 1 m, every 5 cm; the map lies 0.125 m farther along each axis.
  std::vector<CloudPoint> map;
  std::vector<Eigen::Vector3f> truth;
  for (int i = 0; i < 3 * 20 * 20; ++i) {
    Eigen::Vector3f p(0.05F * static_cast<float>(i % 20), 0.05F * static_cast<float>(i / 20 % 20),
                      0);
    std::rotate(p.data(), p.data() + i / 400, p.data() + 3);
    truth.push_back(p);
    map.push_back({p.cast<double>() + Eigen::Vector3d::Constant(0.125), 1, 1});
  }
  writePcd(folder() / "map.pcd", *mapCloudOf(map, 0.01));
  writePly(folder() / "truth.ply", truth);
  const auto as_it_is = evaluateCloud(folder() / "map.pcd", folder() / "truth.ply", {{0.05}, {}});
  EXPECT_GT(as_it_is.errors.accuracy.mean, 0.1);
  EXPECT_FALSE(nlohmann::json::parse(evaluationJson(as_it_is)).contains("alignment"));

  const auto aligned =
      evaluateCloud(folder() / "map.pcd", folder() / "truth.ply", {{0.05}, {}, true});
  // Without noise, only the last step (0.01 mm) and the rounding of floats are left.
  EXPECT_LT(aligned.errors.accuracy.max, 1e-4);
  EXPECT_EQ(aligned.errors.steps.at(0).completeness, 1) << "of the truth to the moved map";
  EXPECT_THAT(evaluationTable(aligned), AllOf(HasSubstr("moved by (-0.125"), HasSubstr("turned by"),
                                              HasSubstr("of 1200 points compared")));
  const auto json = nlohmann::json::parse(evaluationJson(aligned))["alignment"];
  EXPECT_NEAR(json["T_truth_map"][2][3], -0.125, 1e-4);
  EXPECT_NEAR(json["T_truth_map"][0][0], 1, 1e-6);
  EXPECT_EQ(json["points"], 1200);
  for (const auto& [key, value] : json.items()) {
    EXPECT_THAT(cloudEvaluationKeys(), HasSubstr(key));
  }
}

TEST_F(EvaluateCloud, AWrongInputIsAnErrorThatNamesIt) {
  const auto one = cloud("one.pcd", {0});
  EXPECT_THAT(errorOf(cloud("none.pcd", {}), one), HasSubstr("none.pcd: no points"));
  EXPECT_THAT(errorOf(one, cloud("none.ply", {})), HasSubstr("none.ply: no points"));
  EXPECT_THROW(evaluateCloud(one, one, {{-1}, {}}), std::invalid_argument);
}

}  // namespace
}  // namespace efm
