#pragma once
#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <memory>
#include <string>
#include <vector>

#include "dds_adapter/service.hpp"
#include "sd/net/node.hpp"
#include "test/hostile/flow_parts.hpp"

namespace trestle::test {

/// Carries Strings and calls from one network to the other and says to nobody that it is a bridge, as an
/// older version or one of another maker.
class OldBridge {
 public:
  OldBridge(boost::asio::io_context& io, Lines& lines, const std::string& address, std::uint32_t domain);

  /// event:TOPIC:SERVICE      a topic of Strings to an event
  /// method:SERVICE:ROS_SERVICE   a method that calls a std_srvs/srv/SetBool
  void add(const Part& part);
  void shutdown() { node_.shutdown(); }

 private:
  void event(const Part& part);
  void method(const Part& part);
  void work();

  boost::asio::io_context& io_;
  Lines& lines_;
  sd::Node node_;
  dds::Participant participant_;
  std::vector<dds::Reader> readers_;
  std::vector<std::unique_ptr<dds::ServiceClient>> clients_;
  boost::asio::steady_timer timer_;
};

}  // namespace trestle::test
