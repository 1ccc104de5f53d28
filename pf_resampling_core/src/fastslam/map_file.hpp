#pragma once

#include <array>
#include <clocale>
#include <cstdint>
#include <cstdio>
#include <string>

/// What reader and writer of map files share. The format is described in doc/map_format.md.
namespace pf_resampling::map_file {

inline constexpr const char* kFirstLine = "pf_resampling map 1";
inline constexpr const char* kFirstWords = "pf_resampling map ";

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

}  // namespace pf_resampling::map_file
