#include <trestle/sd/core/device/device.hpp>

int main() {
  using namespace trestle;
  static device::StaticDevice<device::Limits{.services = 1}> nothing{device::Settings{}};
  return nothing.offer(0, TimePoint{}) ? 1 : 0;
}
