#include "pf_resampling_core/range_memory/radio_remark.hpp"

#include <gtest/gtest.h>

namespace pf_resampling {
namespace {

TEST(RadioRemark, SaysWhichRadioIsWrongAndHow) {
  Beacon beacon;
  beacon.id = 3;
  beacon.position = {31.5, 20.0, 2.0};
  RadioKnowledge radio;
  radio.id = 3;
  EXPECT_EQ(remark_on(radio, {beacon}), "");
  radio.account = RadioAccount::elsewhere;
  radio.places.push_back({{30.0, 20.0}, 0.01 * Eigen::Matrix2d::Identity(), 1.0});
  EXPECT_EQ(remark_on(radio, {beacon}),
            "beacon 3 is listed 1.5 m from where its ranges put it (31.50, 20.00 -> 30.00, 20.00 ± "
            "0.10): is the list right? Until it is settled, that place is used");
  radio.in_place_of = 2;
  EXPECT_NE(remark_on(radio, {beacon}).find("at the place of beacon 2"), std::string::npos);
  radio.account = RadioAccount::biased;
  radio.calibration.bias = -1.0;
  EXPECT_NE(remark_on(radio, {beacon}).find("1.00 ± 0.00 m too short"), std::string::npos);
}

TEST(PlaceInWords, SaysWhereARadioIsAndHowToKnowMore) {
  RadioKnowledge radio;
  radio.id = 3;
  radio.ranges = 12;
  EXPECT_EQ(place_in_words(radio), "beacon 3 is as listed; 12 ranges");
  radio.account = RadioAccount::unlisted;
  EXPECT_EQ(place_in_words(radio), "beacon 3 is not found: drive about it; 12 ranges");
  radio.places = {{{4.0, -1.5}, 0.04 * Eigen::Matrix2d::Identity(), 1.0}};
  EXPECT_EQ(place_in_words(radio), "beacon 3 is at (4.00, -1.50), known to 0.20 m; 12 ranges");
  radio.places[0].probability = 0.62;
  radio.places.push_back({{4.0, 1.5}, Eigen::Matrix2d::Identity(), 0.38});
  EXPECT_EQ(place_in_words(radio),
            "beacon 3: more than one place fits, (4.00, -1.50) and (4.00, 1.50), 62 to 38 %: drive "
            "a turn near it; 12 ranges");
}

}  // namespace
}  // namespace pf_resampling
