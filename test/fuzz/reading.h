// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <sys/mman.h>
#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <stdexcept>
#include <string>
#include <vector>

#include "plugin/recordings/streams/recording_parts.h"

/// Helpers of all fuzz harnesses.
namespace efm::fuzz {

/// A file that exists only in memory.
class MemoryFile {
 public:
  MemoryFile(const std::string& begin, const std::uint8_t* data, std::size_t size)
      : file_(memfd_create("fuzz", 0)) {
    if (file_ < 0 || write(file_, begin.data(), begin.size()) < 0 || write(file_, data, size) < 0) {
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

/// Reads at most 4 million events of a stream, so that no input takes long.
/// @return the time of the middle event of the first block that is not empty; 0 without events.
inline std::int64_t readStream(EventStream& stream) {
  constexpr std::size_t kMaxEvents = 4'000'000;
  std::int64_t middle_ns = 0;
  std::vector<Event> events;
  for (std::size_t count = 0; count < kMaxEvents && stream.read(events);) {
    if (count == 0 && !events.empty()) {
      middle_ns = events[events.size() / 2].t_ns;
      if (stream.positionOf(events.size() - 1).empty()) std::abort();
    }
    // A block without events also takes time.
    count += events.size() + 1;
  }
  if (!stream.damage().empty()) throw std::runtime_error(stream.damage());
  return middle_ns;
}

/// Calls `read`. It may reject a file with an error that names the file.
template <typename Read>
void readOrReject(const std::string& file, const Read& read) {
  try {
    read();
  } catch (const std::runtime_error& error) {
    if (std::string(error.what()).find(file) == std::string::npos) {
      std::fprintf(stderr, "an error without the file's name: %s\n", error.what());
      std::abort();
    }
  }
}

}  // namespace efm::fuzz
