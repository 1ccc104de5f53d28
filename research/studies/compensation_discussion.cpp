// What the figures of a compensation study mean. The numbers are the study's; the words are about
// the reference world.
#include <cmath>

#include "research/studies/compensation_study.hpp"
#include "tools/common/table.hpp"

namespace pf_resampling {
namespace {

using Figures = CompensationFigures;
using Figure = double Figures::*;

const std::vector<std::string> kNeeded = {"NR",
                                          "RSR",
                                          "RBR",
                                          "compensation",
                                          "compensation random",
                                          "compensation roulette",
                                          "compensation 10 %",
                                          "compensation 20 %",
                                          "compensation moment_matched",
                                          "RSR regularized",
                                          "compensation regularized",
                                          "compensation T_N=0.25",
                                          "compensation T_N=1",
                                          "RSR M=500"};

class Words {
 public:
  explicit Words(const CompensationStudy& study) : study_(study) {}

  double mean(Figure figure, const std::string& filter) const {
    return study_.find(filter)->mean(figure).mean;
  }
  std::string metres(Figure figure, const std::string& filter) const {
    return fixed(mean(figure, filter), 3) + " m";
  }
  std::string percent(Figure figure, const std::string& filter) const {
    return fixed(100.0 * mean(figure, filter), 0) + " %";
  }
  MeanEstimate difference(Figure figure, const std::string& first,
                          const std::string& second) const {
    return paired_difference(study_.find(first)->values(figure),
                             study_.find(second)->values(figure));
  }
  /// "0.018 ± 0.009 m below" or "… above".
  std::string beside(Figure figure, const std::string& first, const std::string& second) const {
    const MeanEstimate found = difference(figure, first, second);
    return fixed(std::abs(found.mean), 3) + " ± " + fixed(found.standard_error, 3) + " m " +
           (found.mean < 0.0 ? "below" : "above");
  }

 private:
  const CompensationStudy& study_;
};

std::string what_it_buys(const Words& words) {
  const double gain = -words.difference(&Figures::feature_error, "compensation", "RSR").mean;
  const double map_gain = -words.difference(&Figures::map_error, "compensation", "RSR").mean;
  return "**What compensation buys.** On K's measure, much: eq. 5 goes from " +
         words.metres(&Figures::feature_error, "RSR") + " with RSR to " +
         words.metres(&Figures::feature_error, "compensation") +
         ". But eq. 5 takes the error over all particles without their weights, so it is the error "
         "of the map and the spread of the cloud in one, and compensation pulls particles "
         "together: "
         "whatever shrinks the cloud lowers eq. 5. What a user gets is the weighted-mean map. Its "
         "error goes from " +
         words.metres(&Figures::map_error, "RSR") + " to " +
         words.metres(&Figures::map_error, "compensation") + ": of the " + fixed(gain, 3) +
         " m gained on eq. 5, " + fixed(map_gain, 3) +
         " m are gained on the map. At the end of the drive, with both loops closed, "
         "compensation's "
         "map is " +
         words.beside(&Figures::map_error_end, "compensation", "RSR") +
         " RSR's. Most of what remains is one turn and shift of the whole map: after the best "
         "alignment RSR's is off by " +
         words.metres(&Figures::map_error_aligned, "RSR") + ", compensation's by " +
         words.metres(&Figures::map_error_aligned, "compensation") + ".\n";
}

std::string what_it_costs(const Words& words) {
  return "**What it costs: honesty.** An estimate whose 95 % ellipse is to be believed holds the "
         "truth 95 % of the time. With 100 particles, RSR's ellipses hold " +
         words.percent(&Figures::map_inside, "RSR") + " of the landmarks, full compensation's " +
         words.percent(&Figures::map_inside, "compensation") +
         " (poses: " + words.percent(&Figures::pose_inside, "RSR") + " and " +
         words.percent(&Figures::pose_inside, "compensation") +
         "). K introduces compensation against over-confidence; no particle is rejected, but the "
         "distinct particles that this leaves are no independent ones: they have been averaged "
         "with "
         "each other. After every observation (T_N = 1) it is worst: " +
         words.percent(&Figures::map_inside, "compensation T_N=1") + " and " +
         words.percent(&Figures::pose_inside, "compensation T_N=1") +
         ", and the map at the end is off by " +
         words.metres(&Figures::map_error_end, "compensation T_N=1") +
         ". Covariances matched to the moments bring the landmarks to " +
         words.percent(&Figures::map_inside, "compensation moment_matched") + ", the poses not (" +
         words.percent(&Figures::pose_inside, "compensation moment_matched") + ").\n";
}

std::string what_to_use(const Words& words) {
  return "**What to use.** A gentle compensation. With a ratio of 20 % the map is off by " +
         words.metres(&Figures::map_error, "compensation 20 %") + " (" +
         words.beside(&Figures::map_error, "compensation 20 %", "RSR") + " RSR's; at the end " +
         words.beside(&Figures::map_error_end, "compensation 20 %", "RSR") + ") and " +
         words.percent(&Figures::map_inside, "compensation 20 %") +
         " of the landmarks are inside; with 10 %, " +
         words.metres(&Figures::map_error, "compensation 10 %") + " and " +
         words.percent(&Figures::map_inside, "compensation 10 %") + ". Eq. 5 says the opposite (" +
         words.metres(&Figures::feature_error, "compensation 20 %") + " and " +
         words.metres(&Figures::feature_error, "compensation 10 %") + ", RSR " +
         words.metres(&Figures::feature_error, "RSR") +
         "): honest spread counts against a filter there. Rank-based resampling, which K finds "
         "worst, is of the same kind: map " +
         words.metres(&Figures::map_error, "RBR") + ", " +
         words.percent(&Figures::map_inside, "RBR") +
         " inside. A lower threshold does some of it with fewer calls: full compensation with T_N "
         "= "
         "0.25, " +
         fixed(words.mean(&Figures::calls, "compensation T_N=0.25"), 0) + " calls, " +
         words.metres(&Figures::map_error, "compensation T_N=0.25") + ", " +
         words.percent(&Figures::map_inside, "compensation T_N=0.25") +
         ". And so do more particles: RSR with 500 has " +
         words.metres(&Figures::map_error, "RSR M=500") + " and " +
         words.percent(&Figures::map_inside, "RSR M=500") + ", at " +
         fixed(words.mean(&Figures::processor_ms, "RSR M=500") /
                   words.mean(&Figures::processor_ms, "RSR"),
               1) +
         " times the time.\n";
}

std::string what_does_not_matter(const Words& words) {
  return "**What hardly matters.** The pairing: by rank, at random, by roulette, eq. 5 is " +
         words.metres(&Figures::feature_error, "compensation") + ", " +
         words.metres(&Figures::feature_error, "compensation random") + " and " +
         words.metres(&Figures::feature_error, "compensation roulette") +
         ". The run-time, K's reservation: its compensation took seven times as long as its RSR "
         "(1.108 s and 0.165 s). Here maps are blended when they are next looked at, and the whole "
         "filter takes " +
         fixed(words.mean(&Figures::processor_ms, "compensation") /
                   words.mean(&Figures::processor_ms, "RSR"),
               2) +
         " times that of RSR (but see [performance.md](performance.md) for large maps).\n\n"
         "**What harms.** Excitation, which range-beacon localization cannot do without, moves "
         "poses "
         "away from the maps that hang on them: the map of RSR with `regularized` is " +
         words.beside(&Figures::map_error, "RSR regularized", "RSR") +
         " that without, of compensation " +
         words.beside(&Figures::map_error, "compensation regularized", "compensation") +
         ". The proposal of FastSLAM spreads poses already. And not renewing at all: eq. 5 is " +
         words.metres(&Figures::feature_error, "NR") + ", though the weighted-mean map is off by " +
         words.metres(&Figures::map_error, "NR") + ", not much more than RSR's.\n";
}

}  // namespace

std::string discussion_to_markdown(const CompensationStudy& study) {
  if (!is_reference(study)) return "";
  for (const std::string& name : kNeeded) {
    if (study.find(name) == nullptr) return "";
  }
  const Words words(study);
  return "## In plain words\n\n" + what_it_buys(words) + "\n" + what_it_costs(words) + "\n" +
         what_to_use(words) + "\n" + what_does_not_matter(words);
}

}  // namespace pf_resampling
