#pragma once

#include <Eigen/Core>
#include <limits>
#include <string_view>
#include <type_traits>

#include "pf_resampling_core/files/archive.hpp"
#include "pf_resampling_core/parallel/worker_pool.hpp"
#include "pf_resampling_core/population/ancestry.hpp"

namespace pf_resampling {

// A population is a struct of arrays with a list of them, which is all that the following need:
//
//   template <typename Self, typename Visit>
//   static void for_each_column(Self& self, const Visit& visit) {
//     visit("x", self.x);
//     ...
//
// A column is an Eigen array with a row per particle.

/// Gives every column so many rows. Rows that are added hold copies, so that nothing in them is
/// ever undefined.
template <typename Particles>
void resize_columns(Eigen::Index size, Particles* particles) {
  Particles::for_each_column(*particles, [size](const char*, auto& column) {
    const Eigen::Index before = column.rows();
    column.conservativeResize(size);
    for (Eigen::Index i = before; before > 0 && i < size; ++i) column[i] = column[i % before];
  });
}

/// Slot i becomes a copy of the former slot ancestors[i]. Survivors keep their slots, as
/// counts_to_ancestors() has it, so copies are made in place. Weights and ancestors, which a
/// renewal gives anew, stay in their slots. `pool`: shares the work out.
template <typename Particles>
void select_columns(ConstIndices ancestors, Particles* particles, WorkerPool* pool = nullptr) {
  const Eigen::Index before = particles->size();
  const Eigen::Index after = ancestors.size();
  if (after > before) resize_columns(after, particles);
  // Which slots change, without a branch that would be guessed wrong as often as not.
  Eigen::ArrayXi slots(after);
  Eigen::Index changed = 0;
  for (int i = 0; i < after; ++i) {
    slots[changed] = i;
    changed += ancestors[i] != i ? 1 : 0;
  }
  const auto copy = [&](std::int64_t begin, std::int64_t end) {
    Particles::for_each_column(*particles, [&](const std::string_view name, auto& column) {
      if (name == "weight" || name == "log_weight" || name == "ancestor") return;
      for (Eigen::Index i = begin; i < end; ++i) column[slots[i]] = column[ancestors[slots[i]]];
    });
  };
  if (pool != nullptr) {
    pool->for_each_block(changed, copy, WorkerPool::kManyCheapElements / 4);
  } else {
    copy(0, changed);
  }
  if (after < before) resize_columns(after, particles);
}

/// As it is saved. The logarithm of a weight of zero is written as the lowest number, for JSON has
/// no infinity.
template <typename Particles>
void describe_columns(Archive& archive, Particles& particles) {
  Particles::for_each_column(particles, [&](const char* name, auto& column) {
    using Column = std::decay_t<decltype(column)>;
    using Limits = std::numeric_limits<typename Column::Scalar>;
    if constexpr (Limits::has_infinity) {
      Column finite = (column == -Limits::infinity()).select(Limits::lowest(), column);
      archive(name, finite);
      if (!archive.is_reading()) return;
      column = (finite == Limits::lowest()).select(-Limits::infinity(), finite);
    } else {
      archive(name, column);
    }
  });
}

}  // namespace pf_resampling
