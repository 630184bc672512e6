// SPDX-License-Identifier: BSD-3-Clause
// Reads any bytes as a file of one format, chosen when compiling:
//   EFM_FUZZ_HEADER      the header with the function that opens it
//   EFM_FUZZ_OPEN        that function: openAedat4
//   EFM_FUZZ_FIRST_LINE  optional: a line before the bytes
// A file may be read or rejected. An error names the file.
#include <cstddef>
#include <cstdint>
#include <string>

#include EFM_FUZZ_HEADER
#include "test/fuzz/reading.h"

namespace {

#ifdef EFM_FUZZ_FIRST_LINE
const std::string kBegin = EFM_FUZZ_FIRST_LINE "\n";
#else
const std::string kBegin;
#endif

/// @return the time of the middle event of the first stream.
std::int64_t readStreams(const std::string& path, const std::int64_t* seek_ns) {
  efm::RecordingParts parts = efm::EFM_FUZZ_OPEN({path}, {});
  std::int64_t middle_ns = 0;
  for (const auto& camera : parts.cameras) {
    if (seek_ns != nullptr) camera->seek(*seek_ns);
    middle_ns = efm::fuzz::readStream(*camera);
  }
  return middle_ns;
}

}  // namespace

// NOLINTNEXTLINE(readability-identifier-naming)
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const efm::fuzz::MemoryFile file(kBegin, data, size);
  std::int64_t middle_ns = 0;
  efm::fuzz::readOrReject(file.path(), [&] { middle_ns = readStreams(file.path(), nullptr); });
  efm::fuzz::readOrReject(file.path(), [&] { readStreams(file.path(), &middle_ns); });
  return 0;
}
