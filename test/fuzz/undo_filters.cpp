// SPDX-License-Identifier: BSD-3-Clause
// Undoes the filters of any bytes as a chunk of an HDF5 data set. The first byte selects the
// filters, the second byte the length of the numbers, two more bytes the length of the result.

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <vector>

#include "plugin/recordings/columns/chunk_filters.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  constexpr std::size_t kHeaderBytes = 4;
  if (size < kHeaderBytes) return 0;
  static const std::vector<std::vector<efm::ChunkFilter>> kFilters = {
      {32001}, {32000}, {1}, {2, 1}, {2, 32000}};
  const std::size_t element_bytes = std::size_t{1} << data[1] % 4;
  const std::size_t bytes = 1 + data[2] + data[3] * std::size_t{256};
  std::vector<std::uint8_t> chunk(data + kHeaderBytes, data + size);
  std::vector<std::uint8_t> scratch;
  const auto rejected = efm::undoFilters(kFilters[data[0] % kFilters.size()], 0, element_bytes,
                                         bytes, chunk, scratch);
  if (!rejected && chunk.size() != bytes) std::abort();
  return 0;
}
