// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/chrono.h>
#include <fmt/format.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <stdexcept>

#include "mapping/base/atomic_file.h"
#include "mapping/base/text.h"
#include "mapping/geometry/timestamp.h"
#include "mapping/keyframes/keyframe_mapper.h"
#include "plugin/app/commands.h"
#include "plugin/app/program.h"
#include "plugin/app/recording_interval.h"
#include "plugin/playback/session_map.h"
#include "plugin/playback/stored_run.h"
#include "plugin/results/output/result_folder.h"

namespace efm {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr int kPlanVersion = 2;

/// The content of plan.json.
struct Plan {
  fs::path file;
  fs::path folder;                 ///< In which the words hold.
  std::vector<std::string> words;  ///< The arguments of `map`.
  std::shared_ptr<PlannedMap> map;
  std::vector<KeyframeRange> shards;

  static Plan read(const fs::path& file);
  void write() const;
  /// Returns the arguments of `map`, in the folder of the plan, for a result.
  MapArguments argumentsFor(const fs::path& out, Verbosity verbosity) const;
};

Plan Plan::read(const fs::path& file) {
  try {
    const Json json = Json::parse(readBytes(file));
    const int version = json.at("plan").get<int>();
    if (version != kPlanVersion) {
      throw std::runtime_error(fmt::format("version {}: expected {}", version, kPlanVersion));
    }
    Plan plan{file,
              json.at("folder").get<std::string>(),
              json.at("arguments"),
              std::make_shared<PlannedMap>(PlannedMap::of(json)),
              {}};
    const std::vector<PlannedMap::Keyframe>& keyframes = plan.map->keyframes;
    std::uint64_t begin = 0;
    for (const Json& json_of : json.at("shards")) {
      const KeyframeRange& shard =
          plan.shards.emplace_back(KeyframeRange{json_of.at("begin"), json_of.at("end")});
      const bool is_block =
          shard.end % KeyframeMapper::kBlockKeyframes == 0 || shard.end == keyframes.size();
      if (shard.begin != begin || shard.end < begin || !is_block) break;
      begin = shard.end;
    }
    const auto is_before = [](const PlannedMap::Keyframe& a, const PlannedMap::Keyframe& b) {
      return a.window.t0_ns < b.window.t0_ns;
    };
    if (keyframes.empty() || plan.shards.empty() || begin != keyframes.size() ||
        plan.shards.back().end != begin ||
        !std::is_sorted(keyframes.begin(), keyframes.end(), is_before)) {
      throw std::runtime_error("expected keyframes in order, and shards that divide them all");
    }
    return plan;
  } catch (const Json::exception&) {
    throw std::runtime_error(file.string() + ": no plan: expected a file of `event-fusion plan`");
  } catch (const std::runtime_error& error) {
    throw std::runtime_error(file.string() + ": " + error.what());
  }
}

void Plan::write() const {
  const std::vector<PlannedMap::Keyframe>& keyframes = map->keyframes;
  Json json = {{"plan", kPlanVersion},
               {"folder", folder.string()},
               {"arguments", words},
               {"keyframes", keyframes.size()},
               {"shards", Json::array()}};
  for (const KeyframeRange& shard : shards) {
    Json one = {{"begin", shard.begin}, {"end", shard.end}};
    if (shard.begin < shard.end) {
      one["t0"] = formatSeconds(keyframes[shard.begin].window.t0_ns);
      one["t1"] = formatSeconds(keyframes[shard.end - 1].window.t1_ns);
    }
    json["shards"].push_back(std::move(one));
  }
  map->addTo(json);
  writeAtomically(file, byStream([&](std::ostream& stream) { stream << json << '\n'; }));
}

MapArguments Plan::argumentsFor(const fs::path& out, Verbosity verbosity) const {
  const fs::path absolute = fs::absolute(out);
  std::error_code error;
  fs::current_path(folder, error);
  if (error) {
    throw std::runtime_error(file.string() + ": its folder " + folder.string() +
                             " is not here: expected the same paths on all machines");
  }
  MapArguments arguments = mapArgumentsOf(words);
  arguments.out = absolute;
  arguments.planned = map;
  if (verbosity != Verbosity::kNormal) arguments.verbosity = verbosity;
  return arguments;
}

/// Returns the number of a shard: that of the command line, or of the system that started it.
std::size_t shardNumber(const std::optional<std::size_t>& given, std::size_t count) {
  std::optional<std::size_t> number = given;
  std::string name = "--shard";
  for (const auto& [variable, first] : {std::pair("PARALLEL_SEQ", 1),
                                        {"SLURM_ARRAY_TASK_ID", 0},
                                        {"JOB_COMPLETION_INDEX", 0},
                                        {"AWS_BATCH_JOB_ARRAY_INDEX", 0}}) {
    const char* const text = std::getenv(variable);
    if (number || text == nullptr || *text == '\0') continue;
    name = variable;
    const auto value = parseNumber<std::int64_t>(text);
    if (!value || *value < first) {
      throw UsageError(fmt::format("{}={}: expected a number, from {}", name, text, first));
    }
    number = static_cast<std::size_t>(*value - first);
  }
  if (!number) throw UsageError("--shard: expected a number, from 0");
  if (*number < count) return *number;
  throw UsageError(fmt::format("{}: shard {}: expected 0 to {}", name, *number, count - 1));
}

/// The file status.json in the folder of a shard or a join: what the process is doing.
class StatusFile {
 public:
  /// A folder that is not for this result, or that another process works for, has no file of this
  /// one: the error says why.
  StatusFile(const fs::path& out, bool force) {
    try {
      ResultFolder::require(out, OutputKind::kMap, force);
      folder_ = fs::absolute(out);
    } catch (const std::exception&) {
    }
    json_ = {{"state", "running"}, {"activity", "start"}, {"progress", 0.0}, {"reason", ""}};
    json_["host"] = hostName();
    json_["process"] = ::getpid();
    json_["begin"] = json_["time"] = now();
    write();
  }

  /// Returns why the process for a folder did not end; empty if it is not known.
  static std::string reasonIn(const fs::path& folder) {
    std::ifstream file(folder / "status.json");
    const Json status = Json::parse(file, nullptr, false);
    const Json reason = status.is_object() ? status.value("reason", Json()) : Json();
    return reason.is_string() ? reason.get<std::string>() : "";
  }

  void show(const char* activity, double progress) {
    json_["activity"] = activity;
    json_["progress"] = std::round(1000 * progress) / 1000;
    if (std::chrono::steady_clock::now() - written_ > std::chrono::seconds(1)) write();
  }
  /// @param reason of a failure.
  void end(int status, const std::string& reason) {
    json_["state"] = status == 0 ? "done" : status == kTryAgainStatus ? "try again" : "failed";
    json_["exit_status"] = status;
    json_["reason"] = reason;
    if (status == 0) json_["progress"] = 1.0;
    write();
  }

 private:
  static std::string now() {
    const std::time_t time = std::time(nullptr);
    return fmt::format("{:%FT%TZ}", fmt::gmtime(time));
  }
  void write() {
    written_ = std::chrono::steady_clock::now();
    json_["time"] = now();
    if (folder_.empty()) return;
    try {
      writeStatus(folder_, json_.dump(1, ' ', false, Json::error_handler_t::replace));
    } catch (const std::exception&) {  // no room: the shard says so
    }
  }

  fs::path folder_;
  Json json_;
  std::chrono::steady_clock::time_point written_;
};

/// Runs `map` for a shard or a join. @return 75 if the next try may succeed.
int runPlanned(MapArguments arguments) {
  StatusFile status(arguments.out, arguments.force);
  std::string reason;
  arguments.on_progress = [&](const char* activity, double fraction) {
    status.show(activity, fraction);
  };
  arguments.on_error = [&](const std::string& text) { reason = text; };
  const auto failed = [&](const std::string& text, bool is_temporary) {
    reason = text;
    return fail(text, is_temporary ? kTryAgainStatus : kFailedStatus);
  };
  int result = 0;
  try {
    result = runMap(arguments);
    if (result == kInterruptedStatus) {
      reason = "stopped by a signal";
      result = kTryAgainStatus;
    }
  } catch (const UsageError& error) {
    status.end(kUsageStatus, error.what());
    throw;
  } catch (const PartDiffers& error) {
    if (arguments.keyframes && arguments.planned->from_begin.empty()) throw;
    result = failed(std::string(error.what()) + ": expected the recording of the plan", false);
  } catch (const Interrupted& interrupted) {
    result = failed(interrupted.what(), true);
  } catch (const std::exception& error) {
    const std::string text = userMessage(error);
    result = failed(text, isTemporary(text));
  }
  status.end(result, reason);
  return result;
}

}  // namespace

int runPlan(const PlanArguments& arguments) {
  if (fs::exists(arguments.out)) {  // nothing else is replaced
    const Json earlier = Json::parse(readBytes(arguments.out), nullptr, false);
    if (!earlier.is_object() || !earlier.contains("plan")) {
      throw std::runtime_error(arguments.out.string() + ": no plan: expected a new file");
    }
  }
  MapArguments of_map = mapArgumentsOf(arguments.words);
  if (arguments.verbosity == Verbosity::kQuiet) of_map.verbosity = Verbosity::kQuiet;
  for (const fs::path& file : of_map.source.files) {
    if (fs::is_directory(file) && fs::exists(arguments.out.parent_path() / ".") &&
        fs::equivalent(file, fs::absolute(arguments.out).parent_path())) {
      throw UsageError("--out " + arguments.out.string() +
                       ": lies in the recording's folder: expected another one");
    }
  }
  if (of_map.resume || of_map.view || !of_map.record_frames.empty()) {
    throw UsageError("--resume, --view, --record-frames: are for one run, not for a plan");
  }
  Plan plan{arguments.out, fs::current_path(), arguments.words, {}, {}};
  plan.map = std::make_shared<PlannedMap>(planMapOf(of_map));
  const std::uint64_t keyframes = plan.map->keyframes.size();
  const std::uint64_t block = KeyframeMapper::kBlockKeyframes;
  const std::uint64_t blocks = (keyframes + block - 1) / block;
  for (std::size_t k = 0; k < arguments.shards; ++k) {
    // The first shards have one block more, so that the last ones are empty.
    const auto begin_of = [&](std::size_t shard) {
      const std::uint64_t begin =
          shard * (blocks / arguments.shards) + std::min(shard, blocks % arguments.shards);
      return std::min(begin * block, keyframes);
    };
    plan.shards.push_back({begin_of(k), begin_of(k + 1)});
  }
  plan.write();
  if (!plan.map->pass.error.empty()) {
    printWarnings({{"damaged", plan.map->pass.error + ": the map ends there"}});
  }
  if (arguments.verbosity == Verbosity::kQuiet) return 0;
  const auto empty = std::count_if(plan.shards.begin(), plan.shards.end(),
                                   [](const KeyframeRange& s) { return s.begin == s.end; });
  fmt::print("{} keyframes in {} shards; written to {}\n", keyframes, plan.shards.size(),
             arguments.out.string());
  const PlannedMap& map = *plan.map;
  if (!map.from_begin.empty()) {
    fmt::print("each shard reads the recording from its begin, up to {:.3g} s: {}\n", map.read_s,
               map.from_begin);
  } else if (map.reach_s > std::max(1.0, 0.5 * map.read_s)) {
    fmt::print("each shard takes up to {:.3g} s to reach its part; all is read in {:.3g} s\n",
               map.reach_s, map.read_s);
  } else {
    fmt::print(
        "a shard reads its part: it reaches the last keyframe's events in {:.2g} s; all are "
        "read in {:.2g} s\n",
        map.reach_s, map.read_s);
  }
  if (empty > 0) {
    fmt::print("empty: the last {} of them: there are {} blocks of {} keyframes\n", empty, blocks,
               block);
  }
  return 0;
}

int runShard(const MapArguments& arguments) {
  const Plan plan = Plan::read(arguments.plan);
  const std::size_t number = shardNumber(arguments.shard, plan.shards.size());
  if (arguments.out.empty()) throw UsageError("--out: expected the folder of the shard");
  const KeyframeRange keyframes = plan.shards[number];
  if (keyframes.begin == keyframes.end) {
    StatusFile(arguments.out, arguments.force).end(0, "");
    if (arguments.verbosity != Verbosity::kQuiet) fmt::print("shard {} has no keyframe\n", number);
    return 0;
  }
  MapArguments of_shard = plan.argumentsFor(arguments.out, arguments.verbosity);
  of_shard.keyframes = keyframes;
  of_shard.resume = true;
  of_shard.strict = false;
  of_shard.force |= arguments.force;
  try {
    return runPlanned(of_shard);
  } catch (const PartDiffers& error) {
    printWarnings(
        {{"shard", std::string(error.what()) + ": it reads the recording from its begin"}}, "note");
    plan.map->from_begin = "the part has other events";
  }
  return runPlanned(of_shard);  // goes on after the keyframes that are right
}

int runJoin(const JoinArguments& arguments) {
  const Plan plan = Plan::read(arguments.plan);
  rlimit files{};  // each session is an open file
  if (getrlimit(RLIMIT_NOFILE, &files) == 0) {
    files.rlim_cur = files.rlim_max;
    setrlimit(RLIMIT_NOFILE, &files);
  }
  std::vector<std::shared_ptr<const SessionFile>> by_shard(plan.shards.size());
  std::vector<std::string> without;
  for (const fs::path& folder : arguments.shards) {
    const auto file = sessionAt(folder);
    if (!file) {  // of an empty shard, or of one that did not end
      const std::string reason = StatusFile::reasonIn(folder);
      without.push_back(folder.string() + (reason.empty() ? "" : " (" + reason + ")"));
      continue;
    }
    const auto session = std::make_shared<const SessionFile>(fs::absolute(*file));
    requireSameChoice(plan.map->run, session->run(), file->string(), "");
    const Json range = session->run().value("shard", Json());
    const auto shard =
        std::find_if(plan.shards.begin(), plan.shards.end(), [&](const KeyframeRange& s) {
          return s.begin < s.end && range == Json{s.begin, s.end};
        });
    if (shard == plan.shards.end()) {
      throw std::runtime_error(file->string() + ": no shard of " + plan.file.string());
    }
    const std::size_t count = session->keyframes();
    if (count != shard->size() || session->keyframe(count - 1).after_stop) {
      throw std::runtime_error(fmt::format(
          "{}: {} of {} keyframes: expected a shard that ended (run it again: it goes on)",
          file->string(), count, shard->size()));
    }
    auto& place = by_shard[static_cast<std::size_t>(shard - plan.shards.begin())];
    if (place) {
      throw std::runtime_error(file->string() + ": the same shard as " + place->path().string());
    }
    place = session;
  }
  std::vector<std::size_t> missing;
  std::vector<std::shared_ptr<const SessionFile>> all;
  for (std::size_t k = 0; k < by_shard.size(); ++k) {
    if (by_shard[k]) all.push_back(by_shard[k]);
    if (!by_shard[k] && plan.shards[k].begin < plan.shards[k].end) missing.push_back(k);
  }
  if (!missing.empty()) {
    throw std::runtime_error(fmt::format(
        "shards {} are missing: expected the folders of all{}{}", fmt::join(missing, ", "),
        without.empty() ? "" : "; no session.mcap is in ", fmt::join(without, ", ")));
  }
  MapArguments of_map = plan.argumentsFor(arguments.out, arguments.verbosity);
  of_map.by_shards = std::move(all);
  return runPlanned(of_map);
}

}  // namespace efm
