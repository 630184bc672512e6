// SPDX-License-Identifier: BSD-3-Clause
// Reads any bytes as a NumPy array or an archive of arrays. Reads numbers and events, from
// the beginning and after a seek.

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "plugin/recordings/columns/event_arrays.h"
#include "plugin/recordings/columns/npy_array.h"
#include "plugin/recordings/files/file_content.h"
#include "test/fuzz/reading.h"

namespace {

/// Reads some rows of each block as numbers and as times.
void readNumbers(const std::shared_ptr<efm::NpyArray>& array, std::uint64_t first) {
  constexpr std::uint64_t kMaxRows = 100'000;
  for (std::uint64_t row = first; row < std::min(array->size(), kMaxRows);) {
    const std::uint64_t end = array->blockAt(row).end;
    const std::uint64_t rows = end - row;
    for (; row < end; row += std::max<std::uint64_t>(rows / 256, 1)) {
      for (std::size_t k = 0; k < array->columns(); ++k) {
        const efm::RowColumn column = efm::NpyArray::columnOf(array, k);
        column.number(row);
        column.time(row, 1'000'000'000);
        column.time(row, 1);
      }
    }
    row = end;
  }
}

}  // namespace

// NOLINTNEXTLINE(readability-identifier-naming)
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const efm::fuzz::MemoryFile file({}, data, size);
  const std::string path = file.path();
  if (efm::isCompressed(path)) {
    efm::fuzz::readOrReject(path, [&] {
      for (const std::string& member : efm::membersOf(path)) {
        efm::fuzz::readOrReject(
            path, [&] { readNumbers(std::make_shared<efm::NpyArray>(path, member), 0); });
      }
    });
  } else {
    efm::fuzz::readOrReject(path, [&] {
      const auto array = std::make_shared<efm::NpyArray>(path);
      readNumbers(array, 0);
      readNumbers(array, array->size() / 2);
    });
  }
  efm::ReaderOptions options;
  options.time_unit = "us";
  efm::fuzz::readOrReject(path, [&] {
    const auto camera = std::move(efm::openEventArrays({path}, options).cameras.at(0));
    camera->seek(1'000'000'000);
    std::vector<efm::Event> events;
    for (int blocks = 0; blocks < 4 && camera->read(events); ++blocks) camera->positionOf(0);
    if (!camera->damage().empty()) throw std::runtime_error(camera->damage());
  });
  return 0;
}
