#pragma once
#include <functional>

#include "sd/net/proxy.hpp"
#include "test/bridge/end_to_end/bridge_test.hpp"
#include "test/dds_adapter/service_driver.hpp"

namespace trestle::test {

/// What a call of a method or a ROS service came to: payload or error.
struct Answer {
  boost::system::error_code error;
  Bytes payload;
};

/// A bridge between a ROS peer with services and clients, and Nodes of SOME/IP.
class ServicesEndToEnd : public BridgeTest {
 protected:
  static sd::NodeConfig node_config() {
    sd::NodeConfig config = peer_config();
    config.max_reassemblies_per_sender = 128;
    config.max_reassemblies = 128;
    return config;
  }

  void work() override {
    BridgeTest::work();
    driver_.work();
  }

  static void call(sd::Proxy& proxy, someip::MethodId id, Bytes payload, std::vector<Answer>& answers,
                   Duration timeout = patience) {
    proxy.call({.method = id, .timeout = timeout}, std::move(payload),
               [&answers](boost::system::error_code error, sd::Response response) {
                 answers.push_back({error, std::move(response.payload)});
               });
  }

  static dds::ServiceConfig ros(const std::string& name, const std::string& type,
                                dds::RosForm form = dds::RosForm::automatic) {
    dds::ServiceConfig config;
    config.name = name;
    config.type = type;
    config.form = form;
    config.match_timeout = patience;
    return config;
  }

  static void ros_call(dds::ServiceClient& client, const Bytes& request, std::vector<Answer>& answers,
                       std::chrono::nanoseconds timeout = patience) {
    const dds::ByteView bytes = request;
    client.call({&bytes, 1}, timeout, std::chrono::steady_clock::now(),
                [&answers](const tl::expected<dds::ServiceMessage, dds::CallFault>& reply) {
                  if (reply) {
                    answers.push_back({{}, copy(reply->cdr())});
                  } else {
                    answers.push_back({boost::asio::error::timed_out, {}});
                  }
                });
  }

  /// A ROS server that answers each request at once.
  dds::ServiceServer& answering(const dds::ServiceConfig& config,
                                std::function<Bytes(const dds::ServiceMessage& request)> answer) {
    const auto place = std::make_shared<dds::ServiceServer*>(nullptr);
    *place = &driver_.server(
        ros_, config,
        [place, answer = std::move(answer)](const dds::RequestId& id, const dds::ServiceMessage& request) {
          const Bytes reply = answer(request);
          const dds::ByteView bytes = reply;
          (*place)->reply(id, {&bytes, 1}, std::chrono::steady_clock::now());
        });
    return **place;
  }

  ServiceDriver driver_;
};

}  // namespace trestle::test
