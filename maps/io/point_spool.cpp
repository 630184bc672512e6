// SPDX-License-Identifier: BSD-3-Clause
#include "maps/io/point_spool.h"

#include <cerrno>
#include <stdexcept>
#include <string>

#include "mapping/base/atomic_file.h"

namespace efm {
namespace {

constexpr auto kPointBytes = static_cast<std::streamsize>(sizeof(CloudPoint));

}  // namespace

PointSpool::PointSpool(const std::filesystem::path& beside) : beside_(beside) {
  const AtomicFile name(beside);  // removes the name at once
  file_.open(name.temporary(), std::ios::in | std::ios::out | std::ios::trunc | std::ios::binary);
  if (!file_) throw std::runtime_error("cannot write beside " + beside.string());
}

void PointSpool::add(const std::vector<CloudPoint>& part) {
  sizes_.push_back(part.size());
  file_.write(reinterpret_cast<const char*>(part.data()),
              static_cast<std::streamsize>(part.size()) * kPointBytes);
  if (file_.flush()) return;
  const std::string why = reasonNotWritten(errno);
  throw std::runtime_error("cannot write the points of " + beside_.string() +
                           " (56 bytes each): " + (why.empty() ? "the disk fails" : why));
}

void PointSpool::visit(const std::function<void(const std::vector<CloudPoint>& part)>& take) {
  file_.seekg(0);
  std::vector<CloudPoint> part;
  for (const std::size_t size : sizes_) {
    part.resize(size);
    file_.read(reinterpret_cast<char*>(part.data()),
               static_cast<std::streamsize>(size) * kPointBytes);
    if (!file_) throw std::runtime_error("cannot read the points of " + beside_.string());
    take(part);
  }
}

}  // namespace efm
