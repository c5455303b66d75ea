// The firmware with a sensor.
#include "firmware.hpp"
#include "sensor.hpp"

int main() {
  return trestle::example::run<trestle::example::Sensor>();
}
