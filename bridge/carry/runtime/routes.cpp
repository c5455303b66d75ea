#include "bridge/carry/runtime/routes.hpp"

#include "bridge/carry/runtime/start_at.hpp"

namespace trestle::carry {
void Routes::join_someip(SomeipSide& someip) {
  for (const auto& [mark, route] : routes_) {
    route->describe(offers_);
  }
  for (const auto& offer : offers_) {
    start_at(config_, offer->mark(), [&] { offer->open(someip); });
  }
  for (const auto& [mark, route] : routes_) {
    start_at(config_, mark, [&one = *route] { one.join_someip(); });
  }
}

void Routes::join_dds() {
  for (const auto& [mark, route] : routes_) {
    start_at(config_, mark, [&one = *route] { one.join_dds(); });
  }
}

void Routes::update_offers() {
  for (const auto& offer : offers_) {
    offer->update();
  }
}

void Routes::add(const Route& what, std::shared_ptr<RunningRoute> route, SomeipSide& someip) {
  try {
    route->describe(offers_);
    offers_.of(what).open(someip);
    route->join_someip();
    route->join_dds();
  } catch (...) {
    route.reset();  // before the offer that it knows
    offers_.end(what);
    throw;
  }
  routes_.push_back({what.mark, std::move(route)});
}

void Routes::remove(const Route& what, const RunningRoute& route) {
  offers_.of(what).withdraw();
  std::erase_if(routes_, [&](const MadeRoute& one) { return one.route.get() == &route; });
  offers_.end(what);
}

void Routes::stop() {
  for (const auto& offer : offers_) {
    offer->stop();
  }
  for (const auto& [mark, route] : routes_) {
    route->stop();
  }
}

void Routes::append_offers(std::vector<OwnOfferPicture>& offers) const {
  for (const auto& offer : offers_) {
    const sd::ServiceSpec& spec = offer->spec();
    offers.push_back({.service = value(spec.service),
                      .instance = value(spec.instance),
                      .major = spec.major,
                      .minor = spec.minor,
                      .udp_port = spec.udp_port.value_or(0),
                      .tcp_port = spec.tcp_port.value_or(0),
                      .offered = offer->handle().has_value()});
  }
}

}  // namespace trestle::carry
