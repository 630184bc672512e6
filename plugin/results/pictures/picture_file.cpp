// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/results/pictures/picture_file.h"

#include <opencv2/imgcodecs.hpp>
#include <stdexcept>

#include "mapping/base/atomic_file.h"

namespace efm {

void writePicture(const std::filesystem::path& file, const cv::Mat3b& picture) {
  if (file.extension() != ".png") {
    throw std::runtime_error(file.string() + ": expected a name that ends in .png");
  }
  writeAtomically(file, [&](const std::filesystem::path& temporary) {
    if (!cv::imwrite(temporary.string(), picture)) {
      throw std::runtime_error("the file cannot be created or the disk is full");
    }
  });
}

}  // namespace efm
