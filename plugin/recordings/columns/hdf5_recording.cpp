// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/recordings/columns/hdf5_files.h"

#include <fmt/format.h>

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <map>
#include <memory>
#include <optional>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "mapping/base/text.h"
#include "mapping/geometry/rigid3.h"
#include "mapping/geometry/timestamp.h"
#include "plugin/recordings/columns/event_table.h"
#include "plugin/recordings/columns/hdf5_crash_note.h"
#include "plugin/recordings/columns/hdf5_file.h"
#include "plugin/recordings/streams/time_unit.h"
#include "plugin/recordings/text/dataset_folder.h"
#include "plugin/recordings/text/event_columns.h"

namespace efm {
namespace {

namespace fs = std::filesystem;

/// The order of the columns in the layouts, and in the rows of a matrix.
constexpr std::string_view kHdf5Columns = "xytp";

/// A layout of events in HDF5. A new layout is a row of `hdf5Layouts`. Polarity 1 is on; 0 and -1
/// are off.
struct Hdf5Layout {
  std::string name;                  ///< Names of the data sets with this layout.
  std::vector<std::string> cameras;  ///< Groups in this order; not all need exist.
  /// The data set in the group whose rows are the events. Empty: a data set per column.
  std::string events;
  /// The names of x, y, t and p: data sets in the group, or fields of compound rows. Empty: the
  /// columns of a matrix in this order.
  std::array<std::string, 4> columns;
  /// Unit of t; 0: unknown. Floating-point times have this unit only if it is seconds. An unknown
  /// unit is found from the values (`findTimeUnit`).
  std::int64_t time_unit_ns = 0;
  std::string index{};   ///< Data set: first event of each millisecond of t; empty: none.
  std::string offset{};  ///< Data set: added to t, in units of `time_unit_ns`; empty: none.
  std::optional<CameraSize> size{};  ///< Size of the sensor, if all recordings have it.
  std::string order = std::string(kHdf5Columns);  ///< Of the columns of a matrix.

  /// Returns the data set that identifies a file with this layout.
  std::string signature() const { return events.empty() ? columns[0] : events; }
};

const std::vector<Hdf5Layout>& hdf5Layouts() {
  static const std::vector<Hdf5Layout> all = {
      // TUM-VIE's sensors have 1280x720 pixels, DSEC's and VECtor's 640x480.
      {"DSEC, TUM-VIE, VECtor",
       {""},
       "",
       {"/events/x", "/events/y", "/events/t", "/events/p"},
       kNanosecondsPerMicrosecond,
       "/ms_to_idx",
       "/t_offset"},
      {"E2VID", {""}, "", {"/events/xs", "/events/ys", "/events/ts", "/events/ps"}},
      {"M3ED",
       {"/prophesee/left", "/prophesee/right"},
       "",
       {"/x", "/y", "/t", "/p"},
       kNanosecondsPerMicrosecond,
       "/ms_map_idx",
       "",
       CameraSize{1280, 720}},
      {"MVSEC",
       {"/davis/left", "/davis/right"},
       "/events",
       {},
       kNanosecondsPerSecond,
       "",
       "",
       CameraSize{346, 260}},
      {"Metavision", {""}, "/CD/events", {"x", "y", "t", "p"}, kNanosecondsPerMicrosecond},
  };
  return all;
}

/// Opens the events of a camera. Floating-point times are rounded, see `nanoseconds`.
/// @param camera one of the layout's groups.
/// @param size size of the sensor, if it is known.
/// @param options unit of times, used if the layout has none.
/// @throws std::runtime_error naming the file and the data set that is missing or wrong, or whose
/// unit of time is not certain.
std::unique_ptr<EventStream> openHdf5Events(const std::shared_ptr<const Hdf5File>& file,
                                            const Hdf5Layout& layout, const std::string& camera,
                                            std::optional<CameraSize> size,
                                            const ReaderOptions& options) {
  const auto rows_of = [&](const std::string& name) {
    return std::make_shared<Hdf5Rows>(file, camera + name);
  };
  EventTable table;
  table.name = file->path().string();
  table.place = table.name + ":" + camera + layout.signature();
  if (layout.events.empty()) table.place.resize(table.place.rfind('/'));
  table.size = size;
  const auto rows = layout.events.empty() ? nullptr : rows_of(layout.events);
  for (std::size_t i = 0; i < layout.columns.size(); ++i) {
    const std::string& column = layout.columns[i];
    const auto of_column = rows ? rows : rows_of(column);
    if (!rows && of_column->rowNumbers() > 1) {
      throw of_column->fail(
          fmt::format("N x {} numbers: expected a list; for an N x 4 data set "
                      "/events: --event-columns \"t x y p\"",
                      of_column->rowNumbers()));
    }
    table.column(kHdf5Columns[i]) =
        rows && !column.empty()
            ? Hdf5Rows::ofField(rows, column)
            : Hdf5Rows::ofMatrix(of_column, rows ? layout.order.find(kHdf5Columns[i]) : 0);
    if (of_column->size() != table.column('x').rows->size()) {
      throw of_column->fail(fmt::format("{} numbers: expected {}, as many as {}{} has",
                                        of_column->size(), table.column('x').rows->size(), camera,
                                        layout.columns[0]));
    }
    if (kHdf5Columns[i] == 't') table.times = table.name + ":" + of_column->path();
  }
  const bool has_unit = layout.time_unit_ns == kNanosecondsPerSecond ||
                        (layout.time_unit_ns != 0 && !isReal(table.column('t').type));
  if (has_unit) table.time_unit_ns = layout.time_unit_ns;
  if (!layout.offset.empty() && file->has(camera + layout.offset)) {
    const std::string path = camera + layout.offset;
    const std::int64_t offset = file->integer(path);
    const auto offset_ns = nanoseconds(offset, layout.time_unit_ns);
    if (!offset_ns) throw file->fail(path, fmt::format("{}: expected a time", offset));
    table.offset_ns = *offset_ns;
  }
  if (!layout.index.empty() && file->has(camera + layout.index)) {
    table.index = Hdf5Rows::ofMatrix(rows_of(layout.index), 0);
  }
  return eventsOf(std::move(table), options);
}

/// Poses in HDF5: 4x4 matrices and their times.
struct Hdf5Poses {
  const char* matrices;
  const char* times;
  std::int64_t time_unit_ns;
  bool inverse;  ///< True if the matrices are T_body_world.
};

constexpr Hdf5Poses kPoses[] = {
    {"/davis/left/pose", "/davis/left/pose_ts", kNanosecondsPerSecond, false},
    {"/Cn_T_C0", "/ts", kNanosecondsPerMicrosecond, true},
};

constexpr std::size_t kMatrixNumbers = 16;

/// Returns the transform in the rows of a 4x4 matrix; std::nullopt if it is not rigid.
std::optional<Rigid3> transformOf(const double* rows) {
  return transformNear(Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(rows));
}

constexpr const char* kExpectedRigid = "a 4x4 matrix of a rotation and a translation";

std::vector<StampedPose> readPoses(const std::shared_ptr<const Hdf5File>& file,
                                   const Hdf5Poses& poses) {
  const auto matrices = std::make_shared<Hdf5Rows>(file, poses.matrices);
  const auto times = std::make_shared<Hdf5Rows>(file, poses.times);
  if (matrices->rowNumbers() != kMatrixNumbers || matrices->size() != times->size()) {
    throw matrices->fail(
        fmt::format("{} rows of {} numbers: expected {} matrices of 4x4 numbers, "
                    "as many as {} has",
                    matrices->size(), matrices->rowNumbers(), times->size(), poses.times));
  }
  const RowColumn time = Hdf5Rows::ofMatrix(times, 0);
  std::vector<RowColumn> numbers;
  for (std::size_t k = 0; k < kMatrixNumbers; ++k) {
    numbers.push_back(Hdf5Rows::ofMatrix(matrices, k));
  }
  std::vector<StampedPose> read;
  for (std::uint64_t i = 0; i < times->size(); ++i) {
    time.from(i).forEach(1, [&](std::size_t, auto number) {
      const auto t_ns = nanoseconds(number, poses.time_unit_ns);
      if (!t_ns) throw times->failAt(i, fmt::format("{}: expected {}", number, kExpectedTime));
      read.push_back({*t_ns, {}});
      return true;
    });
    double rows[kMatrixNumbers];
    for (std::size_t k = 0; k < kMatrixNumbers; ++k) rows[k] = numbers[k].number(i);
    const std::optional<Rigid3> transform = transformOf(rows);
    if (!transform) throw matrices->failAt(i, fmt::format("expected {}", kExpectedRigid));
    read.back().T_world_rig = poses.inverse ? transform->inverse() : *transform;
  }
  return read;
}

/// Reads M3ED's calibration of a camera.
RigCamera readCalib(const Hdf5File& file, const std::string& group) {
  RigCamera camera;
  CameraModel& model = camera.model;
  const std::vector<double> resolution = file.numbers(group + "/resolution", 2, "width and height");
  for (const double side : resolution) {
    if (side < 1 || side > 65'535 || std::floor(side) != side) {
      throw file.fail(group + "/resolution",
                      fmt::format("{}: expected whole numbers from 1 to 65535", side));
    }
  }
  const auto width = static_cast<int>(resolution[0]);
  const auto height = static_cast<int>(resolution[1]);
  const std::vector<double> k = file.numbers(group + "/intrinsics", 4, "fx fy cx cy");
  model = {width, height, k[0], k[1], k[2], k[3], DistortionModel::kNone, {}};
  const std::string distortion = file.text(group + "/distortion_model");
  try {
    model.distortion = fromName<DistortionModel>(distortion);
  } catch (const std::invalid_argument&) {
    throw file.fail(group + "/distortion_model",
                    inQuotes(distortion) + ": expected radtan, equidistant or none");
  }
  if (model.distortion != DistortionModel::kNone) {
    model.coefficients = file.numbers(group + "/distortion_coeffs", 4, "k1 k2 and two more");
  }
  const std::string transform = group + "/T_to_prophesee_left";
  const std::optional<Rigid3> T_rig_cam =
      transformOf(file.numbers(transform, kMatrixNumbers, kExpectedRigid).data());
  if (!T_rig_cam) throw file.fail(transform, fmt::format("expected {}", kExpectedRigid));
  camera.T_rig_cam = *T_rig_cam;
  try {
    camera.validate();
  } catch (const std::invalid_argument& error) {
    throw file.fail(group, error.what());
  }
  return camera;
}

/// Reads the size from Metavision's attribute.
std::optional<CameraSize> sizeOfAttribute(const Hdf5File& file) {
  const std::optional<std::string> text = file.attribute("geometry");
  return text ? cameraSizeOf(*text) : std::nullopt;
}

/// Adds the cameras of a layout. @return whether the file has any.
bool addCameras(const std::shared_ptr<const Hdf5File>& file, const Hdf5Layout& layout,
                const ReaderOptions& options, RecordingParts& parts) {
  Calibration calibration{file->path(), {}};
  std::size_t count = 0;
  for (const std::string& camera : layout.cameras) {
    if (!file->has(camera + layout.signature())) continue;
    std::optional<CameraSize> size = layout.size ? layout.size : sizeOfAttribute(*file);
    if (const std::string calib = camera + "/calib"; file->has(calib)) {
      const RigCamera calibrated = readCalib(*file, calib);
      size = CameraSize{calibrated.model.width, calibrated.model.height};
      calibration.rig.cameras.push_back(calibrated);
    }
    parts.cameras.push_back(openHdf5Events(file, layout, camera, size, options));
    ++count;
  }
  // If the first camera is missing, T_rig_cam of the others refers to another rig.
  if (count > 0 && calibration.rig.cameras.size() == count && !parts.calibration &&
      isSame(calibration.rig.cameras.front().T_rig_cam, Rigid3())) {
    parts.calibration = std::move(calibration);
  }
  return count > 0;
}

/// Makes the layout of data sets, or of fields of a compound data set, with given names.
Hdf5Layout namedLayout(const Hdf5File& file, const EventNames& names) {
  Hdf5Layout layout = {"--event-columns", {""}, "", {}};
  for (std::size_t i = 0; i < layout.columns.size(); ++i) {
    const std::string& name = names[kEventColumns.find(kHdf5Columns[i])];
    layout.columns[i] = (name.front() == '/' ? "" : "/") + name;
  }
  const std::string parent = fs::path(layout.columns[0]).parent_path().string();
  if (file.has(layout.columns[0]) || !file.has(parent)) return layout;
  layout.events = parent;
  for (std::string& column : layout.columns) {
    const fs::path path = column;
    if (path.parent_path() != parent) throw file.fail(column, "expected a field of " + parent);
    column = path.filename().string();
  }
  return layout;
}

/// Adds the cameras of the layout that the option names, or of the known layouts.
bool addEvents(const std::shared_ptr<const Hdf5File>& file, const ReaderOptions& options,
               RecordingParts& parts) {
  const std::optional<EventNames> names = eventNamesOf(options.columns);
  if (names) {
    const Hdf5Layout layout = namedLayout(*file, *names);
    ReaderOptions named = options;
    const auto exponent = headerWord(fs::path(names->front()).filename().string()).time_exponent;
    if (named.time_unit.empty() && exponent) named.time_unit = timeUnitOf(*exponent);
    if (addCameras(file, layout, named, parts)) return true;
  }
  bool any = false;
  for (const Hdf5Layout& layout : hdf5Layouts()) {
    any = addCameras(file, layout, options, parts) || any;
  }
  if (constexpr const char* kMatrix = "/events";
      !any && !names && !options.columns.empty() && file->has(kMatrix)) {
    Hdf5Layout matrix = {"--event-columns", {""}, kMatrix, {}};
    matrix.order = orderOfOption(options.columns);
    return addCameras(file, matrix, options, parts);
  }
  if (any && names) throw file->fail("/" + (*names)[1], "no such data set (--event-columns)");
  return any;
}

/// Adds a file. @return whether it has events or poses.
bool addFile(const fs::path& path, const ReaderOptions& options, RecordingParts& parts) {
  constexpr unsigned kLimitS = 60;
  const Hdf5CrashNote note(path, kLimitS);
  const auto file = std::make_shared<const Hdf5File>(path);
  bool any = addEvents(file, options, parts);
  for (const Hdf5Poses& poses : kPoses) {
    if (!file->has(poses.matrices)) continue;
    any = true;
    // M3ED repeats the poses in the file of the depth maps.
    if (parts.poses.empty()) parts.poses = readPoses(file, poses);
  }
  return any;
}

[[noreturn]] void reject(const fs::path& path) {
  std::string expected;
  for (const Hdf5Layout& layout : hdf5Layouts()) {
    expected += fmt::format("{}{} ({}), ", layout.cameras.front(), layout.signature(), layout.name);
  }
  throw std::runtime_error(
      fmt::format("{}: an HDF5 file without events or poses: expected {}others by "
                  "--event-columns \"t=PATH x=PATH y=PATH p=PATH\" (an N x 4 data set /events: "
                  "\"t x y p\"), or poses, {} (MVSEC) or {} (M3ED)",
                  path.string(), expected, kPoses[0].matrices, kPoses[1].matrices));
}

void addFolder(const fs::path& folder, const ReaderOptions& options, RecordingParts& parts) {
  bool any = false;
  std::map<std::string, fs::path> files;  // the file with events of each side
  for (const auto& [side, file] : hdf5FilesIn(folder)) {
    const std::size_t cameras = parts.cameras.size();
    any = addFile(file, options, parts) || any;
    if (parts.cameras.size() == cameras) continue;
    const auto [other, is_new] = files.emplace(side, file);
    if (!is_new) {
      throw std::runtime_error(
          fmt::format("{}: events of a second recording, beside {}: expected "
                      "a folder of one recording",
                      file.string(), other->second.string()));
    }
  }
  if (!any) reject(folder);
  addFolderFiles(folder, options, parts);
}

}  // namespace

RecordingParts openHdf5(const std::vector<fs::path>& sources, const ReaderOptions& options) {
  RecordingParts parts;
  for (const fs::path& source : sources) {
    std::error_code ignored;
    if (!fs::is_directory(source, ignored)) {
      if (!addFile(source, options, parts)) reject(source);
      continue;
    }
    addFolder(source, options, parts);
  }
  return parts;
}

}  // namespace efm
