// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/numpy/evimo2.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>

#include "plugin/numpy/npy_array.h"
#include "plugin/streams/number_checks.h"
#include "plugin/streams/source_files.h"
#include "plugin/streams/time_unit.h"
#include "tracking_stub/poses/tum_trajectory.h"

namespace efm {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kEvimo2BlockRows = std::size_t{1} << 16;
constexpr CameraSize kEvimo2Size = {640, 480};

/// The data set's layout is CAMERA/CATEGORY/SUBCATEGORY/SEQUENCE.
bool isSamsung(const fs::path& folder) {
  std::error_code ignored;
  const fs::path absolute = fs::absolute(folder, ignored);
  return std::any_of(absolute.begin(), absolute.end(),
                     [](const fs::path& part) { return part.string().rfind("samsung", 0) == 0; });
}

/// The size of the first array of dataset_depth.npz.
std::optional<CameraSize> sizeOfDepth(const fs::path& folder) {
  const fs::path file = folder / "dataset_depth.npz";
  if (!isFile(file)) return std::nullopt;
  const std::vector<std::string> members = membersOf(file);
  if (members.empty()) return std::nullopt;
  const NpyArray array(file, members.front());
  const std::vector<std::uint64_t>& shape = array.header().shape;
  if (shape.size() != 2 || shape[0] - 1 >= 65'535 || shape[1] - 1 >= 65'535) return std::nullopt;
  return CameraSize{static_cast<int>(shape[1]), static_cast<int>(shape[0])};
}

std::vector<double> numbersOf(NpyArray array, std::size_t max_count) {
  if (array.header().count() > max_count) {
    throw std::runtime_error(fmt::format("{}: {} numbers: expected at most {}", array.name(),
                                         array.header().count(), max_count));
  }
  std::vector<double> numbers;
  const std::size_t rows = array.readRows(max_count);
  for (std::size_t row = 0; row < rows; ++row) {
    for (std::size_t column = 0; column < array.columns(); ++column) {
      numbers.push_back(array.number(row, column));
    }
  }
  return numbers;
}

/// The camera's model, without the sensor's size.
CameraModel modelOf(const fs::path& info) {
  const std::vector<double> k = numbersOf(NpyArray(info, "K.npy"), 9);
  if (k.size() != 9) throw std::runtime_error(info.string() + "/K.npy: expected 3 x 3 numbers");
  CameraModel model;
  model.width = kEvimo2Size.width;
  model.height = kEvimo2Size.height;
  model.fx = k[0];
  model.cx = k[2];
  model.fy = k[4];
  model.cy = k[5];
  model.distortion = DistortionModel::kRadtan;
  model.coefficients = numbersOf(NpyArray(info, "D.npy"), 5);
  try {
    model.validate();
  } catch (const std::invalid_argument& error) {
    throw std::runtime_error(fmt::format("{}: {}", info.string(), error.what()));
  }
  model.width = 0;
  model.height = 0;
  return model;
}

class Evimo2Events : public EventStream {
 public:
  Evimo2Events(const fs::path& folder, const ReaderOptions& options)
      : t_(folder / "dataset_events_t.npy"),
        xy_(folder / "dataset_events_xy.npy"),
        p_(folder / "dataset_events_p.npy"),
        inverted_(isSamsung(folder)),
        size_(sizeOfDepth(folder)) {
    requireShape(t_, 1);
    requireShape(xy_, 2);
    requireShape(p_, 1);
    if (!t_.isReal()) time_exponent_ = wholeTimeExponent(options);
  }

  bool read(std::vector<Event>& events) override {
    events.clear();
    begin_ = t_.position();
    const std::size_t rows = t_.readRows(kEvimo2BlockRows);
    if (rows == 0) return false;
    xy_.readRows(kEvimo2BlockRows);
    p_.readRows(kEvimo2BlockRows);
    events.reserve(rows);
    for (std::size_t row = 0; row < rows; ++row) events.push_back(eventAt(row));
    return true;
  }

  void seek(std::int64_t t_ns) override {
    // An event of t_ns or later is not before one that is more than 10 ms older.
    const std::int64_t before_ns = t_ns - kMaxEventDelayNs;
    std::uint64_t low = 0;
    std::uint64_t high = t_.rows();
    while (low < high) {
      const std::uint64_t middle = low + (high - low) / 2;
      t_.seek(middle);
      t_.readRows(1);
      const std::optional<std::int64_t> t = t_.time(0, 0, time_exponent_);
      if (t && *t < before_ns) {
        low = middle + 1;
      } else {
        high = middle;
      }
    }
    for (NpyArray* array : {&t_, &xy_, &p_}) array->seek(low);
  }

  std::string positionOf(std::size_t index) const override {
    return fmt::format("{}: row {}", t_.name(), begin_ + index);
  }
  std::string name() const override { return t_.name(); }
  double progress() const override {
    return t_.rows() == 0 ? 1 : static_cast<double>(t_.position()) / static_cast<double>(t_.rows());
  }
  std::optional<CameraSize> size() const override { return size_; }
  std::vector<Warning> warnings() const override { return warnings_; }

 private:
  void requireShape(const NpyArray& array, std::size_t columns) const {
    if (array.rows() == t_.rows() && (array.columns() == columns || array.rows() == 0)) return;
    throw std::runtime_error(fmt::format("{}: {} rows of {} numbers: expected {} of {}",
                                         array.name(), array.rows(), array.columns(), t_.rows(),
                                         columns));
  }

  int wholeTimeExponent(const ReaderOptions& options) {
    TimeSample sample;
    const std::size_t rows = t_.readRows(1000);
    for (std::size_t row = 0; row < rows; ++row) {
      sample.add(t_.number(row), true);
    }
    t_.seek(0);
    TimeUnit unit = findTimeUnit(options, sample, kUsualEventRate, t_.name());
    if (unit.warning) warnings_.push_back(std::move(*unit.warning));
    return unit.exponent;
  }

  Event eventAt(std::size_t row) const {
    const std::optional<std::int64_t> t_ns = t_.time(row, 0, time_exponent_);
    if (!t_ns) {
      throw t_.failure(begin_ + row,
                       fmt::format("t = {}: expected a time before the year 2116", t_.number(row)));
    }
    Event event;
    event.t_ns = *t_ns;
    event.x = pixel(row, 0, "x");
    event.y = pixel(row, 1, "y");
    const double polarity = p_.number(row);
    if (polarity != 0 && polarity != 1) {
      throw p_.failure(begin_ + row, fmt::format("p = {}: expected polarity 0 or 1", polarity));
    }
    event.polarity = (polarity == 1) != inverted_;
    return event;
  }

  std::uint16_t pixel(std::size_t row, std::size_t column, const char* name) const {
    const double value = xy_.number(row, column);
    if (const auto pixel = wholeNumber(value, 0, 65'535)) return static_cast<std::uint16_t>(*pixel);
    throw xy_.failure(begin_ + row,
                      fmt::format("{} = {}: expected a whole number from 0 to 65535", name, value));
  }

  NpyArray t_;
  NpyArray xy_;
  NpyArray p_;
  bool inverted_;
  std::optional<CameraSize> size_;
  int time_exponent_ = 0;
  std::vector<Warning> warnings_;
  std::uint64_t begin_ = 0;  // row of the block
};

}  // namespace

bool looksLikeEvimo2(const fs::path& folder) { return isFile(folder / "dataset_events_t.npy"); }

RecordingParts openEvimo2(const std::vector<fs::path>& folders, const ReaderOptions& options) {
  RecordingParts parts;
  parts.default_size = kEvimo2Size;
  parts.expected_poses = "poses.txt, from dataset_info.npz (docs/recordings.md)";
  for (const fs::path& folder : folders) {
    parts.cameras.push_back(std::make_unique<Evimo2Events>(folder, options));
    if (parts.poses.empty() && isFile(folder / "poses.txt")) {
      parts.poses = readPosesFile(folder / "poses.txt");
    }
  }
  const fs::path info = folders.front() / "dataset_info.npz";
  if (folders.size() == 1 && isFile(info)) {
    parts.calibration = Calibration{info, {{{modelOf(info), {}, 0}}}};
  } else {
    parts.expected_calibration =
        folders.size() == 1 ? "dataset_info.npz" : "one of all cameras (docs/recordings.md)";
  }
  return parts;
}

}  // namespace efm
