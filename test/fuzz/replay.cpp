// SPDX-License-Identifier: BSD-3-Clause
// Replaces libFuzzer: reads the files of a folder and damaged copies, the same in each run.
//   PROGRAM FOLDER [SECONDS]
#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <vector>

// NOLINTNEXTLINE(readability-identifier-naming)
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace {

using Bytes = std::vector<std::uint8_t>;

void damage(Bytes& bytes, std::mt19937& random) {
  for (unsigned changes = 1 + random() % 4; changes > 0 && !bytes.empty(); --changes) {
    const auto at = static_cast<std::ptrdiff_t>(random() % bytes.size());
    switch (random() % 5) {
      case 0:  // cuts the end
        bytes.resize(static_cast<std::size_t>(at));
        break;
      case 1:  // may make a length wrong
        bytes[static_cast<std::size_t>(at)] = random() % 2 == 0 ? 0xff : 0;
        break;
      case 2:  // removes a part
        bytes.erase(bytes.begin() + at,
                    bytes.begin() + std::min(at + 1 + static_cast<std::ptrdiff_t>(random() % 16),
                                             static_cast<std::ptrdiff_t>(bytes.size())));
        break;
      default:
        bytes[static_cast<std::size_t>(at)] ^= static_cast<std::uint8_t>(1U << random() % 8);
    }
  }
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) {
    std::fprintf(stderr, "expected a folder of files\n");
    return EXIT_FAILURE;
  }
  std::vector<Bytes> files;
  for (const auto& entry : std::filesystem::directory_iterator(argv[1])) {
    std::ifstream stream(entry.path(), std::ios::binary);
    files.emplace_back(std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>());
    LLVMFuzzerTestOneInput(files.back().data(), files.back().size());
  }
  if (files.empty()) {
    std::fprintf(stderr, "%s: expected files in it\n", argv[1]);
    return EXIT_FAILURE;
  }
  constexpr int kDefaultSeconds = 3;
  const auto end = std::chrono::steady_clock::now() +
                   std::chrono::seconds(argc > 2 ? std::atoi(argv[2]) : kDefaultSeconds);
  std::mt19937 random(1);
  std::size_t runs = 0;
  for (; std::chrono::steady_clock::now() < end; ++runs) {
    Bytes bytes = files[random() % files.size()];
    damage(bytes, random);
    LLVMFuzzerTestOneInput(bytes.data(), bytes.size());
  }
  std::printf("%zu files, %zu damaged copies\n", files.size(), runs);
  return EXIT_SUCCESS;
}
