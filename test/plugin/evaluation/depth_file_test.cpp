// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/evaluation/depth_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <cstring>
#include <fstream>
#include <opencv2/imgcodecs.hpp>

#include "maps/io/atomic_file.h"
#include "plugin/evaluation/npy_image.h"
#include "plugin/evaluation/pfm_image.h"
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

std::string npy(const std::string& dictionary, const std::string& data, char version = 1) {
  std::string length(version == 1 ? 2 : 4, '\0');
  length[0] = static_cast<char>(dictionary.size());
  return std::string("\x93NUMPY") + version + '\0' + length + dictionary + data;
}

class DepthFile : public TemporaryFolder {
 protected:
  std::filesystem::path write(const std::string& name, const std::string& bytes) const {
    std::ofstream(folder() / name, std::ios::binary) << bytes;
    return folder() / name;
  }
  std::filesystem::path image(const std::string& name, const cv::Mat& content) const {
    EXPECT_TRUE(cv::imwrite((folder() / name).string(), content));
    return folder() / name;
  }
  std::string errorOf(const std::filesystem::path& file,
                      std::optional<double> scale = std::nullopt) const {
    try {
      readDepthFile(file, scale);
    } catch (const std::runtime_error& error) {
      return error.what();
    }
    return "no error";
  }
  /// 1 2 3 / 4 5 6
  void expectOneToSix(const cv::Mat1f& depth_m) const {
    ASSERT_EQ(depth_m.size(), cv::Size(3, 2));
    for (int k = 0; k < 6; ++k) EXPECT_EQ(depth_m(k / 3, k % 3), k + 1) << k;
  }

  const cv::Mat1f one_to_six_ = (cv::Mat1f(2, 3) << 1, 2, 3, 4, 5, 6);
  const std::string dictionary_ = "{'descr': '<f4', 'fortran_order': False, 'shape': (2, 3), }\n";
};

TEST_F(DepthFile, ReadsFloatTiff) { expectOneToSix(readDepthFile(image("a.tiff", one_to_six_))); }

TEST_F(DepthFile, ReadsPfmFromTheBottomUpwardsInBothByteOrders) {
  const std::vector<float> upwards = {4, 5, 6, 1, 2, 3};
  expectOneToSix(readDepthFile(write("a.pfm", "Pf\n3 2\n-1.0\n" + bytesOf(upwards))));
  expectOneToSix(readDepthFile(write("b.pfm", "Pf\n3 2\n1\n" + bytesOf(upwards, true))));
}

TEST_F(DepthFile, ReadsNumpyArraysOfBothWidthsAndByteOrders) {
  const std::vector<float> floats = {1, 2, 3, 4, 5, 6};
  const std::vector<double> doubles = {1, 2, 3, 4, 5, 6};
  const auto header = [&](const std::string& type) {
    return "{'descr': '" + type + "', 'fortran_order': False, 'shape': (2, 3), }\n";
  };
  expectOneToSix(parseNpy(npy(header("<f4"), bytesOf(floats))));
  expectOneToSix(parseNpy(npy(header(">f4"), bytesOf(floats, true))));
  expectOneToSix(parseNpy(npy(header("<f8"), bytesOf(doubles), 2)));
  expectOneToSix(parseNpy(npy(header(">f8"), bytesOf(doubles, true), 3)));
  expectOneToSix(readDepthFile(write("a.npy", npy(header("<f4"), bytesOf(floats)))));
  // Keys in any order.
  expectOneToSix(
      parseNpy(npy("{'shape':(2,3),'fortran_order':False,'descr':'<f4'}", bytesOf(floats))));
}

TEST_F(DepthFile, ReadsPngOf16BitsByItsScaleInEitherSense) {
  const cv::Mat_<std::uint16_t> millimetres =
      (cv::Mat_<std::uint16_t>(2, 3) << 1000, 2000, 3000, 4000, 5000, 6000);
  const auto file = image("a.png", millimetres);
  expectOneToSix(readDepthFile(file, 1000));
  EXPECT_NEAR(readDepthFile(file, 0.001)(1, 2), 6, 1e-6);
  EXPECT_EQ(readDepthFile(file, 1)(0, 0), 1000);
  EXPECT_THAT(errorOf(file), AllOf(HasSubstr("a.png"), HasSubstr("--scale")));
  EXPECT_THROW(readDepthFile(file, 0), std::invalid_argument);
  EXPECT_THROW(readDepthFile(file, -1), std::invalid_argument);
}

TEST_F(DepthFile, DetectsTheFormatByTheContent) {
  const auto file = image("a.tiff", one_to_six_);
  std::filesystem::rename(file, folder() / "a.depth");
  expectOneToSix(readDepthFile(folder() / "a.depth"));
}

TEST_F(DepthFile, WrongKindsOfImagesAreErrorsThatNameTheKind) {
  EXPECT_THAT(errorOf(image("a.png", cv::Mat1b(2, 3, uchar{1})), 1000),
              AllOf(HasSubstr("a.png"), HasSubstr("8-bit, 1 channel")));
  EXPECT_THAT(errorOf(image("b.tiff", cv::Mat1b(2, 3, uchar{1}))), HasSubstr("float32"));
  EXPECT_THAT(errorOf(image("c.tiff", cv::Mat3f(2, 3))), HasSubstr("3 channels"));
  EXPECT_THAT(errorOf(write("d.pfm", "PF\n1 1\n-1\n" + bytesOf<float>({1, 2, 3}))),
              HasSubstr("Pf"));
  EXPECT_THAT(errorOf(write("e.txt", "hello")), HasSubstr("'hello': expected a TIFF"));
  EXPECT_THAT(errorOf(write("f.txt", "")), HasSubstr("empty"));
  EXPECT_THAT(errorOf(folder()), HasSubstr("not a regular file"));
  EXPECT_THAT(errorOf(folder() / "none.tiff"), HasSubstr("no such file"));
}

TEST_F(DepthFile, WrongHeadersOfPfmAreErrorsThatNameTheLine) {
  const auto refused = [&](const std::string& text) { return errorOf(write("a.pfm", text)); };
  EXPECT_THAT(refused("Pf\n3\n-1\n"), HasSubstr("line 2"));
  EXPECT_THAT(refused("Pf\n0 2\n-1\n"), HasSubstr("line 2"));
  EXPECT_THAT(refused("Pf\n3 99999999\n-1\n"), HasSubstr("line 2"));
  EXPECT_THAT(refused("Pf\n3 2\n0\n"), HasSubstr("line 3"));
  EXPECT_THAT(refused("Pf\n3 2\nx\n"), HasSubstr("line 3"));
  EXPECT_THAT(refused("Pf\n1 1\n-1\n123"), HasSubstr("expected 4"));
  EXPECT_THAT(refused("Pf\n1 1\n-1\n12345"), HasSubstr("expected 4"));
}

TEST_F(DepthFile, WrongHeadersOfNumpyAreErrors) {
  const auto refused = [&](const std::string& dictionary) {
    return errorOf(write("a.npy", npy(dictionary, bytesOf<float>({1, 2, 3, 4, 5, 6}))));
  };
  const std::string order = "'fortran_order': False, ";
  EXPECT_THAT(refused("{'descr': '<i4', " + order + "'shape': (2, 3), }"), HasSubstr("<i4"));
  EXPECT_THAT(refused("{'descr': '<f4', 'fortran_order': True, 'shape': (2, 3), }"),
              HasSubstr("fortran_order"));
  for (const char* shape : {"(6,)", "(1, 2, 3)", "()", "(2, x)", "(0, 3)", "(2, 3", "(2, 99999)"}) {
    EXPECT_THAT(refused("{'descr': '<f4', " + order + "'shape': " + shape + ", }"),
                HasSubstr("shape"))
        << shape;
  }
  EXPECT_THAT(refused("{'descr': '<f4', " + order + "}"), HasSubstr("no 'shape'"));
  EXPECT_THAT(refused("{'descr': '<f4', " + order + "'shape': (2, 4), }"),
              HasSubstr("24 bytes follow the array's header: expected 32"));
  EXPECT_THAT(errorOf(write("a.npy", npy(dictionary_, "", 9))), HasSubstr("version 9"));
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

RC_GTEST_PROP(NpyImage, ReadsNoArbitraryBytesBeyondTheirEnd, ()) {
  const std::string start = *rc::gen::element<std::string>(
      "", "\x93NUMPY", std::string("\x93NUMPY\x01\0\x20\0", 10),
      std::string("\x93NUMPY\x01\0\x3a\0{'descr': '<f4', 'fortran_order': False, 'shape': (", 61));
  const auto rest = *rc::gen::arbitrary<std::string>();
  try {
    parseNpy(start + rest);
  } catch (const std::runtime_error&) {
  }
  try {
    parsePfm("Pf\n" + rest);
  } catch (const std::runtime_error&) {
  }
}

}  // namespace
}  // namespace efm
