#include "rviz_panel/strip_widget.hpp"

#include <QFontMetrics>
#include <QPainter>
#include <QPainterPath>
#include <algorithm>

namespace pf_resampling {
namespace {

constexpr int kCurveHeight = 36;  // pixels
const QColor kCurve(31, 119, 180);
const QColor kThreshold(214, 39, 40);
const QColor kMark(44, 160, 44);

}  // namespace

StripWidget::StripWidget(const QString& title, const QString& help, QWidget* parent)
    : QWidget(parent), title_(title) {
  setToolTip(help);
  setSizePolicy(QSizePolicy::Preferred, QSizePolicy::Fixed);
}

void StripWidget::show_values(const StripBuffer& values, const QString& now,
                              const StripBuffer& marks) {
  values_ = values;
  marks_ = marks;
  now_ = now;
  update();
}

void StripWidget::show_threshold(std::optional<double> threshold, bool has_effect) {
  threshold_ = threshold;
  threshold_has_effect_ = has_effect;
  update();
}

QSize StripWidget::minimumSizeHint() const {
  return {150, 2 * fontMetrics().height() + kCurveHeight + 4};
}

QSize StripWidget::sizeHint() const {
  return {280, minimumSizeHint().height()};
}

void StripWidget::paintEvent(QPaintEvent*) {
  QPainter painter(this);
  const int line = fontMetrics().height();
  const QRect text(0, 0, width(), line);
  painter.drawText(text, Qt::AlignLeft | Qt::AlignVCenter, title_);
  painter.drawText(text, Qt::AlignRight | Qt::AlignVCenter, now_);

  const QRect frame(0, line + 1, width() - 1, kCurveHeight);
  painter.fillRect(frame, palette().base());
  painter.setPen(palette().color(QPalette::Mid));
  painter.drawRect(frame);
  const QRect time(0, frame.bottom() + 2, width(), line);
  painter.setPen(palette().color(QPalette::Disabled, QPalette::Text));
  painter.drawText(time, Qt::AlignLeft, QString("%1 s ago").arg(values_.length()));
  painter.drawText(time, Qt::AlignRight, "now");

  const auto columns = values_.columns();
  double top = std::max(1.0, threshold_.value_or(0.0) * 1.1);
  for (const auto& column : columns) top = std::max(top, column.high * 1.05);
  const QRectF area = QRectF(frame).adjusted(1, 2, -1, -2);
  const auto x_of = [&](double age) {
    return area.right() - age / values_.length() * area.width();
  };
  const auto y_of = [&](double value) {
    return area.bottom() - std::max(0.0, value) / top * area.height();
  };
  painter.setClipRect(frame.adjusted(1, 1, 0, 0));

  for (const auto& mark : marks_.columns()) {
    if (mark.high == 0.0) continue;
    painter.setPen(QPen(kMark, 1));
    const double x = x_of(mark.age);
    painter.drawLine(QPointF(x, area.bottom() + 1), QPointF(x, area.bottom() - 4));
  }
  if (threshold_) {
    painter.setPen(
        QPen(threshold_has_effect_ ? kThreshold : palette().color(QPalette::Mid), 1, Qt::DashLine));
    painter.drawLine(QPointF(area.left(), y_of(*threshold_)),
                     QPointF(area.right(), y_of(*threshold_)));
  }

  painter.setRenderHint(QPainter::Antialiasing);
  QPainterPath path;
  for (const auto& column : columns) {
    const QPointF point(x_of(column.age), y_of(column.mean));
    if (column.follows) {
      path.lineTo(point);
    } else {
      path.moveTo(point);
      path.lineTo(point + QPointF(0.5, 0.0));
    }
    if (column.high > column.low) {
      QColor band = kCurve;
      band.setAlpha(90);
      painter.setPen(QPen(band, 1));
      painter.drawLine(QPointF(point.x(), y_of(column.low)), QPointF(point.x(), y_of(column.high)));
    }
  }
  painter.setPen(QPen(kCurve, 1.5));
  painter.drawPath(path);
}

}  // namespace pf_resampling
