// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/recordings/open/recording_formats.h"
#include "test/integration/mistakes.h"

#include <fmt/format.h>

#include <iterator>
#include <sstream>

#include "mapping/geometry/timestamp.h"
#include "plugin/recordings/text/event_text.h"
#include "test/plugin/temporary_folder.h"

namespace efm {
namespace {

namespace fs = std::filesystem;

std::string eventsName(std::size_t camera) {
  return "cam" + std::to_string(camera) + "/events.txt";
}

}  // namespace

void DraftRecording::usualLine(const Event& event, std::string& text) {
  fmt::format_to(std::back_inserter(text), "{} {} {} {}\n", formatSeconds(event.t_ns), event.x,
                 event.y, event.polarity ? 1 : 0);
}

void DraftRecording::replaceInCamchain(const std::string& part, const std::string& by) {
  ASSERT_NE(camchain.find(part), std::string::npos) << part;
  for (std::size_t at = 0; (at = camchain.find(part, at)) != std::string::npos; at += by.size()) {
    camchain.replace(at, part.size(), by);
  }
}

std::string DraftRecording::eventText(std::size_t camera) const {
  std::string text;
  for (const Event& event : events[camera]) event_line(event, text);
  return text;
}

std::string DraftRecording::poseText() const {
  std::ostringstream text;
  writeTumTrajectory(text, poses);
  return text.str();
}

DraftRecording readDraft(const fs::path& folder) {
  DraftRecording draft;
  for (std::size_t camera = 0; camera < 2; ++camera) {
    EventTextStream stream(folder / eventsName(camera));
    std::vector<Event>& events = draft.events.emplace_back();
    for (std::vector<Event> block; stream.read(block);) {
      events.insert(events.end(), block.begin(), block.end());
    }
  }
  draft.poses = readPoses(folder / "poses.txt");
  draft.camchain = readText(folder / "camchain.yaml");
  return draft;
}

void writeDraft(const DraftRecording& draft, const DraftRecording& base,
                const fs::path& base_folder, const fs::path& folder) {
  const auto linkOr = [&](bool same, const std::string& name, const auto& text) {
    if (draft.files.count(name) > 0) return;
    fs::create_directories((folder / name).parent_path());
    if (same) {
      fs::create_hard_link(base_folder / name, folder / name);
    } else {
      writeFile(folder / name, text());
    }
  };
  for (std::size_t camera = 0; camera < draft.events.size(); ++camera) {
    const bool same =
        draft.event_line == base.event_line && draft.events[camera] == base.events[camera];
    linkOr(same, eventsName(camera), [&] { return draft.eventText(camera); });
  }
  const bool same_poses = std::equal(
      draft.poses.begin(), draft.poses.end(), base.poses.begin(), base.poses.end(),
      [](auto& a, auto& b) { return a.t_ns == b.t_ns && isSame(a.T_world_rig, b.T_world_rig); });
  linkOr(same_poses, "poses.txt", [&] { return draft.poseText(); });
  linkOr(draft.camchain == base.camchain, "camchain.yaml", [&] { return draft.camchain; });
  for (const auto& [name, text] : draft.files) writeFile(folder / name, text);
}

}  // namespace efm
