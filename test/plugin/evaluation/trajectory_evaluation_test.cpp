// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>

#include <cmath>
#include <sstream>
#include <tuple>

#include "mapping/geometry/trajectory.h"
#include "plugin/evaluation/cloud_evaluation.h"
#include "plugin/evaluation/depth_evaluation.h"
#include "plugin/evaluation/trajectory_evaluation.h"
#include "plugin/recordings/open/recording_formats.h"
#include "plugin/results/pictures/depth_picture.h"
#include "test/plugin/temporary_folder.h"

namespace efm {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using Unit = RelativeSpacing::Unit;

class EvaluateTrajectory : public TemporaryFolder {
 protected:
  /// Writes a helix with a pose every 0.1 s, moved by `T_map_world`. Its clock is ahead.
  std::filesystem::path helix(const std::string& name, const Rigid3& T_map_world = {},
                              double ahead_s = 0) const {
    std::vector<StampedPose> poses;
    for (int i = 0; i < 40; ++i) {
      const double angle = 0.2 * i;
      const Rigid3 T_world_rig{
          Eigen::Quaterniond(Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ())),
          {std::cos(angle), std::sin(angle), 0.1 * angle}};
      poses.push_back(
          {std::int64_t{100'000'000} * i + std::llround(ahead_s * 1e9), T_map_world * T_world_rig});
    }
    return write(name, poses);
  }
  std::filesystem::path write(const std::string& name,
                              const std::vector<StampedPose>& poses) const {
    std::filesystem::create_directories((folder() / name).parent_path());
    writeTumTrajectory(folder() / name, poses);
    return folder() / name;
  }
  std::string errorOf(const std::filesystem::path& estimate,
                      const std::filesystem::path& truth) const {
    return messageOf([&] { evaluateTrajectory(estimate, truth, {}); });
  }

  const Rigid3 T_map_world_{Eigen::Quaterniond(Eigen::AngleAxisd(1, Eigen::Vector3d(1, 2, 2) / 3)),
                            {10, 20, 30}};
};

TEST_F(EvaluateTrajectory, IsIndependentOfTheEstimatesWorld) {
  const auto evaluation =
      evaluateTrajectory(helix("est.txt", T_map_world_, 0.004), helix("gt.txt"), {});
  EXPECT_EQ(evaluation.pairs.size(), 40U);
  EXPECT_LT(statisticsOf(evaluation.errors.translation_m).max, 1e-9);
  EXPECT_LT(statisticsOf(evaluation.errors.rotation_rad).max, 1e-7);
  std::vector<double> amounts;
  for (const auto& relative : evaluation.relative) {
    const double of_length = relative.spacing.amount / evaluation.true_length_m;
    amounts.push_back(relative.spacing.unit == Unit::kMetres ? of_length : relative.spacing.amount);
  }
  EXPECT_THAT(amounts,
              testing::Pointwise(testing::DoubleEq(), {1.0, 1.0, 0.1, 0.2, 0.3, 0.4, 0.5}));
  EXPECT_EQ(evaluation.relative[0].spacing.unit, Unit::kFrames);
  EXPECT_EQ(evaluation.relative[1].spacing.unit, Unit::kSeconds);
  for (const EvaluatedSpacing& relative : evaluation.relative) {
    EXPECT_GT(relative.translation_m.count, 0U);
    EXPECT_LT(relative.translation_m.max, 1e-9);
  }
  const auto as_they_are = evaluateTrajectory(folder() / "est.txt", folder() / "gt.txt",
                                              {0.01, TrajectoryAlignment::kNone, {}});
  EXPECT_GT(statisticsOf(as_they_are.errors.translation_m).min, 10);
}

TEST_F(EvaluateTrajectory, ReadsTheTrajectoriesOfFolders) {
  helix("out/trajectory.txt");
  helix("data/poses.txt");
  helix("uzh/groundtruth.txt");
  EXPECT_EQ(evaluateTrajectory(folder() / "out", folder() / "data", {}).pairs.size(), 40U);
  EXPECT_EQ(evaluateTrajectory(folder() / "out", folder() / "uzh", {}).pairs.size(), 40U);
  EXPECT_EQ(evaluateTrajectory(folder() / "uzh", folder() / "data", {}).pairs.size(), 40U);
  EXPECT_THAT(errorOf(folder() / "data", folder() / "out"),
              HasSubstr("out: a folder without poses.txt or groundtruth.txt"));
}

TEST_F(EvaluateTrajectory, TheTableAndTheJsonSayTheSame) {
  const auto evaluation = evaluateTrajectory(
      helix("est.txt", T_map_world_), helix("gt.txt"),
      {0.01, TrajectoryAlignment::kNone, {{Unit::kMetres, 2.0}, {Unit::kMetres, 1000.0}}});
  const auto json = nlohmann::json::parse(evaluationJson(evaluation));
  EXPECT_EQ(json["pairs"], 40);
  EXPECT_NEAR(json["ate"]["rotation_deg"]["mean"], 180 / M_PI, 1e-9);
  const SampleStatistics position = statisticsOf(evaluation.errors.translation_m);
  const nlohmann::json expected = {{"rmse", position.rms},      {"mean", position.mean},
                                   {"median", position.median}, {"std", position.stddev},
                                   {"min", position.min},       {"max", position.max}};
  EXPECT_EQ(json["ate"]["translation_m"], expected);
  const nlohmann::json& relative = json["rpe"][0];
  EXPECT_EQ(relative["unit"], "m");
  EXPECT_EQ(relative["delta"], 2.0);
  const double mean_m = relative["translation_m"]["mean"];
  EXPECT_NEAR(relative["translation_percent"], 50 * mean_m, 1e-9);
  EXPECT_NEAR(relative["rotation_deg_per_m"], 0.5 * relative["rotation_deg"]["mean"].get<double>(),
              1e-12);
  EXPECT_NEAR(json["length_m"], evaluation.true_length_m, 1e-12);
  EXPECT_NEAR(json["duration_s"], 3.9, 1e-12);
  EXPECT_EQ(json["last_s"], "3.900000000");
  EXPECT_EQ(json["rpe"][1]["pairs"], 0);
  EXPECT_FALSE(json["rpe"][1].contains("translation_m"));
  EXPECT_THAT(evaluationTable(evaluation),
              AllOf(HasSubstr("57.2958"), HasSubstr("over 1000.000 m      0")));
  for (const auto& part : {json, json["rpe"][0], json["ate"]["rotation_deg"]}) {
    for (const auto& [key, value] : part.items()) {
      EXPECT_THAT(trajectoryEvaluationKeys(), HasSubstr(key));
    }
  }
}

TEST_F(EvaluateTrajectory, TheTableSaysWhatItComparesIn80Columns) {
  std::vector<StampedPose> truth = readPoses(helix("gt.txt"));
  truth.resize(30);
  write("data/poses.txt", truth);
  helix("out/trajectory.txt", {Eigen::Quaterniond::Identity(), {1, -2, 3}});
  for (const auto& [alignment, name, transform] :
       {std::tuple{TrajectoryAlignment::kSe3, "se3: least squares",
                   "moved by (-1.000, 2.000, -3.000) m, turned by 0.000 deg\n"},
        {TrajectoryAlignment::kOrigin, "origin: the first poses coincide",
         "moved by (-1.000, 2.000, -3.000) m, turned by 0.000 deg\n"},
        {TrajectoryAlignment::kNone, "none: the poses as they are", ""}}) {
    const std::string table = evaluationTable(
        evaluateTrajectory(folder() / "out", folder() / "data", {0.004, alignment, {}}));
    EXPECT_THAT(table,
                AllOf(HasSubstr("estimate   " + (folder() / "out/trajectory.txt").string() + "\n"),
                      HasSubstr("truth      " + (folder() / "data/poses.txt").string() + "\n"),
                      HasSubstr("30 of 40 estimated and 30 true poses, at most 0.004 s apart\n"),
                      HasSubstr("0.000000000 s to 2.900000000 s: 2.900 s\n"), HasSubstr(name),
                      HasSubstr(transform)));
    std::istringstream lines(table.substr(table.find("pairs  ")));  // starts after the files' names
    for (std::string line; std::getline(lines, line);) EXPECT_LE(line.size(), 80U) << line;
  }
}

TEST_F(EvaluateTrajectory, AWrongInputIsAnErrorThatNamesIt) {
  const auto gt = helix("gt.txt");
  EXPECT_THAT(errorOf(helix("late.txt", {}, 100), gt),
              AllOf(HasSubstr("late.txt"), HasSubstr("within 0.010000 s"), HasSubstr("gt.txt")));
  EXPECT_THAT(errorOf(write("few.txt", {{0, {}}, {100'000'000, {}}}), gt),
              AllOf(HasSubstr("few.txt: cannot be aligned: 2 pairs"), HasSubstr("--align origin")));
}

TEST(ValuePicture, NanIsWhiteOrWhatLiesUnder) {
  ValuePicture picture;
  picture.values = (cv::Mat1f(1, 3) << 1, NAN, 3);
  picture.range = {1, 3};
  picture.min_width = 300;
  const cv::Mat3b drawn = drawValues(picture);
  ASSERT_GE(drawn.cols, 300);
  const int middle = 24 + drawn.cols / 6;  // below the title
  const cv::Vec3b low = drawn(middle, drawn.cols / 6);
  EXPECT_EQ(drawn(middle, drawn.cols / 2), cv::Vec3b(255, 255, 255));
  picture.under = (cv::Mat1b(1, 3) << 0, 200, 0);
  EXPECT_EQ(drawValues(picture)(middle, drawn.cols / 2), cv::Vec3b(200, 200, 200));
  EXPECT_EQ(drawValues(picture)(middle, drawn.cols / 6), low) << "grey is under the values alone";
  EXPECT_THROW(drawValues({}), std::invalid_argument);
}

}  // namespace

}  // namespace efm
