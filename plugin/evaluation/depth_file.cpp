// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/evaluation/depth_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <set>
#include <sstream>
#include <stdexcept>
#include <string>
#include <string_view>

#include "mapping/base/atomic_file.h"
#include "mapping/base/npy_header.h"
#include "mapping/base/option.h"
#include "mapping/base/picture_file.h"
#include "mapping/base/text.h"
#include "mapping/geometry/timestamp.h"
#include "maps/io/point_record.h"

namespace efm {

namespace fs = std::filesystem;

namespace {

/// The maximum width and height of a PFM or NumPy image. A larger value means a damaged header.
constexpr std::uint64_t kMaxImageSide = 65535;

std::string kindOf(const cv::Mat& image) {
  constexpr const char* kDepths[] = {"8-bit",  "signed 8-bit", "16-bit", "signed 16-bit",
                                     "32-bit", "float32",      "float64"};
  const int depth = image.depth();
  return fmt::format("{}, {} channel{}", depth < 7 ? kDepths[depth] : "unknown", image.channels(),
                     image.channels() == 1 ? "" : "s");
}

cv::Mat1f parseTiff(const std::string& bytes) {
  cv::Mat image = decodePicture(bytes);
  if (image.type() != CV_32FC1) {
    throw std::runtime_error("a TIFF image, " + kindOf(image) +
                             ": must be a float32 image of one channel");
  }
  return image;
}

cv::Mat1f parsePng(const std::string& bytes, std::optional<double> scale) {
  const cv::Mat image = decodePicture(bytes);
  if (image.type() != CV_16UC1) {
    throw std::runtime_error("a PNG image, " + kindOf(image) +
                             ": expected 16-bit, 1 channel, or a float32 TIFF");
  }
  if (!scale) {
    throw std::runtime_error("a 16-bit PNG needs a scale, --scale (1000: millimetres)");
  }
  const double units_per_m = *scale >= 1 ? *scale : 1 / *scale;
  cv::Mat1f depth_m(image.size());
  std::transform(image.begin<std::uint16_t>(), image.end<std::uint16_t>(), depth_m.begin(),
                 [&](std::uint16_t units) { return static_cast<float>(units / units_per_m); });
  return depth_m;
}

cv::Size imageSizeOf(const NpyHeader& header) {
  bool is_image = header.shape.size() == 2;
  for (const std::uint64_t side : header.shape) {
    is_image = is_image && side >= 1 && side <= kMaxImageSide;
  }
  if (!is_image) {
    throw std::runtime_error(
        fmt::format("the array's header: shape = '({})': expected (rows, columns), each from 1 to "
                    "65535",
                    fmt::join(header.shape, ", ")));
  }
  return {static_cast<int>(header.shape[1]), static_cast<int>(header.shape[0])};
}

/// Returns the image of a NumPy array (`parseNpyHeader`): two dimensions, [row][column], float32 or
/// float64 of either byte order, in C order. Doubles are rounded to float.
cv::Mat1f parseNpy(std::string_view bytes) {
  const NpyHeader header = parseNpyHeader(bytes);
  requirePlainRows(header);
  if (header.type != NumberType::kFloat32 && header.type != NumberType::kFloat64) {
    throw std::runtime_error(
        fmt::format("the array's header: descr = '{}': expected float32 or float64", header.descr));
  }
  const cv::Size size = imageSizeOf(header);
  const std::string_view data = bytes.substr(header.data_begin);
  const std::size_t step = sizeOf(header.type);
  if (data.size() != header.bytes()) {
    throw std::runtime_error(
        fmt::format("{} bytes follow the array's header: expected {} for {}x{} float{}",
                    data.size(), header.bytes(), size.width, size.height, 8 * step));
  }
  cv::Mat1f image(size);
  const char* at = data.data();
  for (float& value : image) {
    value = static_cast<float>(numberAt(at, header.type, header.big_endian));
    at += step;
  }
  return image;
}

int side(const WordLine& line, std::size_t word) {
  const std::uint64_t pixels = line.count(word);
  if (pixels < 1 || pixels > kMaxImageSide) {
    line.reject(fmt::format("{} pixels: expected from 1 to 65535", pixels));
  }
  return static_cast<int>(pixels);
}

/// Returns whether bytes begin like a PFM ("portable float map", Debevec), grey or coloured.
bool looksLikePfm(std::string_view bytes) {
  return bytes.size() > 2 && bytes[0] == 'P' && (bytes[1] == 'f' || bytes[1] == 'F') &&
         (bytes[2] == '\n' || bytes[2] == '\r' || bytes[2] == ' ');
}

/// Reads a grey PFM: lines "Pf", "width height" and "scale", then float32 rows from the bottom
/// upwards, little endian if the scale is negative. As in stereo benchmarks (Middlebury), the size
/// of the scale has no effect. (OpenCV's reader divides by the scale and rejects CRLF line ends.)
cv::Mat1f parsePfm(std::string_view bytes) {
  TextScanner cursor(bytes);
  const WordLine kind = wordLine(cursor, "Pf");
  if (kind.words.size() != 1 || kind.words[0] != "Pf") {
    kind.reject("expected Pf alone, a grey float map");
  }
  const WordLine sides = wordLine(cursor, "width and height");
  if (sides.words.size() != 2) sides.reject("expected width and height");
  const int width = side(sides, 0);
  const int height = side(sides, 1);
  const WordLine line = wordLine(cursor, "the scale");
  const double scale = line.words.size() == 1 ? parseFinite(line.words[0]).value_or(0) : 0;
  if (scale == 0) {
    line.reject("expected one number, the scale, below 0 where the data are little endian");
  }

  cv::Mat1f image(height, width);
  const std::size_t expected = image.total() * sizeof(float);
  if (cursor.left() != expected) {
    cursor.reject(fmt::format("{} bytes follow: expected {} for {}x{} float32", cursor.left(),
                              expected, width, height));
  }
  const char* at = cursor.take(expected).data();
  for (float& value : image) {
    value = static_cast<float>(numberAt(at, NumberType::kFloat32, scale > 0));
    at += sizeof(float);
  }
  cv::flip(image, image, 0);
  return image;
}

cv::Mat1f parseDepth(const std::string& bytes, std::optional<double> png_scale) {
  if (looksLikeTiff(bytes)) return parseTiff(bytes);
  if (looksLikePng(bytes)) return parsePng(bytes, png_scale);
  if (looksLikePfm(bytes)) return parsePfm(bytes);
  if (looksLikeNpy(bytes)) return parseNpy(bytes);
  throw std::runtime_error(
      (bytes.empty() ? "it is empty" : "it begins with " + inQuotes(bytes.substr(0, 8))) +
      ": expected a TIFF, PFM, NPY or PNG image");
}

}  // namespace

cv::Mat1f readDepthFile(const fs::path& file, std::optional<double> png_scale) {
  if (png_scale) {
    requireOption(*png_scale > 0 && std::isfinite(*png_scale), "scale", *png_scale, "above 0");
  }
  try {
    return parseDepth(readBytes(file), png_scale);
  } catch (const std::exception& error) {
    throw std::runtime_error("cannot read the depth map " + file.string() + ": " + error.what());
  }
}

cv::Mat1b readMaskFile(const fs::path& file) {
  try {
    // The maximum of the colours is used: OpenCV's conversion to grey rounds a dark blue to black.
    const cv::Mat channels = decodePicture(readBytes(file));
    cv::Mat1b mask(channels.size(), uchar{0});
    for (int c = 0; c < std::min(channels.channels(), 3); ++c) {  // the fourth channel is opacity
      cv::Mat one;
      cv::extractChannel(channels, one, c);
      mask |= one > 0;
    }
    return mask;
  } catch (const std::exception& error) {
    throw std::runtime_error("cannot read the mask " + file.string() + ": " + error.what());
  }
}

fs::path fileInFolder(const fs::path& path, std::initializer_list<const char*> names) {
  if (!fs::is_directory(path)) return path;
  std::string expected;
  for (const char* name : names) {
    if (fs::is_regular_file(path / name)) return path / name;
    expected += (expected.empty() ? "" : " or ") + std::string(name);
  }
  const bool killed = fs::exists(path / "run.lock");
  throw std::runtime_error(
      path.string() + ": a folder without " + expected +
      (killed ? ": the run that writes it was killed, or is not at its end yet" : ""));
}

namespace {

/// Returns the files <t>/depth.tiff.
std::vector<TimedFile> keyframesIn(const fs::path& folder) {
  std::vector<TimedFile> maps;
  const fs::path keyframes = folder / "keyframes";
  for (const auto& entry :
       fs::directory_iterator(fs::is_directory(keyframes) ? keyframes : folder)) {
    const auto t_ns = parseSeconds(entry.path().filename().string());
    const fs::path file = entry.path() / "depth.tiff";
    if (t_ns && fs::exists(file)) maps.push_back({*t_ns, file});
  }
  return maps;
}

/// Returns files with their time in the name, like "1.25.tiff" or "cam0_1.25.tiff".
std::vector<TimedFile> namedIn(const fs::path& folder) {
  const std::set<std::string> extensions = {".tiff", ".tif", ".pfm", ".npy", ".png"};
  std::vector<TimedFile> maps;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (extensions.count(entry.path().extension().string()) == 0) continue;
    const std::string stem = entry.path().stem().string();
    const auto t_ns = parseSeconds(stem.substr(stem.rfind('_') + 1));
    if (t_ns) maps.push_back({*t_ns, entry.path()});
  }
  return maps;
}

std::vector<TimedFile> indexIn(const fs::path& folder) {
  for (const fs::path& index : {folder / "depth" / "index.txt", folder / "index.txt"}) {
    if (!fs::exists(index)) continue;
    std::vector<TimedFile> maps = timedFilesIn(index);
    if (maps.empty()) throw std::runtime_error(index.string() + " lists no depth maps");
    return maps;
  }
  return {};
}

}  // namespace

std::vector<TimedFile> depthSeries(const fs::path& folder, DepthSeriesRole role) {
  const bool truth = role == DepthSeriesRole::kTruth;
  std::vector<TimedFile> maps = truth ? indexIn(folder) : keyframesIn(folder);
  if (maps.empty()) maps = truth ? keyframesIn(folder) : indexIn(folder);
  if (maps.empty()) maps = namedIn(folder);
  if (maps.empty()) {
    throw std::runtime_error("no depth maps in " + folder.string() +
                             ": expected keyframes/<t>/depth.tiff, depth/index.txt, index.txt, or "
                             "files with their time as name");
  }
  std::sort(maps.begin(), maps.end(), [](const TimedFile& a, const TimedFile& b) {
    return a.t_ns != b.t_ns ? a.t_ns < b.t_ns : a.file < b.file;
  });
  return maps;
}

const TimedFile* nearestFile(const std::vector<TimedFile>& series, std::int64_t t_ns,
                             std::int64_t within_ns) {
  const TimedFile* best = nullptr;
  const auto consider = [&](const TimedFile& file) {
    const std::int64_t off_ns = std::abs(file.t_ns - t_ns);
    if (off_ns <= within_ns && (!best || off_ns < std::abs(best->t_ns - t_ns))) best = &file;
  };
  const auto after = std::lower_bound(
      series.begin(), series.end(), t_ns,
      [](const TimedFile& file, std::int64_t time_ns) { return file.t_ns < time_ns; });
  if (after != series.begin()) consider(*(after - 1));
  if (after != series.end()) consider(*after);
  return best;
}

}  // namespace efm
