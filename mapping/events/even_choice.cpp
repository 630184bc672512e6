// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/events/even_choice.h"

#include <cstdint>

namespace efm {
namespace {

/// Pseudo-random bits of a number: the finaliser of SplitMix64 (Steele et al., OOPSLA 2014).
std::uint64_t randomBits(std::uint64_t number) {
  std::uint64_t bits = (number + 1) * 0x9e3779b97f4a7c15U;
  bits = (bits ^ (bits >> 30U)) * 0xbf58476d1ce4e5b9U;
  bits = (bits ^ (bits >> 27U)) * 0x94d049bb133111ebU;
  return bits ^ (bits >> 31U);
}

}  // namespace

EvenChoice::EvenChoice(std::size_t events, std::size_t limit)
    : events_(events), size_(limit == 0 || limit > events ? events : limit) {}

std::size_t EvenChoice::operator[](std::size_t k) const {
  if (all()) return k;
  const std::size_t begin = k * events_ / size_;
  const std::size_t end = (k + 1) * events_ / size_;
  return begin + randomBits(k) % (end - begin);
}

EventSpan chooseEvenly(EventSpan events, std::size_t limit, std::vector<Event>& buffer) {
  const EvenChoice choice(events.size(), limit);
  if (choice.all()) return events;
  buffer.clear();
  buffer.reserve(choice.size());
  for (std::size_t k = 0; k < choice.size(); ++k) buffer.push_back(events[choice[k]]);
  return EventSpan(buffer);
}

std::vector<Event> chosenEvenly(EventSpan events, std::size_t limit) {
  std::vector<Event> chosen;
  const EventSpan view = chooseEvenly(events, limit, chosen);
  if (chosen.empty()) chosen.assign(view.begin(), view.end());
  return chosen;
}

}  // namespace efm
