// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace efm {

/// The filters of an HDF5 data set that this reader undoes itself: deflate (1), shuffle (2), LZF
/// (32000, M3ED) and Blosc (32001, DSEC and TUM-VIE). The HDF5 library and its plugins believe the
/// lengths in a chunk: a damaged chunk makes them read beyond their memory. Here the length of the
/// result is given, and every chunk of another length is refused.
using ChunkFilter = int;  ///< HDF5's number.

bool isKnownFilter(ChunkFilter filter);

/// What to install, or to do, for a filter that the HDF5 library does not find.
std::string adviceForFilter(ChunkFilter filter);

/// Undoes the filters of a chunk.
/// @param filters in the order in which the writer applied them, known ones.
/// @param skipped bit i is set if the writer left out filter i.
/// @param element_bytes of a number of the data set.
/// @param chunk the stored bytes; replaced by the result.
/// @param bytes length of the result.
/// @param scratch a buffer to reuse.
/// @return nothing, or the filter that refused the chunk.
std::optional<ChunkFilter> undoFilters(const std::vector<ChunkFilter>& filters,
                                       std::uint32_t skipped, std::size_t element_bytes,
                                       std::size_t bytes, std::vector<std::uint8_t>& chunk,
                                       std::vector<std::uint8_t>& scratch);

}  // namespace efm
