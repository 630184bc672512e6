// SPDX-License-Identifier: BSD-3-Clause
#include "maps/io/point_cloud_file.h"

#include <gmock/gmock.h>

#include <cmath>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <limits>
#include <random>
#include <set>
#include <sstream>

#include "mapping/base/atomic_file.h"
#include "test/plugin/temporary_folder.h"

namespace efm {
namespace {

using testing::AllOf;
using testing::EndsWith;
using testing::HasSubstr;

class PointCloudFile : public TemporaryFolder {
 protected:
  int runInFolder(const std::string& command) const {
    return std::system(
        ("cd '" + folder().string() + "' && " + command + " >/dev/null 2>&1").c_str());
  }
  std::size_t filesInFolder() const {
    return static_cast<std::size_t>(
        std::distance(std::filesystem::directory_iterator(folder()), {}));
  }
};

PointCloudContent parse(const std::filesystem::path& name, const std::string& bytes) {
  return name.extension() == ".ply" ? parsePly(bytes) : parsePcd(bytes);
}

/// Returns the bytes of a number in this machine's or in the opposite order.
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

/// Returns LZF without compression: runs of up to 32 bytes, each after its length minus 1.
std::string asLzf(const std::string& bytes) {
  std::string packed;
  for (std::size_t i = 0; i < bytes.size(); i += 32) {
    const std::string run = bytes.substr(i, 32);
    packed += static_cast<char>(run.size() - 1) + run;
  }
  return packed;
}

/// Returns names and bytes of files with the same points, one per format and encoding. All files
/// but the first have the fields of older maps, without support and sigma.
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
  const MapCloud::Ptr cloud = mapCloudOf(points, 0.01);
  (*cloud)[1].first_keyframe = 1;
  (*cloud)[1].probability = 0.75F;
  const std::vector<StampedPose> views = {{0, {{}, {450'000.125, 5'200'000.25, 7}}},
                                          {1, {{}, {449'999.5, 5'200'006, 2}}}};
  std::ofstream file(folder() / "map.ply", std::ios::binary);
  writePlyTo(file, *cloud, {{1, 2, 3}, {254, 255, 0}}, views);
  file.close();
  const PointCloudContent content = readPointCloud(folder() / "map.ply");
  ASSERT_EQ(content.points.size(), 2U);
  for (int i = 0; i < 2; ++i) EXPECT_EQ(content.points[i].p_world, points[i].p_world);
  // The reader ignores the last bytes of a vertex.
  const std::string bytes = readBytes(folder() / "map.ply");
  EXPECT_THAT(
      bytes, AllOf(HasSubstr("property uchar red\nproperty uchar green\nproperty uchar blue"
                             "\nproperty float confidence\nproperty uint support\n"
                             "property float probability\n"),
                   HasSubstr(raw(-3.0) + raw(0.0F) + raw(0.0F) + raw(1.0F)),
                   EndsWith(raw(2.0) + raw(0.0F) + raw(1.0F) + raw(0.0F) +
                            std::string("\xFE\xFF\0", 3) + raw(0.25F) + raw(70'000U) + raw(0.75F))))
      << "normals from each point to its first keyframe";
  std::ostringstream stream;
  EXPECT_THAT(messageOf([&] {
                writePlyTo(stream, *mapCloudOf({{{0, 0, 0}, INFINITY}}, 0.01), {{0, 0, 0}});
              }),
              HasSubstr("point 0 ("));
}

TEST_F(PointCloudFile, IsReadByThePclProgramsAndTheirFilesAreReadBack) {
  if (std::system("command -v pcl_convert_pcd_ascii_binary pcl_pcd2ply >/dev/null") != 0) {
    GTEST_SKIP() << "the package pcl-tools is not installed";
  }
  const std::vector<CloudPoint> points = plainPoints(1000);
  std::vector<CloudPoint> with_sigma = points;
  for (CloudPoint& point : with_sigma) point.sigma = point.probability = 0.25F;
  writePcd(folder() / "map.pcd", *mapCloudOf(with_sigma, 1e9));
  EXPECT_EQ(filesInFolder(), 1U) << "no temporary file stays";
  ASSERT_EQ(runInFolder("pcl_convert_pcd_ascii_binary map.pcd a.pcd 0"), 0);
  ASSERT_EQ(runInFolder("pcl_convert_pcd_ascii_binary map.pcd c.pcd 2"), 0);
  ASSERT_EQ(runInFolder("pcl_pcd2ply -format 0 map.pcd a.ply"), 0);
  ASSERT_EQ(runInFolder("pcl_pcd2ply -format 1 map.pcd b.ply"), 0);
  expectNear(readPointCloud(folder() / "a.pcd").points, points, 1e-6);
  expectNear(readPointCloud(folder() / "a.ply").points, points, 1e-6);
  expectNear(readPointCloud(folder() / "b.ply").points, points, 0);
  // The PCL filters keep the fields: means of the points of a voxel, and PCL's own support.
  ASSERT_EQ(runInFolder("pcl_voxel_grid map.pcd v.pcd -leaf 5,5,5"), 0);
  ASSERT_EQ(runInFolder("pcl_convert_pcd_ascii_binary v.pcd va.pcd 0"), 0);
  EXPECT_LT(readPointCloud(folder() / "va.pcd").points.size(), 200U);
  EXPECT_THAT(readBytes(folder() / "va.pcd"),
              AllOf(HasSubstr("\nFIELDS x y z intensity support sigma probability\n"),
                    HasSubstr(" 1 0.25 0.25\n")));
  // pcl_convert_pcd_ascii_binary pads the compressed file to a whole page.
  std::string bytes = readBytes(folder() / "c.pcd");
  const std::size_t sizes = bytes.find("compressed\n") + 11;
  std::uint32_t packed_bytes = 0;
  std::memcpy(&packed_bytes, bytes.data() + sizes, sizeof(packed_bytes));
  expectNear(parsePcd(std::string_view(bytes).substr(0, sizes + 8 + packed_bytes)).points, points,
             0);
}

/// Poses in UTM coordinates: a float has steps of 0.5 m at 5,400,000 m.
TEST_F(PointCloudFile, PointsFarFromTheOriginKeepTheirDigits) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> offset_m(-2.5, 2.5);
  std::vector<CloudPoint> points;
  while (points.size() < 4649) {
    points.push_back({{450'123 + offset_m(random), 5'400'456 + offset_m(random), 100}, 2});
  }
  const auto expectAllDigits = [&](const std::string& name, double tolerance_m) {
    const auto read = readPointCloud(folder() / name).points;
    ASSERT_EQ(read.size(), points.size());
    std::set<double> heights;
    for (std::size_t i = 0; i < read.size(); ++i) {
      heights.insert(read[i].p_world.y());
      ASSERT_LT((read[i].p_world - points[i].p_world).norm(), tolerance_m) << name;
    }
    EXPECT_GT(heights.size(), 4000U) << name;  // floats in the world: 11
  };
  writePcd(folder() / "map.pcd", *mapCloudOf(points, 0.01));
  expectAllDigits("map.pcd", 1e-4);
  EXPECT_THAT(readBytes(folder() / "map.pcd"),
              AllOf(HasSubstr("\nFIELDS x y z intensity support sigma probability\n"),
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

/// Other programs store the pose of a sensor there. Their points may be relative to any frame.
TEST_F(PointCloudFile, ViewpointsOfOtherProgramsAreNotAdded) {
  const std::string start = "VERSION 0.7\nFIELDS x y z";
  const std::string end = "WIDTH 1\nHEIGHT 1\nVIEWPOINT 10 20 30 1 0 0 0\nPOINTS 1\nDATA ascii\n";
  const auto other = parse("a.pcd", start + "\nSIZE 4 4 4\nTYPE F F F\n" + end + "1 2 3\n");
  EXPECT_EQ(other.points.at(0).p_world, Eigen::Vector3d(1, 2, 3));
  const std::string ours = " support sigma\nSIZE 4 4 4 4 4\nTYPE F F F U F\n";
  const auto map = parse("b.pcd", start + ours + end + "1 2 3 4 nan\n");
  EXPECT_EQ(map.points.at(0).p_world, Eigen::Vector3d(11, 22, 33));
  std::string wrong = end;
  wrong.replace(wrong.find("20"), 2, "x");
  EXPECT_THAT(messageOf([&] { parsePcd(start + ours + wrong + "1 2 3 4 nan\n"); }),
              HasSubstr("line 7: VIEWPOINT: expected 7 numbers"));
  wrong.replace(wrong.find(" x 30 1 0 0 0"), 13, " 20");
  EXPECT_THAT(messageOf([&] { parsePcd(start + ours + wrong + "1 2 3 4 nan\n"); }),
              HasSubstr("line 7: VIEWPOINT: expected 7 numbers"));
}

TEST_F(PointCloudFile, IsReadBackFromEachEncoding) {
  for (const int count : {0, 1000}) {
    std::vector<CloudPoint> points = plainPoints(count);
    if (count > 0) points.push_back({{-0.0, 1e-45, -3e38}, 1e-38F});  // of any magnitude
    for (const auto& [name, bytes] : filesOf(points)) {
      SCOPED_TRACE(name);
      expectNear(parse(name, bytes).points, points, 0);
    }
  }
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
      parse("b.ply", "ply\nformat binary_big_endian" + ply_fields + swapped),
      parse("l.ply", "ply\nformat binary_little_endian" + ply_fields + bytes),
      parse("a.ply", "ply\nformat ascii" + ply_fields + text),
      parse("b.pcd", pcd + "binary\n" + bytes),
      parse("a.pcd", pcd + "ascii\n" + text),
  };

  for (const PointCloudContent& content : contents) {
    ASSERT_EQ(content.points.size(), 1U);
    EXPECT_EQ(content.points[0].p_world, Eigen::Vector3d(x, 2, 3));
    EXPECT_EQ(content.points[0].confidence, 1.0F) << "without an intensity";
  }
}

TEST_F(PointCloudFile, NumbersOfEachTypeAreRead) {
  struct Type {
    std::string pcd;
    std::vector<std::string> ply;
    std::string bytes;
    float value;
  };
  const Type types[] = {
      {"I 1", {"char", "int8"}, raw(std::int8_t{-7}), -7},
      {"U 1", {"uchar", "uint8"}, raw(std::uint8_t{200}), 200},
      {"I 2", {"short", "int16"}, raw(std::int16_t{-300}), -300},
      {"U 2", {"ushort", "uint16"}, raw(std::uint16_t{60'000}), 60'000},
      {"I 4", {"int", "int32"}, raw(-70'000), -70'000},
      {"U 4", {"uint", "uint32"}, raw(4'000'000'000U), 4e9F},
      {"I 8", {}, raw(std::int64_t{-5'000'000'000}), -5e9F},
      {"U 8", {}, raw(std::uint64_t{1} << 63U), 9223372036854775808.0F},
      {"F 4", {"float", "float32"}, raw(-2.5F), -2.5F},
      {"F 8", {"double", "float64"}, raw(0.25), 0.25F},
  };
  const std::string xyz = rawFloats({1, 2, 3});
  for (const Type& type : types) {
    std::ostringstream text;
    text.precision(20);
    text << "1 2 3 " << type.value << "\n";
    std::vector<PointCloudContent> contents;
    const std::string pcd = "FIELDS x y z intensity\nTYPE F F F " + type.pcd.substr(0, 1) +
                            "\nSIZE 4 4 4 " + type.pcd.substr(2) + "\nPOINTS 1\nDATA ";
    contents.push_back(parsePcd(pcd + "binary\n" + xyz + type.bytes));
    contents.push_back(parsePcd(pcd + "ascii\n" + text.str()));
    for (const std::string& name : type.ply) {
      const std::string ply =
          " 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float "
          "z\nproperty " +
          name + " intensity\nend_header\n";
      contents.push_back(parsePly("ply\nformat binary_little_endian" + ply + xyz + type.bytes));
      contents.push_back(parsePly("ply\nformat ascii" + ply + text.str()));
    }
    for (const PointCloudContent& content : contents) {
      EXPECT_EQ(content.points.at(0).confidence, type.value) << type.pcd;
    }
    if (type.pcd[0] == 'F') continue;
    for (const char* wrong : {"1 2 3 0.5\n", "1 2 3 1e3\n"}) {
      EXPECT_THROW(parsePcd(pcd + "ascii\n" + wrong), std::runtime_error) << type.pcd;
    }
    if (type.pcd[0] == 'U') {
      EXPECT_THROW(parsePcd(pcd + "ascii\n1 2 3 -1\n"), std::runtime_error);
    }
  }
}

TEST_F(PointCloudFile, OtherFieldsAndElementsAreIgnored) {
  const std::string before = "element camera 2\nproperty uchar id\nproperty double f\n";
  const std::string vertex =
      "element vertex 2\nproperty uchar red\nproperty float z\nproperty short intensity\n"
      "property float y\nproperty float x\n";
  const std::string after = "element face 1\nproperty list uchar int vertex_indices\nend_header\n";
  const PointCloudContent text =
      parse("a.ply", "ply\r\nformat ascii 1.0\r\ncomment by hand\r\nobj_info x\r\n" + before +
                         vertex + after + "1 0.5\n2 0.5\n255 3 -7 2 1\n\n0 6 8 5 4\r\n3 0 1 1\n");
  const PointCloudContent binary = parse(
      "b.ply", "ply\nformat binary_big_endian 1.0\n" + before + vertex + after +
                   std::string(18, 'c') + "r" + raw(3.0F, true) + raw(std::int16_t{-7}, true) +
                   rawFloats({2, 1}, true) + "r" + raw(6.0F, true) + raw(std::int16_t{8}, true) +
                   rawFloats({5, 4}, true) + "faces");
  // A point has four bytes of padding, x, a pair of shorts, y and z.
  const PointCloudContent pcd =
      parse("c.pcd",
            "#by hand\n\nVERSION 0.7\nCOLUMNS _ x pair y z intensity\nSIZE 1 4 2 4 4 1\nTYPE U F "
            "U F F I\n"
            "COUNT 4 1 2 1 1 1\nWIDTH 1\nHEIGHT 2\nVIEWPOINT 1 2 3 1 0 0 0\nPOINTS 2\n"
            "DATA binary\n" +
                ("____" + raw(1.0F)) + "pair" + rawFloats({2, 3}) + raw(std::int8_t{-7}) +
                ("____" + raw(4.0F)) + "pair" + rawFloats({5, 6}) + raw(std::int8_t{8}));

  // A compressed file has the fields one after the other, without the padding.
  const std::string plain = rawFloats({1, 4}) + "pairpair" + rawFloats({2, 5}) + rawFloats({3, 6}) +
                            raw(std::int8_t{-7}) + raw(std::int8_t{8});
  const PointCloudContent compressed = parsePcd(
      "FIELDS x _ pair y z intensity\nSIZE 4 1 2 4 4 1\nTYPE F U U F F I\n"
      "COUNT 1 3 2 1 1 1\nPOINTS 2\nDATA binary_compressed\n" +
      raw(static_cast<std::uint32_t>(asLzf(plain).size())) +
      raw(static_cast<std::uint32_t>(plain.size())) + asLzf(plain));

  for (const PointCloudContent& content : {text, binary, pcd, compressed}) {
    ASSERT_EQ(content.points.size(), 2U);
    EXPECT_EQ(content.points[0].p_world, Eigen::Vector3d(1, 2, 3));
    EXPECT_EQ(content.points[0].confidence, -7.0F);
    EXPECT_EQ(content.points[1].p_world, Eigen::Vector3d(4, 5, 6));
    EXPECT_EQ(content.points[1].confidence, 8.0F);
  }
}

TEST_F(PointCloudFile, PointsThatAreNotFiniteAreCounted) {
  const PointCloudContent content =
      parse("holes.pcd",
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
  const std::string xyz_pcd = "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\n";
  const std::string packed = pcd + "DATA binary_compressed\n";
  const std::string ply = "ply\nformat ascii 1.0\nelement vertex 1\n";
  const std::string xyz = "property float x\nproperty float y\nproperty float z\n";
  const std::string little = "ply\nformat binary_little_endian 1.0\n";
  const std::string end = xyz + "end_header\n";
  const std::pair<std::string, std::string> of_pcd[] = {
      {"", "line 1: the file ends: expected a line of a PCD header"},
      {"FIELDS x y", "line 1: 'FIELDS x y', then the file ends"},
      {"ply\n", "line 1: 'ply': expected one of VERSION FIELDS"},
      {pcd + "DATA ascii\n1 2 3banana\n", "line 8: z '3banana': expected a number"},
      {pcd + "DATA ascii\n1 2\n", "line 8: point 1 has 2 numbers: expected 3"},
      {pcd + "DATA ascii\n1 2 3\n4 5 6\n", "more bytes: expected the end"},
      {pcd + "DATA ascii\n", "line 8: the file ends: expected point 1 of 1"},
      {pcd + "DATA ascii\n1 2 3", "line 8: '1 2 3', then the file ends"},
      {pcd + "DATA ascii\n1 2 1e39\n", "line 8: z '1e39': expected a number"},
      {pcd + "DATA binary\n12345678901", "11 bytes are left: expected 1 points of 12"},
      {pcd + "DATA binary\n1234567890123", "1 more bytes: expected the end"},
      {pcd + "DATA zip\n", "line 7: DATA 'zip': expected ascii, binary or"},
      {"FIELDS x y\nSIZE 4 4\nTYPE F F\nPOINTS 0\nDATA ascii\n",
       "no field z: expected x, y and z among the fields (x, y)"},
      {"FIELDS x y z\nSIZE 4 4\nTYPE F F F\nPOINTS 0\nDATA ascii\n",
       "line 2: 2 values: expected 3, as many as FIELDS has"},
      {"FIELDS x y z\nSIZE 4 4 3\nTYPE F F F\nPOINTS 0\nDATA ascii\n",
       "line 3: TYPE 'F' of SIZE '3': expected I or U"},
      {xyz_pcd + "DATA ascii\n", "line 4: DATA ends the header: expected POINTS before it"},
      {xyz_pcd + "WIDTH 2\nHEIGHT 3\nPOINTS 5\nDATA ascii\n",
       "line 6: POINTS 5: expected WIDTH x HEIGHT, 2 x 3"},
      {xyz_pcd + "POINTS -1\nDATA ascii\n", "line 4: '-1': expected a whole number from 0 on"},
      {xyz_pcd + "POINTS 18446744073709551615\nDATA binary\n",
       "0 bytes are left: expected 18446744073709551615 points of 12 bytes"},
      {"FIELDS x y z x\nSIZE 4 4 4 4\nTYPE F F F F\nPOINTS 0\nDATA ascii\n",
       "field x is there twice"},
      {"FIELDS x y z\nFIELDS x y z\n", "line 2: FIELDS again: expected it once"},
      {pcd + "DATA binary_compressed\n" + raw(12U) + raw(24U) + "123456789012",
       "24 bytes when decompressed: expected 1 points of 12 bytes"},
      {pcd + "DATA binary_compressed\n" + raw(12U) + raw(12U) +
           "\377\377\377\377\377\377\377\377\377\377\377\377",
       "12 compressed bytes: expected 12 when decompressed: is the file damaged?"},
      {packed + "1234567", "expected the sizes of the compressed points, 8 bytes"},
      {packed + raw(13U) + raw(12U) + std::string(12, 'x'),
       "12 bytes are left: expected 13 that decompress to 12"},
      {packed + raw(0U) + raw(12U), "expected 0 that decompress to 12"},
      {xyz_pcd + "COUNT 1 0 1\nPOINTS 0\nDATA ascii\n", "line 4: COUNT 0: expected 1 to 1048576"},
      {xyz_pcd + "COUNT 1 1 1048577\nPOINTS 0\nDATA ascii\n", "line 4: COUNT 1048577: expected"},
      {xyz_pcd + "COUNT 1 2 1\nPOINTS 0\nDATA ascii\n", "field y has 2 numbers: expected 1"},
      {xyz_pcd + "COUNT 1 1\nPOINTS 0\nDATA ascii\n", "line 4: 2 values: expected 3"},
      {xyz_pcd + "WIDTH 2\nHEIGHT 2\nPOINTS 6\nDATA ascii\n",
       "line 6: POINTS 6: expected WIDTH x HEIGHT"},
      {xyz_pcd + "WIDTH 0\nHEIGHT 2\nPOINTS 2\nDATA ascii\n", "POINTS 2: expected WIDTH x HEIGHT"},
      {xyz_pcd + "WIDTH 2\nHEIGHT 0\nPOINTS 2\nDATA ascii\n", "POINTS 2: expected WIDTH x HEIGHT"},
      {xyz_pcd + "POINTS\nDATA ascii\n", "line 4: '': expected a whole number from 0 on"},
      {pcd + "DATA ascii twice\n", "line 7: DATA '': expected ascii"},
      {"SIZE 4\nTYPE F\nPOINTS 0\nDATA ascii\n", "expected FIELDS before it"},
      {"FIELDS x\nTYPE F\nPOINTS 0\nDATA ascii\n", "expected SIZE before it"},
      {"FIELDS x\nSIZE 4\nPOINTS 0\nDATA ascii\n", "expected TYPE before it"},
  };
  const std::pair<std::string, std::string> of_ply[] = {
      {"PLY\n", "line 1: not a PLY file: expected ply"},
      {"ply\nformat ascii 2.0\n", "line 2: not a known format"},
      {ply + "property float\n", "line 4: expected property TYPE NAME"},
      {ply + "property half x\n", "line 4: type 'half': expected char"},
      {ply + "end_header\n", "no field x"},
      {ply + xyz + "property list uchar int l\nend_header\n1 2 3 0\n",
       "line 7: a list in element vertex"},
      {ply + xyz + "end_header\n1 2 x\n", "line 8: z 'x': expected a number"},
      {ply + xyz, "line 7: the file ends: expected a line of a PLY header"},
      {"ply\nformat ascii 1.0\nend_header\n", "line 3: end_header without an element vertex"},
      {ply + xyz + "end\033[2J\n", "line 7: 'end\\x1b[2J': expected comment"},
      {"ply\nformat binary_little_endian 1.0\nelement face 1\nproperty list uchar int l\n"
       "element vertex 1\n" +
           xyz + "end_header\n",
       "line 4: a list in element face: expected lists behind element vertex"},
      {"ply\nformat ascii 1.0 x\n", "line 2: not a known format"},
      {"ply\nformat binary 1.0\n", "line 2: not a known format"},
      {"ply\nelement vertex 1\n", "line 2: not a known format"},
      {"ply\nformat ascii 1.0\nproperty float x\n",
       "line 3: a property: expected an element before"},
      {"ply\nformat ascii 1.0\nelement vertex\n", "line 3: expected element NAME COUNT"},
      {ply + "property list uchar int\n", "line 4: expected property TYPE NAME"},
      {little + "element eye 3\nproperty double f\nelement vertex 0\n" + end +
           "12345678901234567890123",
       "23 bytes are left: expected 3 elements eye of 8 bytes"},
      {ply + xyz + "element face 0\nend_header\n1 2 3\n4\n", "more bytes: expected the end"},
  };
  for (const auto& [bytes, expected] : of_pcd) {
    EXPECT_THAT(messageOf([&, &wrong = bytes] { parsePcd(wrong); }), HasSubstr(expected)) << bytes;
  }
  // Values at the limits: the most numbers per field, and exactly the bytes of the elements.
  EXPECT_NO_THROW(
      parsePcd("FIELDS x y z all\nSIZE 4 4 4 1\nTYPE F F F U\nCOUNT 1 1 1 1048576\n"
               "POINTS 0\nDATA binary\n"));
  EXPECT_NO_THROW(parsePly(little + "element eye 2\nproperty double f\nelement none 3\n" +
                           "element vertex 0\n" + end + "1234567812345678"));
  for (const auto& [bytes, expected] : of_ply) {
    EXPECT_THAT(messageOf([&, &wrong = bytes] { parsePly(wrong); }), HasSubstr(expected)) << bytes;
  }
}

TEST_F(PointCloudFile, ThatIsMissingAFolderOrOfAnotherKindIsAnErrorThatNamesIt) {
  std::filesystem::create_directories(folder() / "folder.PLY");
  const std::pair<std::string, std::string> cases[] = {
      {"nowhere.pcd", "there is no such file"},
      {"folder.PLY", "it is not a regular file"},
      {"cloud.xyz", "extension '.xyz': expected .pcd or .ply"}};
  for (const auto& [name, why] : cases) {
    const auto path = folder() / name;
    EXPECT_EQ(messageOf([&] { readPointCloud(path); }),
              "cannot read " + path.string() + ": " + why);
  }
}

TEST_F(PointCloudFile, WithAPointThatAFloatCannotHoldIsNotWritten) {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  for (const CloudPoint& point :
       {CloudPoint{{1e39, 0, 0}, 1.0F}, {{0, std::nan(""), 0}, 1.0F}, {{0, 0, 0}, kInfinity}}) {
    const auto cloud = mapCloudOf({{{1, 2, 3}, 1.0F}, point}, 0.01);
    EXPECT_THAT(messageOf([&] { writePcd(folder() / "map.pcd", *cloud); }),
                AllOf(HasSubstr("map.pcd: point 1 ("), HasSubstr("expected finite numbers")));
  }
  EXPECT_EQ(filesInFolder(), 0U);
}

}  // namespace
}  // namespace efm
