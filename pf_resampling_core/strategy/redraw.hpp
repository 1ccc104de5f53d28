#pragma once

#include "pf_resampling_core/parameters/parameters.hpp"

namespace pf_resampling {

/// When a population is drawn anew from all that the data say (Renewal::redraw), for filters that
/// can, and what happens between two redraws.
struct RedrawOptions {
  /// When a landmark comes back into view that was out of it for this many updates; 0: never.
  int closure_absence = 20;
  /// Updates after the last redraw for which closures wait: one soon after another changes little.
  int closure_spacing = 5;
  int every_n = 25;  ///< updates after the last redraw; 0: at closures alone
  /// Between redraws log-weights grow by this share of what the observations say, so that more of
  /// the population is left at the next; the redraw itself uses the data as they are.
  double tempering = 0.3;
  /// Standard deviations beyond which an observation begins to count for less (Cauchy's loss); 0:
  /// never. Narrower ones take too much from data that are good.
  double robust_width = 4.0;
  /// Whether the noise is taken to be as large as blocks of the data that are left out, and
  /// predicted from the rest, say: errors that last make it larger than residuals show.
  bool learn_noise = true;
  /// A map with more landmarks is not redrawn. The joint belief about them is dense: 32 bytes for
  /// each pair, and a solution holds a few of these matrices.
  int max_landmarks = 1000;
};

/// The parameters population/redraw/..., bound to `options`, which must outlive the list.
void add_parameters(RedrawOptions* options, ParameterList* parameters);

}  // namespace pf_resampling
