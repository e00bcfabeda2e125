// Role: tests of the NI-DAQmx driver; the device behind the stand-in for the vendor's library. Its
// monitor sees what its output emits while the relay is closed, and the interlock follows the
// relay.
#pragma once

struct FakeDaq {
  double temperature_V = 0.0;
  double power_V = 0.0;                ///< written by the driver
  unsigned char relay = 0, alive = 0;  ///< written by the driver
  unsigned char shutter = 1, foot = 1;
  bool gone = false;
  int tasks = 0;               ///< that are not cleared
  double patience = 0.0;       ///< s, the longest that a call was told to wait
  char channels[4][256] = {};  ///< of AI, AO, DI, DO, as they were asked for
};

extern "C" FakeDaq* fake_daq();
