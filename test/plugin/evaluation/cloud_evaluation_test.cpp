// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <fstream>
#include <random>

#include "maps/io/point_cloud_file.h"
#include "plugin/evaluation/cloud_evaluation.h"
#include "test/plugin/temporary_folder.h"
#include "tracking_stub/truth/dataset_writer.h"

namespace efm {
namespace {

using testing::HasSubstr;

/// Returns points every 5 cm: a room of 4 x 3 x 2 m with floor and two walls, and a box on its
/// floor.
std::vector<CloudPoint> room(const Eigen::Vector3d& corner) {
  std::vector<CloudPoint> points;
  const auto wall = [&](Eigen::Vector3d from, const Eigen::Vector3d& u, const Eigen::Vector3d& v) {
    for (double a = 0; a < u.norm(); a += 0.05) {
      for (double b = 0; b < v.norm(); b += 0.05) {
        points.push_back({corner + from + a * u.normalized() + b * v.normalized(), 1, 1});
      }
    }
  };
  wall({0, 0, 0}, {4, 0, 0}, {0, 3, 0});
  wall({0, 0, 0}, {4, 0, 0}, {0, 0, 2});
  wall({0, 0, 0}, {0, 3, 0}, {0, 0, 2});
  wall({2, 1, 0}, {0, 1, 0}, {0, 0, 1});
  return points;
}

/// Returns every third point with 1 cm of noise. A tenth of them are outliers of up to 1 m.
std::vector<CloudPoint> noisy(const std::vector<CloudPoint>& truth) {
  std::mt19937 random(7);
  std::normal_distribution<double> noise(0, 0.01);
  std::uniform_real_distribution<double> outlier(-1, 1);
  std::vector<CloudPoint> map;
  for (std::size_t i = 0; i < truth.size(); i += 3) {
    const auto add = [&](auto& of) {
      map.push_back(truth[i]);
      map.back().p_world += Eigen::Vector3d(of(random), of(random), of(random));
    };
    if (i % 10 == 0) {
      add(outlier);
    } else {
      add(noise);
    }
  }
  return map;
}

TEST(AlignCloud, RecoversAKnownTransform) {
  const Eigen::Vector3d axis = Eigen::Vector3d(1, 2, 2) / 3;
  const auto turned = [&](double angle_rad) { return rotationBy(angle_rad * axis); };
  struct Case {
    Rigid3 T_map_truth;  ///< Rotates about the corner of the room.
    Eigen::Vector3d corner;
  };
  const Eigen::Vector3d utm(450'000, 5'200'000, 300);
  for (const Case& example :
       {Case{{turned(0), {0, 0, 0}}, {0, 0, 0}}, Case{{turned(0.05), {0.1, -0.2, 0.1}}, {0, 0, 0}},
        Case{{turned(0.2), {0.3, 0.2, -0.3}}, {0, 0, 0}},
        Case{{turned(0.05), {0.1, -0.2, 0.1}}, utm}}) {
    const std::vector<CloudPoint> truth = room(example.corner);
    const std::vector<CloudPoint> map = noisy(truth);
    std::vector<CloudPoint> displaced = map;
    for (CloudPoint& point : displaced) {
      point.p_world =
          example.T_map_truth * Eigen::Vector3d(point.p_world - example.corner) + example.corner;
    }
    const CloudAlignment alignment = alignCloud(displaced, truth);
    // 3,600 points, at least 800 on each wall: 1 cm of noise moves a wall by 1 cm / sqrt(800) =
    // 0.35 mm, and its far end by twice that. Five times this, as outliers near walls count.
    double worst_m = 0;
    for (std::size_t i = 0; i < map.size(); ++i) {
      const Eigen::Vector3d error = alignment.T_truth_map * displaced[i].p_world - map[i].p_world;
      worst_m = std::max(worst_m, error.norm());
    }
    EXPECT_LT(worst_m, 5 * 0.7e-3) << example.T_map_truth.translation.transpose();
    EXPECT_EQ(alignment.points, map.size());
    // All points but the outliers (a tenth) and the tail of the noise are used.
    EXPECT_GT(alignment.points_used, 0.85 * map.size());
    EXPECT_LT(alignment.points_used, map.size());
  }
}

TEST(AlignCloud, WhatCannotBeAlignedIsAnErrorThatSaysWhy) {
  const auto errorOf = [](const std::vector<CloudPoint>& map,
                          const std::vector<CloudPoint>& truth) {
    return messageOf([&] { alignCloud(map, truth); });
  };
  const std::vector<CloudPoint> truth = room({0, 0, 0});
  const std::vector<CloudPoint> few(truth.begin(), truth.begin() + 49);
  EXPECT_THAT(errorOf(few, truth), HasSubstr("49 points of the map"));
  EXPECT_THAT(errorOf(truth, few), HasSubstr("expected at least 50 of each"));
  // A map of the floor only, exact and with the noise of a scanner.
  const std::vector<CloudPoint> floor(truth.begin(), truth.begin() + 80 * 60);
  EXPECT_THAT(errorOf(noisy(truth), floor), HasSubstr("not a single wall"));
  std::vector<CloudPoint> rough = floor;
  std::mt19937 random(3);
  std::normal_distribution<double> noise(0, 0.002);
  for (CloudPoint& point : rough) point.p_world.z() += noise(random);
  EXPECT_THAT(errorOf(noisy(truth), rough), HasSubstr("not a single wall"));
  // The truth has all walls; the map has only the floor away from the walls.
  std::vector<CloudPoint> middle;
  for (const CloudPoint& point : floor) {
    if (point.p_world.x() > 2.5 && point.p_world.y() > 0.5) middle.push_back(point);
  }
  EXPECT_THAT(errorOf(noisy(middle), truth), HasSubstr("not a single wall"));
  // A map of another scene.
  std::vector<CloudPoint> other;
  std::uniform_real_distribution<double> anywhere(-3, 3);
  for (int i = 0; i < 300; ++i) {
    other.push_back({{anywhere(random), anywhere(random), anywhere(random)}, 1, 1});
  }
  EXPECT_THAT(errorOf(other, truth), HasSubstr("does not converge"));
}

using testing::AllOf;

class EvaluateCloud : public TemporaryFolder {
 protected:
  /// Writes points along x.
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
  writePly(folder() / "nan.ply", {{0, 0, 0}, {NAN, 0, 0}});
  const auto evaluation = evaluateCloud(folder() / "nan.ply", cloud("b.pcd", {1}), {});
  EXPECT_EQ(evaluation.non_finite, 1U);
  EXPECT_EQ(evaluation.errors.accuracy.count, 1U);
  EXPECT_THAT(evaluationTable(evaluation), HasSubstr("1 points are not finite"));
}

TEST_F(EvaluateCloud, AlignsAMapWithTheTruthOnlyWhereAsked) {
  // The truth: a corner of three squares of 1 m, every 5 cm. The map is 0.125 m off on each axis.
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
  // Without noise, only the last step (0.01 mm) and the rounding of floats remain.
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
