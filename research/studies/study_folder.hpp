#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "research/studies/study_definition.hpp"
#include "research/studies/study_trials.hpp"

namespace pf_resampling {

/// Which part of a study is run: the blocks whose number leaves `index` when divided by `count`.
struct StudyShard {
  int index = 0;  ///< from 0
  int count = 1;
};

/// A folder that holds a study:
///
///     study.json        what is studied: problems, filters with their settings, figures
///     blocks/           what has been run, a file for every block of seeds of a problem
///     trials.csv        a row per problem, seed and filter: its figures
///     times.csv         likewise: processor time, by the clock
///     curves.csv        means and standard deviations over the trials, time by time
///     paths.csv         paths of seed 1
///     places.csv        landmarks, beacons, closures
///     scheme_times.csv  time of one resampling, if the study asks for it
///
/// Blocks depend on the definition alone, and files are put together in their order. So all but the
/// times are the same bytes whether one thread ran all of it, or many machines a shard each, and
/// whether or not it was interrupted.
class StudyFolder {
 public:
  /// Takes up the folder, or makes it. Throws Error if it holds another study; the number of trials
  /// may differ. Throws Error for a definition that makes no sense.
  StudyFolder(const std::string& folder, const StudyDefinition& definition);

  /// Runs what of the shard has not been run yet, `jobs` drives at a time. `progress` is called
  /// with the number of drives that are done, of drives(shard). A block is kept as soon as it is
  /// whole.
  void run(const StudyShard& shard, int jobs, const std::function<void(std::uint64_t)>& progress);

  /// Drives of a shard that have not been run yet.
  std::uint64_t drives(const StudyShard& shard) const;

  /// Of the study: as many as the folder was ever to have.
  int trials() const { return definition_.trials; }

  /// Names of the blocks that are missing.
  std::vector<std::string> missing() const;

  /// Writes the tables from the blocks. Throws Error if some are missing, naming the first of them
  /// and the command that runs them.
  void merge() const;

  /// The row of trials.csv of a trial, run again. Throws Error for a problem or filter that the
  /// study has not, naming those it has.
  std::string row_of(const std::string& problem, const std::string& filter,
                     std::uint64_t seed) const;

 private:
  struct Block {
    std::size_t problem = 0;
    std::uint64_t first = 1, last = 1;  ///< seeds
  };
  std::vector<Block> blocks() const;
  std::vector<Block> missing_blocks(const StudyShard& shard) const;
  std::string name_of(const Block& block) const;
  std::string path_of(const Block& block) const;

  std::string folder_;
  StudyDefinition definition_;
  std::vector<Experiment> experiments_;  // by problem
};

/// The definition that a folder holds, for those who were not given it. Throws Error if there is no
/// study.json in it, or one that was damaged.
StudyDefinition definition_in(const std::string& folder);

}  // namespace pf_resampling
