// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <new>
#include <vector>

namespace efm {

/// Allocates from the start of a cache line: vectors of any instruction set then lie in one line
/// each, where those that straddle two cost up to half as much again.
template <typename Value>
struct CacheLineAllocator {
  using value_type = Value;
  static constexpr std::align_val_t kCacheLine{64};

  CacheLineAllocator() = default;
  template <typename Other>
  CacheLineAllocator(const CacheLineAllocator<Other>&) {}

  Value* allocate(std::size_t n) {
    return static_cast<Value*>(::operator new(n * sizeof(Value), kCacheLine));
  }
  void deallocate(Value* values, std::size_t) { ::operator delete(values, kCacheLine); }

  template <typename Other>
  bool operator==(const CacheLineAllocator<Other>&) const {
    return true;
  }
  template <typename Other>
  bool operator!=(const CacheLineAllocator<Other>&) const {
    return false;
  }
};

/// What the pixels of a plane, or of a tile of it, have of something: row-major.
template <typename Value>
using PixelValues = std::vector<Value, CacheLineAllocator<Value>>;
using PlaneValues = PixelValues<float>;

}  // namespace efm
