// SPDX-License-Identifier: BSD-3-Clause
#include "maps/io/point_cloud_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <random>
#include <set>
#include <sstream>

#include "maps/io/atomic_file.h"
#include "maps/io/pcd_file.h"
#include "maps/io/ply_file.h"

namespace efm {
namespace {

using testing::AllOf;
using testing::EndsWith;
using testing::HasSubstr;

class PointCloudFile : public testing::Test {
 protected:
  void SetUp() override {
    const std::string name = testing::UnitTest::GetInstance()->current_test_info()->name();
    folder_ = std::filesystem::temp_directory_path() / ("efm_" + name);
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  int runInFolder(const std::string& command) const {
    return std::system(
        ("cd '" + folder_.string() + "' && " + command + " >/dev/null 2>&1").c_str());
  }
  std::size_t filesInFolder() const {
    return static_cast<std::size_t>(
        std::distance(std::filesystem::directory_iterator(folder_), {}));
  }

  PointCloudContent contentOf(const std::string& name, const std::string& bytes) const {
    std::ofstream(folder_ / name, std::ios::binary) << bytes;
    return readPointCloud(folder_ / name);
  }

  /// The error without the path, which must be there.
  static std::string refusalOf(const std::filesystem::path& path) {
    try {
      readPointCloud(path);
    } catch (const std::runtime_error& error) {
      const std::string start = "cannot read " + path.string() + ": ";
      EXPECT_EQ(std::string(error.what()).substr(0, start.size()), start);
      return std::string(error.what()).substr(start.size());
    }
    return "accepted";
  }
  std::string refusalOf(const std::string& name, const std::string& bytes) const {
    std::ofstream(folder_ / name, std::ios::binary) << bytes;
    return refusalOf(folder_ / name);
  }
  /// The error of writing one point, or none.
  static std::string writeRefusalOf(const std::filesystem::path& path, const CloudPoint& point) {
    try {
      writePcd(path, *mapCloudOf({{{1, 2, 3}, 1.0F}, point}, 0.01));
    } catch (const std::runtime_error& error) {
      return error.what();
    }
    return "accepted";
  }

  std::filesystem::path folder_;
};

PointCloudContent parse(const std::filesystem::path& name, const std::string& bytes) {
  return name.extension() == ".ply" ? parsePly(bytes) : parsePcd(bytes);
}

/// The bytes of a number, in the order of this machine or the other.
template <typename Number>
std::string raw(Number number, bool swapped = false) {
  std::string bytes(sizeof(number), '\0');
  std::memcpy(bytes.data(), &number, sizeof(number));
  return swapped ? std::string(bytes.rbegin(), bytes.rend()) : bytes;
}

std::string rawFloats(const std::vector<float>& numbers, bool swapped = false) {
  std::string bytes;
  for (const float number : numbers) bytes += raw(number, swapped);
  return bytes;
}

std::vector<CloudPoint> plainPoints(int count) {
  std::vector<CloudPoint> points;
  for (int i = 0; i < count; ++i) points.push_back({{i * 0.1, -i / 3.0, 3.5}, i * 0.7F + 1});
  return points;
}

/// LZF without compression: runs of up to 32 bytes, each after its length minus 1.
std::string asLzf(const std::string& bytes) {
  std::string packed;
  for (std::size_t i = 0; i < bytes.size(); i += 32) {
    const std::string run = bytes.substr(i, 32);
    packed += static_cast<char>(run.size() - 1) + run;
  }
  return packed;
}

/// The same points as a file of each format and encoding: names and bytes. All but the first have
/// the fields of maps before they had support and sigma.
std::vector<std::pair<std::string, std::string>> filesOf(const std::vector<CloudPoint>& points) {
  std::ostringstream pcd;
  writePcdTo(pcd, *mapCloudOf(points, 1e9));
  const std::string count = std::to_string(points.size());
  const std::string pcd_header =
      "VERSION 0.7\nFIELDS x y z intensity\nSIZE 4 4 4 4\nTYPE F F F F\nCOUNT 1 1 1 1\nWIDTH " +
      count + "\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS " + count + "\nDATA ";
  const std::string ply_header = " 1.0\nelement vertex " + count +
                                 "\nproperty float x\nproperty float y\nproperty float z\n"
                                 "property float intensity\nend_header\n";
  std::ostringstream text;
  text.precision(9);
  std::vector<std::vector<float>> columns(4);
  std::string by_point;
  for (const CloudPoint& point : points) {
    const Eigen::Vector3f p = point.p_world.cast<float>();
    text << p.x() << ' ' << p.y() << ' ' << p.z() << ' ' << point.confidence << '\n';
    for (int axis = 0; axis < 3; ++axis) columns[axis].push_back(p[axis]);
    by_point += rawFloats({p.x(), p.y(), p.z(), point.confidence});
    columns[3].push_back(point.confidence);
  }
  std::string by_field;
  for (const std::vector<float>& column : columns) by_field += rawFloats(column);
  const std::string packed = asLzf(by_field);
  return {{"binary.pcd", pcd.str()},
          {"text.pcd", pcd_header + "ascii\n" + text.str()},
          {"compressed.pcd", pcd_header + "binary_compressed\n" +
                                 raw(static_cast<std::uint32_t>(packed.size())) +
                                 raw(static_cast<std::uint32_t>(by_field.size())) + packed},
          {"older.pcd", pcd_header + "binary\n" + by_point},
          {"binary.ply", "ply\nformat binary_little_endian" + ply_header + by_point},
          {"text.ply", "ply\nformat ascii" + ply_header + text.str()}};
}

void expectNear(const std::vector<CloudPoint>& read, const std::vector<CloudPoint>& points,
                double relative) {
  ASSERT_EQ(read.size(), points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    for (int axis = 0; axis < 3; ++axis) {
      const auto expected = static_cast<float>(points[i].p_world[axis]);
      EXPECT_NEAR(read[i].p_world[axis], expected, std::abs(expected) * relative);
    }
    EXPECT_NEAR(read[i].confidence, points[i].confidence, points[i].confidence * relative);
    EXPECT_EQ(read[i].support, 1U);
  }
}

TEST_F(PointCloudFile, AColouredPlyKeepsAllDigitsAndHasTheColours) {
  const std::vector<CloudPoint> points = {{{450'000.125, 5'200'000.25, -3}, 17.5F, 4},
                                          {{449'999.5, 5'200'001, 2}, 0.25F, 70'000}};
  writeColouredPly(folder_ / "map.ply", *mapCloudOf(points, 0.01), {{1, 2, 3}, {254, 255, 0}});
  const PointCloudContent content = readPointCloud(folder_ / "map.ply");
  ASSERT_EQ(content.points.size(), 2U);
  for (int i = 0; i < 2; ++i) EXPECT_EQ(content.points[i].p_world, points[i].p_world);
  // The last bytes of a vertex, which the reader leaves out.
  const std::string bytes = readBytes(folder_ / "map.ply");
  EXPECT_THAT(bytes, AllOf(HasSubstr("property uchar red\nproperty uchar green\nproperty uchar blue"
                                     "\nproperty float confidence\nproperty uint support\n"),
                           EndsWith(std::string("\xFE\xFF\0", 3) + raw(0.25F) + raw(70'000U))));
  EXPECT_EQ(filesInFolder(), 1U);
  EXPECT_THROW(
      writeColouredPly(folder_ / "map.ply", *mapCloudOf({{{1, 2, NAN}, 1, 1}}, 0.01), {{0, 0, 0}}),
      std::runtime_error);
  EXPECT_EQ(readPointCloud(folder_ / "map.ply").points.size(), 2U) << "the earlier file stays";
}

TEST_F(PointCloudFile, IsReadByThePclProgramsAndTheirFilesAreReadBack) {
  if (std::system("command -v pcl_convert_pcd_ascii_binary pcl_pcd2ply >/dev/null") != 0) {
    GTEST_SKIP() << "the package pcl-tools is not installed";
  }
  const std::vector<CloudPoint> points = plainPoints(1000);
  std::vector<CloudPoint> with_sigma = points;
  for (CloudPoint& point : with_sigma) point.sigma = 0.25F;
  writePcd(folder_ / "map.pcd", *mapCloudOf(with_sigma, 1e9));
  EXPECT_EQ(filesInFolder(), 1U) << "no temporary file stays";
  ASSERT_EQ(runInFolder("pcl_convert_pcd_ascii_binary map.pcd a.pcd 0"), 0);
  ASSERT_EQ(runInFolder("pcl_convert_pcd_ascii_binary map.pcd c.pcd 2"), 0);
  ASSERT_EQ(runInFolder("pcl_pcd2ply -format 0 map.pcd a.ply"), 0);
  ASSERT_EQ(runInFolder("pcl_pcd2ply -format 1 map.pcd b.ply"), 0);
  expectNear(readPointCloud(folder_ / "a.pcd").points, points, 1e-6);
  expectNear(readPointCloud(folder_ / "a.ply").points, points, 1e-6);
  expectNear(readPointCloud(folder_ / "b.ply").points, points, 0);
  // Their filters keep the fields: the mean of the points of a voxel, support as they count it.
  ASSERT_EQ(runInFolder("pcl_voxel_grid map.pcd v.pcd -leaf 5,5,5"), 0);
  ASSERT_EQ(runInFolder("pcl_convert_pcd_ascii_binary v.pcd va.pcd 0"), 0);
  EXPECT_LT(readPointCloud(folder_ / "va.pcd").points.size(), 200U);
  EXPECT_THAT(readBytes(folder_ / "va.pcd"),
              AllOf(HasSubstr("\nFIELDS x y z intensity support sigma\n"), HasSubstr(" 1 0.25\n")));
  // This program pads the compressed file to a whole page.
  std::string bytes = readBytes(folder_ / "c.pcd");
  const std::size_t sizes = bytes.find("compressed\n") + 11;
  std::uint32_t packed_bytes = 0;
  std::memcpy(&packed_bytes, bytes.data() + sizes, sizeof(packed_bytes));
  expectNear(parsePcd(std::string_view(bytes).substr(0, sizes + 8 + packed_bytes)).points, points,
             0);
}

/// With poses in UTM coordinates: a float has steps of 0.5 m at 5,400,000 m.
TEST_F(PointCloudFile, PointsFarFromTheOriginKeepTheirDigits) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> offset_m(-2.5, 2.5);
  std::vector<CloudPoint> points;
  while (points.size() < 4649) {
    points.push_back({{450'123 + offset_m(random), 5'400'456 + offset_m(random), 100}, 2});
  }
  const auto expectAllDigits = [&](const std::string& name, double tolerance_m) {
    const auto read = readPointCloud(folder_ / name).points;
    ASSERT_EQ(read.size(), points.size());
    std::set<double> heights;
    for (std::size_t i = 0; i < read.size(); ++i) {
      heights.insert(read[i].p_world.y());
      ASSERT_LT((read[i].p_world - points[i].p_world).norm(), tolerance_m) << name;
    }
    EXPECT_GT(heights.size(), 4000U) << name;  // of floats in the world: 11
  };
  writePcd(folder_ / "map.pcd", *mapCloudOf(points, 0.01));
  expectAllDigits("map.pcd", 1e-4);
  EXPECT_THAT(readBytes(folder_ / "map.pcd"),
              AllOf(HasSubstr("\nFIELDS x y z intensity support sigma\n"),
                    HasSubstr("\nVIEWPOINT 450000 5400000 0 1 0 0 0\n")));
  if (std::system("command -v pcl_convert_pcd_ascii_binary >/dev/null") != 0) {
    GTEST_SKIP() << "the package pcl-tools is not installed";
  }
  ASSERT_EQ(runInFolder("pcl_convert_pcd_ascii_binary map.pcd a.pcd 0"), 0);
  expectAllDigits("a.pcd", 1e-3);
  ASSERT_EQ(runInFolder("pcl_outlier_removal map.pcd o.pcd -method radius -radius 9 -min_pts 1"),
            0);
  ASSERT_EQ(runInFolder("pcl_convert_pcd_ascii_binary o.pcd oa.pcd 0"), 0);
  expectAllDigits("oa.pcd", 1e-3);
}

/// The place of a sensor, whose points may be relative to anything.
TEST_F(PointCloudFile, ViewpointsOfOtherProgramsAreNotAdded) {
  const std::string start = "VERSION 0.7\nFIELDS x y z";
  const std::string end = "WIDTH 1\nHEIGHT 1\nVIEWPOINT 10 20 30 1 0 0 0\nPOINTS 1\nDATA ascii\n";
  const auto other = contentOf("a.pcd", start + "\nSIZE 4 4 4\nTYPE F F F\n" + end + "1 2 3\n");
  EXPECT_EQ(other.points.at(0).p_world, Eigen::Vector3d(1, 2, 3));
  const std::string ours = " support sigma\nSIZE 4 4 4 4 4\nTYPE F F F U F\n";
  const auto map = contentOf("b.pcd", start + ours + end + "1 2 3 4 nan\n");
  EXPECT_EQ(map.points.at(0).p_world, Eigen::Vector3d(11, 22, 33));
  std::string wrong = end;
  wrong.replace(wrong.find("20"), 2, "x");
  EXPECT_THAT(refusalOf("c.pcd", start + ours + wrong + "1 2 3 4 nan\n"),
              HasSubstr("line 7: VIEWPOINT: expected 7 numbers"));
}

TEST_F(PointCloudFile, IsReadBackFromEachEncoding) {
  for (const int count : {0, 1000}) {
    const std::vector<CloudPoint> points = plainPoints(count);
    for (const auto& [name, bytes] : filesOf(points)) {
      SCOPED_TRACE(name);
      expectNear(parse(name, bytes).points, points, 0);
    }
  }
}

TEST_F(PointCloudFile, IsReadBackAsTheSameFloatsOfAnyMagnitude) {
  std::mt19937 random(1);
  std::vector<CloudPoint> points = {{{0, -0.0, 1e-45}, 1e-38F}};
  const auto any_float = [&random] {
    float number = std::numeric_limits<float>::quiet_NaN();
    while (!std::isfinite(number)) {
      const auto bits = static_cast<std::uint32_t>(random());
      std::memcpy(&number, &bits, sizeof(number));
    }
    return number;
  };
  while (points.size() < 5000) {
    points.push_back({{any_float(), any_float(), any_float()}, any_float()});
  }
  writePcd(folder_ / "map.pcd", *mapCloudOf(points, 1e9));
  const PointCloudContent content = readPointCloud(folder_ / "map.pcd");
  ASSERT_EQ(content.points.size(), points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    EXPECT_EQ(content.points[i].p_world, points[i].p_world.cast<float>().cast<double>());
    EXPECT_EQ(content.points[i].confidence, points[i].confidence);
  }
}

// As a simulated recording has it.
TEST_F(PointCloudFile, WithoutAnIntensityHasConfidenceOne) {
  const PointCloudContent content =
      contentOf("gt_cloud.ply",
                "ply\nformat binary_little_endian 1.0\nelement vertex 2\nproperty float x\n"
                "property float y\nproperty float z\nend_header\n" +
                    rawFloats({1, 2, 3, -4, 5.5F, 6}));

  ASSERT_EQ(content.points.size(), 2U);
  EXPECT_EQ(content.points[1].p_world, Eigen::Vector3d(-4, 5.5, 6));
  EXPECT_EQ(content.points[1].confidence, 1.0F);
}

TEST_F(PointCloudFile, DoublesAreReadInFull) {
  const double x = 1000000.123456789;
  const std::string ply_fields =
      " 1.0\nelement vertex 1\nproperty double x\nproperty float64 y\nproperty double z\n"
      "end_header\n";
  const std::string pcd =
      "FIELDS x y z\nSIZE 8 8 8\nTYPE F F F\nWIDTH 1\nHEIGHT 1\nPOINTS 1\nDATA ";
  const std::string swapped = raw(x, true) + raw(2.0, true) + raw(3.0, true);
  const std::string bytes = raw(x) + raw(2.0) + raw(3.0);
  const std::string text = "1000000.123456789 2 3\n";
  const std::vector<PointCloudContent> contents = {
      contentOf("b.ply", "ply\nformat binary_big_endian" + ply_fields + swapped),
      contentOf("l.ply", "ply\nformat binary_little_endian" + ply_fields + bytes),
      contentOf("a.ply", "ply\nformat ascii" + ply_fields + text),
      contentOf("b.pcd", pcd + "binary\n" + bytes),
      contentOf("a.pcd", pcd + "ascii\n" + text),
  };

  for (const PointCloudContent& content : contents) {
    ASSERT_EQ(content.points.size(), 1U);
    EXPECT_EQ(content.points[0].p_world, Eigen::Vector3d(x, 2, 3));
  }
}

TEST_F(PointCloudFile, OtherFieldsAndElementsAreIgnored) {
  const std::string before = "element camera 2\nproperty uchar id\nproperty double f\n";
  const std::string vertex =
      "element vertex 2\nproperty uchar red\nproperty float z\nproperty short intensity\n"
      "property float y\nproperty float x\n";
  const std::string after = "element face 1\nproperty list uchar int vertex_indices\nend_header\n";
  const PointCloudContent text = contentOf(
      "a.ply", "ply\r\nformat ascii 1.0\r\ncomment by hand\r\nobj_info x\r\n" + before + vertex +
                   after + "1 0.5\n2 0.5\n255 3 -7 2 1\n\n0 6 8 5 4\r\n3 0 1 1\n");
  const PointCloudContent binary = contentOf(
      "b.ply", "ply\nformat binary_big_endian 1.0\n" + before + vertex + after +
                   std::string(18, 'c') + "r" + raw(3.0F, true) + raw(std::int16_t{-7}, true) +
                   rawFloats({2, 1}, true) + "r" + raw(6.0F, true) + raw(std::int16_t{8}, true) +
                   rawFloats({5, 4}, true) + "faces");
  // Points of four bytes of padding, x, a pair of shorts, y and z.
  const PointCloudContent pcd =
      contentOf("c.pcd",
                "VERSION 0.7\nFIELDS _ x pair y z intensity\nSIZE 1 4 2 4 4 1\nTYPE U F U F F I\n"
                "COUNT 4 1 2 1 1 1\nWIDTH 1\nHEIGHT 2\nVIEWPOINT 1 2 3 1 0 0 0\nPOINTS 2\n"
                "DATA binary\n" +
                    ("____" + raw(1.0F)) + "pair" + rawFloats({2, 3}) + raw(std::int8_t{-7}) +
                    ("____" + raw(4.0F)) + "pair" + rawFloats({5, 6}) + raw(std::int8_t{8}));

  for (const PointCloudContent& content : {text, binary, pcd}) {
    ASSERT_EQ(content.points.size(), 2U);
    EXPECT_EQ(content.points[0].p_world, Eigen::Vector3d(1, 2, 3));
    EXPECT_EQ(content.points[0].confidence, -7.0F);
    EXPECT_EQ(content.points[1].p_world, Eigen::Vector3d(4, 5, 6));
    EXPECT_EQ(content.points[1].confidence, 8.0F);
  }
}

TEST_F(PointCloudFile, PointsThatAreNotFiniteAreCounted) {
  const PointCloudContent content =
      contentOf("holes.pcd",
                "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nWIDTH 2\nHEIGHT 2\nPOINTS 4\nDATA ascii\n"
                "nan nan nan\n1 2 3\n1 -inf 3\n4 5 1e-60\n");

  EXPECT_EQ(content.non_finite, 2U);
  ASSERT_EQ(content.points.size(), 2U);
  EXPECT_EQ(content.points[1].p_world, Eigen::Vector3d(4, 5, 0));
}

TEST_F(PointCloudFile, CutShortAnywhereIsAnError) {
  for (const auto& [name, bytes] : filesOf(plainPoints(3))) {
    for (std::size_t length = 0; length < bytes.size(); ++length) {
      EXPECT_THROW(parse(name, bytes.substr(0, length)), std::runtime_error)
          << name << " after " << length << " of " << bytes.size() << " bytes";
    }
  }
}

TEST_F(PointCloudFile, DamagedAnywhereIsAnErrorOrAsManyPoints) {
  std::mt19937 random(3);
  for (const auto& [name, bytes] : filesOf(plainPoints(40))) {
    for (int i = 0; i < 2000; ++i) {
      std::string damaged = bytes;
      damaged[random() % damaged.size()] = static_cast<char>(random());
      try {
        const PointCloudContent content = parse(name, damaged);
        EXPECT_EQ(content.points.size() + content.non_finite, 40U);
      } catch (const std::runtime_error&) {
      }
    }
  }
}

TEST_F(PointCloudFile, ThatIsMalformedSaysWhereAndWhatWasExpected) {
  const std::string pcd = "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nWIDTH 1\nHEIGHT 1\nPOINTS 1\n";
  const std::string ply = "ply\nformat ascii 1.0\nelement vertex 1\n";
  const std::string xyz = "property float x\nproperty float y\nproperty float z\n";
  struct Case {
    const char* name;
    std::string bytes;
    std::vector<std::string> parts;
  };
  for (const Case& wrong : std::vector<Case>{
           {"a.pcd", "", {"line 1: the file ends: expected a line of a PCD header"}},
           {"b.pcd", "FIELDS x y", {"line 1: 'FIELDS x y', then the file ends"}},
           {"c.pcd", "ply\n", {"line 1: 'ply': expected one of VERSION FIELDS"}},
           {"d.pcd", pcd + "DATA ascii\n1 2 banana\n", {"line 8: z 'banana': expected a number"}},
           {"e.pcd", pcd + "DATA ascii\n1 2\n", {"line 8: point 1 has 2 numbers: expected 3"}},
           {"f.pcd", pcd + "DATA ascii\n1 2 3\n4 5 6\n", {"byte", "more bytes: expected the end"}},
           {"g.pcd", pcd + "DATA ascii\n", {"line 8: the file ends: expected point 1 of 1"}},
           {"h.pcd", pcd + "DATA ascii\n1 2 3", {"line 8: '1 2 3', then the file ends"}},
           {"i.pcd", pcd + "DATA ascii\n1 2 1e39\n", {"line 8: z '1e39': expected a number"}},
           {"j.pcd",
            pcd + "DATA binary\n12345678901",
            {"11 bytes are left: expected 1 points of 12"}},
           {"k.pcd", pcd + "DATA binary\n1234567890123", {"1 more bytes: expected the end"}},
           {"l.pcd", pcd + "DATA zip\n", {"line 7: DATA 'zip': expected ascii, binary or"}},
           {"m.pcd",
            "FIELDS x y\nSIZE 4 4\nTYPE F F\nPOINTS 0\nDATA ascii\n",
            {"no field z: expected x, y and z among the fields (x, y)"}},
           {"n.pcd",
            "FIELDS x y z\nSIZE 4 4\nTYPE F F F\nPOINTS 0\nDATA ascii\n",
            {"line 2: 2 values: expected 3, as many as FIELDS has"}},
           {"o.pcd",
            "FIELDS x y z\nSIZE 4 4 3\nTYPE F F F\nPOINTS 0\nDATA ascii\n",
            {"line 3: TYPE 'F' of SIZE '3': expected I or U"}},
           {"p.pcd",
            "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nDATA ascii\n",
            {"line 4: DATA ends the header: expected POINTS before it"}},
           {"q.pcd",
            "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nWIDTH 2\nHEIGHT 3\nPOINTS 5\nDATA ascii\n",
            {"line 6: POINTS 5: expected WIDTH x HEIGHT, 2 x 3"}},
           {"r.pcd",
            "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nPOINTS -1\nDATA ascii\n",
            {"line 4: '-1': expected a whole number from 0 on"}},
           {"s.pcd",
            "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nPOINTS 18446744073709551615\nDATA binary\n",
            {"0 bytes are left: expected 18446744073709551615 points of 12 bytes"}},
           {"t.pcd",
            "FIELDS x y z x\nSIZE 4 4 4 4\nTYPE F F F F\nPOINTS 0\nDATA ascii\n",
            {"field x is there twice"}},
           {"u.pcd", "FIELDS x y z\nFIELDS x y z\n", {"line 2: FIELDS again: expected it once"}},
           {"v.pcd",
            pcd + "DATA binary_compressed\n" + raw(12U) + raw(24U) + "123456789012",
            {"24 bytes when decompressed: expected 1 points of 12 bytes"}},
           {"w.pcd",
            pcd + "DATA binary_compressed\n" + raw(12U) + raw(12U) +
                "\377\377\377\377\377\377\377\377\377\377\377\377",
            {"12 compressed bytes: expected 12 when decompressed: is the file damaged?"}},
           {"a.ply", "PLY\n", {"line 1: not a PLY file: expected ply"}},
           {"b.ply", "ply\nformat ascii 2.0\n", {"line 2: not a known format"}},
           {"c.ply", ply + "property float\n", {"line 4: expected property TYPE NAME"}},
           {"d.ply", ply + "property half x\n", {"line 4: type 'half': expected char"}},
           {"e.ply", ply + "end_header\n", {"no field x"}},
           {"f.ply",
            ply + xyz + "property list uchar int l\nend_header\n1 2 3 0\n",
            {"line 7: a list in element vertex"}},
           {"g.ply", ply + xyz + "end_header\n1 2 x\n", {"line 8: z 'x': expected a number"}},
           {"h.ply", ply + xyz, {"line 7: the file ends: expected a line of a PLY header"}},
           {"i.ply",
            "ply\nformat ascii 1.0\nend_header\n",
            {"line 3: end_header without an element vertex"}},
           {"j.ply", ply + xyz + "end\033[2J\n", {"line 7: 'end\\x1b[2J': expected comment"}},
           {"k.ply",
            "ply\nformat binary_little_endian 1.0\nelement face 1\nproperty list uchar int l\n"
            "element vertex 1\n" +
                xyz + "end_header\n",
            {"line 4: a list in element face: expected lists behind element vertex"}},
           {"cloud.xyz", "1 2 3\n", {"extension '.xyz': expected .pcd or .ply"}},
       }) {
    const std::string refusal = refusalOf(wrong.name, wrong.bytes);
    for (const std::string& part : wrong.parts) EXPECT_THAT(refusal, HasSubstr(part)) << wrong.name;
  }
}

TEST_F(PointCloudFile, ThatIsMissingOrAFolderIsAnError) {
  std::filesystem::create_directories(folder_ / "folder.ply");
  EXPECT_EQ(refusalOf(folder_ / "nowhere.pcd"), "there is no such file");
  EXPECT_EQ(refusalOf(folder_ / "folder.ply"), "it is not a regular file");
}

TEST_F(PointCloudFile, WithAPointThatAFloatCannotHoldIsNotWritten) {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  for (const CloudPoint& point :
       {CloudPoint{{1e39, 0, 0}, 1.0F}, {{0, std::nan(""), 0}, 1.0F}, {{0, 0, 0}, kInfinity}}) {
    EXPECT_THAT(writeRefusalOf(folder_ / "map.pcd", point),
                AllOf(HasSubstr("map.pcd: point 1 ("), HasSubstr("expected finite numbers")));
  }
  EXPECT_EQ(filesInFolder(), 0U);
}

TEST_F(PointCloudFile, ThatCannotBeWrittenIsAnErrorAndLeavesNoHalfFile) {
  const CloudPoint point{{1, 2, 3}, 1.0F};
  EXPECT_THAT(writeRefusalOf(folder_ / "nowhere" / "map.pcd", point), HasSubstr("nowhere/map.pcd"));
  std::filesystem::create_directories(folder_ / "map.pcd" / "inside");
  EXPECT_THAT(writeRefusalOf(folder_ / "map.pcd", point), HasSubstr("it is a folder"));
  EXPECT_EQ(filesInFolder(), 1U);
}

}  // namespace
}  // namespace efm
