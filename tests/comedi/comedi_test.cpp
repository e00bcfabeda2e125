// The Comedi driver against a stand-in for libcomedi: no card, no kernel module.
#include <gtest/gtest.h>

#include <cmath>

#include "comedi/fake_comedi.hpp"
#include "photocoag/core/error.hpp"
#include "photocoag/device/driver.h"
#include "photocoag/rt/clock.hpp"
#include "photocoag/rt/driver_device.hpp"

extern "C" const photocoag_driver_table* photocoag_driver(void);

namespace photocoag::testing {
namespace {

constexpr const char* kSettings = "file=/dev/fake K_per_V=10 W_per_V=0.02 monitor_W_per_V=0.02";
constexpr double kStep = 20.0 / 65535.0;  // V of one code

/// The driver, open and armed for 1 ms.
struct Driver {
  explicit Driver(const char* settings = kSettings) {
    *fake_card() = {};
    char message[200] = "";
    status = table->open(&device, settings, message, sizeof(message));
    said = message;
    if (status == PHOTOCOAG_GOOD) table->arm(device, 1'000'000);
  }
  ~Driver() {
    if (status == PHOTOCOAG_GOOD) table->close(device);
  }
  photocoag_sample sample(int expected = PHOTOCOAG_GOOD) {
    photocoag_sample s{};
    EXPECT_EQ(table->wait_sample(device, monotonic_ns() + 50'000'000, &s), expected);
    return s;
  }
  const photocoag_driver_table* table = photocoag_driver();
  void* device = nullptr;
  int status = PHOTOCOAG_GONE;
  std::string said;
};

TEST(ComediDriver, ScalesWhatItReadsAndWrites) {
  Driver d;
  ASSERT_EQ(d.status, PHOTOCOAG_GOOD) << d.said;
  EXPECT_NEAR(fake_card()->power_V, 0.0, kStep) << "0 W from the start";
  fake_card()->temperature_V = 1.5;
  const photocoag_sample first = d.sample();
  EXPECT_NEAR(first.volume_temperature, 15.0, 10.0 * kStep);
  EXPECT_EQ(first.sequence, 1u);
  EXPECT_EQ(first.saturated, 0);
  EXPECT_EQ(d.sample().sequence, 2u);
  EXPECT_EQ(d.table->write_power(d.device, 0.05, 1), PHOTOCOAG_GOOD);
  EXPECT_NEAR(fake_card()->power_V, 2.5, kStep);
  fake_card()->monitor_V = 2.5;
  photocoag_readback r{};
  EXPECT_EQ(d.table->readback(d.device, &r), PHOTOCOAG_GOOD);
  EXPECT_NEAR(r.power, 0.05, 0.02 * kStep);
  EXPECT_TRUE(std::isnan(r.command)) << "no such word from a card";
  EXPECT_EQ(r.interlock_closed + r.shutter_open + r.foot_switch, 3);
  fake_card()->bits[2] = 0;
  d.table->readback(d.device, &r);
  EXPECT_EQ(r.foot_switch, 0);
}

TEST(ComediDriver, TokensAndTheLineForTheWatchdog) {
  Driver d;
  ASSERT_EQ(d.status, PHOTOCOAG_GOOD) << d.said;
  EXPECT_EQ(d.table->write_power(d.device, 0.01, 5), PHOTOCOAG_GOOD);
  EXPECT_EQ(fake_card()->bits[4], 1u);
  EXPECT_EQ(d.table->write_power(d.device, 0.01, 5), PHOTOCOAG_TIMEOUT) << "an old token";
  EXPECT_EQ(fake_card()->bits[4], 1u);
  EXPECT_EQ(d.table->write_power(d.device, 0.01, 6), PHOTOCOAG_GOOD);
  EXPECT_EQ(fake_card()->bits[4], 0u);
  EXPECT_EQ(d.table->write_power(d.device, 1.5, 7), PHOTOCOAG_GONE) << "milliwatts?";
  // No token for two periods: dark.
  for (int k = 0; k < 4; ++k) d.sample();
  EXPECT_NEAR(fake_card()->power_V, 0.0, kStep);
}

TEST(ComediDriver, RailsAreMarkedAndSafeOffOpensTheRelay) {
  Driver d;
  ASSERT_EQ(d.status, PHOTOCOAG_GOOD) << d.said;
  fake_card()->temperature_V = 10.0;
  EXPECT_EQ(d.sample().saturated, 1);
  EXPECT_EQ(fake_card()->bits[3], 1u);
  d.table->write_power(d.device, 0.05, 1);
  d.table->safe_off(d.device);
  EXPECT_EQ(fake_card()->bits[3], 0u);
  EXPECT_NEAR(fake_card()->power_V, 0.0, kStep);
  EXPECT_EQ(d.table->write_power(d.device, 0.05, 2), PHOTOCOAG_GOOD);
  EXPECT_NEAR(fake_card()->power_V, 0.0, kStep) << "off stays off";
}

TEST(ComediDriver, AVanishedCardIsGone) {
  Driver d;
  ASSERT_EQ(d.status, PHOTOCOAG_GOOD) << d.said;
  fake_card()->gone = true;
  d.sample(PHOTOCOAG_GONE);
  photocoag_readback r{};
  EXPECT_EQ(d.table->readback(d.device, &r), PHOTOCOAG_GONE);
  EXPECT_EQ(d.table->write_power(d.device, 0.01, 1), PHOTOCOAG_GONE);
}

TEST(ComediDriver, BadSettingsAreRefusedByName) {
  for (const auto& [settings, word] :
       {std::pair{"file=/dev/fake", "K_per_V"},
        std::pair{"file=/dev/fake K_per_V=10 W_per_V=0.02 monitor_W_per_V=0.02 colour=red",
                  "colour"},
        std::pair{"file=/dev/fake K_per_V=nan W_per_V=0.02 monitor_W_per_V=0.02", "K_per_V"},
        std::pair{"file=/dev/absent K_per_V=10 W_per_V=0.02 monitor_W_per_V=0.02", "/dev/absent"},
        std::pair{"file=/dev/fake K_per_V=10 W_per_V=0.02 monitor_W_per_V=0.02 power=7",
                  "power"}}) {
    const Driver d(settings);
    EXPECT_NE(d.status, PHOTOCOAG_GOOD) << settings;
    EXPECT_NE(d.said.find(word), std::string::npos) << d.said;
    EXPECT_EQ(fake_card()->opened, 0) << "closed again";
  }
}

// The module as it is shipped, with the real library: it loads, and no card is there.
TEST(ComediDriver, TheRealLibraryIsLoadedAndFindsNoCard) {
  try {
    const DriverDevice device(
        PHOTOCOAG_COMEDI, "file=/nonexistent/comedi K_per_V=1 W_per_V=1 monitor_W_per_V=1", 1e-3);
    ADD_FAILURE() << "a card where there is none";
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("/nonexistent/comedi"), std::string::npos)
        << error.what();
  }
}

}  // namespace
}  // namespace photocoag::testing
