// SPDX-License-Identifier: BSD-3-Clause
#include "test/memory/failing_allocation.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdlib>
#include <map>
#include <new>

namespace efm {
namespace {

std::atomic<bool> counting{false};
std::atomic<std::size_t> counted{0};
std::atomic<std::size_t> failing_number{0};
std::atomic<Allocating> counted_threads{Allocating::kThisThread};
thread_local bool is_this_thread = false;

std::array<std::atomic<std::size_t>, 65536> sizes_of{};

bool fails(std::size_t size) {
  if (!counting) return false;
  if (is_this_thread != (counted_threads == Allocating::kThisThread)) return false;
  const std::size_t number = counted++;
  if (number < sizes_of.size()) sizes_of[number] = size;
  return number == failing_number;
}

}  // namespace

void failAllocation(Allocating threads, std::size_t skipped) {
  is_this_thread = true;
  counted = 0;
  failing_number = skipped;
  counted_threads = threads;
  counting = true;
}

std::vector<std::size_t> stopFailing() {
  counting = false;
  is_this_thread = false;
  return {sizes_of.begin(), sizes_of.begin() + std::min<std::size_t>(counted, sizes_of.size())};
}

std::vector<std::size_t> rareOnes(const std::vector<std::size_t>& sizes) {
  constexpr int kRare = 3;
  std::map<std::size_t, int> times;
  for (const std::size_t size : sizes) ++times[size];
  std::vector<std::size_t> rare;
  for (std::size_t i = 0; i < sizes.size(); ++i) {
    if (times[sizes[i]] <= kRare) rare.push_back(i);
  }
  return rare;
}

}  // namespace efm

// The array forms call these operators. Sanitizers have another array form without an exception.
void* operator new(std::size_t size) {
  if (efm::fails(size)) throw std::bad_alloc();
  if (void* memory = std::malloc(size > 0 ? size : 1)) return memory;
  throw std::bad_alloc();
}

void* operator new(std::size_t size, const std::nothrow_t& /*tag*/) noexcept {
  return efm::fails(size) ? nullptr : std::malloc(size > 0 ? size : 1);
}

void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
