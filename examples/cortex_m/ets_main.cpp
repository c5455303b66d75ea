// The firmware with the Enhanced Testability Service.
#include "ets_application.hpp"
#include "firmware.hpp"

int main() {
  return trestle::example::run<trestle::example::EtsApplication>();
}
