#pragma once

#include <clocale>
#include <cstdint>
#include <fstream>
#include <string>

/// What readers of files share.
namespace pf_resampling::text_file {

/// Numbers are written and read with a point, whatever the locale of the program.
class ClassicLocale {
 public:
  ClassicLocale() : classic_(newlocale(LC_ALL_MASK, "C", nullptr)), before_(uselocale(classic_)) {}
  ~ClassicLocale() {
    uselocale(before_);
    freelocale(classic_);
  }
  ClassicLocale(const ClassicLocale&) = delete;
  ClassicLocale& operator=(const ClassicLocale&) = delete;

 private:
  locale_t classic_;
  locale_t before_;
};

/// What is in a damaged file may be anything; what is said about it is one line of letters: at most
/// the first 40.
std::string printable(const std::string& text);
/// Likewise, without quotes.
std::string letters(const std::string& text);
/// Likewise, of any length.
std::string in_letters(std::string text);

/// The whole of `word` as a finite number in decimals, as a number from 0 to `most`; false if it is
/// none.
bool parse(const std::string& word, double* value);
bool parse(const std::string& word, std::int64_t most, std::int64_t* value);

/// Opens a file to be read. Throws Error that names it: `what` is what it is ("map file").
void open(const std::string& what, const std::string& path, std::ifstream* stream);

}  // namespace pf_resampling::text_file
