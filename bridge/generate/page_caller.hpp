#pragma once
#include <boost/asio/io_context.hpp>
#include <functional>
#include <memory>

#include "bridge/generate/page.hpp"
#include "sd/net/node.hpp"

namespace trestle::generate {

/// Calls what the page wants to try. The Node is made for the first call, so that a page that calls nothing
/// needs no network.
class PageCaller {
 public:
  /// @param network  how to make it; what it throws is told as the call's error.
  PageCaller(boost::asio::io_context& io, std::function<sd::NodeConfig()> network)
      : io_{io}, network_{std::move(network)} {}

  using Done = std::function<void(web::Answer)>;
  /// @param done  gets the answer for the page, later, on the thread of the io_context.
  void call(PageCall call, Done done);
  /// Ends all calls without an answer, and takes leave of the network.
  void shutdown();

 private:
  struct Call;
  void send(const std::shared_ptr<Call>& call);
  void finish(const std::shared_ptr<Call>& call, web::Answer answer);

  boost::asio::io_context& io_;
  std::function<sd::NodeConfig()> network_;
  std::unique_ptr<sd::Node> node_{};
  std::vector<std::shared_ptr<Call>> calls_{};  ///< that have not ended
};

}  // namespace trestle::generate
