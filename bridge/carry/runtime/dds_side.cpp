#include "bridge/carry/runtime/dds_side.hpp"

#include <utility>

namespace trestle::carry {
namespace {

class OwnReader final : public DdsReader {
 public:
  explicit OwnReader(dds::Reader reader) : reader_{std::move(reader)} {}
  std::size_t matched() const override { return reader_.matched(); }
  dds::ReaderCounters counters() const override { return reader_.counters(); }

 private:
  dds::Reader reader_;
};

class OwnWriter final : public DdsWriter {
 public:
  explicit OwnWriter(dds::Writer writer) : writer_{std::move(writer)} {}
  tl::expected<void, dds::WriteError> write(std::span<const ByteView> slices) override {
    return writer_.write(slices);
  }
  void forget_written() override { writer_.forget_written(); }
  std::size_t matched() const override { return writer_.matched(); }
  dds::WriterCounters counters() const override { return writer_.counters(); }

 private:
  dds::Writer writer_;
};

class OwnClient final : public DdsClient {
 public:
  OwnClient(dds::Participant& participant, const dds::ServiceConfig& config, std::function<void()> wake)
      : client_{participant, config, std::move(wake)} {}
  bool ready() const override { return client_.ready(); }
  void call(std::span<const ByteView> slices, std::chrono::nanoseconds timeout, dds::TimePoint now,
            dds::ServiceClient::Handler handler) override {
    client_.call(slices, timeout, now, std::move(handler));
  }
  void work(dds::TimePoint now) override { client_.work(now); }
  std::optional<dds::TimePoint> deadline() const override { return client_.deadline(); }
  dds::ServiceClientCounters counters() const override { return client_.counters(); }

 private:
  dds::ServiceClient client_;
};

class OwnServer final : public DdsServer {
 public:
  OwnServer(dds::Participant& participant, const dds::ServiceConfig& config, std::function<void()> wake,
            dds::ServiceServer::Handler on_request)
      : server_{participant, config, std::move(wake), std::move(on_request)} {}
  void reply(const dds::RequestId& id, std::span<const ByteView> slices, dds::TimePoint now) override {
    server_.reply(id, slices, now);
  }
  void work(dds::TimePoint now) override { server_.work(now); }
  std::optional<dds::TimePoint> deadline() const override { return server_.deadline(); }
  dds::ServiceServerCounters counters() const override { return server_.counters(); }

 private:
  dds::ServiceServer server_;
};

class ParticipantSide final : public DdsSide {
 public:
  explicit ParticipantSide(dds::Participant& participant) : participant_{participant} {}

  std::unique_ptr<DdsReader> reader(std::string_view topic, std::string_view type, const dds::Qos& qos,
                                    dds::OnSample on_sample, std::size_t max_sample_bytes,
                                    dds::EndpointExtras extras) override {
    return std::make_unique<OwnReader>(participant_.create_reader(topic, type, qos, std::move(on_sample),
                                                                  max_sample_bytes, std::move(extras)));
  }
  std::unique_ptr<DdsWriter> writer(std::string_view topic, std::string_view type, const dds::Qos& qos,
                                    std::size_t max_sample_bytes, dds::EndpointExtras extras) override {
    return std::make_unique<OwnWriter>(
        participant_.create_writer(topic, type, qos, max_sample_bytes, std::move(extras)));
  }
  std::unique_ptr<DdsClient> client(const dds::ServiceConfig& config, std::function<void()> wake) override {
    return std::make_unique<OwnClient>(participant_, config, std::move(wake));
  }
  std::unique_ptr<DdsServer> server(const dds::ServiceConfig& config, std::function<void()> wake,
                                    dds::ServiceServer::Handler on_request) override {
    return std::make_unique<OwnServer>(participant_, config, std::move(wake), std::move(on_request));
  }

  std::vector<dds::FoundWriter> writers() const override { return participant_.writers(); }
  std::vector<dds::BridgeEnd> bridge_ends(std::string_view topic) const override {
    return participant_.bridge_ends(topic);
  }
  std::uint64_t bridge_changes() const override { return participant_.bridge_changes(); }
  std::vector<dds::Counterpart> counterparts(std::string_view topic, bool writers) const override {
    return participant_.counterparts(topic, writers);
  }
  std::size_t peers() const override { return participant_.peers(); }
  std::uint64_t not_remembered() const override { return participant_.not_remembered(); }

 private:
  dds::Participant& participant_;
};

}  // namespace

std::unique_ptr<DdsSide> dds_side_of(dds::Participant& participant) {
  return std::make_unique<ParticipantSide>(participant);
}

}  // namespace trestle::carry
