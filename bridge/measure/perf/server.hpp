#pragma once
#include <memory>

#include "bridge/measure/perf/event_source.hpp"

namespace trestle::measure::perf {

/// Offers the service that is measured, by UDP and TCP.
class Server {
 public:
  /// The Node outlives it.
  /// @throws as Node::offer().
  Server(sd::Node& node, someip::ServiceId service, someip::InstanceId instance);
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

 private:
  [[nodiscard]] std::vector<std::byte> status() const;
  void on_start(const someip::Message& request, sd::Responder& responder);

  sd::Node& node_;
  sd::OfferHandle offer_{};
  std::shared_ptr<EventSource> events_;
};

}  // namespace trestle::measure::perf
