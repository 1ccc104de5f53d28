#pragma once

#include <cstdint>
#include <map>
#include <vector>

#include "pf_resampling_core/population/ancestry.hpp"
#include "pf_resampling_core/strategy/compensation.hpp"

namespace pf_resampling {

/// The landmark store in the plain way: every step is applied to every row at once.
class EagerStore {
 public:
  static constexpr std::size_t kFields = 6;

  struct Row {
    std::int64_t birth = 0;
    std::vector<double> fields[kFields];  // x, y, xx, xy, yy, log_odds
    std::vector<std::uint8_t> held;
  };

  explicit EagerStore(int particles) : particles_(static_cast<std::size_t>(particles)) {}

  std::size_t particles() const { return particles_; }
  std::map<int, Row>& rows() { return rows_; }

  void add(int row, std::int64_t birth) {
    Row& added = rows_[row];
    added = Row{};
    added.birth = birth;
    for (auto& field : added.fields) field.assign(particles_, 0.0);
    added.held.assign(particles_, 0);
  }

  void select(ConstIndices ancestors) {
    particles_ = static_cast<std::size_t>(ancestors.size());
    for (auto& [number, row] : rows_) {
      const Row former = row;
      for (std::size_t f = 0; f < kFields; ++f) row.fields[f].resize(particles_);
      row.held.resize(particles_);
      for (std::size_t i = 0; i < particles_; ++i) {
        const auto from = static_cast<std::size_t>(ancestors[static_cast<Eigen::Index>(i)]);
        for (std::size_t f = 0; f < kFields; ++f) row.fields[f][i] = former.fields[f][from];
        row.held[i] = former.held[from];
      }
    }
  }

  void blend(const std::vector<BlendPair>& pairs, CovarianceTreatment treatment) {
    for (auto& [number, row] : rows_) {
      for (const BlendPair& pair : pairs) {
        const auto l = static_cast<std::size_t>(pair.low);
        const auto h = static_cast<std::size_t>(pair.high);
        if (row.held[l] == 0 || row.held[h] == 0) continue;
        const double a = pair.share;
        const double b = pair.share_of_high();
        auto& [x, y, xx, xy, yy, log_odds] = row.fields;
        const double dx = x[h] - x[l];
        const double dy = y[h] - y[l];
        x[l] = a * x[l] + b * x[h];
        y[l] = a * y[l] + b * y[h];
        if (treatment == CovarianceTreatment::moment_matched) {
          xx[l] = a * xx[l] + b * xx[h] + (a * b) * (dx * dx);
          xy[l] = a * xy[l] + b * xy[h] + (a * b) * (dx * dy);
          yy[l] = a * yy[l] + b * yy[h] + (a * b) * (dy * dy);
        }
      }
    }
  }

 private:
  std::size_t particles_;
  std::map<int, Row> rows_;
};

}  // namespace pf_resampling
