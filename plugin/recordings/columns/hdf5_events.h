// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "plugin/recordings/columns/hdf5_file.h"
#include "plugin/recordings/streams/recording_parts.h"

namespace efm {

/// How a data set stores its events in HDF5. A new one is a row of the table in hdf5_events.cpp.
/// Polarity 1 is on; 0 and -1 are off.
struct Hdf5Layout {
  std::string name;                  ///< Of the data sets that have it.
  std::vector<std::string> cameras;  ///< Groups; those that exist, in this order.
  /// The data set, in the group, whose rows are the events. Empty: a data set per column.
  std::string events;
  /// x, y, t and p: data sets in the group; the fields of compound rows; empty: the columns of a
  /// matrix in this order.
  std::array<std::string, 4> columns;
  /// Of t. 0: it is not known. Real times have this unit only if it is seconds. An unknown unit is
  /// found from the values (`findTimeUnit`).
  std::int64_t time_unit_ns = 0;
  std::string index;   ///< In the group: the first event of each millisecond of t. Or empty.
  std::string offset;  ///< In the group: is added to t; a whole number of `time_unit_ns`. Or empty.
  std::optional<CameraSize> size;  ///< Of the sensor, if all recordings have the same.

  /// The data set by which a file with this layout is known.
  std::string signature() const { return events.empty() ? columns[0] : events; }
};

const std::vector<Hdf5Layout>& hdf5Layouts();

/// The events of a camera in an HDF5 file. Real times are rounded to what they resolve
/// (`nanoseconds`). Reads chunk by chunk; `seek` reads the index and a few chunks.
/// @param camera one of the layout's groups.
/// @param size of the sensor, if it is known.
/// @param options the unit of times that the layout does not know.
/// @throws std::runtime_error naming the file and the data set that is missing or wrong, or whose
/// unit of time is not certain.
std::unique_ptr<EventStream> openHdf5Events(std::shared_ptr<const Hdf5File> file,
                                            const Hdf5Layout& layout, const std::string& camera,
                                            std::optional<CameraSize> size,
                                            const ReaderOptions& options);

}  // namespace efm
