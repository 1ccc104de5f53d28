#pragma once

#include <QString>
#include <QWidget>
#include <deque>
#include <optional>

#include "rviz_panel/filter_health.hpp"

namespace pf_resampling {

/// Draws N_eff over the last minute: a line of text, and the curve under it.
class StripWidget : public QWidget {
 public:
  /// `help`: shown when the mouse rests on it.
  StripWidget(const QString& title, const QString& help, QWidget* parent);

  /// The curve, with ticks at renewals, and what it is at present in words.
  void show_values(const std::deque<FilterHealth::SampleSize>& values, const QString& now);
  /// A line across; pale while it has no effect.
  void show_threshold(std::optional<double> threshold, bool has_effect);

  QSize sizeHint() const override;
  QSize minimumSizeHint() const override;

 protected:
  void paintEvent(QPaintEvent* event) override;

 private:
  QString title_;
  std::deque<FilterHealth::SampleSize> values_;
  QString now_;
  std::optional<double> threshold_;
  bool threshold_has_effect_ = false;
};

}  // namespace pf_resampling
