#include "photocoag/safety/device_check.hpp"

#include <gtest/gtest.h>

namespace photocoag {
namespace {

constexpr DeviceSample kHere{.status = DeviceStatus::kGood};

SafetyLatch treating() {
  SafetyLatch latch;
  latch.status.state = SafetyState::kTreating;
  return latch;
}

SafetyLatch after(const DeviceSample& sample, const Readback& readback, DeviceStatus write) {
  SafetyLatch latch = treating();
  check_device(sample, readback, write, latch);
  return latch;
}

TEST(DeviceCheck, AHealthyDeviceIsNotNoticed) {
  const SafetyLatch latch = after(kHere, {}, DeviceStatus::kGood);
  EXPECT_EQ(latch.status.state, SafetyState::kTreating);
  EXPECT_EQ(latch.status.detections, 0);
  EXPECT_FALSE(latch.open_interlock);
}

TEST(DeviceCheck, WhatCannotBeSwitchedOffBySoftwareOpensTheInterlock) {
  const auto is = [](const SafetyLatch& latch, SafetyReason reason, bool by_hardware) {
    EXPECT_EQ(latch.status.state, SafetyState::kSafeStop);
    EXPECT_EQ(latch.status.reason, reason);
    EXPECT_EQ(latch.open_interlock, by_hardware);
  };
  is(after({.status = DeviceStatus::kGone}, {}, DeviceStatus::kGood), SafetyReason::kDeviceGone,
     true);
  is(after(kHere, {}, DeviceStatus::kGone), SafetyReason::kDeviceGone, true);
  is(after(kHere, {}, DeviceStatus::kTimeout), SafetyReason::kWriteFailed, true);
  is(after(kHere, {.interlock_closed = false}, DeviceStatus::kGood), SafetyReason::kInterlock,
     false);
  is(after(kHere, {.shutter_open = false}, DeviceStatus::kGood), SafetyReason::kShutter, false);
}

TEST(DeviceCheck, AReleasedFootSwitchIsStandbyAndAFaultBesideItIsNot) {
  EXPECT_EQ(after(kHere, {.foot_switch = false}, DeviceStatus::kGood).status.state,
            SafetyState::kStandby);
  const SafetyLatch both =
      after(kHere, {.shutter_open = false, .foot_switch = false}, DeviceStatus::kGood);
  EXPECT_EQ(both.status.state, SafetyState::kSafeStop);
  EXPECT_EQ(both.status.reason, SafetyReason::kShutter) << "the first reason stays";
  EXPECT_EQ(both.status.detections, 2);
}

TEST(SafetyLatch, DoneGivesWayToAFaultAlone) {
  SafetyLatch latch = treating();
  latch.stop(SafetyState::kDone, SafetyReason::kEnergy);
  latch.stop(SafetyState::kStandby, SafetyReason::kFootSwitch);
  EXPECT_EQ(latch.status.state, SafetyState::kDone);
  EXPECT_EQ(latch.status.reason, SafetyReason::kEnergy);
  latch.safe_stop(SafetyReason::kInterlock);
  EXPECT_EQ(latch.status.state, SafetyState::kSafeStop);
  latch.stop(SafetyState::kDone, SafetyReason::kExposure);
  EXPECT_EQ(latch.status.reason, SafetyReason::kInterlock);
}

}  // namespace
}  // namespace photocoag
