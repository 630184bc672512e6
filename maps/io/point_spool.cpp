// SPDX-License-Identifier: BSD-3-Clause
#include "maps/io/point_spool.h"

#include <stdexcept>
#include <system_error>

namespace efm {
namespace {

constexpr auto kPointBytes = static_cast<std::streamsize>(sizeof(CloudPoint));

}  // namespace

PointSpool::PointSpool(const std::filesystem::path& beside)
    : name_(beside),
      file_(name_.temporary(), std::ios::in | std::ios::out | std::ios::trunc | std::ios::binary) {
  std::error_code ignored;
  std::filesystem::remove(name_.temporary(), ignored);
}

void PointSpool::add(const std::vector<CloudPoint>& part) {
  sizes_.push_back(part.size());
  file_.write(reinterpret_cast<const char*>(part.data()),
              static_cast<std::streamsize>(part.size()) * kPointBytes);
  if (!file_.flush()) {
    throw std::runtime_error("cannot write the points of " + name_.path().string() +
                             ": the disk is full");
  }
}

void PointSpool::visit(const std::function<void(const std::vector<CloudPoint>& part)>& take) {
  file_.seekg(0);
  std::vector<CloudPoint> part;
  for (const std::size_t size : sizes_) {
    part.resize(size);
    file_.read(reinterpret_cast<char*>(part.data()),
               static_cast<std::streamsize>(size) * kPointBytes);
    if (!file_) throw std::runtime_error("cannot read the points of " + name_.path().string());
    take(part);
  }
}

}  // namespace efm
