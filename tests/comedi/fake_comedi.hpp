// Role: tests of the Comedi driver; the card behind the stand-in for libcomedi.
#pragma once

struct FakeCard {
  double temperature_V = 0.0;
  double monitor_V = 0.0;
  double power_V = 0.0;  ///< written by the driver
  unsigned bits[8] = {1, 1, 1, 0, 0, 0, 0, 0};
  bool output[8] = {};
  bool gone = false;
  int opened = 0;
};

extern "C" FakeCard* fake_card();
