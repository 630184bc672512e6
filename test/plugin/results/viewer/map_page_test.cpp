// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/results/viewer/map_page.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <random>
#include <set>
#include <sstream>

#include "mapping/base/picture_file.h"
#include "plugin/results/pictures/depth_picture.h"

namespace efm {
namespace {

using nlohmann::json;
using testing::Each;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

std::vector<CloudPoint> randomPoints(int count, const Eigen::Vector3d& origin_m) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> coordinate(-1, 1);
  std::vector<CloudPoint> points;
  for (int i = 0; i < count; ++i) {
    const Eigen::Vector3d p(20 * coordinate(random), coordinate(random), 0.1 * coordinate(random));
    const auto number = static_cast<std::uint32_t>(i);
    points.push_back({origin_m + p, 1.0F + static_cast<float>(i), 1 + number % 300, number});
  }
  return points;
}

TEST(Base64, IsThatOfTheStandard) {
  const std::pair<std::string, std::string> cases[] = {
      {"", ""}, {"f", "Zg=="}, {"fo", "Zm8="}, {"foo", "Zm9v"}, {"foobar", "Zm9vYmFy"}};
  for (const auto& [bytes, text] : cases) EXPECT_EQ(base64(bytes), text);
  EXPECT_EQ(base64("\xFB\xFF\xBF"), "+/+/");
}

/// The points are far from the world's origin, as in a town's coordinates.
TEST(PagePoints, PositionsAreOffByHalfAStepAtMost) {
  const std::vector<CloudPoint> points = randomPoints(1000, {4e5, 5e6, 300});
  const MapCloud::ConstPtr cloud = mapCloudOf(points, 1e-4);
  const PagePoints page(*cloud, 0.01);
  ASSERT_EQ(page.size(), points.size());
  EXPECT_NEAR(page.step_m().x(), 40.0 / 65535, 1e-5);
  EXPECT_EQ(page.subsampled_m(), 0);
  // Confidences are 1 to 1000: the range goes from the lowest to the highest percent.
  EXPECT_EQ(page.lowConfidence(), 10);
  EXPECT_EQ(page.highConfidence(), 990);
  std::set<std::size_t> found;
  for (std::size_t i = 0; i < page.size(); ++i) {
    const PagePoint quantised = page.at(i);
    const CloudPoint& point = points[quantised.keyframe];  // each point has its own keyframe
    found.insert(quantised.keyframe);
    EXPECT_EQ(quantised.support, std::min<std::uint32_t>(point.support, 255));
    for (int axis = 0; axis < 3; ++axis) {
      const double p = page.origin_m()[axis] + page.step_m()[axis] * quantised.cell[axis];
      // The error is half a step plus the digits of a float relative to the origin of the cloud.
      EXPECT_LE(std::abs(p - point.p_world[axis]), 0.5 * page.step_m()[axis] + 1e-5);
    }
    const double level = std::log(point.confidence / page.lowConfidence()) /
                         std::log(page.highConfidence() / page.lowConfidence());
    EXPECT_NEAR(quantised.confidence, 255 * std::clamp(level, 0.0, 1.0), 0.51);
  }
  EXPECT_EQ(found.size(), points.size()) << "each point once";
}

TEST(PagePoints, AnyFirstPartCoversTheMap) {
  std::vector<CloudPoint> line;  // sorted like a map
  for (int i = 0; i < 100000; ++i) line.push_back({{0.01 * i, 0, 0}, 1.0F});
  const MapCloud::ConstPtr cloud = mapCloudOf(line, 0.01);
  const PagePoints page(*cloud, 0.01);
  std::array<int, 10> histogram{};
  for (std::size_t i = 0; i < 1000; ++i) ++histogram.at(page.at(i).cell[0] / 6554);
  EXPECT_THAT(histogram, Each(testing::AllOf(testing::Ge(95), testing::Le(105))));
  EXPECT_GE(PagePoints(*cloud, 0.01, 1000).size(), 700U) << "thinned as a surface is";
}

TEST(PagePoints, MoreThanTheLimitAreSubsampledToTheBestOfEachCell) {
  std::vector<CloudPoint> points = randomPoints(20000, {0, 0, 0});
  for (std::size_t i = 0; i < points.size(); ++i) points[i].support = 1 + i * 7 % 4;
  const MapCloud::ConstPtr cloud = mapCloudOf(points, 1e-9);
  const PagePoints page(*cloud, 0.01, 1000);
  EXPECT_LE(page.size(), 1000U);
  EXPECT_GE(page.size(), 700U) << "not many fewer than there may be";
  EXPECT_GT(page.subsampled_m(), 0.01);
  // Each cell keeps the points with its highest support, and of these the highest confidence.
  std::map<std::tuple<double, double, double>, std::pair<std::uint32_t, float>> best;
  const auto cell_of = [&](const MapPoint& point) {
    const Eigen::Vector3d cell =
        ((positionIn(*cloud, point) - page.origin_m()) / page.subsampled_m()).array().floor();
    return std::tuple(cell.x(), cell.y(), cell.z());
  };
  for (const MapPoint& point : *cloud) {
    auto& of_cell = best[cell_of(point)];
    of_cell = std::max(of_cell, std::pair(point.support, point.intensity));
  }
  EXPECT_EQ(page.size(), best.size());
  for (std::size_t i = 0; i < page.size(); ++i) {
    const MapPoint& point = cloud->at(page.at(i).keyframe);
    EXPECT_EQ(best[cell_of(point)], std::pair(point.support, point.intensity)) << i;
  }
}

/// Eight corners: cells of any size keep one of the corners or all, no number between.
TEST(PagePoints, ThinningEndsWhereNoCellGivesTheNumber) {
  std::vector<CloudPoint> corners;
  for (int i = 0; i < 8; ++i) corners.push_back({{i % 2 * 1.0, i / 2 % 2 * 1.0, i / 4 * 1.0}, 1});
  const MapCloud::ConstPtr cloud = mapCloudOf(corners, 0.01);
  for (const double voxel_m : {0.01, 0.013, 0.017, 0.02, 0.023}) {
    EXPECT_EQ(PagePoints(*cloud, voxel_m, 4).size(), 1U) << voxel_m;
  }
}

TEST(PagePoints, OneOrNoPointAndManyKeyframesFit) {
  const MapCloud none;
  EXPECT_EQ(PagePoints(none, 0.01).size(), 0U);
  const MapCloud::ConstPtr one = mapCloudOf({{{1, 2, 3}, 4.0F, 1, 200'000}}, 0.01);
  const PagePoints page(*one, 0.01);
  ASSERT_EQ(page.size(), 1U);
  EXPECT_EQ(page.origin_m(), Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(page.keyframeStep(), 4U);
  EXPECT_EQ(page.at(0).keyframe, 50'000);
  EXPECT_EQ(page.at(0).confidence, 255);
  EXPECT_EQ(page.at(0).cell[0], 0);
  for (const std::uint32_t last : {65'535U, 65'536U}) {
    const MapCloud::ConstPtr two = mapCloudOf({{{0, 0, 0}, 1, 1, 0}, {{1, 0, 0}, 1, 1, last}}, 1);
    EXPECT_EQ(PagePoints(*two, 0.01).keyframeStep(), last == 65'536 ? 2U : 1U);
  }
  std::string bytes;
  PagePoint{{0x0102, 3, 0x0405}, 6, 7, 0x0809}.appendTo(bytes);
  EXPECT_THAT(bytes, testing::ElementsAre(2, 1, 3, 0, 5, 4, 6, 7, 9, 8));
}

TEST(KeyframePictures, KeepEverySecondOneWhereTheyAreTooLarge) {
  const cv::Mat1f depth(260, 720, 2.0F);
  const cv::Mat_<cv::Vec2i> events(260, 720, cv::Vec2i(0, 1));
  KeyframePictures pictures({}, 9000);
  for (int i = 0; i < 100; ++i) pictures.add(depth, events);
  std::size_t bytes = 0;
  std::set<std::size_t> numbers;
  for (const auto& [number, picture] : pictures.pictures()) {
    bytes += picture.depth.size() + picture.events.size();
    numbers.insert(number);
  }
  EXPECT_LE(bytes, 9000U);
  ASSERT_GE(numbers.size(), 2U);
  const std::size_t stride = *std::next(numbers.begin());
  EXPECT_GT(stride, 1U);
  for (std::size_t n = 0, i = 0; n < 100; n += stride, ++i) EXPECT_EQ(numbers.count(n), 1U) << n;
  EXPECT_EQ(numbers.size(), (99 / stride) + 1);
}

TEST(KeyframePictures, JoinBlocksOfPixelsToTheNearestDepthAndTheSumOfEvents) {
  cv::Mat1f depth(2, 2 * KeyframePictures::kMaxWidth, 0.0F);
  cv::Mat_<cv::Vec2i> events = cv::Mat_<cv::Vec2i>::zeros(depth.size());
  depth(1, 10) = 4;
  depth(0, 11) = 2;
  events(0, 20) = {1, 0};
  events(1, 21) = {0, 2};
  const int last = KeyframePictures::kMaxWidth - 1;
  events(1, 2 * last + 1) = {3, 0};
  const DepthPlanesOptions limits;
  KeyframePictures pictures(limits);
  pictures.add(depth, events);
  pictures.add(depth, {});
  const auto decoded = [](const std::string& png) { return cv::Mat3b(decodePicture(png)); };
  const cv::Vec3b white(255, 255, 255);
  const cv::Mat3b depth_picture = decoded(pictures.pictures().at(0).depth);
  const cv::Mat3b event_picture = decoded(pictures.pictures().at(0).events);
  ASSERT_EQ(depth_picture.size(), cv::Size(KeyframePictures::kMaxWidth, 1));
  ASSERT_EQ(event_picture.size(), depth_picture.size());
  EXPECT_EQ(depth_picture(0, 5),
            depthPicture((cv::Mat1f(1, 1) << 2), limits, Palette::kBrightToDark)(0, 0));
  EXPECT_EQ(depth_picture(0, 10), white);
  EXPECT_EQ(event_picture(0, 10), eventPicture(cv::Mat_<cv::Vec2i>(1, 1, cv::Vec2i(1, 2)))(0, 0));
  EXPECT_EQ(event_picture(0, last), eventPicture(cv::Mat_<cv::Vec2i>(1, 1, cv::Vec2i(3, 0)))(0, 0));
  EXPECT_EQ(event_picture(0, 5), white);
  EXPECT_THAT(pictures.pictures().at(1).events, IsEmpty());
}

/// Returns the data of a page by the id of their script element, as a browser reads it.
std::string dataOf(const std::string& page, const std::string& id) {
  const std::size_t tag = page.find("<script id=\"" + id + "\"");
  const std::size_t begin = page.find('>', tag) + 1;
  return page.substr(begin, page.find("</script", begin) - begin);
}

TEST(MapPage, TextsCannotEndTheirPartOfThePage) {
  const std::string mean = "\"'</script><!--<script>alert(1)</ScRiPt>&amp;\\";
  const MapCloud::ConstPtr points =
      mapCloudOf({{{1, 2, 3}, 4, 1, 0}, {{1, 2, 65538}, 8, 1, 70'000}, {{2, 2, 3}, 2, 1, 1}}, 1e9);
  const std::vector<StampedPose> trajectory = {{1'500'000'000, {{0.8, 0, 0.6, 0}, {4, 5, 6}}}};
  KeyframePictures pictures({});
  pictures.add(cv::Mat1f(2, 2, 1.0F), cv::Mat_<cv::Vec2i>(2, 2, cv::Vec2i(1, 0)));
  const MapPage page = {mean,
                        *points,
                        0.01,
                        trajectory,
                        pictures,
                        ReferenceView{2, 3, 4, 5, 6, 7},
                        json{{"warnings", {{{"name", mean}, {"text", mean}}}}}.dump()};
  std::ostringstream stream;
  writeMapPage(stream, page);

  const std::string html = stream.str();
  EXPECT_THAT(html, Not(HasSubstr("alert(1)</")));
  const json map = json::parse(dataOf(html, "map-data"));
  json expected = json::parse(R"({"points": 3, "all_points": 3, "thinned_m": 0.0, "voxel_m": 0.01,
    "origin_m": [1.0, 2.0, 3.0], "confidence": [2.0, 4.0], "keyframe_step": 2,
    "up": [0.0, -1.0, 0.0],
    "keyframes": [{"t": "1.500000000", "p": [4.0, 5.0, 6.0], "q": [0.0, 0.6, 0.0, 0.8]}],
    "view": {"width": 2, "height": 3, "fx": 4.0, "fy": 5.0, "cx": 6.0, "cy": 7.0}})");
  expected["name"] = mean;
  expected["step_m"] = {1.0 / 65535, 0.0, 1.0};
  expected["depths_m"] = {pictures.limits().min_depth_m, pictures.limits().max_depth_m};
  EXPECT_EQ(map, expected);
  EXPECT_THAT(dataOf(html, "map-data"), Not(HasSubstr("\n"))) << "no blanks to read";
  EXPECT_EQ(json::parse(dataOf(html, "report-data"))["warnings"][0]["text"], mean);
  EXPECT_EQ(dataOf(html, "point-data").size(), 40U) << "30 bytes";
  for (const char* kind : {"depth", "events"}) {
    EXPECT_THAT(json::parse(dataOf(html, "picture-data"))["0"][kind], HasSubstr("iVBORw0KGgo"));
  }
  for (const char* mark : {"<!-- data -->", "<!-- draw.js -->", "http:", "https:"}) {
    EXPECT_THAT(html, Not(HasSubstr(mark)));
  }
}

TEST(MapPage, SaysHowManyPointsAreLeftOut) {
  const MapCloud::ConstPtr points = mapCloudOf(randomPoints(15'000, {0, 0, 0}), 0.01);
  const std::vector<StampedPose> trajectory;
  const KeyframePictures pictures({});
  for (const std::size_t limit : {100U, 15'000U}) {
    const MapPage page = {"map", *points, 0.01, trajectory, pictures, {}, "{}", limit};
    std::ostringstream stream;
    writeMapPage(stream, page);
    const json map = json::parse(dataOf(stream.str(), "map-data"));
    const PagePoints shown(*points, 0.01, limit);
    EXPECT_EQ(map["all_points"], 15'000);
    EXPECT_EQ(map["points"], shown.size());
    EXPECT_EQ(shown.size() == 15'000, limit == 15'000) << "as many as there may be";
    EXPECT_EQ(map["thinned_m"], shown.subsampled_m());
    EXPECT_FALSE(map.contains("view"));
    std::string bytes;
    for (std::size_t i = 0; i < shown.size(); ++i) shown.at(i).appendTo(bytes);
    EXPECT_EQ(dataOf(stream.str(), "point-data"), base64(bytes));
  }
}

}  // namespace
}  // namespace efm
