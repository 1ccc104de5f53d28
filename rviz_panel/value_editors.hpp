#pragma once

#include <QComboBox>
#include <QDoubleSpinBox>
#include <QSpinBox>
#include <QWheelEvent>

namespace pf_resampling {

/// Turning the mouse wheel over these scrolls what they are in, instead of changing a parameter of
/// a robot.
template <typename Base>
class WithoutWheel : public Base {
 public:
  explicit WithoutWheel(QWidget* parent) : Base(parent) { this->setFocusPolicy(Qt::StrongFocus); }

 protected:
  void wheelEvent(QWheelEvent* event) override { event->ignore(); }
};

using ChoiceEditor = WithoutWheel<QComboBox>;
using IntegerEditor = WithoutWheel<QSpinBox>;

/// A real number of any size, written as short as it goes ("1e-05").
class RealEditor : public WithoutWheel<QDoubleSpinBox> {
 public:
  explicit RealEditor(QWidget* parent);

 protected:
  QString textFromValue(double value) const override;
  double valueFromText(const QString& text) const override;
  QValidator::State validate(QString& text, int& position) const override;
  void stepBy(int steps) override;
};

}  // namespace pf_resampling
