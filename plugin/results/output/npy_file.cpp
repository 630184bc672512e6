// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/results/output/npy_file.h"

#include <fmt/format.h>

#include <stdexcept>
#include <string>
#include <utility>

namespace efm {
namespace {

/// Magic, version 1.0, length, and a dictionary padded so that the data begins at a multiple of 64
/// bytes (NEP 1).
std::string npyHeader(int planes, const ReferenceView& view) {
  std::string dictionary =
      fmt::format("{{'descr': '<f4', 'fortran_order': False, 'shape': ({}, {}, {}), }}", planes,
                  view.height, view.width);
  constexpr std::size_t kPrefix = 10;
  const std::size_t padding = 63 - (kPrefix + dictionary.size()) % 64;
  dictionary += std::string(padding, ' ') + "\n";
  const auto length = static_cast<std::uint16_t>(dictionary.size());
  std::string header = "\x93NUMPY";
  header += '\x01';
  header += '\x00';
  header += static_cast<char>(length & 0xff);
  header += static_cast<char>(length >> 8);
  return header + dictionary;
}

}  // namespace

NpyDsiFile::NpyDsiFile(const std::filesystem::path& path, int planes, const ReferenceView& view)
    : target_(std::make_unique<AtomicFile>(path)),
      plane_bytes_(static_cast<std::streamoff>(view.pixels() * sizeof(float))),
      file_(target_->temporary(), std::ios::binary | std::ios::trunc) {
  const std::string header = npyHeader(planes, view);
  header_bytes_ = static_cast<std::streamoff>(header.size());
  file_.write(header.data(), header_bytes_);
  if (!file_) throw std::runtime_error("cannot write " + target_->path().string());
}

void NpyDsiFile::addPlane(int plane, const float* values) {
  const std::lock_guard<std::mutex> lock(mutex_);
  file_.seekp(header_bytes_ + plane * plane_bytes_);
  file_.write(reinterpret_cast<const char*>(values), plane_bytes_);
}

std::unique_ptr<AtomicFile> NpyDsiFile::finish() {
  file_.close();
  if (!file_) {
    throw std::runtime_error("cannot write " + target_->path().string() + ": the disk may be full");
  }
  return std::move(target_);
}

}  // namespace efm
