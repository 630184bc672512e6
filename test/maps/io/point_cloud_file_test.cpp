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

template <typename Number>
std::string raw(Number number) {
  std::string bytes(sizeof(number), '\0');
  std::memcpy(bytes.data(), &number, sizeof(number));
  return bytes;
}

std::string rawFloats(const std::vector<float>& numbers) {
  std::string bytes;
  for (const float number : numbers) bytes += raw(number);
  return bytes;
}

std::vector<CloudPoint> plainPoints(int count) {
  std::vector<CloudPoint> points;
  for (int i = 0; i < count; ++i) points.push_back({{i * 0.1, -i / 3.0, 3.5}, i * 0.7F + 1});
  return points;
}

/// Returns names and bytes of files with the same points, one per format. All files
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
  std::string by_point;
  for (const CloudPoint& point : points) {
    const Eigen::Vector3f p = point.p_world.cast<float>();
    by_point += rawFloats({p.x(), p.y(), p.z(), point.confidence});
  }
  return {{"binary.pcd", pcd.str()},
          {"older.pcd", pcd_header + "binary\n" + by_point},
          {"binary.ply", "ply\nformat binary_little_endian" + ply_header + by_point}};
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

TEST_F(PointCloudFile, IsReadByThePclProgramsWhichConvertOtherEncodings) {
  if (std::system("command -v pcl_convert_pcd_ascii_binary pcl_pcd2ply pcl_ply2pcd >/dev/null") !=
      0) {
    GTEST_SKIP() << "the package pcl-tools is not installed";
  }
  const std::vector<CloudPoint> points = plainPoints(1000);
  std::vector<CloudPoint> with_sigma = points;
  for (CloudPoint& point : with_sigma) point.sigma = point.probability = 0.25F;
  writePcd(folder() / "map.pcd", *mapCloudOf(with_sigma, 1e9));
  EXPECT_EQ(filesInFolder(), 1U) << "no temporary file stays";
  ASSERT_EQ(runInFolder("pcl_convert_pcd_ascii_binary map.pcd text.pcd 0"), 0);
  ASSERT_EQ(runInFolder("pcl_convert_pcd_ascii_binary map.pcd packed.pcd 2"), 0);
  ASSERT_EQ(runInFolder("pcl_pcd2ply -format 0 map.pcd text.ply"), 0);
  ASSERT_EQ(runInFolder("pcl_pcd2ply -format 1 map.pcd binary.ply"), 0);
  expectNear(readPointCloud(folder() / "binary.ply").points, points, 0);
  // The command in the error makes a file that is read.
  for (const char* name : {"text.pcd", "packed.pcd", "text.ply"}) {
    const std::string error = messageOf([&] { readPointCloud(folder() / name); });
    const std::size_t begin = error.find("; pcl_") + 2;
    ASSERT_NE(begin, std::string::npos + 2) << error;
    std::string command = error.substr(begin, error.find(" converts") - begin);
    command.replace(command.find("FILE"), 4, name);
    ASSERT_EQ(runInFolder(command), 0) << command;
    expectNear(readPointCloud(folder() / "NEW.pcd").points, points, 1e-6);
  }
  // The PCL filters keep the fields: means of the points of a voxel, and PCL's own support.
  ASSERT_EQ(runInFolder("pcl_voxel_grid map.pcd v.pcd -leaf 5,5,5"), 0);
  ASSERT_EQ(runInFolder("pcl_convert_pcd_ascii_binary v.pcd va.pcd 0"), 0);
  EXPECT_THAT(readBytes(folder() / "va.pcd"),
              AllOf(HasSubstr("\nFIELDS x y z intensity support sigma probability\n"),
                    HasSubstr(" 1 0.25 0.25\n")));
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
  if (std::system("command -v pcl_outlier_removal >/dev/null") != 0) {
    GTEST_SKIP() << "the package pcl-tools is not installed";
  }
  ASSERT_EQ(runInFolder("pcl_outlier_removal map.pcd o.pcd -method radius -radius 9 -min_pts 1"),
            0);
  ASSERT_EQ(runInFolder("pcl_convert_pcd_ascii_binary o.pcd ob.pcd 1"), 0);
  expectAllDigits("ob.pcd", 1e-3);
}

/// Other programs store the pose of a sensor there. Their points may be relative to any frame.
TEST_F(PointCloudFile, ViewpointsOfOtherProgramsAreNotAdded) {
  const std::string start = "VERSION 0.7\nFIELDS x y z";
  const std::string end = "WIDTH 1\nHEIGHT 1\nVIEWPOINT 10 20 30 1 0 0 0\nPOINTS 1\nDATA binary\n";
  const std::string xyz = rawFloats({1, 2, 3});
  const auto other = parse("a.pcd", start + "\nSIZE 4 4 4\nTYPE F F F\n" + end + xyz);
  EXPECT_EQ(other.points.at(0).p_world, Eigen::Vector3d(1, 2, 3));
  const std::string ours = " support sigma\nSIZE 4 4 4 4 4\nTYPE F F F U F\n";
  const std::string point = xyz + raw(4U) + raw(0.5F);
  const auto map = parse("b.pcd", start + ours + end + point);
  EXPECT_EQ(map.points.at(0).p_world, Eigen::Vector3d(11, 22, 33));
  std::string wrong = end;
  wrong.replace(wrong.find("20"), 2, "x");
  EXPECT_THAT(messageOf([&] { parsePcd(start + ours + wrong + point); }),
              HasSubstr("line 7: VIEWPOINT: expected 7 numbers"));
  wrong.replace(wrong.find(" x 30 1 0 0 0"), 13, " 20");
  EXPECT_THAT(messageOf([&] { parsePcd(start + ours + wrong + point); }),
              HasSubstr("line 7: VIEWPOINT: expected 7 numbers"));
}

TEST_F(PointCloudFile, IsReadBackFromEachFormat) {
  for (const int count : {0, 1000}) {
    std::vector<CloudPoint> points = plainPoints(count);
    if (count > 0) points.push_back({{-0.0, 1e-45, -3e38}, 1e-38F});  // of any magnitude
    for (const auto& [name, bytes] : filesOf(points)) {
      SCOPED_TRACE(name);
      expectNear(parse(name, bytes).points, points, 0);
    }
  }
}

TEST_F(PointCloudFile, NumbersOfEachTypeAreRead) {
  struct Type {
    std::string pcd;
    std::vector<std::string> ply;
    std::string bytes;
    double value;
  };
  const Type types[] = {
      {"I 1", {"char", "int8"}, raw(std::int8_t{-7}), -7},
      {"U 1", {"uchar", "uint8"}, raw(std::uint8_t{200}), 200},
      {"I 2", {"short", "int16"}, raw(std::int16_t{-300}), -300},
      {"U 2", {"ushort", "uint16"}, raw(std::uint16_t{60'000}), 60'000},
      {"I 4", {"int", "int32"}, raw(-70'000), -70'000},
      {"U 4", {"uint", "uint32"}, raw(4'000'000'000U), 4e9},
      {"I 8", {}, raw(std::int64_t{-5'000'000'000}), -5e9},
      {"U 8", {}, raw(std::uint64_t{1} << 63U), 9223372036854775808.0},
      {"F 4", {"float", "float32"}, raw(-2.5F), -2.5},
      {"F 8", {"double", "float64"}, raw(1000000.123456789), 1000000.123456789},
  };
  const std::string yz = rawFloats({2, 3});
  for (const Type& type : types) {
    std::vector<PointCloudContent> contents;
    contents.push_back(parsePcd("FIELDS y z x\nTYPE F F " + type.pcd.substr(0, 1) + "\nSIZE 4 4 " +
                                type.pcd.substr(2) + "\nPOINTS 1\nDATA binary\n" + yz +
                                type.bytes));
    for (const std::string& name : type.ply) {
      contents.push_back(
          parsePly("ply\nformat binary_little_endian 1.0\nelement vertex 1\nproperty float y\n"
                   "property float z\nproperty " +
                   name + " x\nend_header\n" + yz + type.bytes));
    }
    for (const PointCloudContent& content : contents) {
      EXPECT_EQ(content.points.at(0).p_world, Eigen::Vector3d(type.value, 2, 3)) << type.pcd;
      EXPECT_EQ(content.points[0].confidence, 1.0F) << "without an intensity";
    }
  }
}

TEST_F(PointCloudFile, OtherFieldsAndElementsAreIgnored) {
  const PointCloudContent ply =
      parse("b.ply",
            "ply\nformat binary_little_endian 1.0\ncomment by hand\nobj_info x\nelement vertex 2\n"
            "property uchar red\nproperty float z\nproperty short intensity\nproperty float y\n"
            "property float x\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
            "r" +
                raw(3.0F) + raw(std::int16_t{-7}) + rawFloats({2, 1}) + "r" + raw(6.0F) +
                raw(std::int16_t{8}) + rawFloats({5, 4}) + "faces");
  // A point has four bytes of padding, x, a pair of shorts, y and z.
  const PointCloudContent pcd =
      parse("c.pcd",
            "#by hand\n\nVERSION 0.7\nCOLUMNS _ x pair y z intensity\nSIZE 1 4 2 4 4 1\nTYPE U F "
            "U F F I\n"
            "COUNT 4 1 2 1 1 1\nWIDTH 1\nHEIGHT 2\nVIEWPOINT 1 2 3 1 0 0 0\nPOINTS 2\n"
            "DATA binary\n" +
                ("____" + raw(1.0F)) + "pair" + rawFloats({2, 3}) + raw(std::int8_t{-7}) +
                ("____" + raw(4.0F)) + "pair" + rawFloats({5, 6}) + raw(std::int8_t{8}));
  for (const PointCloudContent& content : {ply, pcd}) {
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
            "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nWIDTH 2\nHEIGHT 2\nPOINTS 4\nDATA binary\n" +
                rawFloats({NAN, NAN, NAN, 1, 2, 3, 1, -INFINITY, 3, 4, 5, 0}));
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
  const std::string little = "ply\nformat binary_little_endian 1.0\n";
  const std::string ply = little + "element vertex 1\n";
  const std::string xyz = "property float x\nproperty float y\nproperty float z\n";
  const std::string end = xyz + "end_header\n";
  const std::pair<std::string, std::string> of_pcd[] = {
      {"", "line 1: the file ends: expected a line of a PCD header"},
      {"FIELDS x y", "line 1: 'FIELDS x y', then the file ends"},
      {"ply\n", "line 1: 'ply': expected one of VERSION FIELDS"},
      {pcd + "DATA binary\n12345678901", "11 bytes are left: expected 1 points of 12"},
      {pcd + "DATA binary\n1234567890123", "1 more bytes: expected the end"},
      {pcd + "DATA zip\n", "line 7: DATA 'zip': expected binary; pcl_convert_pcd_ascii_binary"},
      {"FIELDS x y\nSIZE 4 4\nTYPE F F\nPOINTS 0\nDATA binary\n",
       "no field z: expected x, y and z among the fields (x, y)"},
      {"FIELDS x y z\nSIZE 4 4\nTYPE F F F\nPOINTS 0\nDATA binary\n",
       "line 2: 2 values: expected 3, as many as FIELDS has"},
      {"FIELDS x y z\nSIZE 4 4 3\nTYPE F F F\nPOINTS 0\nDATA binary\n",
       "line 3: TYPE 'F' of SIZE '3': expected I or U"},
      {xyz_pcd + "DATA binary\n", "line 4: DATA ends the header: expected POINTS before it"},
      {xyz_pcd + "WIDTH 2\nHEIGHT 3\nPOINTS 5\nDATA binary\n",
       "line 6: POINTS 5: expected WIDTH x HEIGHT, 2 x 3"},
      {xyz_pcd + "POINTS -1\nDATA binary\n", "line 4: '-1': expected a whole number from 0 on"},
      {xyz_pcd + "POINTS 18446744073709551615\nDATA binary\n",
       "0 bytes are left: expected 18446744073709551615 points of 12 bytes"},
      {"FIELDS x y z x\nSIZE 4 4 4 4\nTYPE F F F F\nPOINTS 0\nDATA binary\n",
       "field x is there twice"},
      {"FIELDS x y z\nFIELDS x y z\n", "line 2: FIELDS again: expected it once"},
      {xyz_pcd + "COUNT 1 0 1\nPOINTS 0\nDATA binary\n", "line 4: COUNT 0: expected 1 to 1048576"},
      {xyz_pcd + "COUNT 1 1 1048577\nPOINTS 0\nDATA binary\n", "line 4: COUNT 1048577: expected"},
      {xyz_pcd + "COUNT 1 2 1\nPOINTS 0\nDATA binary\n", "field y has 2 numbers: expected 1"},
      {xyz_pcd + "COUNT 1 1\nPOINTS 0\nDATA binary\n", "line 4: 2 values: expected 3"},
      {xyz_pcd + "WIDTH 0\nHEIGHT 2\nPOINTS 2\nDATA binary\n", "POINTS 2: expected WIDTH x HEIGHT"},
      {xyz_pcd + "WIDTH 2\nHEIGHT 0\nPOINTS 2\nDATA binary\n", "POINTS 2: expected WIDTH x HEIGHT"},
      {xyz_pcd + "POINTS\nDATA binary\n", "line 4: '': expected a whole number from 0 on"},
      {pcd + "DATA binary twice\n", "line 7: DATA '': expected binary"},
      {"SIZE 4\nTYPE F\nPOINTS 0\nDATA binary\n", "expected FIELDS before it"},
      {"FIELDS x\nTYPE F\nPOINTS 0\nDATA binary\n", "expected SIZE before it"},
      {"FIELDS x\nSIZE 4\nPOINTS 0\nDATA binary\n", "expected TYPE before it"},
  };
  const std::pair<std::string, std::string> of_ply[] = {
      {"PLY\n", "line 1: not a PLY file: expected ply"},
      {"ply\nformat ascii 1.0\n",
       "line 2: expected format binary_little_endian 1.0; pcl_ply2pcd FILE NEW.pcd"},
      {"ply\nformat binary_little_endian 1.0 x\n", "line 2: expected format"},
      {"ply\nelement vertex 1\n", "line 2: expected format"},
      {ply + "property float\n", "line 4: expected property TYPE NAME"},
      {ply + "property half x\n", "line 4: type 'half': expected char"},
      {ply + "end_header\n", "no field x"},
      {ply + xyz + "property list uchar int l\nend_header\n", "line 7: a list in element vertex"},
      {ply + xyz, "line 7: the file ends: expected a line of a PLY header"},
      {little + "end_header\n", "line 3: 'end_header': expected element vertex COUNT"},
      {little + "property float x\n", "line 3: 'property': expected element vertex COUNT"},
      {little + "element vertex\n", "line 3: expected element NAME COUNT"},
      {little + "element face 1\n", "line 3: expected element vertex first; pcl_ply2pcd"},
      {ply + xyz + "end\033[2J\n", "line 7: 'end\\x1b[2J': expected comment"},
      {ply + end + "12345678901", "11 bytes are left: expected 1 points of 12"},
      {ply + xyz + "element face 0\nend_header\n1234567890123", "more bytes: expected the end"},
  };
  for (const auto& [bytes, expected] : of_pcd) {
    EXPECT_THAT(messageOf([&, &wrong = bytes] { parsePcd(wrong); }), HasSubstr(expected)) << bytes;
  }
  // The most numbers per field.
  EXPECT_NO_THROW(
      parsePcd("FIELDS x y z all\nSIZE 4 4 4 1\nTYPE F F F U\nCOUNT 1 1 1 1048576\n"
               "POINTS 0\nDATA binary\n"));
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
