#pragma once

#include <fstream>
#include <string>

/// What readers of files share.
namespace pf_resampling::text_file {

/// What is in a damaged file may be anything; what is said about it is one line of letters: at most
/// the first 40.
std::string printable(const std::string& text);
/// Likewise, of any length and without quotes.
std::string in_letters(std::string text);

/// The whole of `word` as a finite number in decimals; false if it is none.
bool parse(const std::string& word, double* value);

/// Opens a file to be read. Throws Error that names it: `what` is what it is ("map file").
void open(const std::string& what, const std::string& path, std::ifstream* stream);

}  // namespace pf_resampling::text_file
