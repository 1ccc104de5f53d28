#include "rviz_panel/strip_widget.hpp"

#include <QFontMetrics>
#include <QPainter>
#include <QPainterPath>
#include <algorithm>

namespace pf_resampling {
namespace {

constexpr int kCurveHeight = 36;     // pixels
constexpr double kLength = 60.0;     // s, from the left to the right
constexpr double kLongestGap = 3.0;  // s, over which values are joined
const QColor kCurve(31, 119, 180);
const QColor kThreshold(214, 39, 40);
const QColor kMark(44, 160, 44);

}  // namespace

StripWidget::StripWidget(const QString& title, const QString& help, QWidget* parent)
    : QWidget(parent), title_(title) {
  setToolTip(help);
  setSizePolicy(QSizePolicy::Preferred, QSizePolicy::Fixed);
}

void StripWidget::show_values(const std::deque<FilterHealth::SampleSize>& values,
                              const QString& now) {
  values_ = values;
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
  painter.drawText(time, Qt::AlignLeft, QString("%1 s ago").arg(kLength));
  painter.drawText(time, Qt::AlignRight, "now");

  double top = std::max(1.0, threshold_.value_or(0.0) * 1.1);
  for (const auto& value : values_) top = std::max(top, value.share * 1.05);
  const QRectF area = QRectF(frame).adjusted(1, 2, -1, -2);
  const auto x_of = [&](double stamp) {
    return area.right() - (values_.back().time - stamp) / kLength * area.width();
  };
  const auto y_of = [&](double value) {
    return area.bottom() - std::max(0.0, value) / top * area.height();
  };
  painter.setClipRect(frame.adjusted(1, 1, 0, 0));

  painter.setPen(QPen(kMark, 1));
  for (const auto& value : values_) {
    if (!value.renewed) continue;
    const double x = x_of(value.time);
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
  std::optional<double> before;
  for (const auto& value : values_) {
    const QPointF point(x_of(value.time), y_of(value.share));
    if (before && value.time - *before <= kLongestGap) {
      path.lineTo(point);
    } else {
      path.moveTo(point);
      path.lineTo(point + QPointF(0.5, 0.0));
    }
    before = value.time;
  }
  painter.setPen(QPen(kCurve, 1.5));
  painter.drawPath(path);
}

}  // namespace pf_resampling
