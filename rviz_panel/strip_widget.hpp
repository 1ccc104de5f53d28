#pragma once

#include <QString>
#include <QWidget>
#include <optional>

#include "rviz_panel/strip_buffer.hpp"

namespace pf_resampling {

/// Draws a quantity over the last minute: a line of text, and the curve under it.
class StripWidget : public QWidget {
 public:
  /// `help`: shown when the mouse rests on it.
  StripWidget(const QString& title, const QString& help, QWidget* parent);

  /// The curve, what it is at present in words, and ticks where `marks` is not zero.
  void show_values(const StripBuffer& values, const QString& now, const StripBuffer& marks);
  /// A line across; pale while it has no effect.
  void show_threshold(std::optional<double> threshold, bool has_effect);

  QSize sizeHint() const override;
  QSize minimumSizeHint() const override;

 protected:
  void paintEvent(QPaintEvent* event) override;

 private:
  QString title_;
  StripBuffer values_, marks_;
  QString now_;
  std::optional<double> threshold_;
  bool threshold_has_effect_ = false;
};

}  // namespace pf_resampling
