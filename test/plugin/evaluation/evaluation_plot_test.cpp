// SPDX-License-Identifier: BSD-3-Clause

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/imgcodecs.hpp>

#include "plugin/evaluation/cloud_evaluation_plot.h"
#include "plugin/evaluation/depth_evaluation_plot.h"
#include "plugin/evaluation/text_table.h"
#include "plugin/evaluation/trajectory_evaluation_plot.h"
#include "plugin/pictures/picture_file.h"
#include "plugin/pictures/picture_grid.h"
#include "plugin/pictures/value_picture.h"
#include "test/plugin/temporary_folder.h"

namespace efm {
namespace {

using testing::HasSubstr;

const cv::Vec3b kWhite(255, 255, 255);

TEST(PictureGrid, JoinsPicturesOnWhiteWithoutChangingThem) {
  const cv::Mat3b red(10, 20, cv::Vec3b(0, 0, 255));
  const cv::Mat3b blue(30, 5, cv::Vec3b(255, 0, 0));
  const cv::Mat3b row = sideBySide({red, blue});
  EXPECT_EQ(row.rows, 30);
  EXPECT_EQ(cv::countNonZero(row.reshape(1) == 0), 2 * (10 * 20 + 30 * 5));
  EXPECT_EQ(row(29, 0), kWhite);
  EXPECT_EQ(row(29, row.cols - 1), blue(0, 0));
  const cv::Mat3b column = oneBelowAnother({red, blue});
  EXPECT_EQ(column.cols, 20);
  EXPECT_EQ(column(0, 0), red(0, 0));
  EXPECT_EQ(column(column.rows - 1, 10), blue(0, 0)) << "in the middle";
  EXPECT_TRUE(sideBySide({}).empty());
}

TEST(ValuePicture, LowAndHighValuesHaveTheColoursOfTheBarAndNanIsWhite) {
  ValuePicture picture;
  picture.values = (cv::Mat1f(1, 3) << 1, NAN, 3);
  picture.range = {1, 3};
  picture.min_width = 300;
  const cv::Mat3b drawn = drawValues(picture);
  ASSERT_GE(drawn.cols, 300);
  const int middle = 24 + drawn.cols / 6;  // below the title
  const cv::Vec3b low = drawn(middle, drawn.cols / 6);
  const cv::Vec3b high = drawn(middle, drawn.cols * 5 / 6);
  EXPECT_EQ(drawn(middle, drawn.cols / 2), kWhite);
  EXPECT_GT(low[0], low[2]) << "blue";
  EXPECT_GT(high[2], high[0]) << "red";
  picture.under = (cv::Mat1b(1, 3) << 0, 200, 0);
  EXPECT_EQ(drawValues(picture)(middle, drawn.cols / 2), cv::Vec3b(200, 200, 200));
  EXPECT_EQ(drawValues(picture)(middle, drawn.cols / 6), low) << "grey is under the values alone";
  EXPECT_THROW(drawValues({}), std::invalid_argument);
}

TEST(TextTable, ColumnsFitTheirCells) {
  TextTable table;
  table.add({"a", "long"});
  table.add({"wide", "1", "x"});
  table.add({"b"});
  EXPECT_EQ(table.text(), "a     long\nwide     1  x\nb\n");
  EXPECT_EQ(fixedText(1.005, 1), "1.0");
}

class EvaluationPlot : public TemporaryFolder {
 protected:
  std::filesystem::path tiff(const std::string& name, float depth_m) const {
    cv::imwrite((folder() / name).string(), cv::Mat1f(30, 40, depth_m));
    return folder() / name;
  }
};

TEST_F(EvaluationPlot, OfDepthShowsThreeImagesAboveTheCurves) {
  const auto evaluation = evaluateDepth(tiff("a.tiff", 2), tiff("b.tiff", 4), {});
  const cv::Mat3b plot = evaluationPlot(evaluation, {});
  EXPECT_GE(plot.cols, 3 * 320);
  EXPECT_GT(plot.rows, 600);
}

TEST_F(EvaluationPlot, OfDepthWithoutErrorIsDrawn) {
  const auto evaluation = evaluateDepth(tiff("a.tiff", 2), tiff("b.tiff", 2), {});
  EXPECT_FALSE(evaluationPlot(evaluation, {}).empty());
}

TEST_F(EvaluationPlot, OfATrajectoryWithoutErrorIsDrawn) {
  TrajectoryEvaluation evaluation;
  evaluation.pairs = {{0, {}, {}}};
  evaluation.errors = {{0}, {0}};
  EXPECT_FALSE(evaluationPlot(evaluation).empty());
}

TEST_F(EvaluationPlot, OfACloudDrawsItsDistancesInOrder) {
  CloudEvaluation evaluation;
  evaluation.errors.steps = {{1, 1, 0, 1, 1}, {0.1, 0.2, 0.8, 0.1, 0.13}};
  CloudEvaluation sorted = evaluation;
  std::swap(sorted.errors.steps[0], sorted.errors.steps[1]);
  EXPECT_EQ(cv::norm(evaluationPlot(evaluation), evaluationPlot(sorted)), 0);
}

TEST_F(EvaluationPlot, IsWrittenAsPngOnly) {
  const cv::Mat3b picture(3, 4, kWhite);
  writePicture(folder() / "a.png", picture);
  EXPECT_EQ(cv::imread((folder() / "a.png").string()).size(), picture.size());
  const auto errorOf = [&](const std::filesystem::path& file) -> std::string {
    try {
      writePicture(file, picture);
    } catch (const std::runtime_error& error) {
      return error.what();
    }
    return "no error";
  };
  EXPECT_THAT(errorOf(folder() / "a.pdf"), HasSubstr("a.pdf: expected a name that ends in .png"));
  EXPECT_THAT(errorOf(folder() / "nowhere" / "a.png"), HasSubstr("nowhere"));
}

}  // namespace
}  // namespace efm
