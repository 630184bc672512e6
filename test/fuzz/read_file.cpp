// SPDX-License-Identifier: BSD-3-Clause
// Reads any bytes as a file of one format, chosen when compiling:
//   EFM_FUZZ_HEADER      the header with the function that opens it
//   EFM_FUZZ_OPEN        that function: openAedat4
//   EFM_FUZZ_FIRST_LINE  optional: a line before the bytes
// A file may be read or refused. An error names the file.
#include <sys/mman.h>
#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <stdexcept>
#include <string>
#include <vector>

#include EFM_FUZZ_HEADER

namespace {

#ifdef EFM_FUZZ_FIRST_LINE
const std::string kBegin = EFM_FUZZ_FIRST_LINE "\n";
#else
const std::string kBegin;
#endif

/// A file in memory.
class MemoryFile {
 public:
  MemoryFile(const std::uint8_t* data, std::size_t size) : file_(memfd_create("fuzz", 0)) {
    if (file_ < 0 || write(file_, kBegin.data(), kBegin.size()) < 0 ||
        write(file_, data, size) < 0) {
      std::perror("memfd");
      std::abort();
    }
  }
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;
  ~MemoryFile() { close(file_); }
  std::string path() const { return "/proc/self/fd/" + std::to_string(file_); }

 private:
  int file_;
};

/// Reads all streams, at most so many events that no input takes long.
/// @return the time in the middle of the first stream.
std::int64_t readStreams(const std::string& path, const std::int64_t* seek_ns) {
  constexpr std::size_t kMaxEvents = 4'000'000;
  efm::RecordingParts parts = efm::EFM_FUZZ_OPEN({path}, {});
  std::int64_t middle_ns = 0;
  std::vector<efm::Event> events;
  for (const auto& camera : parts.cameras) {
    if (seek_ns != nullptr) camera->seek(*seek_ns);
    for (std::size_t count = 0; count < kMaxEvents && camera->read(events);) {
      if (count == 0 && !events.empty()) {
        middle_ns = events[events.size() / 2].t_ns;
        if (camera->positionOf(events.size() - 1).empty()) std::abort();
      }
      // A block without events costs time, too.
      count += events.size() + 1;
    }
  }
  return middle_ns;
}

void readOrRefuse(const std::string& path, const std::int64_t* seek_ns, std::int64_t& middle_ns) {
  try {
    middle_ns = readStreams(path, seek_ns);
  } catch (const std::runtime_error& error) {
    if (std::string(error.what()).find(path) == std::string::npos) {
      std::fprintf(stderr, "an error without the file's name: %s\n", error.what());
      std::abort();
    }
  }
}

}  // namespace

// NOLINTNEXTLINE(readability-identifier-naming)
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const MemoryFile file(data, size);
  std::int64_t middle_ns = 0;
  readOrRefuse(file.path(), nullptr, middle_ns);
  const std::int64_t seek_ns = middle_ns;
  readOrRefuse(file.path(), &seek_ns, middle_ns);
  return 0;
}
