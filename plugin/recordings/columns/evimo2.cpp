// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/recordings/columns/event_arrays.h"
#include "plugin/recordings/text/pose_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "mapping/geometry/timestamp.h"
#include "mapping/geometry/trajectory.h"

namespace efm {
namespace {

namespace fs = std::filesystem;

constexpr CameraSize kEvimo2Size = {640, 480};

/// Finds the camera in the path: the layout is CAMERA/CATEGORY/SUBCATEGORY/SEQUENCE.
bool isSamsung(const fs::path& folder) {
  std::error_code ignored;
  const fs::path absolute = fs::absolute(folder, ignored);
  return std::any_of(absolute.begin(), absolute.end(),
                     [](const fs::path& part) { return part.string().rfind("samsung", 0) == 0; });
}

/// Returns the size of the first array of dataset_depth.npz.
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

std::unique_ptr<EventStream> eventsOf(const fs::path& folder, const ReaderOptions& options) {
  const auto t = std::make_shared<NpyArray>(folder / "dataset_events_t.npy");
  const auto xy = std::make_shared<NpyArray>(folder / "dataset_events_xy.npy");
  const auto p = std::make_shared<NpyArray>(folder / "dataset_events_p.npy");
  const auto require_shape = [&](const NpyArray& array, std::size_t columns) {
    if (array.size() == t->size() && (array.columns() == columns || array.size() == 0)) return;
    throw std::runtime_error(fmt::format("{}: {} rows of {} numbers: expected {} of {}",
                                         array.name(), array.size(), array.columns(), t->size(),
                                         columns));
  };
  require_shape(*t, 1);
  require_shape(*xy, 2);
  require_shape(*p, 1);
  EventTable table;
  table.columns = {NpyArray::columnOf(t, 0), NpyArray::columnOf(xy, 0), NpyArray::columnOf(xy, 1),
                   NpyArray::columnOf(p, 0)};
  if (isReal(table.column('t').type)) table.time_unit_ns = kNanosecondsPerSecond;
  table.inverted = isSamsung(folder);
  table.size = sizeOfDepth(folder);
  return openArrayEvents(std::move(table), options);
}

}  // namespace

bool looksLikeEvimo2(const fs::path& folder) { return isFile(folder / "dataset_events_t.npy"); }

RecordingParts openEvimo2(const std::vector<fs::path>& folders, const ReaderOptions& options) {
  RecordingParts parts;
  parts.default_size = kEvimo2Size;
  parts.expected_poses = "poses.txt, from dataset_info.npz (docs/recordings.md)";
  for (const fs::path& folder : folders) {
    parts.cameras.push_back(eventsOf(folder, options));
    if (parts.poses.empty() && isFile(folder / "poses.txt")) {
      parts.poses = readPoseText(folder / "poses.txt", options, parts);
    }
  }
  const fs::path info = folders.front() / "dataset_info.npz";
  if (folders.size() == 1 && isFile(info)) {
    parts.calibration = Calibration{info, {{{lensIn(info), {}, 0}}}};
  } else {
    parts.expected_calibration =
        folders.size() == 1 ? "dataset_info.npz" : "one of all cameras (docs/recordings.md)";
  }
  return parts;
}

}  // namespace efm
