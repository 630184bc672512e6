// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/session_file/run_record.h"

#include <fmt/format.h>
#include <openssl/evp.h>
#include <tbb/parallel_sort.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <memory>
#include <numeric>
#include <string>

#include "event_fusion/engine.h"
#include "mapping/base/number_bytes.h"
#include "plugin/options/option_keys.h"
#include "plugin/session_file/keyframe_record.h"

namespace efm {

/// Has a name outside of this file, because a member of MapHasher has it.
class Sha256 {
 public:
  Sha256() { EVP_DigestInit_ex(context_.get(), EVP_sha256(), nullptr); }
  void add(std::string_view bytes) { EVP_DigestUpdate(context_.get(), bytes.data(), bytes.size()); }
  /// Returns the digest in hexadecimal digits.
  std::string finish() {
    std::array<unsigned char, EVP_MAX_MD_SIZE> digest{};
    unsigned int size = 0;
    EVP_DigestFinal_ex(context_.get(), digest.data(), &size);
    return fmt::format("{:02x}", fmt::join(digest.begin(), digest.begin() + size, ""));
  }

 private:
  std::unique_ptr<EVP_MD_CTX, void (*)(EVP_MD_CTX*)> context_{EVP_MD_CTX_new(), EVP_MD_CTX_free};
};

namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

/// @return null if the file cannot be read.
Json identityOf(const fs::path& file, const std::string& name) {
  constexpr std::uintmax_t kMiB = 1 << 20;
  std::error_code error;
  const std::uintmax_t size = fs::file_size(file, error);
  std::ifstream stream(file, std::ios::binary);
  if (error || !stream) return nullptr;
  Sha256 hash;
  std::string bytes(std::min(size, kMiB), '\0');
  for (const std::uintmax_t position : {std::uintmax_t{0}, size - bytes.size()}) {
    stream.seekg(static_cast<std::streamoff>(position));
    stream.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    hash.add(bytes);
    if (size <= kMiB) break;
  }
  return {{"name", name}, {"bytes", size}, {"sha256", hash.finish()}};
}

/// Returns whether a name is that of a result's folder, or of the folders of its runs.
bool isOneOf(const std::string& name, const std::string& out) {
  for (const char* more : {"", ".partial", ".left", ".left.other", ".earlier", ".moving"}) {
    if (name == out + more) return !out.empty();
  }
  return false;
}

/// Adds the files in a folder and those below it that a recording may be made of.
void addFilesIn(const fs::path& folder, const fs::path& except, std::vector<fs::path>& files) {
  constexpr std::array<const char*, 12> kOthers = {".png",  ".jpg", ".jpeg", ".tif",
                                                   ".tiff", ".ply", ".pcd",  ".mp4",
                                                   ".avi",  ".log", ".md",   ".html"};
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    const fs::path& path = entry.path();
    const std::string name = path.filename().string();
    const bool is_out = isOneOf(name, except.filename().string()) &&
                        fs::equivalent(folder, except.parent_path(), error);
    const bool is_result =
        fs::exists(path / "run.lock", error) || fs::exists(path / "session.mcap", error);
    if (is_out || is_result) continue;
    const fs::file_status status = entry.symlink_status(error);
    if (fs::is_directory(status)) {
      addFilesIn(path, except, files);
    } else if (entry.is_regular_file(error) &&
               std::find(kOthers.begin(), kOthers.end(), path.extension()) == kOthers.end()) {
      files.push_back(path);
    }
  }
}

/// Returns whether a result depends on a key. Files are compared by their content.
bool matters(const std::string& name) {
  return name != "performance.threads" && name != "performance.kernel" &&
         name != "rig.calibration" && name != "rig.hand_eye" && name != "output.session_file";
}

/// Adds the differences of two values, key by key.
void compare(const std::string& name, const Json& before, const Json& now,
             std::vector<std::string>& differences) {
  if (before == now || !matters(name)) return;
  const auto inner = [&](const std::string& key) { return name.empty() ? key : name + "." + key; };
  if (before.is_object() && now.is_object()) {
    for (const auto& [key, value] : before.items()) {
      compare(inner(key), value, now.value(key, Json()), differences);
    }
    for (const auto& [key, value] : now.items()) {
      if (!before.contains(key)) compare(inner(key), Json(), value, differences);
    }
    return;
  }
  const auto text = [](const Json& value) {
    return value.is_null() ? std::string("not given")
                           : value.dump(-1, ' ', false, Json::error_handler_t::replace);
  };
  differences.push_back(fmt::format("{} was {}, now {}", name, text(before), text(now)));
}

}  // namespace

Json runOf(const EventFusionOptions& given) {
  return {{"version", EFM_VERSION},
          {"kernel", std::string(nameOf(given.mapper.keyframe.sweep.kernelOrFastest()))},
          {"given", asJson(given)}};
}

void addChosen(Json& run, const Rig& rig, const EventFusionOptions& options,
               const std::vector<ChosenOption>& chosen) {
  Json& cameras = run["cameras"] = Json::array();
  for (const RigCamera& camera : rig.cameras) {
    const CameraModel& model = camera.model;
    cameras.push_back({{"width", model.width},
                       {"height", model.height},
                       {"intrinsics", {model.fx, model.fy, model.cx, model.cy}},
                       {"distortion_model", std::string(nameOf(model.distortion))},
                       {"distortion_coeffs", model.coefficients},
                       {"T_rig_cam", numbersIn(camera.T_rig_cam)},
                       {"time_offset_ns", camera.time_offset_ns}});
  }
  run["options"] = asJson(options);
  run["chosen"] = asJson(chosen);
  if (const auto maximum = options.mapper.keyframe.sequence_maximum) {
    run["sequence_maximum"] = *maximum;
  }
}

Json fingerprintOf(const std::vector<fs::path>& inputs, const fs::path& out) {
  const fs::path except =
      out.empty() ? out : fs::absolute(out / "").lexically_normal().parent_path();
  Json files = Json::array();
  for (const fs::path& input : inputs) {
    std::error_code error;
    std::vector<fs::path> all = {input};
    const bool is_folder = fs::is_directory(input, error);
    if (is_folder) {
      all.clear();
      addFilesIn(input, except, all);
      std::sort(all.begin(), all.end());
    }
    for (const fs::path& file : all) {
      Json identity =
          identityOf(file, (is_folder ? file.lexically_relative(input) : file.filename()).string());
      if (!identity.is_null()) files.push_back(std::move(identity));
    }
  }
  return files;
}

std::vector<std::string> differencesOf(const Json& before, const Json& now) {
  std::vector<std::string> differences;
  for (const char* key : {"version", "given", "limits", "reading", "perturbation", "shard"}) {
    const std::string name = std::string(key) == "given" ? "" : key;
    compare(name, before.value(key, Json()), now.value(key, Json()), differences);
  }
  const Json files_before = before.value("files", Json::array());
  const Json files_now = now.value("files", Json::array());
  for (std::size_t i = 0; i < std::max(files_before.size(), files_now.size()); ++i) {
    if (i >= files_before.size() || i >= files_now.size()) {
      const Json& file = i < files_before.size() ? files_before[i] : files_now[i];
      differences.push_back(fmt::format("the recording's file {} {}", file.at("name").dump(),
                                        i < files_before.size() ? "is missing" : "is new"));
    } else if (files_before[i].at("bytes") != files_now[i].at("bytes")) {
      differences.push_back(fmt::format(
          "the recording's file {} had {} bytes, now {}", files_now[i].at("name").dump(),
          files_before[i].at("bytes").dump(), files_now[i].at("bytes").dump()));
    } else if (files_before[i].at("sha256") != files_now[i].at("sha256")) {
      differences.push_back(
          fmt::format("the recording's file {} has other content", files_now[i].at("name").dump()));
    }
  }
  return differences;
}

struct MapHasher::State {
  using Row = std::array<double, 7>;
  Sha256 hash;
  std::vector<Row> last;  ///< The points with the largest x: the next part may have others.

  std::string bytes;  ///< Of a row.

  void add(const Row& row) {
    bytes.clear();
    for (const double value : row) appendLittleEndian(bytes, value);
    hash.add(bytes);
  }
  void addLast() {
    std::sort(last.begin(), last.end());
    for (const Row& row : last) add(row);
    last.clear();
  }
};

MapHasher::MapHasher() : state_(new State) {}
MapHasher::~MapHasher() = default;

void MapHasher::add(const MapCloud& part) {
  const auto rowOf = [&](std::uint32_t index) {
    const MapPoint& point = part[index];
    const Eigen::Vector3d p_world = positionIn(part, point);
    State::Row row = {p_world.x(), p_world.y(),       p_world.z(),          point.intensity,
                      point.sigma, point.probability, double(point.support)};
    for (double& value : row) {
      if (std::isnan(value)) value = -1;  // not known; NaN has many forms, and no order
      if (value == 0) value = 0;          // no negative zero
    }
    return row;
  };
  std::vector<std::uint32_t> order(part.size());
  std::iota(order.begin(), order.end(), 0U);
  tbb::parallel_sort(order.begin(), order.end(),
                     [&](std::uint32_t a, std::uint32_t b) { return part[a].x < part[b].x; });
  for (const std::uint32_t index : order) {
    const State::Row row = rowOf(index);
    if (!state_->last.empty() && state_->last.back()[0] < row[0]) state_->addLast();
    state_->last.push_back(row);
  }
}

std::string MapHasher::finish() {
  state_->addLast();
  return state_->hash.finish();
}

std::string mapHash(const MapCloud& cloud) {
  MapHasher hash;
  hash.add(cloud);
  return hash.finish();
}

}  // namespace efm
