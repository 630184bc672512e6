// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <nlohmann/json.hpp>

#include <cstddef>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "plugin/playback/map_job.h"
#include "plugin/session_file/session_file.h"

namespace efm {

/// Returns what the result of a job depends on, before its options are chosen: the begin of
/// SessionFile::run.
nlohmann::ordered_json runOf(const MapJob& job);

/// Keyframes that an earlier run for the same result stored.
struct StoredRun {
  std::filesystem::path folder;
  std::shared_ptr<const SessionFile> session;
  /// Folders of the first keyframes, which can be used: their images are whole, too.
  std::vector<std::string> names;
  std::set<std::string> kernels;  ///< That made them.
  bool is_complete = false;  ///< The folder is OUT, and its run mapped the recording to its end.

  /// Returns the number of keyframes that can be used.
  std::size_t keyframes() const { return is_complete ? session->keyframes() : names.size(); }
  /// Removes the folders of other keyframes in the folder of a result.
  void removeOthers(const std::filesystem::path& result) const;
};

/// Finds the stored run of a job with the most keyframes.
/// @param notes gets what was found, and why a file is not used.
/// @throws std::runtime_error naming what differs, if all that is stored is of other options or of
/// another recording.
std::optional<StoredRun> findStored(const MapJob& job, const nlohmann::ordered_json& run,
                                    std::vector<std::string>& notes);

/// @throws std::runtime_error if the chosen options differ from those of an earlier run.
/// @param name of the earlier run, for the error. @param remedy a further one, for its end.
void requireSameChoice(const nlohmann::ordered_json& earlier, const nlohmann::ordered_json& run,
                       const std::string& name, const std::string& remedy);

/// Stored keyframes of a session: the first ones.
struct StoredKeyframes {
  std::shared_ptr<const SessionFile> session;
  std::size_t count = 0;
};
/// Returns the source of the keyframes of sessions, one after the other, for
/// KeyframeMapperOptions::made_earlier. It throws std::runtime_error if a keyframe is not among the
/// windows of this run.
std::function<std::optional<KeyframeDepthMap>(const Window&)> storedKeyframes(
    std::vector<StoredKeyframes> sessions);

}  // namespace efm
