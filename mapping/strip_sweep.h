// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "mapping/second_votes.h"
#include "mapping/space_sweep.h"

namespace efm {

/// A pass over the planes where votes are few and kept: strip by strip of the view, all planes of
/// one after the other, so that its peaks stay in the cache. Whole planes are not made: there must
/// be no `sink`. On the threads of the task arena that it is called in. The result's votes are not
/// counted.
SweepResult sweepStrips(SecondVotes& votes, const FusionInputs& inputs, const ReferenceView& view,
                        int planes, const SpaceSweepOptions& options, const SweepRequest& request);

}  // namespace efm
