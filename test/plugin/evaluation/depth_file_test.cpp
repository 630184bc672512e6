// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/evaluation/depth_file.h"

#include <gmock/gmock.h>

#include <cmath>
#include <cstring>
#include <fstream>
#include <opencv2/imgcodecs.hpp>

#include "mapping/base/atomic_file.h"
#include "test/plugin/temporary_folder.h"

namespace efm {
namespace {

using testing::AllOf;
using testing::HasSubstr;

template <typename Number>
std::string bytesOf(std::vector<Number> numbers, bool big_endian = false) {
  std::string bytes;
  for (const Number number : numbers) {
    std::string one(sizeof(Number), '\0');
    std::memcpy(one.data(), &number, sizeof(Number));
    if (big_endian) std::reverse(one.begin(), one.end());
    bytes += one;
  }
  return bytes;
}

std::string npy(const std::string& dictionary, const std::string& data) {
  const char length = static_cast<char>(dictionary.size());
  return std::string("\x93NUMPY\1\0", 8) + length + '\0' + dictionary + data;
}

class DepthFile : public TemporaryFolder {
 protected:
  std::filesystem::path write(const std::string& name, const std::string& bytes) const {
    std::ofstream(folder() / name, std::ios::binary) << bytes;
    return folder() / name;
  }
  std::filesystem::path image(const std::string& name, const cv::Mat& content,
                              const std::vector<int>& parameters = {}) const {
    EXPECT_TRUE(cv::imwrite((folder() / name).string(), content, parameters));
    return folder() / name;
  }
  std::string errorOf(const std::filesystem::path& file,
                      std::optional<double> scale = std::nullopt) const {
    return messageOf([&] { readDepthFile(file, scale); });
  }
  /// Expects the depths 1 2 3 / 4 5 6.
  void expectOneToSix(const cv::Mat1f& depth_m) const {
    ASSERT_EQ(depth_m.size(), cv::Size(3, 2));
    for (int k = 0; k < 6; ++k) EXPECT_EQ(depth_m(k / 3, k % 3), k + 1) << k;
  }

  const cv::Mat1f one_to_six_ = (cv::Mat1f(2, 3) << 1, 2, 3, 4, 5, 6);
  const std::string dictionary_ = "{'descr': '<f4', 'fortran_order': False, 'shape': (2, 3), }\n";
};

TEST_F(DepthFile, ReadsNumpyArraysOfBothWidthsAndByteOrders) {
  for (const bool big : {false, true}) {
    const auto header = [&](const std::string& type) {
      return "{'descr': '" + std::string(big ? ">" : "<") + type +
             "', 'fortran_order': False, 'shape': (2, 3), }\n";
    };
    const std::string floats = npy(header("f4"), bytesOf<float>({1, 2, 3, 4, 5, 6}, big));
    expectOneToSix(readDepthFile(write("a.npy", floats)));
    const std::string doubles = npy(header("f8"), bytesOf<double>({1, 2, 3, 4, 5, 6}, big));
    expectOneToSix(readDepthFile(write("b.npy", doubles)));
  }
}

TEST_F(DepthFile, ReadsPngOf16BitsByItsScaleInEitherSense) {
  const cv::Mat_<std::uint16_t> millimetres =
      (cv::Mat_<std::uint16_t>(2, 3) << 1000, 2000, 3000, 4000, 5000, 6000);
  const auto file = image("a.png", millimetres);
  expectOneToSix(readDepthFile(file, 1000));
  EXPECT_NEAR(readDepthFile(file, 0.001)(1, 2), 6, 1e-6);
  EXPECT_EQ(readDepthFile(file, 2)(0, 0), 500);
  EXPECT_EQ(readDepthFile(file, 0.5)(0, 0), 500);
  EXPECT_THROW(readDepthFile(file, INFINITY), std::invalid_argument);
  EXPECT_EQ(readDepthFile(file, 1)(0, 0), 1000);
  EXPECT_THAT(errorOf(file), AllOf(HasSubstr("a.png"), HasSubstr("--scale")));
  EXPECT_THROW(readDepthFile(file, 0), std::invalid_argument);
  EXPECT_THROW(readDepthFile(file, -1), std::invalid_argument);
}

TEST_F(DepthFile, DetectsFloatTiffByTheContent) {
  const auto file = image("a.tiff", one_to_six_);
  std::filesystem::rename(file, folder() / "a.depth");
  expectOneToSix(readDepthFile(folder() / "a.depth"));
}

TEST_F(DepthFile, WrongKindsOfImagesAreErrorsThatNameTheKind) {
  EXPECT_THAT(errorOf(image("a.png", cv::Mat1b(2, 3, uchar{1})), 1000),
              AllOf(HasSubstr("a.png"), HasSubstr("8-bit, 1 channel")));
  EXPECT_THAT(errorOf(image("b.tiff", cv::Mat1b(2, 3, uchar{1}))), HasSubstr("float32"));
  EXPECT_THAT(errorOf(image("c.tiff", cv::Mat3f(2, 3), {cv::IMWRITE_TIFF_COMPRESSION, 1})),
              HasSubstr("float32, 3 channels: must"));
  EXPECT_THAT(errorOf(write("d.pfm", "PF\n1 1\n-1\n" + bytesOf<float>({1, 2, 3}))),
              HasSubstr("Pf"));
  EXPECT_THAT(errorOf(write("e.txt", "hello")), HasSubstr("'hello': expected a TIFF"));
  EXPECT_THAT(errorOf(write("f.txt", "")), HasSubstr("empty"));
  EXPECT_THAT(errorOf(folder()), HasSubstr("not a regular file"));
  EXPECT_THAT(errorOf(folder() / "none.tiff"), HasSubstr("no such file"));
}

TEST_F(DepthFile, WrongHeadersOfPfmAreErrorsThatNameTheLine) {
  const auto rejected = [&](const std::string& text) { return errorOf(write("a.pfm", text)); };
  const std::pair<const char*, const char*> cases[] = {
      {"Pf 2\n3 2\n-1\n", "line 1: expected Pf alone"},
      {"PF\n3 2\n-1\n", "line 1: expected Pf alone"},
      {"Pf\n3\n-1\n", "line 2: expected width and height"},
      {"Pf\n3 2 1\n-1\n", "line 2: expected width and height"},
      {"Pf\n0 2\n-1\n", "line 2: 0 pixels"},
      {"Pf\n2 0\n-1\n", "line 2: 0 pixels"},
      {"Pf\n65536 1\n-1\n", "line 2: 65536 pixels: expected from 1 to 65535"},
      {"Pf\n65535 1\n-1\n", "0 bytes follow: expected 262140 for 65535x1 float32"},
      {"Pf\n3 2\n0\n", "line 3: expected one number, the scale"},
      {"Pf\n3 2\nx\n", "line 3"},
      {"Pf\n3 2\n1 1\n", "line 3"},
      {"Pf\n1 1\n-1\n123", "3 bytes follow: expected 4"},
      {"Pf\n1 1\n-1\n12345", "5 bytes follow: expected 4"}};
  for (const auto& [text, expected] : cases)
    EXPECT_THAT(rejected(text), HasSubstr(expected)) << text;
}

TEST_F(DepthFile, WrongHeadersOfNumpyAreErrors) {
  const auto rejected = [&](const std::string& dictionary) {
    return errorOf(write("a.npy", npy(dictionary, bytesOf<float>({1, 2, 3, 4, 5, 6}))));
  };
  const std::string order = "'fortran_order': False, ";
  EXPECT_THAT(rejected("{'descr': '<i4', " + order + "'shape': (2, 3), }"), HasSubstr("<i4"));
  EXPECT_THAT(rejected("{'descr': '<f4', 'fortran_order': True, 'shape': (2, 3), }"),
              HasSubstr("fortran_order"));
  for (const char* shape :
       {"(6,)", "(1, 2, 3)", "()", "(2, x)", "(0, 3)", "(3, 0)", "(2, 65536)"}) {
    EXPECT_THAT(rejected("{'descr': '<f4', " + order + "'shape': " + shape + ", }"),
                HasSubstr("shape"))
        << shape;
  }
  EXPECT_THAT(rejected("{'descr': '<f4', " + order + "'shape': (1, 65535), }"),
              HasSubstr("expected 262140 for 65535x1 float32"));
}

TEST_F(DepthFile, TruncatedFilesAreErrors) {
  const std::string tiff = readBytes(image("whole.tiff", cv::Mat1f(40, 30, 2.F)));
  cv::Mat_<std::uint16_t> noise(40, 30);
  cv::randu(noise, 0, 65535);
  const std::string png = readBytes(image("whole.png", noise));
  const std::string floats = bytesOf<float>({1, 2, 3, 4, 5, 6});
  for (const std::string& whole :
       {tiff, png, "Pf\n3 2\n-1.0\n" + floats, npy(dictionary_, floats)}) {
    ASSERT_EQ(errorOf(write("whole", whole), 1000), "no error");
    for (std::size_t k = 0; k < 40; ++k) {
      const std::size_t length = k * whole.size() / 40;
      EXPECT_THAT(errorOf(write("cut", whole.substr(0, length)), 1000), HasSubstr("cut: "))
          << length << " of " << whole.size() << " bytes";
    }
  }
}

TEST_F(DepthFile, AMaskSelectsPixelsThatAreNotBlack) {
  const cv::Mat3b colours =
      (cv::Mat3b(1, 3) << cv::Vec3b(1, 0, 0), cv::Vec3b(0, 0, 0), cv::Vec3b(255, 255, 255));
  for (const auto& file :
       {image("a.png", colours), image("b.png", cv::Mat1b((cv::Mat1b(1, 3) << 7, 0, 255))),
        image("c.png", cv::Mat((cv::Mat_<std::uint16_t>(1, 3) << 1, 0, 9)))}) {
    const cv::Mat1b mask = readMaskFile(file);
    ASSERT_EQ(mask.size(), cv::Size(3, 1));
    EXPECT_EQ(mask(0, 0), 255);
    EXPECT_EQ(mask(0, 1), 0);
    EXPECT_EQ(mask(0, 2), 255);
  }
  EXPECT_THROW(readMaskFile(write("text.png", "text")), std::runtime_error);
  EXPECT_THROW(readMaskFile(write("empty.png", "")), std::runtime_error);
}

}  // namespace
}  // namespace efm
