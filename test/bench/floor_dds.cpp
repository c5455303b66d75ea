// A sample there and back between two processes that use Fast DDS and nothing else: samples stay on loan
// where DDS received them, and are written from there, by the thread that received them; with the buffers,
// transports and QoS of our own ends.
// Which way of writing is the quicker one depends on the size: with `synchronous=1` the thread that writes
// sends as well, else a thread of DDS does. Both are measured, and the quicker one is the floor of a DDS hop.
#include <unistd.h>

#include <algorithm>
#include <condition_variable>
#include <cstdio>
#include <cstdlib>
#include <deque>
#include <memory>
#include <mutex>
#include <random>
#include <thread>

#include "dds_adapter/fastdds_compat.hpp"
#include "dds_adapter/raw_type.hpp"
#include "test/bench/floor.hpp"

namespace trestle::floor {
namespace {

namespace fast = dds::fast;
using dds::ByteView;
using dds::detail::RawSample;
using dds::detail::RawType;

/// A sample as DDS received it.
struct Received {
  fast::LoanableSequence<RawSample> samples;
  fast::SampleInfoSeq infos;
  std::int64_t at_ns = 0;

  [[nodiscard]] ByteView bytes() const { return samples[0].received; }
};

// All of these are those of dds_adapter/, whose writers are synchronous up to 300 KB.
constexpr std::uint32_t buffer_bytes = 16U << 20U;
constexpr std::uint32_t shared_memory_bytes = 128U << 20U;
constexpr std::uint32_t shared_message_bytes = 16U << 20U;
constexpr std::int32_t depth = 10;

fast::DomainParticipantQos participant_qos(bool shared_memory) {
  fast::DomainParticipantQos qos;
  qos.transport().use_builtin_transports = false;
  const auto udp = std::make_shared<eprosima::fastdds::rtps::UDPv4TransportDescriptor>();
  udp->interfaceWhiteList.emplace_back("127.0.0.1");
  udp->sendBufferSize = buffer_bytes;
  udp->receiveBufferSize = buffer_bytes;
  qos.transport().user_transports.push_back(udp);
  if (shared_memory) {
    const auto shared = std::make_shared<eprosima::fastdds::rtps::SharedMemTransportDescriptor>();
    shared->segment_size(shared_memory_bytes);
    shared->max_message_size(shared_message_bytes);
    qos.transport().user_transports.push_back(shared);
  }
  return qos;
}

fast::DataWriterQos writer_qos(bool synchronous) {
  fast::DataWriterQos qos;
  qos.reliability().kind = fast::RELIABLE_RELIABILITY_QOS;
  qos.history().depth = depth;
  qos.resource_limits().max_samples = depth;
  qos.resource_limits().max_instances = 1;
  qos.resource_limits().max_samples_per_instance = depth;
  qos.resource_limits().allocated_samples = 1;
  qos.publish_mode().kind = synchronous ? fast::SYNCHRONOUS_PUBLISH_MODE : fast::ASYNCHRONOUS_PUBLISH_MODE;
  qos.endpoint().history_memory_policy = fast::rtps::DYNAMIC_REUSABLE_MEMORY_MODE;
  qos.data_sharing().off();
  fast::set_heartbeat_period(qos, fast::Duration{0, 50'000'000});
  fast::set_nack_delay(qos, fast::Duration{0, 1'000'000});
  return qos;
}

fast::DataReaderQos reader_qos() {
  fast::DataReaderQos qos;
  qos.reliability().kind = fast::RELIABLE_RELIABILITY_QOS;
  qos.history().depth = depth;
  qos.resource_limits().max_samples = 0;
  qos.resource_limits().max_instances = 1;
  qos.resource_limits().max_samples_per_instance = 0;
  qos.resource_limits().allocated_samples = depth;
  qos.endpoint().history_memory_policy = fast::rtps::DYNAMIC_REUSABLE_MEMORY_MODE;
  qos.data_sharing().off();
  fast::set_heartbeat_delay(qos, fast::Duration{0, 1'000'000});
  return qos;
}

/// Both ends of the two topics, "there" and "back".
class Peer final : private fast::DataReaderListener {
 public:
  /// @param reflects  writes what comes, and has nothing to take.
  Peer(const Options& options, const char* writes, const char* reads, bool reflects) : reflects_{reflects} {
    auto* factory = fast::DomainParticipantFactory::get_instance();
    participant_ = factory->create_participant(options.domain, participant_qos(options.shared_memory));
    fast::TypeSupport type{new RawType{"trestle::floor::Bytes"}};
    type.register_type(participant_);
    writer_ = participant_->create_publisher(fast::PUBLISHER_QOS_DEFAULT)
                  ->create_datawriter(topic(writes, type), writer_qos(options.synchronous));
    reader_ = participant_->create_subscriber(fast::SUBSCRIBER_QOS_DEFAULT)
                  ->create_datareader(topic(reads, type), reader_qos(), this);
  }
  // The process ends with it: nothing needs to be taken apart.

  /// @param bytes  with the four of the encapsulation in front.
  void write(ByteView bytes) {
    RawSample sample;
    sample.slices = {&bytes, 1};
    sample.size = bytes.size();
    writer_->write(&sample);
  }

  /// The next sample; nothing when none comes.
  std::unique_ptr<Received> take(std::chrono::milliseconds limit) {
    std::unique_lock lock{mutex_};
    if (!came_.wait_for(lock, limit, [this] { return !waiting_.empty(); })) {
      return nullptr;
    }
    std::unique_ptr<Received> first = std::move(waiting_.front());
    waiting_.pop_front();
    return first;
  }
  void give_back(Received& received) { reader_->return_loan(received.samples, received.infos); }

  [[nodiscard]] bool matched() const {
    fast::PublicationMatchedStatus there;
    fast::SubscriptionMatchedStatus back;
    writer_->get_publication_matched_status(there);
    reader_->get_subscription_matched_status(back);
    return there.current_count > 0 && back.current_count > 0;
  }

 private:
  fast::Topic* topic(const char* name, const fast::TypeSupport& type) const {
    return participant_->create_topic(name, type.get_type_name(), fast::TOPIC_QOS_DEFAULT);
  }
  void on_data_available(fast::DataReader* reader) override {
    for (;;) {
      auto received = std::make_unique<Received>();
      if (!fast::is_ok(reader->take(received->samples, received->infos, 1))) {
        return;
      }
      if (!received->infos[0].valid_data) {  // a writer has gone
        reader->return_loan(received->samples, received->infos);
        continue;
      }
      received->at_ns = now_ns();
      if (reflects_) {
        write(received->bytes());
        give_back(*received);
        continue;
      }
      {
        const std::lock_guard lock{mutex_};
        waiting_.push_back(std::move(received));
      }
      came_.notify_one();
    }
  }

  const bool reflects_;
  fast::DomainParticipant* participant_ = nullptr;
  fast::DataWriter* writer_ = nullptr;
  fast::DataReader* reader_ = nullptr;
  std::mutex mutex_;
  std::condition_variable came_;
  std::deque<std::unique_ptr<Received>> waiting_;
};

/// As programs of ROS 2 name them.
constexpr const char* cloud_type = "sensor_msgs::msg::dds_::PointCloud2_";
constexpr const char* cloud_topic = "rt/clouds";
constexpr std::size_t encapsulation = 4;

}  // namespace

void reflect_dds(const Options& options) {
  const Peer peer{options, "back", "there", true};
  for (;;) {
    pause();
  }
}

/// Latencies are those of one way: half of the way there and back.
void ping_dds(const Options& options) {
  Peer peer{options, "there", "back", false};
  for (int i = 0; !peer.matched(); ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds{10});
    if (i > 1000) {
      std::fputs("trestle_floor: nobody reflects\n", stderr);
      std::exit(1);
    }
  }
  Figures figures;
  figures.bytes = options.bytes;
  std::vector<std::byte> bytes(encapsulation + options.bytes, std::byte{0x5a});
  bytes[0] = bytes[2] = bytes[3] = std::byte{0};
  bytes[1] = std::byte{1};  // little-endian CDR
  // We know the other one; when it knows us, too, a sample comes back. Then all that do.
  std::unique_ptr<Received> first;
  for (int i = 0; i < 100 && !first; ++i) {
    peer.write(bytes);
    first = peer.take(std::chrono::milliseconds{100});
  }
  for (; first; first = peer.take(std::chrono::milliseconds{100})) {
    peer.give_back(*first);
  }
  const std::int64_t start = now_ns() + warm_up_ns;
  const std::int64_t end = start + static_cast<std::int64_t>(options.seconds * 1e9);
  for (std::int64_t before = now_ns(); before < end; before = now_ns()) {
    peer.write(bytes);
    const auto received = peer.take(std::chrono::seconds{1});
    if (before >= start && received) {
      ++figures.received;
      figures.latency.add((received->at_ns - before) / 2);
    } else if (before >= start) {
      ++figures.lost;
    }
    if (received) {
      peer.give_back(*received);
    }
  }
  figures.seconds = options.seconds;
  figures.print();
}

/// `rate` samples a second on topic /clouds, to its readers; what they hold is noise, of which compression
/// makes no less.
void publish_dds(const Options& options) {
  auto* participant = fast::DomainParticipantFactory::get_instance()->create_participant(
      options.domain, participant_qos(options.shared_memory));
  fast::TypeSupport type{new RawType{cloud_type}};
  type.register_type(participant);
  fast::DataWriter* writer =
      participant->create_publisher(fast::PUBLISHER_QOS_DEFAULT)
          ->create_datawriter(participant->create_topic(cloud_topic, cloud_type, fast::TOPIC_QOS_DEFAULT),
                              writer_qos(options.synchronous));
  fast::PublicationMatchedStatus readers;
  for (int i = 0; i < 1000 && readers.current_count == 0; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds{10});
    writer->get_publication_matched_status(readers);
  }
  if (readers.current_count == 0) {
    std::fputs("trestle_floor: nobody reads\n", stderr);
    std::exit(1);
  }
  std::this_thread::sleep_for(std::chrono::milliseconds{300});  // until the reader knows us, too

  std::vector<std::byte> bytes(encapsulation + options.bytes);
  std::minstd_rand noise{1};
  std::ranges::generate(bytes, [&] { return static_cast<std::byte>(noise() >> 16U); });
  bytes[0] = bytes[2] = bytes[3] = std::byte{0};
  bytes[1] = std::byte{1};  // little-endian CDR
  const ByteView slice{bytes};
  RawSample sample;
  sample.slices = {&slice, 1};
  sample.size = bytes.size();
  Figures figures;
  figures.bytes = options.bytes;
  const std::int64_t start = now_ns();
  const auto count = static_cast<std::uint64_t>(options.seconds * options.rate);
  for (std::uint64_t i = 0; i < count; ++i) {
    const std::int64_t due = start + static_cast<std::int64_t>(static_cast<double>(i) / options.rate * 1e9);
    std::this_thread::sleep_for(std::chrono::nanoseconds{due - now_ns()});
    if (fast::is_ok(writer->write(&sample, fast::HANDLE_NIL))) {
      ++figures.received;  // by DDS, that is
    } else {
      ++figures.lost;
    }
  }
  figures.seconds = std::max(options.seconds, static_cast<double>(now_ns() - start) / 1e9);
  writer->wait_for_acknowledgments(fast::Duration{5, 0});
  figures.print();
  std::fflush(stdout);
  std::_Exit(0);  // with what DDS has
}

}  // namespace trestle::floor
