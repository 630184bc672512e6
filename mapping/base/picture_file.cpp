// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/base/picture_file.h"

#include <spng.h>
#include <tiffio.h>
#include <zlib.h>
#include <opencv2/imgproc.hpp>

#include <algorithm>
#include <cassert>
#include <cstdarg>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <new>
#include <stdexcept>
#include <utility>

#include "mapping/base/text.h"

namespace efm {
namespace {

constexpr std::uint64_t kMaxPixels = std::uint64_t{1} << 26U;
constexpr std::uint64_t kMaxBytes = std::uint64_t{1} << 30U;

/// Rejects a size that only a damaged header can have, before memory is allocated for it. No usual
/// compression makes a file more than 4096 times smaller.
void requireBelievable(std::uint64_t width, std::uint64_t height, std::uint64_t bytes_per_row,
                       std::size_t file_size) {
  constexpr std::uint64_t kAlways = std::uint64_t{1} << 24U;
  const bool possible = width >= 1 && height >= 1 && width <= kMaxPixels / height;
  if (!possible || bytes_per_row > kMaxBytes / height ||
      std::max(width, bytes_per_row) * height > kAlways + std::uint64_t{4096} * file_size) {
    throw std::runtime_error("the image's header: " + std::to_string(width) + "x" +
                             std::to_string(height) + " pixels in a file of " +
                             std::to_string(file_size) + " bytes");
  }
}

constexpr const char* kDamaged = "the image is damaged or cut short";
constexpr const char* kNotWritten = "no picture can be made";

std::runtime_error pictureError(const std::string& what, std::string_view why) {
  return std::runtime_error(why.empty() ? what : what + " (" + printable(why) + ")");
}

/// Input and output of libtiff: the bytes that it reads, or, if there are none, the bytes that it
/// writes. Also the first error that it reported.
struct CodecBytes {
  std::string_view input;
  std::string output;
  std::size_t at = 0;
  char error[200] = "";

  std::string_view content() const { return input.empty() ? output : input; }
  /// @return the number of bytes that were read; less than `count` at the end.
  std::size_t take(void* to, std::size_t count) {
    count = std::min(count, content().size() - std::min(content().size(), at));
    if (count > 0) std::memcpy(to, content().data() + at, count);
    at += count;
    return count;
  }
  bool put(const void* from, std::size_t count) {
    try {
      output.resize(std::max(output.size(), at + count));
    } catch (const std::exception&) {  // an exception must not pass through C
      return false;
    }
    std::memcpy(output.data() + at, from, count);
    at += count;
    return true;
  }
  std::runtime_error damaged() const { return pictureError(kDamaged, error); }
  std::runtime_error notWritten() const { return pictureError(kNotWritten, error); }
};

using PngCodec = std::unique_ptr<spng_ctx, decltype(&spng_ctx_free)>;

PngCodec pngCodec(int flags) {
  PngCodec codec(spng_ctx_new(flags), spng_ctx_free);
  if (codec == nullptr) throw std::bad_alloc();
  return codec;
}

/// @param status of a call of libspng.
void requirePng(int status, const char* what) {
  if (status == SPNG_EMEM) throw std::bad_alloc();
  if (status != SPNG_OK) throw pictureError(what, spng_strerror(status));
}

cv::Mat decodePng(std::string_view input) {
  const PngCodec codec = pngCodec(0);
  spng_ctx* const png = codec.get();
  requirePng(spng_set_png_buffer(png, input.data(), input.size()), kDamaged);
  spng_ihdr header{};
  requirePng(spng_get_ihdr(png, &header), kDamaged);
  requireBelievable(header.width, header.height, std::uint64_t{header.width}, input.size());
  spng_trns transparent{};
  const int transparency = spng_get_trns(png, &transparent);
  if (transparency != SPNG_ECHUNKAVAIL) requirePng(transparency, kDamaged);
  const int colours = header.color_type;
  const bool grey = colours == SPNG_COLOR_TYPE_GRAYSCALE;
  const bool alpha = colours == SPNG_COLOR_TYPE_GRAYSCALE_ALPHA ||
                     colours == SPNG_COLOR_TYPE_TRUECOLOR_ALPHA ||
                     (!grey && transparency == SPNG_OK);
  const bool deep = header.bit_depth == 16;
  const int channels = grey ? 1 : alpha ? 4 : 3;
  const int format = alpha  ? (deep ? SPNG_FMT_RGBA16 : SPNG_FMT_RGBA8)
                     : deep ? SPNG_FMT_PNG
                     : grey ? SPNG_FMT_G8
                            : SPNG_FMT_RGB8;
  std::size_t bytes = 0;
  requirePng(spng_decoded_image_size(png, format, &bytes), kDamaged);
  requireBelievable(header.width, header.height, bytes / header.height, input.size());
  cv::Mat picture(static_cast<int>(header.height), static_cast<int>(header.width),
                  CV_MAKETYPE(deep ? CV_16U : CV_8U, channels));
  requirePng(spng_decode_image(png, picture.data, bytes, format, alpha ? SPNG_DECODE_TRNS : 0),
             kDamaged);
  requirePng(spng_decode_chunks(png), kDamaged);  // up to the end of the file
  if (channels == 3) cv::cvtColor(picture, picture, cv::COLOR_RGB2BGR);
  if (channels == 4) cv::cvtColor(picture, picture, cv::COLOR_RGBA2BGRA);
  return picture;
}

/// An open TIFF in memory.
class TiffCodec {
 public:
  explicit TiffCodec(CodecBytes& bytes) {
    TIFFOpenOptions* options = TIFFOpenOptionsAlloc();
    if (options == nullptr) throw std::bad_alloc();
    // The library prints nothing if these handlers return 1.
    TIFFOpenOptionsSetErrorHandlerExtR(options, report, &bytes);
    TIFFOpenOptionsSetWarningHandlerExtR(
        options, [](TIFF*, void*, const char*, const char*, std::va_list) { return 1; }, nullptr);
    TIFFOpenOptionsSetMaxSingleMemAlloc(options, kMaxBytes);
    tiff = TIFFClientOpenExt(
        "picture", bytes.input.empty() ? "w" : "r", &bytes,
        [](thandle_t self, void* to, tmsize_t count) {
          return static_cast<tmsize_t>(of(self).take(to, static_cast<std::size_t>(count)));
        },
        [](thandle_t self, void* from, tmsize_t count) {
          return of(self).put(from, static_cast<std::size_t>(count)) ? count : tmsize_t{0};
        },
        [](thandle_t self, toff_t offset, int whence) -> toff_t {
          if (whence == SEEK_CUR) offset += of(self).at;
          if (whence == SEEK_END) offset += of(self).content().size();
          return of(self).at = offset;
        },
        [](thandle_t) { return 0; },
        [](thandle_t self) -> toff_t { return of(self).content().size(); }, nullptr, nullptr,
        options);
    TIFFOpenOptionsFree(options);
    if (tiff == nullptr) throw bytes.damaged();
  }
  ~TiffCodec() { TIFFClose(tiff); }
  TiffCodec(const TiffCodec&) = delete;
  TiffCodec& operator=(const TiffCodec&) = delete;

  /// Returns the value of a tag; if it is missing, its default; without a default, 0.
  template <typename Number>
  Number tag(std::uint32_t name) const {
    Number value = 0;
    return TIFFGetFieldDefaulted(tiff, name, &value) != 0 ? value : Number{0};
  }

  TIFF* tiff = nullptr;

 private:
  static CodecBytes& of(thandle_t self) { return *static_cast<CodecBytes*>(self); }
  static int report(TIFF*, void* self, const char*, const char* format, std::va_list values) {
    if (of(self).error[0] == '\0') {
      std::vsnprintf(of(self).error, sizeof(CodecBytes::error), format, values);
    }
    return 1;
  }
};

bool readStrips(TIFF* tiff, cv::Mat& picture) {
  if (TIFFScanlineSize64(tiff) != picture.cols * picture.elemSize()) return false;
  for (int y = 0; y < picture.rows; ++y) {
    if (TIFFReadScanline(tiff, picture.ptr(y), static_cast<std::uint32_t>(y), 0) < 0) return false;
  }
  return true;
}

bool readTiles(TIFF* tiff, cv::Size size, cv::Mat& picture) {
  cv::Mat tile(size, picture.type());
  if (TIFFTileSize64(tiff) != tile.total() * tile.elemSize()) return false;
  for (int y = 0; y < picture.rows; y += size.height) {
    for (int x = 0; x < picture.cols; x += size.width) {
      if (TIFFReadTile(tiff, tile.data, static_cast<std::uint32_t>(x),
                       static_cast<std::uint32_t>(y), 0, 0) < 0) {
        return false;
      }
      const cv::Rect part = cv::Rect({x, y}, size) & cv::Rect({}, picture.size());
      tile(cv::Rect({}, part.size())).copyTo(picture(part));
    }
  }
  return true;
}

/// Turns the stored image upright. @param orientation 1 to 8, as in TIFF.
void makeUpright(int orientation, cv::Mat& picture) {
  constexpr int kFlips[] = {1, -1, 0};  // for cv::flip, of orientations 2 to 4 and 6 to 8
  if (orientation > 4) cv::transpose(picture, picture);
  const int turn = (orientation - 1) % 4;
  if (turn > 0) cv::flip(picture, picture, kFlips[turn - 1]);
}

/// Returns OpenCV's depth for samples of a TIFF (CV_8U …), or -1 if there is none.
int depthOf(int bits, int format) {
  if (format == SAMPLEFORMAT_UINT) return bits == 8 ? CV_8U : bits == 16 ? CV_16U : -1;
  if (format == SAMPLEFORMAT_IEEEFP) return bits == 32 ? CV_32F : bits == 64 ? CV_64F : -1;
  return -1;
}

cv::Mat decodeTiff(std::string_view input) {
  CodecBytes bytes;
  bytes.input = input;
  const TiffCodec codec(bytes);
  TIFF* const tiff = codec.tiff;
  const auto width = codec.tag<std::uint32_t>(TIFFTAG_IMAGEWIDTH);
  const auto height = codec.tag<std::uint32_t>(TIFFTAG_IMAGELENGTH);
  const auto tile_width = codec.tag<std::uint32_t>(TIFFTAG_TILEWIDTH);
  const auto tile_height = codec.tag<std::uint32_t>(TIFFTAG_TILELENGTH);
  const bool tiled = TIFFIsTiled(tiff) != 0;
  requireBelievable(width, height, TIFFScanlineSize64(tiff), input.size());
  if (tiled) requireBelievable(tile_width, tile_height, TIFFTileRowSize64(tiff), input.size());

  const int bits = codec.tag<std::uint16_t>(TIFFTAG_BITSPERSAMPLE);
  const int channels = codec.tag<std::uint16_t>(TIFFTAG_SAMPLESPERPIXEL);
  const int colours = codec.tag<std::uint16_t>(TIFFTAG_PHOTOMETRIC);
  const int depth = depthOf(bits, codec.tag<std::uint16_t>(TIFFTAG_SAMPLEFORMAT));
  const bool apart =
      channels > 1 && codec.tag<std::uint16_t>(TIFFTAG_PLANARCONFIG) == PLANARCONFIG_SEPARATE;
  const bool plain = colours == PHOTOMETRIC_MINISBLACK || colours == PHOTOMETRIC_RGB;
  if (depth < 0 || (depth == CV_8U && !plain) || channels < 1 || channels > 4 || apart) {
    throw std::runtime_error("a TIFF image, " + std::to_string(bits) + "-bit, " +
                             std::to_string(channels) + " channels, PhotometricInterpretation " +
                             std::to_string(colours) + (apart ? ", in planes" : "") +
                             ": expected grey or RGB pixels of 8 or 16 bits, float32 or float64");
  }
  cv::Mat picture(static_cast<int>(height), static_cast<int>(width), CV_MAKETYPE(depth, channels));
  const bool complete =
      tiled ? readTiles(tiff, cv::Size(static_cast<int>(tile_width), static_cast<int>(tile_height)),
                        picture)
            : readStrips(tiff, picture);
  if (!complete) throw bytes.damaged();
  if (channels == 3) cv::cvtColor(picture, picture, cv::COLOR_RGB2BGR);
  if (channels == 4) cv::cvtColor(picture, picture, cv::COLOR_RGBA2BGRA);
  makeUpright(codec.tag<std::uint16_t>(TIFFTAG_ORIENTATION), picture);
  return picture;
}

/// Returns the number in `count` (2 or 4) bytes from `at` on, the highest byte first.
std::uint32_t bigEndian(std::string_view bytes, std::size_t at, std::size_t count) {
  std::uint32_t number = 0;
  for (const char byte : bytes.substr(at, count)) {
    number = number << 8U | static_cast<std::uint8_t>(byte);
  }
  return number;
}

/// Returns the size in the frame header: the first of the markers SOF0 to SOF15.
cv::Size jpegSize(std::string_view bytes) {
  std::size_t at = 2;
  while (at + 9 <= bytes.size() && bytes[at] == '\xFF') {
    const auto marker = static_cast<std::uint8_t>(bytes[at + 1]);
    const bool other = marker == 0xC4 || marker == 0xC8 || marker == 0xCC;  // DHT, JPG, DAC
    if (marker >= 0xC0 && marker <= 0xCF && !other) {
      return {static_cast<int>(bigEndian(bytes, at + 7, 2)),
              static_cast<int>(bigEndian(bytes, at + 5, 2))};
    }
    at += marker == 0xFF ? 1 : 2 + bigEndian(bytes, at + 2, 2);
  }
  return {};
}

std::string beginning(std::string_view bytes) {
  return bytes.empty() ? "it is empty" : "it begins with " + inQuotes(bytes.substr(0, 8));
}

}  // namespace

std::string encodePng(const cv::Mat& picture) {
  assert(picture.type() == CV_8UC1 || picture.type() == CV_8UC3);
  const PngCodec codec = pngCodec(SPNG_CTX_ENCODER);
  spng_ctx* const png = codec.get();
  const bool grey = picture.channels() == 1;
  spng_set_option(png, SPNG_ENCODE_TO_BUFFER, 1);
  spng_set_option(png, SPNG_IMG_COMPRESSION_LEVEL, 1);
  spng_set_option(png, SPNG_IMG_COMPRESSION_STRATEGY, Z_DEFAULT_STRATEGY);
  spng_set_option(png, SPNG_FILTER_CHOICE, SPNG_FILTER_CHOICE_NONE);
  spng_ihdr header{};
  header.width = static_cast<std::uint32_t>(picture.cols);
  header.height = static_cast<std::uint32_t>(picture.rows);
  header.bit_depth = 8;
  header.color_type = grey ? SPNG_COLOR_TYPE_GRAYSCALE : SPNG_COLOR_TYPE_TRUECOLOR;
  requirePng(spng_set_ihdr(png, &header), kNotWritten);
  cv::Mat pixels;
  if (grey) {
    pixels = picture.isContinuous() ? picture : picture.clone();
  } else {
    cv::cvtColor(picture, pixels, cv::COLOR_BGR2RGB);
  }
  requirePng(spng_encode_image(png, pixels.data, pixels.total() * pixels.elemSize(), SPNG_FMT_PNG,
                               SPNG_ENCODE_FINALIZE),
             kNotWritten);
  std::size_t size = 0;
  int status = 0;
  const std::unique_ptr<void, decltype(&std::free)> file(spng_get_png_buffer(png, &size, &status),
                                                         std::free);
  requirePng(status, kNotWritten);
  return {static_cast<const char*>(file.get()), size};
}

std::string encodeTiff(const cv::Mat1f& image) {
  if (image.empty()) throw std::invalid_argument("an image without pixels");
  constexpr int kStripBytes = 8192;
  const int strip_rows = kStripBytes / (image.cols * static_cast<int>(sizeof(float)));
  const std::pair<std::uint32_t, int> tags[] = {
      {TIFFTAG_IMAGEWIDTH, image.cols},
      {TIFFTAG_IMAGELENGTH, image.rows},
      {TIFFTAG_BITSPERSAMPLE, 32},
      {TIFFTAG_SAMPLEFORMAT, SAMPLEFORMAT_IEEEFP},
      {TIFFTAG_SAMPLESPERPIXEL, 1},
      {TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG},
      {TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISBLACK},
      {TIFFTAG_COMPRESSION, COMPRESSION_NONE},
      {TIFFTAG_ROWSPERSTRIP, std::clamp(strip_rows, 1, image.rows)}};
  CodecBytes bytes;
  {
    const TiffCodec codec(bytes);
    bool written = true;
    for (const auto& [tag, value] : tags) {
      written = written && TIFFSetField(codec.tiff, tag, value) != 0;
    }
    for (int y = 0; written && y < image.rows; ++y) {
      // libtiff writes floats in the machine's byte order, so it changes no row.
      written = TIFFWriteScanline(codec.tiff, const_cast<float*>(image[y]),
                                  static_cast<std::uint32_t>(y), 0) >= 0;
    }
    if (!written || TIFFWriteDirectory(codec.tiff) == 0) throw bytes.notWritten();
  }
  return std::move(bytes.output);
}

bool looksLikePng(std::string_view bytes) { return bytes.substr(0, 8) == "\x89PNG\r\n\x1a\n"; }

bool looksLikeTiff(std::string_view bytes) {
  using namespace std::string_view_literals;
  const std::string_view start = bytes.substr(0, 4);
  return start == "II*\0"sv || start == "MM\0*"sv || start == "II+\0"sv || start == "MM\0+"sv;
}

cv::Mat decodePicture(std::string_view bytes) {
  if (looksLikePng(bytes)) return decodePng(bytes);
  if (looksLikeTiff(bytes)) return decodeTiff(bytes);
  throw std::runtime_error(beginning(bytes) + ": expected a PNG or TIFF image");
}

cv::Size pictureSize(std::string_view bytes) {
  cv::Size size;
  if (looksLikePng(bytes) && bytes.size() >= 24) {
    size = {static_cast<int>(bigEndian(bytes, 16, 4)), static_cast<int>(bigEndian(bytes, 20, 4))};
  } else if (bytes.substr(0, 2) == "\xFF\xD8") {
    size = jpegSize(bytes);
  }
  if (size.width >= 1 && size.height >= 1) return size;
  throw std::runtime_error(beginning(bytes) + ": expected a PNG or JPEG image");
}

}  // namespace efm
