// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/writers/text_file.h"

#include <cerrno>
#include <stdexcept>
#include <utility>

#include "maps/io/atomic_file.h"

namespace efm {

TextFile::TextFile(std::filesystem::path path)
    : path_(std::move(path)), stream_(path_, std::ios::binary) {
  if (!stream_) throw std::runtime_error(path_.string() + ": cannot be made");
}

void TextFile::close() {
  stream_.close();
  requireWritten();
}

void TextFile::requireWritten() const {
  if (stream_) return;
  const std::string why = reasonNotWritten(errno);
  throw std::runtime_error(path_.string() + ": " + (why.empty() ? "cannot be written" : why));
}

}  // namespace efm
