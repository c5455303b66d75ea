#pragma once
#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include <trestle/sd/net/handles.hpp>

#include "ets/interface.hpp"

namespace ets {

using namespace trestle::someip;
namespace sd = trestle::sd;

/// The device as a client: of one service by itself, from its start, and of another one as the Enhanced
/// Testability Service is told to.
class Client {
 public:
  explicit Client(sd::Node& node);
  ~Client();
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;

  /// Methods of the Enhanced Testability Service that drive it.
  [[nodiscard]] std::vector<sd::MethodSpec> methods();

 private:
  void activate();
  void deactivate();
  void subscribe();

  sd::Node& node_;
  sd::Subscription own_;
  std::optional<sd::RequirementId> requirement_;
  std::vector<sd::Subscription> subscriptions_;
  std::map<MethodId, std::uint8_t> last_values_;  ///< by event
};

}  // namespace ets
