// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/revoting.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numeric>
#include <opencv2/core.hpp>
#include <stdexcept>
#include <utility>
#include <vector>

#include "mapping/revote_sweep.h"
#include "test/mapping/kept_dsi.h"
#include "test/mapping/random_rays.h"
#include "test/mapping/same_image.h"

namespace efm {
namespace {

using test::KeptDsi;
using test::RandomRays;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

/// [plane][pixel].
using Planes = std::vector<std::vector<double>>;

/// Rays of several inputs in groups by time and polarity, as sweeps get them, from one seed.
struct RandomSplit {
  ReferenceView view;
  DepthPlanes planes;
  SplitRays rays;

  RandomSplit(std::uint32_t seed, int inputs, int slots, int groups) {
    RandomRays random(seed);
    view = random.view({70, 40});
    planes = DepthPlanes({1, 4, 12, PlaneSpacing::kInverse});
    rays.groups = groups;
    for (int input = 0; input < inputs; ++input) {
      CameraRays& bundles = rays.inputs.emplace_back();
      for (int i = 0; i < slots * groups; ++i) {
        bundles.push_back(random.bundle(view, planes, 3000));
      }
    }
  }
};

SpaceSweepOptions plainOptions(int threads = 1) {
  SpaceSweepOptions options;
  options.kernel = VotingKernel::kPlain;
  options.threads = threads;
  return options;
}

double sampleOf(const std::vector<double>& plane, const ReferenceView& view, double x, double y) {
  const auto column = static_cast<std::size_t>(x);
  const auto row = static_cast<std::size_t>(y);
  const auto stride = static_cast<std::size_t>(view.width);
  const double to_right = x - std::floor(x);
  const double to_bottom = y - std::floor(y);
  const auto at = [&](std::size_t r, std::size_t c) { return plane[r * stride + c]; };
  return (1 - to_bottom) * ((1 - to_right) * at(row, column) + to_right * at(row, column + 1)) +
         to_bottom * ((1 - to_right) * at(row + 1, column) + to_right * at(row + 1, column + 1));
}

/// Re-voting as it is defined, one ray after the other in double.
void voteAgain(const RayBundle& bundle, const RandomSplit& input, const Planes& prior,
               const VoteSharing& sharing, Planes& votes) {
  const ReferenceView& view = input.view;
  for (const RayPacket& packet : bundle.packets) {
    for (std::size_t i = packet.begin; i < packet.end; ++i) {
      std::vector<double> shares(prior.size());
      std::vector<Eigen::Vector2d> places(prior.size());
      for (std::size_t p = 0; p < prior.size(); ++p) {
        const PlaneTransfer to =
            transferToPlane(packet, view, input.planes.depth(static_cast<int>(p)));
        const double x = to.scale * bundle.x_inf[i] + to.offset_x;
        const double y = to.scale * bundle.y_inf[i] + to.offset_y;
        places[p] = {x, y};
        if (!to.in_front || !(x >= 0 && x < view.width - 1 && y >= 0 && y < view.height - 1)) {
          continue;
        }
        shares[p] = std::pow(sampleOf(prior[p], view, x, y), sharing.power);
      }
      const double sum = std::accumulate(shares.begin(), shares.end(), 0.0);
      for (std::size_t p = 0; p < prior.size(); ++p) {
        const double share = shares[p] / sum;
        if (!(shares[p] > 0) || share < double{sharing.min_share}) continue;
        const Eigen::Vector2d whole = places[p].array().floor();
        const Eigen::Vector2d part = places[p] - whole;
        double* upper = votes[p].data() + static_cast<std::ptrdiff_t>(whole.y()) * view.width +
                        static_cast<std::ptrdiff_t>(whole.x());
        double* lower = upper + view.width;
        upper[0] += share * (1 - part.x()) * (1 - part.y());
        upper[1] += share * part.x() * (1 - part.y());
        lower[0] += share * (1 - part.x()) * part.y();
        lower[1] += share * part.x() * part.y();
      }
    }
  }
}

Planes emptyPlanes(const RandomSplit& input) {
  return Planes(static_cast<std::size_t>(input.planes.size()),
                std::vector<double>(input.view.pixels()));
}

/// What the first pass fuses of one polarity.
Planes priorOf(const RandomSplit& input, int polarity, int polarities) {
  const auto bundles = input.rays.inputs.front().size();
  const std::size_t slots = bundles / static_cast<std::size_t>(input.rays.groups);
  std::vector<CameraRays> chosen(input.rays.inputs.size());
  for (std::size_t c = 0; c < chosen.size(); ++c) {
    for (std::size_t i = 0; i < bundles; ++i) {
      if (static_cast<int>(i / slots) % polarities == polarity) {
        chosen[c].push_back(input.rays.inputs[c][i]);
      }
    }
  }
  KeptDsi dsi(input.planes, input.view);
  SweepRequest request;
  request.sink = &dsi;
  request.groups = input.rays.groups / polarities;
  SpaceSweep(plainOptions()).run(chosen, input.view, input.planes, request);
  Planes prior = emptyPlanes(input);
  auto value = dsi.values.begin();
  for (auto& plane : prior) {
    for (double& of_pixel : plane) of_pixel = *value++;
  }
  return prior;
}

std::vector<float> sweptTwice(const RandomSplit& input, int polarities, const VoteSharing& sharing,
                              const SpaceSweepOptions& options = plainOptions()) {
  KeptDsi dsi(input.planes, input.view);
  SweepRequest request;
  request.sink = &dsi;
  request.groups = input.rays.groups;
  sweepTwice(input.rays, polarities, input.view, input.planes, options, sharing, request);
  return dsi.values;
}

double differenceOverMass(const std::vector<float>& values, const Planes& exact) {
  double mass = 0;
  double error = 0;
  auto value = values.begin();
  for (const auto& plane : exact) {
    for (const double of_pixel : plane) {
      mass += of_pixel;
      error += std::abs(of_pixel - double{*value++});
    }
  }
  EXPECT_GT(mass, 0);
  return error / mass;
}

PriorDsi priorOfValue(const RandomSplit& input, float value) {
  PriorDsi prior(input.view, input.planes);
  for (int plane = 0; plane < input.planes.size(); ++plane) {
    prior.takeTile(plane, {0, 0, input.view.width, input.view.height},
                   PlaneValues(input.view.pixels(), value));
  }
  return prior;
}

/// The second votes of one bundle, summed over each plane.
std::vector<double> massByPlane(const RandomSplit& input, const RayBundle& bundle,
                                const PriorDsi& prior, const VoteSharing& sharing) {
  SharedVotes votes(ImageOrderedRays({&bundle}, input.view, input.planes), prior, sharing);
  SharedVotes::Workplace workplace;
  for (std::size_t patch = 0; patch < votes.patches(); ++patch) votes.weigh(patch, workplace);
  std::vector<double> mass;
  for (int plane = 0; plane < input.planes.size(); ++plane) {
    PlaneValues density(input.view.pixels());
    votes.vote(plane, {density.data(), 0, input.view.height, input.view.width, input.view.height},
               workplace);
    mass.push_back(std::accumulate(density.begin(), density.end(), 0.0));
  }
  return mass;
}

TEST(SharedVotes, AreOneTogetherWhereARayMeetsTheViewAndElseNone) {
  const RandomSplit input(1, 1, 1, 1);
  PriorDsi prior = priorOfValue(input, 0.25F);
  for (int plane = 0; plane < 3; ++plane) {  // not everywhere the same
    prior.takeTile(plane, {5, 6, 30, 20}, PlaneValues(600, 3.5F));
  }
  const RayBundle seen = test::raysFromOrigin({{1, 1}, {7.5, 9.25}, {68.9, 38.9}, {34, 25}});
  const RayBundle beside = test::raysFromOrigin({{-0.1, 1}, {69, 3}, {10, 39}, {500, 500}});
  for (const double power : {1.0, 2.0, 3.5}) {
    for (const float min_share : {0.0F, 1e-6F}) {
      const VoteSharing sharing{power, min_share, fastestKernel()};
      const auto mass = massByPlane(input, seen, prior, sharing);
      EXPECT_NEAR(std::accumulate(mass.begin(), mass.end(), 0.0), 4, 1e-4);
      const auto none = massByPlane(input, beside, prior, sharing);
      EXPECT_EQ(std::accumulate(none.begin(), none.end(), 0.0), 0);
    }
  }
}

TEST(SharedVotes, OfAConstantPriorAreTheSameOnEveryPlane) {
  const RandomSplit input(1, 1, 1, 1);
  const PriorDsi prior = priorOfValue(input, 7);
  const RayBundle rays = test::raysFromOrigin({{1, 1}, {7.5, 9.25}, {60, 30}});
  for (const float min_share : {0.0F, 0.05F}) {
    for (const double mass : massByPlane(input, rays, prior, {2, min_share, fastestKernel()})) {
      EXPECT_NEAR(mass, 3.0 / input.planes.size(), 1e-5);
    }
  }
}

TEST(SharedVotes, OfAPriorOfZerosAreNone) {
  const RandomSplit input(1, 1, 1, 1);
  const RayBundle rays = test::raysFromOrigin({{1, 1}, {7.5, 9.25}, {60, 30}});
  for (const float min_share : {0.0F, 0.05F}) {
    const auto mass =
        massByPlane(input, rays, priorOfValue(input, 0), {2, min_share, fastestKernel()});
    EXPECT_EQ(std::accumulate(mass.begin(), mass.end(), 0.0), 0);
  }
}

TEST(RevoteSweep, EqualsTheDefinitionInDouble) {
  struct Case {
    int inputs, slots, groups, polarities;
    VoteSharing sharing;
  };
  const VotingKernel plain = VotingKernel::kPlain;
  for (const Case& c :
       {Case{2, 1, 1, 1, {2, 0.05F, plain}}, Case{2, 1, 4, 2, {2, 0, plain}},
        Case{2, 1, 4, 2, {1, 0.05F, fastestKernel()}}, Case{1, 1, 2, 2, {2, 0, fastestKernel()}},
        Case{4, 1, 2, 2, {1.5, 0, plain}}, Case{2, 3, 2, 2, {2, 0, plain}}}) {
    const RandomSplit input(3, c.inputs, c.slots, c.groups);
    std::vector<Planes> priors;
    for (int p = 0; p < c.polarities; ++p) priors.push_back(priorOf(input, p, c.polarities));
    // Harmonic across inputs, arithmetic across slots: the default.
    Planes fused = emptyPlanes(input);
    for (int slot = 0; slot < c.slots; ++slot) {
      std::vector<Planes> of_inputs;
      for (const CameraRays& rays : input.rays.inputs) {
        Planes& votes = of_inputs.emplace_back(emptyPlanes(input));
        for (int group = 0; group < c.groups; ++group) {
          voteAgain(rays[static_cast<std::size_t>(group * c.slots + slot)], input,
                    priors[static_cast<std::size_t>(group % c.polarities)], c.sharing, votes);
        }
      }
      for (std::size_t p = 0; p < fused.size(); ++p) {
        for (std::size_t i = 0; i < fused[p].size(); ++i) {
          double inverses = 0;
          for (const Planes& votes : of_inputs) inverses += 1 / votes[p][i];  // of 0: infinite
          fused[p][i] += c.inputs / inverses / c.slots;
        }
      }
    }
    // The prior is kept to 1/512; a share near the least one may fall to either side of it.
    const double tolerance = c.sharing.min_share > 0 ? 0.02 : 0.005;
    EXPECT_LT(differenceOverMass(sweptTwice(input, c.polarities, c.sharing), fused), tolerance)
        << c.inputs << " inputs, " << c.slots << " slots, " << c.groups << " groups";
  }
}

TEST(RevoteSweep, ThreadsDoNotChangeABit) {
  const RandomSplit input(4, 2, 2, 4);
  for (const VotingKernel kernel : {VotingKernel::kPlain, fastestKernel()}) {
    for (const float min_share : {0.0F, 0.05F}) {
      SpaceSweepOptions options;
      options.kernel = kernel;
      options.threads = 1;
      const VoteSharing sharing{2, min_share, kernel};
      const std::vector<float> alone = sweptTwice(input, 2, sharing, options);
      for (const int threads : {2, 5}) {
        options.threads = threads;
        EXPECT_EQ(sweptTwice(input, 2, sharing, options), alone) << threads;
      }
    }
  }
}

TEST(RevoteSweep, FindsTheSameInStripsAsOnWholePlanes) {
  const RandomSplit input(8, 2, 2, 4);  // its 40 rows are two strips
  const VoteSharing sharing{2, 0.05F, fastestKernel()};
  SweepRequest request{true, nullptr, input.rays.groups, 5};
  const SweepResult strips =
      sweepTwice(input.rays, 2, input.view, input.planes, {}, sharing, request);
  KeptDsi dsi(input.planes, input.view);
  request.sink = &dsi;  // which is given whole planes
  const SweepResult whole =
      sweepTwice(input.rays, 2, input.view, input.planes, {}, sharing, request);
  ASSERT_EQ(strips.cameras.size(), 2U);
  const std::vector<std::pair<const efm::SweptDsi*, const efm::SweptDsi*>> pairs = {
      {&strips.fused, &whole.fused},
      {&strips.cameras[0], &whole.cameras[0]},
      {&strips.cameras[1], &whole.cameras[1]}};
  for (const auto& [one, other] : pairs) {
    EXPECT_TRUE(test::same(one->peaks, other->peaks));
    EXPECT_GT(cv::countNonZero(one->peaks.confidence), 0);
  }
  EXPECT_GE(strips.fused.rays.size(), whole.fused.rays.size());  // more at borders of strips
  for (int y = 0; y < input.view.height; ++y) {
    for (int x = 0; x < input.view.width; ++x) {
      if (!whole.fused.rays.has({x, y})) continue;
      ASSERT_TRUE(strips.fused.rays.has({x, y}));
      for (int plane = 0; plane < input.planes.size(); ++plane) {
        EXPECT_EQ(strips.fused.rays.value({x, y}, plane), whole.fused.rays.value({x, y}, plane));
      }
    }
  }
}

TEST(RevoteSweep, CountsTheVotesOfTheFirstPass) {
  const RandomSplit input(5, 2, 1, 4);
  SweepRequest request;
  request.groups = input.rays.groups;
  const auto once =
      SpaceSweep(plainOptions()).run(input.rays.inputs, input.view, input.planes, request);
  const auto twice = sweepTwice(input.rays, 2, input.view, input.planes, plainOptions(),
                                {2, 0.05F, VotingKernel::kPlain}, request);
  ASSERT_EQ(twice.votes.size(), 2U);
  for (std::size_t c = 0; c < 2; ++c) {
    EXPECT_EQ(twice.votes[c].cast, once.votes[c].cast);
    EXPECT_EQ(twice.votes[c].total(), once.votes[c].total());
  }
}

TEST(RevoteSweep, GivesTheTruePlaneALargerPartOfTheVotes) {
  // Points on one plane, seen from many places on a line by each of two cameras.
  RandomSplit input(6, 2, 1, 1);
  const int truth = 5;
  RandomRays random(7);
  const std::vector<Eigen::Vector2d> points = random.points(input.view, 60);
  for (std::size_t c = 0; c < 2; ++c) {
    RayBundle& rays = input.rays.inputs[c].front() = {};
    for (int step = 0; step < 20; ++step) {
      const test::RaySource source{{0.02 * step + 0.3 * static_cast<double>(c), 0.01 * step, 0},
                                   true,
                                   input.planes.depth(truth)};
      test::appendPacket(source, input.view, points, rays);
    }
  }
  const auto partOfTruth = [&](const std::vector<float>& dsi) {
    const auto pixels = static_cast<std::ptrdiff_t>(input.view.pixels());
    const auto plane = dsi.begin() + truth * pixels;
    return std::accumulate(plane, plane + pixels, 0.0) /
           std::accumulate(dsi.begin(), dsi.end(), 0.0);
  };
  KeptDsi once(input.planes, input.view);
  SpaceSweep(plainOptions()).run(input.rays.inputs, input.view, input.planes, {false, &once});
  const double before = partOfTruth(once.values);
  const double after = partOfTruth(sweptTwice(input, 1, {2, 0.05F, fastestKernel()}));
  EXPECT_GT(after, 1.5 * before);
  EXPECT_GT(after, 0.85);
}

TEST(RevotingOptions, PowersOutOfRangeAreErrorsThatNameThem) {
  for (const double power : {0.0, -1.0, 8.1, std::nan("")}) {
    const RevotingOptions options{true, power};
    EXPECT_THAT([&] { options.validate(); },
                ThrowsMessage<std::invalid_argument>(HasSubstr("revote_power")));
  }
  EXPECT_FALSE(RevotingOptions().revote);
}

}  // namespace
}  // namespace efm
