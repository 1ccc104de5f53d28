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
            "0.10): is the list right? Its ranges are left out");
  radio.in_place_of = 2;
  EXPECT_NE(remark_on(radio, {beacon}).find("at the place of beacon 2"), std::string::npos);
  radio.account = RadioAccount::biased;
  radio.calibration.bias = -1.0;
  EXPECT_NE(remark_on(radio, {beacon}).find("1.00 ± 0.00 m too short"), std::string::npos);
}

}  // namespace
}  // namespace pf_resampling
