// SPDX-License-Identifier: BSD-3-Clause
#include <exception>

#include "plugin/app/program.h"

int main(int argc, char** argv) {
  if (argc == 3 && argv[1] == efm::kHdf5Trial) return efm::runHdf5Trial(argv[2]);
  try {
    efm::tryHdf5({argv + 1, argv + argc});
  } catch (const std::exception& error) {
    return efm::fail(error.what());
  }
  return efm::runProgram(argc, argv);
}
