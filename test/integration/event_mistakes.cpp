// SPDX-License-Identifier: BSD-3-Clause
// Mistakes about the events, their units and their columns.

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <random>
#include <utility>

#include "mapping/geometry/timestamp.h"
#include "test/integration/mistakes.h"

namespace efm {
namespace {

using Draft = DraftRecording;

/// Changes each event of a camera.
template <typename Change>
std::function<void(Draft&)> eachEvent(std::size_t camera, Change change) {
  return [camera, change](Draft& draft) {
    for (Event& event : draft.events[camera]) change(event);
  };
}

/// Writes the events with other lines.
std::function<void(Draft&)> lines(Draft::EventLine line) {
  return [line](Draft& draft) { draft.event_line = line; };
}

void microseconds(const Event& event, std::string& text) {
  fmt::format_to(std::back_inserter(text), "{} {} {} {}\n", event.t_ns / 1000, event.x, event.y,
                 event.polarity ? 1 : 0);
}
void milliseconds(const Event& event, std::string& text) {
  fmt::format_to(std::back_inserter(text), "{:.6f} {} {} {}\n",
                 1e-6 * static_cast<double>(event.t_ns), event.x, event.y, event.polarity ? 1 : 0);
}
void timeLast(const Event& event, std::string& text) {
  fmt::format_to(std::back_inserter(text), "{} {} {} {}\n", event.x, event.y,
                 event.polarity ? 1 : 0, formatSeconds(event.t_ns));
}

/// Without this many columns at the left, and 106 in all.
std::function<void(Draft&)> cropped(int left) {
  return [left](Draft& draft) {
    for (std::vector<Event>& events : draft.events) {
      std::vector<Event> kept;
      for (Event event : events) {
        if (event.x < left || event.x >= left + 240) continue;
        event.x = static_cast<std::uint16_t>(event.x - left);
        kept.push_back(event);
      }
      events = std::move(kept);
    }
  };
}

constexpr auto kNoChange = [](Draft&) {};

}  // namespace

std::vector<Mistake> eventMistakes() {
  return {
      {"no events",
       [](Draft& draft) { draft.events.assign(2, {}); },
       "",
       kJobError,
       {"no events: expected at least one"}},
      {"a silent camera",
       [](Draft& draft) { draft.events[1].clear(); },
       "",
       kJobError,
       {"warning: silent-camera: camera 1", "warning: no-points:"}},
      {"a camera with a twentieth of the events",
       [](Draft& draft) {
         std::size_t kept = 0;
         for (std::size_t i = 0; i < draft.events[1].size(); i += 20) {
           draft.events[1][kept++] = draft.events[1][i];
         }
         draft.events[1].resize(kept);
       },
       "",
       kFine,
       {"warning: few-events: camera 1"}},
      {"one polarity",
       eachEvent(0, [](Event& event) { event.polarity = true; }),
       "",
       kFine,
       {"warning: polarity: all", "of camera 0"}},
      {"hot pixels",
       eachEvent(1,
                 [](Event& event) {
                   if (event.t_ns / 1000 % 20 == 0) return;
                   event.x = static_cast<std::uint16_t>(event.x % 20);
                   event.y = static_cast<std::uint16_t>(event.y % 20);
                 }),
       "",
       kFine,
       {"warning: hot-pixels:", "of camera 1"}},
      {"one file for both cameras",
       [](Draft& draft) { draft.events[1] = draft.events[0]; },
       "",
       kFine,
       {"warning: same-events: cameras 0 and 1"}},
      {"cameras of two clocks, and poses that cover both",
       [](Draft& draft) {
         for (Event& event : draft.events[1]) event.t_ns += 400'000'000;
         const std::vector<StampedPose> poses = draft.poses;
         for (StampedPose pose : poses) {
           pose.t_ns += 402'000'000;
           draft.poses.push_back(pose);
         }
       },
       "",
       kFine,
       {"warning: camera-clocks: camera 0"}},
      {"a camera 1000 s late",
       eachEvent(1, [](Event& event) { event.t_ns += 1'000'000'000'000; }),
       "",
       kJobError,
       {"warning: camera-clocks:", "warning: clock-overlap:"}},
      {"cropped pictures",
       cropped(106),
       "",
       kFine,
       {"warning: sensor-area: camera 0 has events in columns 0 to 239 of 0 to 345",
        "warning: sensor-area: camera 1", "--calibration"}},
      {"binned pixels",
       [](Draft& draft) {
         for (std::vector<Event>& events : draft.events) {
           for (Event& event : events) {
             event.x /= 2;
             event.y /= 2;
           }
         }
       },
       "",
       kFine,
       {"columns 0 to 172 of 0 to 345 and rows 0 to 129 of 0 to 259"}},
      {"events that are not sorted",
       [](Draft& draft) {
         std::shuffle(draft.events[0].begin(), draft.events[0].end(), std::mt19937(1));
       },
       "",
       kJobError,
       {"cam0/events.txt:", "expected events in time order", "--skip-bad-events"}},
      {"events up to 10 ms late",
       [](Draft& draft) { std::swap(draft.events[0][1000].t_ns, draft.events[0][1500].t_ns); },
       "",
       kFine,
       {"warning: sorted-events:"}},
      {"a truncated file",
       [](Draft& draft) {
         const std::string text = draft.eventText(0);
         draft.files["cam0/events.txt"] = text.substr(0, text.rfind(' ') - 1);
       },
       "",
       kJobError,
       {"cam0/events.txt:", "the file ends within the line"}},
      {"a line of words, skipped",
       [](Draft& draft) { draft.files["cam0/events.txt"] = draft.eventText(0) + "the end\n"; },
       "--skip-bad-events 5",
       kFine,
       {"warning: skipped-events: 1 bad events", "'the end'"}},
      {"more bad events than are skipped",
       [](Draft& draft) {
         for (std::size_t i = 0; i < 6; ++i) draft.events[i % 2][100 * i].x = 400;
       },
       "--skip-bad-events 5",
       kJobError,
       {"x = '400'", "5 bad events before it", "warning: skipped-events: 5 "}},
      {"events in microseconds",
       lines(microseconds),
       "",
       kJobError,
       {"all times are whole numbers", "--time-unit us"}},
      {"events in microseconds, said to be seconds",
       lines(microseconds),
       "--time-unit s",
       kJobError,
       {"warning: clock-overlap:", "if the events' times are in us: --time-unit us"}},
      {"events in milliseconds, with decimals",
       lines(milliseconds),
       "",
       kJobError,
       {"warning: clock-overlap:", "if the events' times are in ms: --time-unit ms"}},
      {"columns x y p t",
       lines(timeLast),
       "",
       kFine,
       {"warning: event-columns: data/cam0/events.txt:", "--event-columns \"x y p t\""}},
      {"the wrong order as an option",
       kNoChange,
       "--event-columns 'x y t p'",
       kJobError,
       {"--event-columns 'x y t p'", "data/cam0/events.txt are t x y p by their values"}},
      {"x and y swapped",
       kNoChange,
       "--event-columns 't y x p'",
       kJobError,
       {"cam0/events.txt:", "are x and y in this order"}},
  };
}

}  // namespace efm
