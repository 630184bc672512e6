// SPDX-License-Identifier: BSD-3-Clause
// Reads any bytes as a NumPy array or an archive of arrays: its numbers, from its beginning and
// after a seek, its poses and its events.

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "plugin/recordings/columns/event_arrays.h"
#include "plugin/recordings/columns/npy_array.h"
#include "plugin/recordings/open/recording_formats.h"
#include "plugin/recordings/streams/file_content.h"
#include "test/fuzz/reading.h"

namespace {

constexpr std::size_t kBlockRows = 256;

void readNumbers(efm::NpyArray& array) {
  constexpr std::uint64_t kMaxRows = 100'000;
  while (array.position() < kMaxRows) {
    const std::size_t rows = array.readRows(kBlockRows);
    if (rows == 0) return;
    for (std::size_t row = 0; row < rows; row += std::max<std::size_t>(rows - 1, 1)) {
      for (std::size_t column = 0; column < array.columns(); ++column) {
        array.number(row, column);
        array.whole(row, column);
        array.time(row, column, 0);
        array.time(row, column, -9);
      }
    }
  }
}

}  // namespace

// NOLINTNEXTLINE(readability-identifier-naming)
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const efm::fuzz::MemoryFile file({}, data, size);
  const std::string path = file.path();
  if (efm::isCompressed(path)) {
    efm::fuzz::readOrRefuse(path, [&] {
      for (const std::string& member : efm::membersOf(path)) {
        efm::fuzz::readOrRefuse(path, [&] {
          efm::NpyArray array(path, member);
          readNumbers(array);
        });
      }
    });
  } else {
    efm::fuzz::readOrRefuse(path, [&] {
      efm::NpyArray array(path);
      readNumbers(array);
      array.seek(array.rows() / 2);
      readNumbers(array);
    });
  }
  efm::fuzz::readOrRefuse(path, [&] { efm::readPoseArrays(path, {}); });
  for (const char* columns : {"", "t=a x=b y=c p=d", "x y - p t"}) {
    efm::ReaderOptions options;
    options.columns = columns;
    options.time_unit = "us";
    efm::fuzz::readOrRefuse(path, [&] {
      const auto camera = std::move(efm::openEventArrays({path}, options).cameras.at(0));
      camera->seek(1'000'000'000);
      std::vector<efm::Event> events;
      for (int blocks = 0; blocks < 4 && camera->read(events); ++blocks) camera->positionOf(0);
    });
  }
  return 0;
}
