#pragma once

#include <array>
#include <clocale>
#include <cstdint>
#include <cstdio>
#include <fstream>
#include <string>

/// What readers and writers of the text files of this package share: maps, checkpoints and poses,
/// described in doc/map_format.md and doc/checkpoints.md.
namespace pf_resampling::text_file {

/// Bytes of a line, without its end. The longest are rows of the joint information about a map: two
/// numbers of up to 24 bytes for each landmark; there is room for 20,000 landmarks.
inline constexpr std::size_t kLongestLine = std::size_t{1} << 20;

/// What a file is, and what is said of one that is not.
struct Kind {
  const char* name;         ///< "map file"
  const char* content;      ///< "map"
  const char* first_words;  ///< of the first line, up to the version
  const char* version;
  const char* if_other;    ///< remedy where it is something else
  const char* if_version;  ///< where it is of another version
  const char* if_damaged;

  std::string first_line() const { return std::string(first_words) + version; }
};

inline constexpr Kind kMap = {"map file",
                              "map",
                              "pf_resampling map ",
                              "2",
                              "give one that save_map wrote",
                              "save the map again with this program",
                              "save the map again or take another copy"};
inline constexpr Kind kCheckpoint = {"checkpoint",
                                     "checkpoint",
                                     "pf_resampling checkpoint ",
                                     "2",
                                     "give a file that was written as a checkpoint",
                                     "write a new one with this program",
                                     "take another copy or start without it"};

inline constexpr Kind kPose = {"pose file",
                               "pose",
                               "pf_resampling pose ",
                               "1",
                               "give one that a node wrote",
                               "remove it: the node writes another",
                               "remove it: the node writes another"};

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

/// FNV-1a, 64 bit. Each byte takes the state through a bijection, so no change of a single byte
/// goes unnoticed.
class Checksum {
 public:
  void add(const std::string& bytes) {
    for (const char byte : bytes) {
      state_ = (state_ ^ static_cast<unsigned char>(byte)) * 0x100000001b3u;
    }
  }
  std::string end_line(std::int64_t lines) const {
    std::array<char, 64> text{};
    std::snprintf(text.data(), text.size(), "end %lld %016llx", static_cast<long long>(lines),
                  static_cast<unsigned long long>(state_));
    return text.data();
  }

 private:
  std::uint64_t state_ = 0xcbf29ce484222325u;
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
