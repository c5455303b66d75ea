#pragma once
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "bridge/carry/runtime/interface.hpp"
#include "dds_adapter/participant.hpp"
#include "dds_adapter/service.hpp"
#include "someip/wire/types.hpp"

namespace trestle::carry {

/// What a route reads from: dds::Reader. After its end the callback is not running and will not be called
/// again.
class DdsReader : public Interface {
 public:
  [[nodiscard]] virtual std::size_t matched() const = 0;
  [[nodiscard]] virtual dds::ReaderCounters counters() const = 0;
};

/// What a route writes to: dds::Writer.
class DdsWriter : public Interface {
 public:
  virtual tl::expected<void, dds::WriteError> write(std::span<const ByteView> slices) = 0;
  virtual void forget_written() = 0;
  [[nodiscard]] virtual std::size_t matched() const = 0;
  [[nodiscard]] virtual dds::WriterCounters counters() const = 0;
};

/// What calls a ROS service: dds::ServiceClient.
class DdsClient : public Interface {
 public:
  [[nodiscard]] virtual bool ready() const = 0;
  virtual void call(std::span<const ByteView> slices, std::chrono::nanoseconds timeout, dds::TimePoint now,
                    dds::ServiceClient::Handler handler) = 0;
  virtual void work(dds::TimePoint now) = 0;
  [[nodiscard]] virtual std::optional<dds::TimePoint> deadline() const = 0;
  [[nodiscard]] virtual dds::ServiceClientCounters counters() const = 0;
};

/// What answers as a ROS service: dds::ServiceServer.
class DdsServer : public Interface {
 public:
  virtual void reply(const dds::RequestId& id, std::span<const ByteView> slices, dds::TimePoint now) = 0;
  virtual void work(dds::TimePoint now) = 0;
  [[nodiscard]] virtual std::optional<dds::TimePoint> deadline() const = 0;
  [[nodiscard]] virtual dds::ServiceServerCounters counters() const = 0;
};

/// What routes need of DDS. All as of dds::Participant; tests of routes have one without a network.
class DdsSide : public Interface {
 public:
  /// @param topic, type  their names on the DDS wire.
  [[nodiscard]] virtual std::unique_ptr<DdsReader> reader(std::string_view topic, std::string_view type,
                                                          const dds::Qos& qos, dds::OnSample on_sample,
                                                          std::size_t max_sample_bytes,
                                                          dds::EndpointExtras extras) = 0;
  [[nodiscard]] virtual std::unique_ptr<DdsWriter> writer(std::string_view topic, std::string_view type,
                                                          const dds::Qos& qos, std::size_t max_sample_bytes,
                                                          dds::EndpointExtras extras) = 0;
  [[nodiscard]] virtual std::unique_ptr<DdsClient> client(const dds::ServiceConfig& config,
                                                          std::function<void()> wake) = 0;
  [[nodiscard]] virtual std::unique_ptr<DdsServer> server(const dds::ServiceConfig& config,
                                                          std::function<void()> wake,
                                                          dds::ServiceServer::Handler on_request) = 0;

  [[nodiscard]] virtual std::vector<dds::FoundWriter> writers() const = 0;
  [[nodiscard]] virtual std::vector<dds::BridgeEnd> bridge_ends(std::string_view topic) const = 0;
  [[nodiscard]] virtual std::uint64_t bridge_changes() const = 0;
  [[nodiscard]] virtual std::vector<dds::Counterpart> counterparts(std::string_view topic,
                                                                   bool writers) const = 0;
  [[nodiscard]] virtual std::size_t peers() const = 0;
  [[nodiscard]] virtual std::uint64_t not_remembered() const = 0;
};

/// @param participant  outlives the result.
[[nodiscard]] std::unique_ptr<DdsSide> dds_side_of(dds::Participant& participant);

}  // namespace trestle::carry
