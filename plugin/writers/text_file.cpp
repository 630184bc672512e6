// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/writers/text_file.h"

#include <stdexcept>
#include <utility>

namespace efm {

TextFile::TextFile(std::filesystem::path path)
    : path_(std::move(path)), stream_(path_, std::ios::binary) {
  if (!stream_) throw std::runtime_error(path_.string() + ": cannot be made");
}

void TextFile::close() {
  stream_.close();
  if (!stream_) throw std::runtime_error(path_.string() + ": cannot be written");
}

}  // namespace efm
