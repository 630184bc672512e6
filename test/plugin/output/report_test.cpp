// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/output/report.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

namespace efm {
namespace {

using nlohmann::json;

MapReport smallReport() {
  MapReport report;
  report.counts.cameras = {{10, 6, 1, 1, 1, 1}, {5, 5, 0, 0, 0, 0}};
  report.counts.event_uses = 20;
  report.counts.votes = {1500, 400, 100};
  report.counts.keyframes = 2;
  report.points = 7;
  report.seconds = {9, 1, 4, 2, 0, 1.5};
  report.options.mapper.keyframe.sweep.threads = 3;
  return report;
}

TEST(Report, HasEveryKeyOfTheContract) {
  const json report = json::parse(reportJson(smallReport()));
  for (const char* key :
       {"events", "event_uses", "votes", "keyframes", "points", "seconds", "votes_per_second",
        "kernel", "threads", "peak_memory_bytes", "options", "version"}) {
    EXPECT_TRUE(report.contains(key)) << key;
  }
  for (const char* key :
       {"read", "used", "without_pose", "outside_window", "dropped", "filtered", "cameras"}) {
    EXPECT_TRUE(report["events"].contains(key)) << key;
  }
  for (const char* key : {"total", "read", "sweep", "depth", "refine", "map"}) {
    EXPECT_TRUE(report["seconds"].contains(key)) << key;
  }
}

TEST(Report, SaysThatPosesWerePerturbedWhereTheyWere) {
  MapReport report = smallReport();
  EXPECT_FALSE(json::parse(reportJson(report)).contains("perturbation"));
  report.faults.latency_ns = 200'000'000;
  report.faults.perturbation.seed = 9;
  const json perturbation = json::parse(reportJson(report))["perturbation"];
  EXPECT_EQ(perturbation["latency_s"], 0.2);
  EXPECT_EQ(perturbation["noise_m"], 0);
  EXPECT_EQ(perturbation["seed"], 9);
  EXPECT_FALSE(perturbation.contains("keyframe_s"));
}

TEST(Report, TotalsAreTheSumsOfTheCameras) {
  const json events = json::parse(reportJson(smallReport()))["events"];
  EXPECT_EQ(events["read"], 15);
  EXPECT_EQ(events["used"], 11);
  EXPECT_EQ(events["filtered"], 1);
  EXPECT_EQ(events["cameras"][0]["read"], 10);
  EXPECT_EQ(events["cameras"][1]["used"], 5);
}

TEST(Report, VotesPerSecondAreThoseOfTheSweep) {
  const json report = json::parse(reportJson(smallReport()));
  EXPECT_EQ(report["votes"]["cast"], 1500);
  EXPECT_DOUBLE_EQ(report["votes_per_second"], 500);  // (1500 + 400 + 100) / 4
  EXPECT_EQ(votesPerSecond({}), 0);
}

TEST(Report, OptionsAreThoseThatFilesKnowWithTheirTypes) {
  const MapReport report = smallReport();
  const json options = json::parse(reportJson(report))["options"];
  std::size_t keys = 0;
  for (const auto& section : options) keys += section.size();
  EXPECT_EQ(keys, listOptions(report.options).size());
  EXPECT_EQ(options["dsi"]["num_planes"], 100);
  EXPECT_EQ(options["dsi"]["min_depth_m"], 0.5);
  EXPECT_EQ(options["depth"]["subplane"], true);
  EXPECT_EQ(options["depth"]["max_confidence"], "keyframe");
  EXPECT_EQ(options["fusion"]["across_cameras"], "harmonic");
  EXPECT_EQ(options["performance"]["threads"], 3);
}

TEST(Report, PeakMemoryIsThatOfAProcess) {
  const std::int64_t bytes = json::parse(reportJson(smallReport()))["peak_memory_bytes"];
  EXPECT_GT(bytes, 1 << 20);
}

}  // namespace
}  // namespace efm
