// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace efm {

/// A filter of an HDF5 data set. This reader undoes four filters itself: deflate (1), shuffle (2),
/// LZF (32000, M3ED) and Blosc (32001, DSEC and TUM-VIE). The HDF5 library and its plugins trust
/// the lengths in a chunk, so a damaged chunk makes them read beyond their memory. Here the caller
/// gives the length of the result, and a chunk of another length is rejected.
using ChunkFilter = int;  ///< HDF5's number of the filter.

bool isKnownFilter(ChunkFilter filter);

/// Returns advice for a filter that the HDF5 library does not find: what to install or to do.
std::string adviceForFilter(ChunkFilter filter);

/// Undoes the filters of a chunk.
/// @param filters known filters, in the order in which the writer applied them.
/// @param skipped bit i is set if the writer left out filter i.
/// @param element_bytes size of a number of the data set.
/// @param chunk the stored bytes; replaced by the result.
/// @param bytes length of the result.
/// @param scratch a buffer to reuse.
/// @return std::nullopt, or the filter that rejected the chunk.
std::optional<ChunkFilter> undoFilters(const std::vector<ChunkFilter>& filters,
                                       std::uint32_t skipped, std::size_t element_bytes,
                                       std::size_t bytes, std::vector<std::uint8_t>& chunk,
                                       std::vector<std::uint8_t>& scratch);

}  // namespace efm
