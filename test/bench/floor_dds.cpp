// A sample there and back between two processes that use Fast DDS as it comes, but for the transport: the
// floor of a DDS hop.
#include <condition_variable>
#include <cstdio>
#include <cstring>
#include <deque>
#include <memory>
#include <mutex>
#include <thread>

#include "dds_adapter/fastdds_compat.hpp"
#include "test/bench/floor.hpp"

namespace trestle::floor {
namespace {

namespace fast = dds::fast;
using Bytes = std::vector<std::byte>;

/// Bytes behind the four of the encapsulation.
class BytesType final : public fast::AnyType {
 public:
  BytesType() : AnyType{"trestle::floor::Bytes"} {}

 private:
  static constexpr std::size_t encapsulation = 4;

  std::uint32_t encoded_size(const void* sample) override {
    return static_cast<std::uint32_t>(static_cast<const Bytes*>(sample)->size() + encapsulation);
  }
  bool encode(const void* sample, fast::Payload& payload) override {
    const auto& bytes = *static_cast<const Bytes*>(sample);
    std::memset(payload.data, 0, encapsulation);
    payload.data[1] = 1;
    std::memcpy(payload.data + encapsulation, bytes.data(), bytes.size());
    payload.length = static_cast<std::uint32_t>(bytes.size() + encapsulation);
    return true;
  }
  bool decode(fast::Payload& payload, void* sample) override {
    auto& bytes = *static_cast<Bytes*>(sample);
    bytes.resize(payload.length - encapsulation);
    std::memcpy(bytes.data(), payload.data + encapsulation, bytes.size());
    return true;
  }
  void* make() override { return new Bytes; }
  void destroy(void* sample) override { delete static_cast<Bytes*>(sample); }
};

/// Both ends of the two topics, "there" and "back".
class Peer final : private fast::DataReaderListener {
 public:
  Peer(const Options& options, const char* writes, const char* reads) {
    fast::DomainParticipantQos qos;
    qos.transport().use_builtin_transports = false;
    if (options.shared_memory) {
      qos.transport().user_transports.push_back(
          std::make_shared<eprosima::fastdds::rtps::SharedMemTransportDescriptor>());
    }
    const auto udp = std::make_shared<eprosima::fastdds::rtps::UDPv4TransportDescriptor>();
    udp->interfaceWhiteList.emplace_back("127.0.0.1");
    udp->sendBufferSize = buffer_bytes;
    udp->receiveBufferSize = buffer_bytes;
    qos.transport().user_transports.push_back(udp);
    auto* factory = fast::DomainParticipantFactory::get_instance();
    participant_ = factory->create_participant(options.domain, qos);
    fast::TypeSupport type{new BytesType};
    type.register_type(participant_);
    writer_ = participant_->create_publisher(fast::PUBLISHER_QOS_DEFAULT)
                  ->create_datawriter(topic(writes, type), writer_qos());
    reader_ = participant_->create_subscriber(fast::SUBSCRIBER_QOS_DEFAULT)
                  ->create_datareader(topic(reads, type), reader_qos(), this);
  }
  // The process ends with it: nothing needs to be taken apart.

  void write(Bytes& bytes) { writer_->write(&bytes); }

  struct Received {
    Bytes bytes;
    std::int64_t at_ns = 0;
  };
  /// The next sample; at 0 when none comes.
  Received take(std::chrono::milliseconds limit) {
    std::unique_lock lock{mutex_};
    if (!came_.wait_for(lock, limit, [this] { return !waiting_.empty(); })) {
      return {};
    }
    Received first = std::move(waiting_.front());
    waiting_.pop_front();
    return first;
  }
  [[nodiscard]] bool matched() const {
    fast::PublicationMatchedStatus there;
    fast::SubscriptionMatchedStatus back;
    writer_->get_publication_matched_status(there);
    reader_->get_subscription_matched_status(back);
    return there.current_count > 0 && back.current_count > 0;
  }

 private:
  static constexpr std::uint32_t buffer_bytes = 4 << 20;

  fast::Topic* topic(const char* name, const fast::TypeSupport& type) const {
    return participant_->create_topic(name, type.get_type_name(), fast::TOPIC_QOS_DEFAULT);
  }
  static fast::DataWriterQos writer_qos() {
    fast::DataWriterQos qos;
    qos.reliability().kind = fast::RELIABLE_RELIABILITY_QOS;
    qos.history().depth = 10;
    qos.publish_mode().kind = fast::ASYNCHRONOUS_PUBLISH_MODE;
    qos.endpoint().history_memory_policy = fast::dynamic_reusable;
    return qos;
  }
  static fast::DataReaderQos reader_qos() {
    fast::DataReaderQos qos;
    qos.reliability().kind = fast::RELIABLE_RELIABILITY_QOS;
    qos.history().depth = 10;
    qos.endpoint().history_memory_policy = fast::dynamic_reusable;
    return qos;
  }

  void on_data_available(fast::DataReader* reader) override {
    Received received;
    fast::SampleInfo info;
    while (fast::is_ok(reader->take_next_sample(&received.bytes, &info))) {
      if (info.valid_data) {
        received.at_ns = now_ns();
        {
          const std::lock_guard lock{mutex_};
          waiting_.push_back(std::move(received));
        }
        came_.notify_one();
        received = {};
      }
    }
  }

  fast::DomainParticipant* participant_ = nullptr;
  fast::DataWriter* writer_ = nullptr;
  fast::DataReader* reader_ = nullptr;
  std::mutex mutex_;
  std::condition_variable came_;
  std::deque<Received> waiting_;
};

}  // namespace

void reflect_dds(const Options& options) {
  Peer peer{options, "back", "there"};
  for (;;) {
    if (Peer::Received received = peer.take(std::chrono::seconds{1}); received.at_ns != 0) {
      peer.write(received.bytes);
    }
  }
}

/// Latencies are those of one way: half of the way there and back.
void ping_dds(const Options& options) {
  Peer peer{options, "there", "back"};
  for (int i = 0; !peer.matched(); ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds{10});
    if (i > 1000) {
      std::fputs("trestle_floor: nobody reflects\n", stderr);
      std::exit(1);
    }
  }
  Figures figures;
  figures.bytes = options.bytes;
  Bytes bytes(options.bytes, std::byte{0x5a});
  const std::int64_t start = now_ns() + warm_up_ns;
  const std::int64_t end = start + static_cast<std::int64_t>(options.seconds * 1e9);
  for (std::int64_t before = now_ns(); before < end; before = now_ns()) {
    peer.write(bytes);
    const Peer::Received received = peer.take(std::chrono::seconds{1});
    if (before >= start) {
      if (received.at_ns == 0) {
        ++figures.lost;
      } else {
        ++figures.received;
        figures.latency.add((received.at_ns - before) / 2);
      }
    }
  }
  figures.seconds = options.seconds;
  figures.print();
}

}  // namespace trestle::floor
