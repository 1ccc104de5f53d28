#pragma once

#include <Eigen/Core>
#include <limits>
#include <string>
#include <type_traits>

#include "pf_resampling_core/files/archive.hpp"
#include "pf_resampling_core/population/ancestry.hpp"

namespace pf_resampling {

/// What the numbers in a column of a population mean.
enum class ColumnKind {
  number,      ///< any finite one
  variance,    ///< finite, not negative
  factor,      ///< finite, above 0
  log_weight,  ///< minus infinity for a weight of zero
  weight,
  ancestor,  ///< slot before the last renewal
};

// A population is a struct of arrays with a list of them, which is all that the following need:
//
//   template <typename Self, typename Visit>
//   static void for_each_column(Self& self, const Visit& visit) {
//     visit("x", ColumnKind::number, self.x);
//     ...
//
// A column is an Eigen array with a row per particle.

/// Gives every column so many rows. Rows that are added hold copies, so that nothing in them is
/// ever undefined.
template <typename Particles>
void resize_columns(Eigen::Index size, Particles* particles) {
  Particles::for_each_column(*particles, [size](const char*, ColumnKind, auto& column) {
    const Eigen::Index before = column.rows();
    column.conservativeResize(size);
    for (Eigen::Index i = before; before > 0 && i < size; ++i) column[i] = column[i % before];
  });
}

/// Slot i becomes a copy of the former slot ancestors[i]. Survivors keep their slots, as
/// counts_to_ancestors() has it, so copies are made in place.
template <typename Particles>
void select_columns(ConstIndices ancestors, Particles* particles) {
  const Eigen::Index before = particles->size();
  const Eigen::Index after = ancestors.size();
  if (after > before) resize_columns(after, particles);
  Particles::for_each_column(*particles, [&](const char*, ColumnKind, auto& column) {
    for (Eigen::Index i = 0; i < after; ++i) {
      if (ancestors[i] != i) column[i] = column[ancestors[i]];
    }
  });
  if (after < before) resize_columns(after, particles);
}

/// What is wrong with the sizes of the columns, in words; nothing if all is well.
template <typename Particles>
std::string fault_of_sizes(const Particles& particles) {
  if (particles.size() < 1) return "there are no particles";
  std::string fault;
  Particles::for_each_column(particles,
                             [&](const std::string& name, ColumnKind, const auto& column) {
                               if (fault.empty() && column.rows() != particles.size()) {
                                 fault = "the particles' columns are not equally long: " + name;
                               }
                             });
  return fault;
}

/// What is wrong with the columns: their sizes, and numbers that are not as their kind says.
template <typename Particles>
std::string fault_of_columns(const Particles& particles) {
  std::string fault = fault_of_sizes(particles);
  Particles::for_each_column(particles,
                             [&](const std::string& name, ColumnKind kind, const auto& column) {
                               using Number = typename std::decay_t<decltype(column)>::Scalar;
                               const Number zero{};
                               if (!fault.empty()) return;
                               if (kind == ColumnKind::log_weight) {
                                 if (!(column <= static_cast<Number>(1e-6)).all())
                                   fault = "a log-weight is above 0";
                               } else if (kind == ColumnKind::ancestor) {
                                 if ((column < zero).any()) fault = "an ancestor is negative";
                               } else if (!column.allFinite()) {
                                 fault = "the " + name + " of a particle is not finite";
                               } else if (kind == ColumnKind::variance && (column < zero).any()) {
                                 fault = "the " + name + " of a particle is negative";
                               } else if (kind == ColumnKind::factor && !(column > zero).all()) {
                                 fault = "the " + name + " of a particle is not above 0";
                               }
                             });
  return fault;
}

/// As it is saved. The logarithm of a weight of zero is written as the lowest number, for JSON has
/// no infinity.
template <typename Column>
void describe_column(Archive& archive, const char* name, ColumnKind kind, Column& column) {
  using Limits = std::numeric_limits<typename Column::Scalar>;
  if (kind != ColumnKind::log_weight) return archive(name, column);
  Column finite = (column == -Limits::infinity()).select(Limits::lowest(), column);
  archive(name, finite);
  if (!archive.is_reading()) return;
  column = (finite == Limits::lowest()).select(-Limits::infinity(), finite);
}

}  // namespace pf_resampling
