// SPDX-License-Identifier: BSD-3-Clause
// Mistakes in the events, their units and their columns, the calibration and the command line.

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

/// Returns a change of each event of a camera.
template <typename Change>
std::function<void(Draft&)> eachEvent(std::size_t camera, Change change) {
  return [camera, change](Draft& draft) {
    for (Event& event : draft.events[camera]) change(event);
  };
}

template <typename Change>
std::function<void(Draft&)> everyEvent(Change change) {
  return [change](Draft& draft) {
    for (std::vector<Event>& events : draft.events) {
      for (Event& event : events) change(event);
    }
  };
}

/// Returns a change that writes the events with other lines.
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
void float32Seconds(const Event& event, std::string& text) {
  fmt::format_to(std::back_inserter(text), "{:.6f} {} {} {}\n",
                 static_cast<float>(200'000 + 1e-9 * static_cast<double>(event.t_ns)), event.x,
                 event.y, event.polarity ? 1 : 0);
}
void timeLast(const Event& event, std::string& text) {
  fmt::format_to(std::back_inserter(text), "{} {} {} {}\n", event.x, event.y,
                 event.polarity ? 1 : 0, formatSeconds(event.t_ns));
}

/// Crops the pictures to 240 of 346 columns. `left` columns are removed at the left.
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

std::function<void(Draft&)> camchain(const std::string& part, const std::string& by) {
  return [part, by](Draft& draft) { draft.replaceInCamchain(part, by); };
}

constexpr auto kNoChange = [](Draft&) {};

}  // namespace

std::vector<Mistake> eventMistakes() {
  return {
      {"no events",
       [](Draft& draft) { draft.events.assign(2, {}); },
       {"error: data/cam0/events.txt, data/cam1/events.txt: no events: expected at least one"}},
      {"a silent camera",
       [](Draft& draft) { draft.events[1].clear(); },
       {"warning: silent-camera: camera 1 has no event",
        "warning: silent-keyframes: camera 1 had no event in 2 of 2 keyframes: rules that ask all "
        "cameras",
        "warning: no-points: the map has no point", "error: the map has no point"}},
      {"a camera with a twentieth of the events",
       [](Draft& draft) {
         std::size_t kept = 0;
         for (std::size_t i = 0; i < draft.events[1].size(); i += 20) {
           draft.events[1][kept++] = draft.events[1][i];
         }
         draft.events[1].resize(kept);
       },
       {"warning: few-events: camera 1 has 9833 events, another one 197617"}},
      {"one polarity",
       eachEvent(0, [](Event& event) { event.polarity = true; }),
       {"warning: polarity: all 197617 events of camera 0 have the polarity 1"}},
      {"hot pixels",
       eachEvent(1,
                 [](Event& event) {
                   if (event.t_ns / 1000 % 20 == 0) return;
                   event.x = static_cast<std::uint16_t>(event.x % 20);
                   event.y = static_cast<std::uint16_t>(event.y % 20);
                 }),
       {"warning: hot-pixels: 96 % of the events of camera 1 come from 1 % of its pixels: hot "
        "pixels, a blinking light or a wrong column"}},
      {"one file for both cameras",
       [](Draft& draft) { draft.events[1] = draft.events[0]; },
       {"warning: depths-disagree: the depths from the cameras of the rig and those from the "
        "motion of one camera agree within 15 % in ~10 % of the pixels",
        "warning: same-events: cameras 0 and 1 have the same events in every pixel"}},
      {"cameras of two clocks, and poses that cover both",
       [](Draft& draft) {
         for (Event& event : draft.events[1]) event.t_ns += 400'000'000;
         const std::vector<StampedPose> poses = draft.poses;
         for (StampedPose pose : poses) {
           pose.t_ns += 402'000'000;
           draft.poses.push_back(pose);
         }
       },
       {"warning: camera-clocks: camera 0 has events from 1.400003000 to 1.799998000 s, camera 1 "
        "from 1.800001000 to 2.199997000 s",
        "warning: pose-jump: the poses jump by 0.173 m after 1.800000000 s (+0.4 s): 39.4",
        "warning: silent-keyframes: camera 0 had no event in 2 of 4 keyframes",
        "warning: silent-keyframes: camera 1 had no event in 1 of 4 keyframes",
        "warning: silent-subintervals: 1 sub-intervals of a camera had no event"}},
      {"a camera 1000 s late",
       eachEvent(1, [](Event& event) { event.t_ns += 1'000'000'000'000; }),
       {"warning: camera-clocks: camera 0 has events from 1.400003000 to 1.799998000 s, camera 1 "
        "from 1001.400001000 to 1001.799997000 s",
        "warning: clock-overlap: the poses cover 0.0 % of the events' time: events from "
        "1.400003000 to 1001.799997000 s (+0 to +1000.4 s), poses from 1.399000000 to 1.800000000 "
        "s (-0.001 to +0.4 s)",
        "warning: silent-keyframes: camera 1 had no event in 2 of 2 keyframes",
        "warning: windows-without-events: 4997 windows were left out: the selected cameras saw "
        "nothing",
        "warning: no-points: the map has no point", "error: the map has no point"}},
      {"camera 1 40 ms late",
       eachEvent(1, [](Event& event) { event.t_ns += 40'000'000; }),
       {"warning: camera-clocks: the events are ~1.6 times as sharp with the events of camera 1 "
        "~0.041 s earlier, as its clock differs from that of camera 0; --set "
        "rig.time_offsets_s=0.000,~-0.041 fixes it"}},
      {"cropped pictures",
       cropped(106),
       {"warning: sensor-area: the events are ~3 % sharper if their pictures are cropped or "
        "moved; the calibration must be of the pixels that the events have: fx fy cx cy = 226 226 "
        "~67 130 of camera 0, fx fy cx cy = 226 226 ~67 130 of camera 1 (--calibration)"}},
      {"mirrored rows",
       everyEvent([](Event& event) { event.y = static_cast<std::uint16_t>(259 - event.y); }),
       {"warning: events-mirrored: the events are ~1.7 times as sharp with rows mirrored"}},
      {"binned pixels",
       everyEvent([](Event& event) {
         event.x /= 2;
         event.y /= 2;
       }),
       {"warning: sensor-area: the events leave a side of a sensor empty, and the poses do not "
        "explain them: are the pictures cropped, or their pixels binned?"}},
      {"events that are not sorted",
       [](Draft& draft) {
         std::shuffle(draft.events[0].begin(), draft.events[0].end(), std::mt19937(1));
       },
       {"error: data/cam0/events.txt: 234 of 270 events are over 10 ms late, first "
        "data/cam0/events.txt:1: expected events in time order; this sorts them: sort -g -k1,1 -s "
        "FILE >NEW"}},
      {"events up to 10 ms late",
       [](Draft& draft) { std::swap(draft.events[0][1000].t_ns, draft.events[0][1500].t_ns); },
       {"warning: sorted-events: 500 events came later than newer ones and were sorted"}},
      {"an event 100 s ahead",
       [](Draft& draft) { draft.events[0][100'000].t_ns += 100'000'000'000; },
       {"error: data/cam0/events.txt:100001: t = '101.592764000': expected a time near those of "
        "the events beside it"}},
      {"an event 100 s ahead, skipped",
       [](Draft& draft) { draft.events[0][100'000].t_ns += 100'000'000'000; },
       {"warning: skipped-events: 1 bad events were left out, the first one found: "
        "data/cam0/events.txt:100001: t = '101.592764000': expected a time near those of the "
        "events beside it"},
       "--skip-bad-events 1"},
      {"times of float32",
       lines(float32Seconds),
       {"error: data/cam0/events.txt: the times are float32 numbers, which are 0.0156 s apart at "
        "200001."}},
      {"a truncated file",
       [](Draft& draft) {
         const std::string text = draft.eventText(0);
         draft.files["cam0/events.txt"] = text.substr(0, text.rfind(' ') - 1);
       },
       {"error: data/cam0/events.txt:197617: '1.799998000 149 18': expected t x y p, but the file "
        "ends within the line"}},
      {"a line of words, skipped",
       [](Draft& draft) { draft.files["cam0/events.txt"] = draft.eventText(0) + "the end\n"; },
       {"warning: skipped-events: 1 bad events were left out, the first one found: "
        "data/cam0/events.txt:197618: 'the end'"},
       "--skip-bad-events 5"},
      {"more bad events than are skipped",
       [](Draft& draft) {
         for (std::size_t i = 0; i < 6; ++i) draft.events[i % 2][100 * i].x = 400;
       },
       {"warning: skipped-events: 5 bad events were left out, the first one found: "
        "data/cam0/events.txt:1: x = '400'",
        "error: data/cam1/events.txt:501: x = '400': expected a whole number from 0 to 345 (the "
        "sensor has 346x260 pixels; are x and y in this order, and is the resolution right?) (5 "
        "bad events before it"},
       "--skip-bad-events 5"},
      {"events in microseconds",
       lines(microseconds),
       {"error: data/cam0/events.txt: all times are whole numbers, of an unknown unit: probably "
        "us, where 3709 events take 0.0083 s: expected --time-unit us"}},
      {"events in microseconds, said to be seconds", lines(microseconds),
       apart({"1400001.000000000 to 1799998.000000000 s (+0 to +399997 s)",
              "1.399000000 to 1.800000000 s (-1399999.601 to -1399999.2 s)",
              "; they fit if the events' times are in us: --time-unit us", "1399999.200000000"}),
       "--time-unit s"},
      {"events in milliseconds, with decimals", lines(milliseconds),
       apart({"1400.001000000 to 1799.998000000 s (+0 to +399.997 s)",
              "1.399000000 to 1.800000000 s (-1398.602 to -1398.201 s)",
              "; they fit if the events' times are in ms: --time-unit ms", "1398.201000000"})},
      {"columns x y p t",
       lines(timeLast),
       {"warning: event-columns: data/cam#/events.txt: by their values, the columns are x y p t "
        "(--event-columns \"x y p t\""}},
      {"the wrong order as an option",
       kNoChange,
       {"error: --event-columns 'x y t p': the columns of data/cam0/events.txt are t x y p by "
        "their values"},
       "--event-columns 'x y t p'"},
      {"x and y swapped",
       kNoChange,
       {"error: data/cam0/events.txt:2: y = '276': expected a whole number from 0 to 259 (the "
        "sensor has 346x260 pixels; are x and y in this order"},
       "--event-columns 't y x p'"},
  };
}

std::vector<Mistake> calibrationMistakes() {
  return {
      {"a baseline of 90 m",
       camchain("-0.10000000000000001", "-90"),
       {"warning: baseline: cameras 0 and 1 are 90 m apart",
        "warning: no-points: the map has no point", "error: the map has no point", "…"}},
      {"a baseline of 0.1 mm",
       camchain("-0.10000000000000001", "-0.0001"),
       {"warning: depths-disagree: the depths from the cameras of the rig and those from the "
        "motion of one camera agree within 15 % in ~13 % of the pixels",
        "warning: baseline: cameras 0 and 1 are 0.0001 m apart"}},
      {"a focal length in millimetres",
       camchain("[226, 226", "[4, 4"),
       {"warning: focal-length: camera #: a focal length of 4 px and 346 columns are a field of "
        "view of 177 degrees",
        "warning: depths-at-limit: ~27 % of the depths lie at the nearest plane, ~0.55 m"}},
      {"a focal length of another resolution",
       camchain("[226, 226", "[22600, 22600"),
       {"warning: focal-length: camera #: a focal length of 22600 px and 346 columns are a field "
        "of view of 0.877 degrees",
        "warning: no-points: the map has no point", "error: the map has no point", "…"}},
      {"a larger resolution",
       camchain("[346, 260]", "[1280, 720]"),
       {"warning: principal-point: camera #: the principal point (173, 130) lies outside the "
        "middle half of the 1280x720 pixels",
        "warning: sensor-area: the events leave a side of a sensor empty"}},
      {"the resolution with its sides swapped",
       camchain("[346, 260]", "[260, 346]"),
       {"error: data/cam0/events.txt:2: x = '276': expected a whole number from 0 to 259 (the "
        "sensor has 260x346 pixels; are x and y in this order, and is the resolution right?"}},
      {"coefficients of a lens that cannot be inverted",
       [](Draft& draft) {
         draft.replaceInCamchain("distortion_coeffs: []", "distortion_coeffs: [-3, 0, 0, 0]");
         draft.replaceInCamchain("distortion_model: none", "distortion_model: radtan");
       },
       {"warning: lens: camera #: the lens model has no viewing ray for 91 % of the pixels",
        "warning: outside-lens: 181426 of 197617 events of camera 0 were not used",
        "warning: outside-lens: 181552 of 196643 events of camera 1 were not used"}},
      {"a calibration of one camera, in the folder",
       [](Draft& draft) { draft.camchain.resize(draft.camchain.find("cam1:")); },
       {"error: data/camchain.yaml: 1 cameras: expected 2"}},
  };
}

std::vector<Mistake> commandMistakes() {
  return {
      {"depth limits in front of the scene",
       kNoChange,
       {"warning: depths-at-limit: ~51 % of the depths lie at the farthest plane, 1 m"},
       "--set dsi.min_depth_m=0.2 --set dsi.max_depth_m=1"},
      {"depth limits behind the scene",
       kNoChange,
       {"warning: rotation-only: the poses move by at most 0.0912863 m and 1.42 degrees within a "
        "window",
        "warning: no-points: the map has no point", "error: the map has no point"},
       "--set dsi.min_depth_m=40 --set dsi.max_depth_m=80"},
      {"a warning that counts as an error",
       [](Draft& draft) { draft.events[1].clear(); },
       {"warning: silent-camera: camera 1 has no event",
        "warning: silent-keyframes: camera 1 had no event in 2 of 2 keyframes",
        "warning: no-points: the map has no point",
        "error: 3 warnings, and --strict makes them errors", "error: the map has no point"},
       "--strict"},
  };
}

}  // namespace efm
