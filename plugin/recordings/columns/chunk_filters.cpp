// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/recordings/columns/chunk_filters.h"

#include <blosc.h>
#include <fmt/format.h>
#include <liblzf/lzf.h>
#include <zlib.h>

#include <algorithm>
#include <limits>

namespace efm {
namespace {

constexpr ChunkFilter kDeflate = 1;
constexpr ChunkFilter kShuffle = 2;
constexpr ChunkFilter kLzo = 305;
constexpr ChunkFilter kBzip2 = 307;
constexpr ChunkFilter kLz4 = 32004;
constexpr ChunkFilter kBitshuffle = 32008;
constexpr ChunkFilter kLzf = 32000;
constexpr ChunkFilter kBlosc = 32001;
constexpr ChunkFilter kEcf = 0x8ECF;

using Bytes = std::vector<std::uint8_t>;

bool inflateChunk(const Bytes& in, Bytes& out) {
  uLongf count = out.size();
  return uncompress(out.data(), &count, in.data(), in.size()) == Z_OK && count == out.size();
}

bool expandLzf(const Bytes& in, Bytes& out) {
  constexpr std::size_t kMax = std::numeric_limits<unsigned>::max();
  if (in.empty() || in.size() > kMax || out.size() > kMax) return false;
  return lzf_decompress(in.data(), static_cast<unsigned>(in.size()), out.data(),
                        static_cast<unsigned>(out.size())) == out.size();
}

bool expandBlosc(const Bytes& in, Bytes& out) {
  std::size_t count = 0;
  if (in.size() < BLOSC_MIN_HEADER_LENGTH ||
      blosc_cbuffer_validate(in.data(), in.size(), &count) < 0 || count != out.size()) {
    return false;
  }
  std::size_t number_bytes = 0;
  int flags = 0;
  blosc_cbuffer_metainfo(in.data(), &number_bytes, &flags);
  if (number_bytes == 0) return false;  // Blosc divides by it
  return blosc_decompress_ctx(in.data(), out.data(), out.size(), 1) == static_cast<int>(out.size());
}

/// Restores numbers that are stored plane by plane: all first bytes, all second bytes, …. Bytes
/// that are not a complete number are at the end.
void unshuffle(std::size_t element_bytes, const Bytes& in, Bytes& out) {
  const std::size_t count = in.size() / element_bytes;
  for (std::size_t k = 0; k < element_bytes; ++k) {
    const std::uint8_t* const plane = in.data() + k * count;
    for (std::size_t i = 0; i < count; ++i) out[i * element_bytes + k] = plane[i];
  }
  const auto rest = static_cast<std::ptrdiff_t>(count * element_bytes);
  std::copy(in.begin() + rest, in.end(), out.begin() + rest);
}

bool undo(ChunkFilter filter, std::size_t element_bytes, const Bytes& in, Bytes& out) {
  switch (filter) {
    case kDeflate:
      return inflateChunk(in, out);
    case kShuffle:
      if (in.size() != out.size()) return false;
      unshuffle(element_bytes, in, out);
      return true;
    case kLzf:
      return expandLzf(in, out);
    case kBlosc:
      return expandBlosc(in, out);
    default:
      return false;
  }
}

}  // namespace

bool isKnownFilter(ChunkFilter filter) {
  return filter == kDeflate || filter == kShuffle || filter == kLzf || filter == kBlosc;
}

std::string adviceForFilter(ChunkFilter filter) {
  if (filter == kEcf) {
    return "Prophesee's ECF (0x8ECF), which no Debian package has: expected its plugin (hdf5_ecf) "
           "in HDF5_PLUGIN_PATH, or the RAW file in place of this one";
  }
  if (filter == kLzo) {
    return "LZO of PyTables (305), which no Debian package of HDF5 has: expected the file without "
           "it "
           "(package python3-tables: ptrepack --complib=zlib --complevel=1 FILE:/ NEW:/)";
  }
  const bool packed = filter == kBzip2 || filter == kLz4 || filter == kBitshuffle;
  return fmt::format(
      "filter {}, which this system does not have: expected its plugin in HDF5_PLUGIN_PATH{}",
      filter, packed ? " (Debian: hdf5-filter-plugin)" : "");
}

std::optional<ChunkFilter> undoFilters(const std::vector<ChunkFilter>& filters,
                                       std::uint32_t skipped, std::size_t element_bytes,
                                       std::size_t bytes, Bytes& chunk, Bytes& scratch) {
  for (std::size_t i = filters.size(); i-- > 0;) {
    if (i < std::numeric_limits<std::uint32_t>::digits && ((skipped >> i) & 1U) != 0) continue;
    scratch.resize(bytes);
    if (!undo(filters[i], element_bytes, chunk, scratch)) return filters[i];
    chunk.swap(scratch);
  }
  return std::nullopt;
}

}  // namespace efm
