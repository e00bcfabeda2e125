// A stand-in for libcomedi: one card without hardware, whose lines the test sets and reads.
#include "comedi/fake_comedi.hpp"

#include <comedilib.h>

#include <cmath>
#include <string>

namespace {

FakeCard card;
constexpr lsampl_t kLargest = 65535;
comedi_range volts{.min = -10.0, .max = 10.0, .unit = UNIT_volt};
int not_used = 0;

comedi_t* handle() { return reinterpret_cast<comedi_t*>(&not_used); }

}  // namespace

extern "C" {

FakeCard* fake_card() { return &card; }

comedi_t* comedi_open(const char* file) {
  if (std::string(file) != "/dev/fake") return nullptr;
  ++card.opened;
  return handle();
}
int comedi_close(comedi_t*) {
  --card.opened;
  return 0;
}
int comedi_errno() { return 2; }
const char* comedi_strerror(int) { return "No such file or directory"; }
enum comedi_oor_behavior comedi_set_global_oor_behavior(enum comedi_oor_behavior) {
  return COMEDI_OOR_NAN;
}
lsampl_t comedi_get_maxdata(comedi_t*, unsigned subdevice, unsigned channel) {
  return subdevice <= 1 && channel <= 1 ? kLargest : 0;
}
comedi_range* comedi_get_range(comedi_t*, unsigned, unsigned, unsigned) { return &volts; }
double comedi_to_phys(lsampl_t data, comedi_range* range, lsampl_t maxdata) {
  return range->min + (range->max - range->min) * data / maxdata;
}
lsampl_t comedi_from_phys(double data, comedi_range* range, lsampl_t maxdata) {
  return static_cast<lsampl_t>(
      std::lround((data - range->min) / (range->max - range->min) * maxdata));
}
int comedi_data_read(comedi_t*, unsigned, unsigned channel, unsigned, unsigned, lsampl_t* data) {
  if (card.gone) return -1;
  const double value = channel == 0 ? card.temperature_V : card.monitor_V;
  *data = comedi_from_phys(value, &volts, kLargest);
  return 1;
}
int comedi_data_write(comedi_t*, unsigned, unsigned, unsigned, unsigned, lsampl_t data) {
  if (card.gone) return -1;
  card.power_V = comedi_to_phys(data, &volts, kLargest);
  return 1;
}
int comedi_dio_config(comedi_t*, unsigned, unsigned bit, unsigned direction) {
  card.output[bit] = direction == COMEDI_OUTPUT;
  return 0;
}
int comedi_dio_read(comedi_t*, unsigned, unsigned bit, unsigned* value) {
  if (card.gone) return -1;
  *value = card.bits[bit];
  return 1;
}
int comedi_dio_write(comedi_t*, unsigned, unsigned bit, unsigned value) {
  if (card.gone || !card.output[bit]) return -1;
  card.bits[bit] = value;
  return 1;
}
}
