#include "rviz_panel/value_editors.hpp"

#include <QLocale>
#include <cmath>

namespace pf_resampling {

RealEditor::RealEditor(QWidget* parent) : WithoutWheel<QDoubleSpinBox>(parent) {
  setDecimals(12);
  setKeyboardTracking(false);
}

QString RealEditor::textFromValue(double value) const {
  return QLocale::c().toString(value, 'g', 7);
}

double RealEditor::valueFromText(const QString& text) const {
  return QLocale::c().toDouble(text);
}

QValidator::State RealEditor::validate(QString& text, int&) const {
  bool is_number = false;
  const double value = QLocale::c().toDouble(text, &is_number);
  if (is_number && value >= minimum() && value <= maximum()) return QValidator::Acceptable;
  // On the way to a number.
  for (const QChar letter : text) {
    if (!letter.isDigit() && !QString("+-.eE").contains(letter)) return QValidator::Invalid;
  }
  return QValidator::Intermediate;
}

// By one in the second digit.
void RealEditor::stepBy(int steps) {
  const double size = std::max(std::abs(value()), 0.001);
  setValue(value() + steps * std::pow(10.0, std::floor(std::log10(size) + 1e-9) - 1.0));
  selectAll();
}

}  // namespace pf_resampling
