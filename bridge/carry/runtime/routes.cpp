#include "bridge/carry/runtime/routes.hpp"

#include "bridge/carry/runtime/start_at.hpp"

namespace trestle::carry {
namespace {

template <typename Start>
auto at(const BridgeConfig* config, documents::Mark mark, const Start& start) {
  return config != nullptr ? start_at(*config, mark, start) : start();
}

}  // namespace

void Routes::join_someip(SomeipSide& someip) {
  for (const auto& [mark, route] : routes_) {
    route->describe(offers_);
  }
  for (const auto& offer : offers_) {
    at(config_, offer->mark(), [&] { offer->open(someip); });
  }
  for (const auto& [mark, route] : routes_) {
    at(config_, mark, [&one = *route] { one.join_someip(); });
  }
}

void Routes::join_dds() {
  for (const auto& [mark, route] : routes_) {
    at(config_, mark, [&one = *route] { one.join_dds(); });
  }
}

void Routes::update_offers() {
  for (const auto& offer : offers_) {
    offer->update();
  }
}

void Routes::withdraw() {
  for (const auto& offer : offers_) {
    offer->withdraw();
  }
}

void Routes::stop() {
  for (const auto& offer : offers_) {
    offer->stop();
  }
  for (const auto& [mark, route] : routes_) {
    route->stop();
  }
}

}  // namespace trestle::carry
