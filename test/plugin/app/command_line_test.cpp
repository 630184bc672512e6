// SPDX-License-Identifier: BSD-3-Clause
#include "test/plugin/app/app_test.h"

namespace efm {
namespace {

using ::testing::HasSubstr;

class CommandLine : public AppTest {};

struct Case {
  const char* arguments;
  int status;
  std::string error;  ///< Behind "event-fusion: error: "; an end of "…" stands for any text.
};

TEST_F(CommandLine, AnErrorIsOneLineWithThePrefixAndAStatus) {
  write("data/events.txt", "0.1 1 2 1\n");
  write("wrong.ini", "[dsi]\nnum_planes = 0\n");
  write("calibration.ini", "[rig]\ncalibration = none.yaml\n");
  const Case cases[] = {
      // Commands and options.
      {"", 2, "no command: expected one of simulate, import, …"},
      {"evaluate", 2, "no command: expected one of depth, map, trajectory"},
      {"mpa data", 2, "'mpa': unknown command: did you mean map? One of: simulate, …"},
      {"evaluate dept a b", 2, "'dept': unknown command: did you mean depth? One of: …"},
      {"import data", 2, "--out is required; see event-fusion import --help"},
      {"import data --ouf x", 2, "--ouf: unknown option: did you mean --out?"},
      {"info data --frobnicate=3", 2,
       "--frobnicate: unknown option; event-fusion info --help lists all"},
      {"evaluate depth a b c", 2, "'c': one word too many; see event-fusion evaluate depth --help"},
      // Values of options.
      {"info data --t0 soon", 2, "--t0: 'soon': expected a time in seconds"},
      {"info data --format rosbg", 2, "--format: 'rosbg': did you mean rosbag?"},
      {"info data --format x", 2, "--format: 'x': expected one of auto, rawlog, …"},
      {"import data --out x --compression gzap", 2,
       "--compression: 'gzap': did you mean gzip? One of: gzip, zstd, none"},
      {"evaluate depth a b --focal abc", 2, "--focal: 'abc': expected a number above 0"},
      {"evaluate depth a b --max-depth abc", 2, "--max-depth = abc: expected a number"},
      {"simulate --preset desk_sterio --out x", 2, "--preset: 'desk_sterio': did you mean desk_s…"},
      {"simulate --preset slider --out x --mismatch 2", 2, "--mismatch = 2: must be 0 to 0.5 …"},
      {"simulate --scene rom --trajectory a --calibration b --out x", 2,
       "--scene: 'rom': did you mean room? …"},
      {"simulate --preset slider --seed -1 --out x", 2, "--seed: '-1': expected a number, 0 or …"},
      // Options of the mapping: option files are a part of the command line.
      {"map data --config dsc", 2, "--config 'dsc': no such option file: did you mean dsec?"},
      {"map none.ini data", 2, "none.ini: no such option file"},
      {"map wrong.ini data", 2, "wrong.ini:2: [dsi] num_planes = 0: must be 1 to 100000"},
      {"map data --set dsi.num_planes=x", 2, "--set dsi.num_planes=x: must be a whole number, or auto"},
      {"map data --t0 5 --t1 3", 2, "t1 = 3.000000000 s: must be after t0 = 5.000000000 s"},
      {"map data --set dsi.nun_planes=3", 2,
       "--set dsi.nun_planes: unknown key: did you mean num_…"},
      {"map data --set fusion.across_time=harmoic", 2,
       "--set fusion.across_time=harmoic: 'harmoic' is unknown: did you mean harmonic? One of: …"},
      {"map data --perturb nois_m=3", 2, "--perturb: nois_m=3: unknown key: did you mean noise_m?"},
      // The job cannot be done.
      {"map data --poses none.txt", 1, "--poses none.txt: no such file"},
      {"map data --calibration none.yaml", 1, "--calibration none.yaml: no such file"},
      {"map calibration.ini data", 1,
       "calibration.ini:2: [rig] calibration = none.yaml: no such file"},
      {"map calibration.ini data --set rig.hand_eye=h.yaml --calibration data/events.txt", 1,
       "--set rig.hand_eye=h.yaml: no such file"},
      {"info nowhere", 1, "nowhere: no such file or folder"},
      {"map data", 1, "data: no calibration: …"},
  };
  for (const Case& row : cases) {
    SCOPED_TRACE(row.arguments);
    const Result result = run(row.arguments);
    EXPECT_EQ(result.status, row.status);
    EXPECT_EQ(result.out, "");
    const std::string any = "…";
    std::string expected = "event-fusion: error: " + row.error;
    const std::size_t end = expected.rfind(any);
    if (end != std::string::npos && end + any.size() == expected.size()) {
      EXPECT_EQ(result.err.substr(0, end), expected.substr(0, end));
      EXPECT_EQ(result.err.find('\n'), result.err.size() - 1);
    } else {
      EXPECT_EQ(result.err, expected + "\n");
    }
  }
}

TEST_F(CommandLine, HelpListsTheExitStatusesAndTheOptionFiles) {
  EXPECT_THAT(run("--help").out, HasSubstr("2    the command line or an option file is wrong"));
  EXPECT_THAT(run("map --help").out, HasSubstr("dsec, evimo2"));
}

}  // namespace
}  // namespace efm
