#pragma once
#include <functional>
#include <memory>
#include <string>

#include "someip/net/net_error.hpp"
#include "someip/wire/endpoint.hpp"

namespace boost::asio {
class io_context;
}

namespace trestle::sd {

/// Watches the link that a Node needs, see LinkState, in the network namespace where this was made. Costs
/// nothing while no interface changes: it sleeps in the kernel.  [feat_req_someipsd_23]
class LinkWatch {
 public:
  /// Told of each change: `words` is a line for the log, such as "link eth0 is down: it has no carrier".
  using Handler = std::function<void(bool up, const std::string& words)>;

  /// @param own, interface  as of LinkState.
  /// @throws someip::NetError when the system does not let us watch (netlink).
  LinkWatch(boost::asio::io_context& io, const IpAddress& own, const std::string& interface, Handler handler);
  /// The handler is not called any more.
  ~LinkWatch();
  LinkWatch(const LinkWatch&) = delete;
  LinkWatch& operator=(const LinkWatch&) = delete;

  /// As it was told last, or found at the start: that is not told.
  [[nodiscard]] bool up() const noexcept;
  /// As it would be told.
  [[nodiscard]] const std::string& words() const noexcept;

 private:
  struct State;
  std::shared_ptr<State> state_;
};

}  // namespace trestle::sd
