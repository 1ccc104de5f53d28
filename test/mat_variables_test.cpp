#include "tools/datasets/mat_variables.hpp"

#include <gtest/gtest.h>
#include <zlib.h>

#include <string>
#include <utility>
#include <vector>

#include "pf_resampling_core/error.hpp"
#include "test/mat_file_writer.hpp"
#include "test/temporary_directory.hpp"

namespace pf_resampling {
namespace {

using Writer = MatFileWriter;

constexpr std::uint32_t kMatrix = 14;
constexpr std::uint32_t kCompressed = 15;

std::string compressed(const std::string& bytes) {
  std::string result(compressBound(bytes.size()), '\0');
  uLongf size = result.size();
  EXPECT_EQ(compress(reinterpret_cast<Bytef*>(result.data()), &size,
                     reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()),
            Z_OK);
  result.resize(size);
  return result;
}

/// What is in a matrix, of doubles if nothing else is said; data that say less are damaged.
struct Contents {
  std::uint32_t flags = 6;
  std::vector<std::uint32_t> dimensions = {3, 2};
  std::string name = "DR";
  std::uint32_t type = 9;
  std::string data = std::string(48, '\1');

  std::string bytes() const {
    return Writer::element(6, Writer::integers({flags, 0})) +
           Writer::element(5, Writer::integers(dimensions)) + Writer::element(1, name) +
           Writer::element(type, data);
  }
};

std::vector<MatVariable> variables_in(const Writer& writer) {
  const TemporaryDirectory directory;
  return variables_of_mat_file(directory.write("a.mat", writer.bytes()));
}

/// What is said of a file with that one matrix, compressed or not, without the name of the file.
std::vector<std::string> errors_of(const std::string& matrix) {
  std::vector<std::string> errors;
  const TemporaryDirectory directory;
  for (const bool is_compressed : {false, true}) {
    Writer writer;
    if (is_compressed) {
      writer.add_element(kCompressed, compressed(Writer::element(kMatrix, matrix)));
    } else {
      writer.add_element(kMatrix, matrix);
    }
    const std::string path = directory.write("a.mat", writer.bytes());
    errors.emplace_back();
    try {
      variables_of_mat_file(path);
    } catch (const Error& error) {
      const std::string what = error.what();
      EXPECT_EQ(what.substr(0, path.size()), path);
      errors.back() = what.substr(path.size());
    }
  }
  return errors;
}

TEST(VariablesOfMatFile, AreToldInTheOrderOfTheFile) {
  Contents text;
  text.flags = 4;  // of characters
  text.name = "who";
  Contents waves;
  waves.flags = 6 | 0x800;  // complex
  waves.name = "w";
  waves.dimensions = {1, 2, 3};
  Writer writer;
  writer.add("DR", {{1.0, 2.0, 3.0}})
      .add_element(kMatrix, text.bytes())
      .add_element(kCompressed, compressed(Writer::element(kMatrix, waves.bytes())))
      .add("nothing", {});
  const std::vector<MatVariable> variables = variables_in(writer);
  ASSERT_EQ(variables.size(), 4U);
  EXPECT_EQ(variables[0].name, "DR");
  EXPECT_TRUE(variables[0].is_numeric);
  EXPECT_FALSE(variables[0].is_complex);
  EXPECT_EQ(variables[0].dimensions, (std::vector<std::uint32_t>{1, 3}));
  EXPECT_EQ(variables[0].place, 128U);
  EXPECT_EQ(variables[1].name, "who");
  EXPECT_FALSE(variables[1].is_numeric);
  EXPECT_EQ(variables[1].place, 128U + variables[0].length);
  EXPECT_EQ(variables[2].name, "w");
  EXPECT_TRUE(variables[2].is_complex);
  EXPECT_EQ(variables[2].dimensions, (std::vector<std::uint32_t>{1, 2, 3}));
  EXPECT_EQ(variables[3].name, "nothing");
  EXPECT_EQ(variables[3].dimensions, (std::vector<std::uint32_t>{0, 0}));
}

TEST(VariablesOfMatFile, HaveOneByteOrder) {
  // A matrix of one double, most significant bytes first.
  const std::string matrix(
      "\0\0\0\6\0\0\0\10\0\0\0\6\0\0\0\0"  // flags: class 6
      "\0\0\0\5\0\0\0\10\0\0\0\1\0\0\0\1"  // 1 x 1
      "\0\2\0\1TL\0\0"                     // a short element: two characters
      "\0\0\0\11\0\0\0\10\77\360\0\0\0\0\0\0",
      56);
  std::string bytes(124, ' ');
  bytes += std::string("\1\0MI\0\0\0\16\0\0\0\70", 12) + matrix;
  const TemporaryDirectory directory;
  const std::vector<MatVariable> variables = variables_of_mat_file(directory.write("a.mat", bytes));
  ASSERT_EQ(variables.size(), 1U);
  EXPECT_EQ(variables[0].name, "TL");
  EXPECT_EQ(variables[0].dimensions, (std::vector<std::uint32_t>{1, 1}));
  EXPECT_EQ(variables[0].length, 64U);
}

TEST(VariablesOfMatFile, OfWhichTheFileSaysMoreThanThereIsAreDamaged) {
  const std::string damaged =
      ": the variable at byte 128 is damaged; save the file again (with -v7)";
  const Contents whole;
  EXPECT_EQ(errors_of(whole.bytes()), (std::vector<std::string>{"", ""}));

  // Each length in the header: 32 times as long as it is, or longer than all memory.
  const std::string bytes = whole.bytes();
  for (const std::size_t length : {4U, 20U, 36U, 52U}) {
    for (const char* const too_much : {"\0\1\0\0", "\x01\xff\xff\xfa"}) {
      std::string boastful = bytes;
      boastful.replace(length, 4, std::string(too_much, 4));
      EXPECT_EQ(errors_of(boastful), (std::vector<std::string>{damaged, damaged})) << length;
    }
  }
  // As many rows as no file of its size can hold; fewer than it holds.
  for (const std::uint32_t rows : {100000000U, 2U}) {
    Contents more;
    more.dimensions[0] = rows;
    EXPECT_EQ(errors_of(more.bytes()), (std::vector<std::string>{damaged, damaged})) << rows;
  }
  Contents unknown;
  unknown.type = 77;
  EXPECT_EQ(errors_of(unknown.bytes()), (std::vector<std::string>{damaged, damaged}));
  Contents endless;
  endless.name = std::string(600, 'x');
  EXPECT_EQ(errors_of(endless.bytes()), (std::vector<std::string>{damaged, damaged}));
}

TEST(VariablesOfMatFile, AreMatricesAndNothingElse) {
  const TemporaryDirectory directory;
  for (const std::uint32_t type : {0U, 9U, 77U, kCompressed}) {
    const std::string path =
        directory.write("a.mat", Writer().add_element(type, "no matrix").bytes());
    try {
      variables_of_mat_file(path);
      ADD_FAILURE() << "taken: " << type;
    } catch (const Error& error) {
      EXPECT_EQ(error.what(),
                path + ": the variable at byte 128 is damaged; save the file again (with -v7)");
    }
  }
}

}  // namespace
}  // namespace pf_resampling
