// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/base/picture_file.h"

#include <gmock/gmock.h>
#include <tiffio.h>
#include <zlib.h>

#include <cstdint>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <stdexcept>
#include <string>
#include <vector>

#include "test/plugin/temporary_folder.h"

namespace efm {
namespace {

using testing::HasSubstr;

cv::Mat randomPixels(cv::Size size, int type) {
  cv::Mat image(size, type);
  cv::randu(image, 0, 255);
  return image;
}

cv::Mat byOpenCv(const std::string& bytes) {
  return cv::imdecode(std::vector<char>(bytes.begin(), bytes.end()), cv::IMREAD_UNCHANGED);
}

void expectSame(const cv::Mat& image, const cv::Mat& expected) {
  ASSERT_EQ(image.size(), expected.size());
  ASSERT_EQ(image.type(), expected.type());
  EXPECT_EQ(cv::norm(image, expected, cv::NORM_INF), 0);
}

std::string bigEndian(std::uint32_t number) {
  std::string bytes;
  for (int shift = 24; shift >= 0; shift -= 8) bytes += static_cast<char>(number >> shift & 0xFFU);
  return bytes;
}

std::string chunk(const std::string& name_and_data) {
  const auto* data = reinterpret_cast<const Bytef*>(name_and_data.data());
  const auto size = static_cast<uInt>(name_and_data.size());
  return bigEndian(size - 4) + name_and_data +
         bigEndian(static_cast<std::uint32_t>(crc32(0, data, size)));
}

/// Returns the bytes of a PNG of any kind, with the rows of 8-bit pixels.
std::string png(std::uint32_t width, std::uint32_t height, char bits, char colours,
                const cv::Mat1b& rows, bool transparent = false) {
  std::string filtered;
  for (int y = 0; y < rows.rows; ++y) filtered += '\0' + std::string(rows[y], rows[y] + rows.cols);
  std::string packed(filtered.size() + 100, '\0');
  uLongf size = packed.size();
  compress(reinterpret_cast<Bytef*>(packed.data()), &size,
           reinterpret_cast<const Bytef*>(filtered.data()), filtered.size());
  std::string bytes = "\x89PNG\r\n\x1a\n" + chunk("IHDR" + bigEndian(width) + bigEndian(height) +
                                                  bits + colours + std::string(3, '\0'));
  if (colours == 3)
    bytes += chunk("PLTE" + std::string("\1\2\3\40\50\60\307\6\5\11\7\3", 3U << bits));
  if (transparent) bytes += chunk("tRNS" + std::string(colours == 2 ? 6 : 2, '\0'));
  return bytes + chunk("IDAT" + packed.substr(0, size)) + chunk("IEND");
}

struct TiffKind {
  int type = CV_32FC1;
  int compression = COMPRESSION_NONE;
  bool tiles = false;
  const char* mode = "w";
  int orientation = ORIENTATION_TOPLEFT;
};

class TiffFiles : public TemporaryFolder {
 protected:
  /// Returns the bytes of a TIFF that libtiff writes, 37 x 21 pixels.
  std::string tiff(const TiffKind& kind) {
    cv::Mat image = randomPixels({37, 21}, kind.type);
    written_ = image.clone();  // libtiff swaps the bytes in place
    const std::string file = (folder() / "a.tiff").string();
    TIFF* tiff = TIFFOpen(file.c_str(), kind.mode);
    TIFFSetField(tiff, TIFFTAG_IMAGEWIDTH, image.cols);
    TIFFSetField(tiff, TIFFTAG_IMAGELENGTH, image.rows);
    TIFFSetField(tiff, TIFFTAG_BITSPERSAMPLE, 8 * image.elemSize1());
    TIFFSetField(tiff, TIFFTAG_SAMPLESPERPIXEL, image.channels());
    TIFFSetField(tiff, TIFFTAG_SAMPLEFORMAT, image.depth() >= CV_32F ? 3 : 1);
    TIFFSetField(tiff, TIFFTAG_PHOTOMETRIC, image.channels() == 1 ? 1 : 2);
    TIFFSetField(tiff, TIFFTAG_COMPRESSION, kind.compression);
    TIFFSetField(tiff, TIFFTAG_ORIENTATION, kind.orientation);
    if (kind.tiles) {
      TIFFSetField(tiff, TIFFTAG_TILEWIDTH, 16);
      TIFFSetField(tiff, TIFFTAG_TILELENGTH, 16);
      cv::copyMakeBorder(image, image, 0, 11, 0, 11, cv::BORDER_REPLICATE);
      for (int y = 0; y < 32; y += 16) {
        for (int x = 0; x < 48; x += 16) {
          TIFFWriteTile(tiff, image(cv::Rect(x, y, 16, 16)).clone().data, x, y, 0, 0);
        }
      }
    } else {
      TIFFSetField(tiff, TIFFTAG_ROWSPERSTRIP, 6);
      for (int y = 0; y < image.rows; ++y) TIFFWriteScanline(tiff, image.ptr(y), y, 0);
    }
    TIFFClose(tiff);
    return readText(file);
  }

  cv::Mat written_;
};

TEST(PictureFile, OpenCvReadsThePixelsThatWereWritten) {
  for (const cv::Size size : {cv::Size(1, 1), cv::Size(121, 90), cv::Size(3000, 7)}) {
    for (const int type : {CV_8UC1, CV_8UC3}) {
      const cv::Mat whole = randomPixels(size + cv::Size(4, 4), type);
      const cv::Mat image = whole(cv::Rect({2, 2}, size));
      const std::string bytes = encodePng(image);
      expectSame(byOpenCv(bytes), image);
      expectSame(decodePicture(bytes), image);
    }
    const cv::Mat1f depth = randomPixels(size, CV_32F);
    expectSame(byOpenCv(encodeTiff(depth)), depth);
    expectSame(decodePicture(encodeTiff(depth)), depth);
  }
  EXPECT_THROW(encodeTiff({}), std::invalid_argument);
}

TEST(PictureFile, EachKindOfPngIsReadAsOpenCvReadsIt) {
  const struct {
    char colours;
    int samples;
    std::vector<char> bits;
  } kinds[] = {
      {0, 1, {1, 2, 4, 8, 16}}, {2, 3, {8, 16}}, {3, 1, {1, 2}}, {4, 2, {8, 16}}, {6, 4, {8, 16}}};
  for (const auto& kind : kinds) {
    for (const char bits : kind.bits) {
      for (const bool transparent : {false, true}) {
        if (transparent && kind.colours > 3) continue;
        const cv::Mat rows = randomPixels({(9 * bits * kind.samples + 7) / 8, 5}, CV_8UC1);
        const std::string bytes = png(9, 5, bits, kind.colours, rows, transparent);
        SCOPED_TRACE(testing::Message() << int{kind.colours} << ", bits " << int{bits});
        expectSame(decodePicture(bytes), byOpenCv(bytes));
      }
    }
  }
}

TEST_F(TiffFiles, OfEachKindAreReadAsTheyWereWritten) {
  for (const int type : {CV_8UC1, CV_8UC3, CV_16UC1, CV_16UC3, CV_16UC4, CV_32FC1, CV_64FC1}) {
    for (const int compression :
         {COMPRESSION_NONE, COMPRESSION_LZW, COMPRESSION_ADOBE_DEFLATE, COMPRESSION_PACKBITS}) {
      for (const char* mode : {"wl", "wb"}) {
        for (const bool tiles : {false, true}) {
          const std::string bytes = tiff({type, compression, tiles, mode});
          if (written_.channels() == 3) cv::cvtColor(written_, written_, cv::COLOR_RGB2BGR);
          if (written_.channels() == 4) cv::cvtColor(written_, written_, cv::COLOR_RGBA2BGRA);
          SCOPED_TRACE(testing::Message() << type << " " << compression << mode << tiles);
          expectSame(decodePicture(bytes), written_);
        }
      }
    }
  }
  for (int orientation = 1; orientation <= 8; ++orientation) {
    const std::string bytes = tiff({CV_32FC1, COMPRESSION_NONE, false, "w", orientation});
    expectSame(decodePicture(bytes), byOpenCv(bytes));
  }
  EXPECT_THAT(errorOf([&] { decodePicture(tiff({CV_32SC1})); }), HasSubstr("expected grey or RGB"));
}

TEST_F(TiffFiles, AndPngsThatAreCutOrDamagedAreErrorsWithoutAWordOnTheTerminal) {
  testing::internal::CaptureStderr();
  for (const std::string& whole :
       {encodePng(randomPixels({37, 21}, CV_8UC3)), tiff({}), tiff({CV_16UC1, COMPRESSION_LZW}),
        tiff({CV_8UC3, COMPRESSION_ADOBE_DEFLATE, true})}) {
    for (std::size_t size = 0; size < whole.size(); size += 7) {
      EXPECT_THROW(decodePicture(whole.substr(0, size)), std::runtime_error) << size;
    }
    for (std::size_t at = 0; at < whole.size(); ++at) {
      for (const char flipped : {'\1', '\x80', '\xFF'}) {
        std::string bytes = whole;
        bytes[at] = static_cast<char>(bytes[at] ^ flipped);
        errorOf([&] { decodePicture(bytes); });
      }
    }
  }
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
}

TEST(PictureFile, ImagesThatTheirFileCannotHoldAreRejected) {
  const auto rejected = [](const std::string& bytes) {
    return errorOf([&] { decodePicture(bytes); });
  };
  const cv::Mat1b rows(5, 18, uchar{7});
  EXPECT_THAT(rejected(png(60000, 60000, 16, 0, rows)),
              HasSubstr("60000x60000 pixels in a file of"));
  EXPECT_THAT(rejected(png(6000, 6000, 16, 0, rows)), HasSubstr("6000x6000 pixels in a file of"));
  std::string tiff = encodeTiff(cv::Mat1f(5, 9, 1.0F));
  for (const std::size_t tag : {0, 1}) {  // the directory of tags follows 180 bytes of pixels
    tiff.replace(8 + 180 + 2 + 12 * tag + 8, 4, std::string("\x70\x17\0\0", 4));
  }
  EXPECT_THAT(rejected(tiff), HasSubstr("6000x6000 pixels in a file of"));
  EXPECT_THAT(rejected("hello"), HasSubstr("'hello': expected a PNG or TIFF"));
  EXPECT_THAT(rejected(""), HasSubstr("it is empty"));
}

TEST(PictureSize, IsThatOfTheHeader) {
  const cv::Mat image = randomPixels({346, 260}, CV_8UC3);
  EXPECT_EQ(pictureSize(encodePng(image)), image.size());
  for (const int progressive : {0, 1}) {
    std::vector<uchar> jpeg;
    cv::imencode(".jpg", image, jpeg, {cv::IMWRITE_JPEG_PROGRESSIVE, progressive});
    const std::string bytes(jpeg.begin(), jpeg.end());
    EXPECT_EQ(pictureSize(bytes), image.size());
    EXPECT_THAT(errorOf([&] { pictureSize(bytes.substr(0, 100)); }),
                HasSubstr("expected a PNG or JPEG"));
  }
  EXPECT_THROW(pictureSize(""), std::runtime_error);
  EXPECT_THROW(pictureSize("\x89PNG\r\n\x1a\n"), std::runtime_error);
}

}  // namespace
}  // namespace efm
