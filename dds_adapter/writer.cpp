#include <algorithm>
#include <array>
#include <limits>
#include <mutex>
#include <optional>
#include <utility>

#include "dds_adapter/participant_core.hpp"
#include "dds_adapter/raw_type.hpp"

namespace trestle::dds {

namespace detail {

class WriterCore final : private fast::WriterListener {
 public:
  WriterCore(std::shared_ptr<ParticipantCore> participant, ParticipantCore::Endpoint endpoint,
             std::size_t max_sample_bytes)
      : participant_{std::move(participant)},
        forgets_{fast::leaving_reader_can_block && endpoint.qos.reliable && !endpoint.qos.transient_local},
        endpoint_{as_announced(std::move(endpoint), forgets_)},
        max_sample_bytes_{std::min<std::size_t>(max_sample_bytes, std::numeric_limits<std::int32_t>::max())} {
    fast::Topic* topic = participant_->use_topic(endpoint_.topic, endpoint_.type);
    writer_ = participant_->publisher()->create_datawriter(topic, writer_qos(), this);
    if (writer_ == nullptr) {
      participant_->drop_topic(endpoint_.topic);
      throw DdsError{"Fast DDS could not make a writer of topic '" + endpoint_.topic + "'"};
    }
    if (endpoint_.qos.reliable) {
      unacknowledged_.emplace(*writer_, endpoint_.qos.depth);
    }
    participant_->add(&endpoint_);
  }

  WriterCore(const WriterCore&) = delete;
  WriterCore& operator=(const WriterCore&) = delete;

  ~WriterCore() override {
    writer_->set_listener(nullptr);
    participant_->remove(&endpoint_);
    participant_->publisher()->delete_datawriter(writer_);
    participant_->drop_topic(endpoint_.topic);
  }

  tl::expected<void, WriteError> write(std::span<const ByteView> pieces) {
    RawSample sample;
    sample.pieces = pieces;
    for (const ByteView piece : pieces) {
      sample.size += piece.size();
    }
    const auto error = send(sample);
    const std::lock_guard lock{counters_mutex_};
    if (!error) {
      ++counters_.sent;
      counters_.sent_bytes += sample.size;
      return {};
    }
    ++(*error == WriteError::bad_encapsulation ? counters_.bad_encapsulation
       : *error == WriteError::oversize        ? counters_.oversize
                                               : counters_.refused);
    return tl::unexpected{*error};
  }

  [[nodiscard]] std::size_t matched() const {
    fast::PublicationMatchedStatus status;
    writer_->get_publication_matched_status(status);
    return participant_->foreign(status.current_count, endpoint_);
  }

  [[nodiscard]] bool wait_until_received(std::chrono::nanoseconds limit) const {
    constexpr std::int64_t second = 1'000'000'000;
    const auto seconds = static_cast<std::int32_t>(limit.count() / second);
    const auto rest = static_cast<std::uint32_t>(limit.count() % second);
    return fast::is_ok(writer_->wait_for_acknowledgments(fast::Duration{seconds, rest}));
  }

  [[nodiscard]] WriterCounters counters() const {
    const std::lock_guard lock{counters_mutex_};
    return counters_;
  }

 private:
  static ParticipantCore::Endpoint as_announced(ParticipantCore::Endpoint endpoint, bool forgets) {
    endpoint.qos.transient_local |= forgets;
    return endpoint;
  }

  [[nodiscard]] fast::DataWriterQos writer_qos() const {
    const Qos& offered = endpoint_.qos;
    fast::DataWriterQos qos;
    qos.reliability().kind =
        offered.reliable ? fast::RELIABLE_RELIABILITY_QOS : fast::BEST_EFFORT_RELIABILITY_QOS;
    qos.durability().kind =
        offered.transient_local ? fast::TRANSIENT_LOCAL_DURABILITY_QOS : fast::VOLATILE_DURABILITY_QOS;
    qos.history().kind = fast::KEEP_LAST_HISTORY_QOS;
    qos.history().depth = static_cast<std::int32_t>(offered.depth);
    qos.resource_limits().max_samples = static_cast<std::int32_t>(offered.depth);
    qos.resource_limits().max_instances = 1;
    qos.resource_limits().max_samples_per_instance = static_cast<std::int32_t>(offered.depth);
    qos.resource_limits().allocated_samples = 1;
    qos.endpoint().history_memory_policy = fast::dynamic_reusable;
    qos.data_sharing().off();
    // One datagram is sent by the caller at once; more of them would keep the caller for milliseconds.
    constexpr std::size_t one_datagram = 60'000;
    qos.publish_mode().kind =
        max_sample_bytes_ < one_datagram ? fast::SYNCHRONOUS_PUBLISH_MODE : fast::ASYNCHRONOUS_PUBLISH_MODE;
    // A large sample is a burst that a full socket buffer cuts; these say how soon it is mended. The defaults
    // (3 s between heartbeats) would let one lost fragment hold up a stream for longer than it stays useful.
    fast::set_heartbeat_period(qos, fast::Duration{0, 50'000'000});
    fast::set_nack_delay(qos, fast::Duration{0, 1'000'000});
    return qos;
  }

  std::optional<WriteError> send(RawSample& sample) {
    if (sample.size > max_sample_bytes_) {
      return WriteError::oversize;
    }
    if (!starts_with_plain_cdr(sample.pieces)) {
      return WriteError::bad_encapsulation;
    }
    const std::lock_guard lock{write_mutex_};
    if (forgets_ && fast::is_ok(writer_->wait_for_acknowledgments(fast::Duration{0, 0}))) {
      writer_->clear_history(nullptr);
    }
    const bool overwrites = unacknowledged_ && unacknowledged_->next_overwrites();
    // The variant with a handle says why it refuses.
    const auto code = writer_->write(&sample, fast::HANDLE_NIL);
    if (fast::is_ok(code)) {
      if (overwrites) {
        on_overwritten();
      }
      return std::nullopt;
    }
    return fast::is_timeout(code)            ? WriteError::timeout
           : fast::is_out_of_resources(code) ? WriteError::no_memory
                                             : WriteError::failed;
  }

  static bool starts_with_plain_cdr(std::span<const ByteView> pieces) {
    std::array<std::byte, 4> front{};
    std::size_t filled = 0;
    for (const ByteView piece : pieces) {
      for (const std::byte byte : piece.first(std::min(piece.size(), front.size() - filled))) {
        front[filled++] = byte;
      }
    }
    return is_plain_cdr(ByteView{front}.first(filled));
  }

  void on_publication_matched(fast::DataWriter* /*writer*/,
                              const fast::PublicationMatchedStatus& status) override {
    const fast::Guid peer = fast::guid_of(status.last_subscription_handle);
    if (!participant_->is_own(peer)) {
      const auto kind = status.current_count_change > 0 ? Event::Kind::matched : Event::Kind::unmatched;
      participant_->report({kind, endpoint_.topic, endpoint_.type, to_hex(peer), "writer",
                            participant_->foreign(status.current_count, endpoint_)});
    }
  }

  void on_offered_incompatible_qos(fast::DataWriter* /*writer*/,
                                   const fast::OfferedIncompatibleQosStatus& status) override {
    std::string policies;
    {
      const std::lock_guard lock{counters_mutex_};
      counters_.incompatible_qos = status.total_count;
      policies = risen_policies(status.policies, seen_policies_);
    }
    participant_->report({Event::Kind::incompatible_qos, endpoint_.topic, endpoint_.type, "", policies, 0});
  }

  void on_overwritten() override {
    const std::lock_guard lock{counters_mutex_};
    ++counters_.overwritten;
  }

  const std::shared_ptr<ParticipantCore> participant_;
  /// A volatile writer drops a sample when the last reader that lacks it leaves, and in some versions of Fast
  /// DDS waits for itself then. A transient-local one never does. So we announce that, which offers more than
  /// was asked for, and drop samples that everybody has when the next one is written.
  const bool forgets_;
  const ParticipantCore::Endpoint endpoint_;
  std::mutex write_mutex_;
  const std::size_t max_sample_bytes_;
  fast::DataWriter* writer_ = nullptr;
  std::optional<fast::UnacknowledgedProbe> unacknowledged_;  ///< reliable writers only
  mutable std::mutex counters_mutex_;
  WriterCounters counters_;
  fast::QosPolicyCountSeq seen_policies_;
};

}  // namespace detail

const char* to_string(WriteError error) noexcept {
  switch (error) {
    case WriteError::bad_encapsulation:
      return "bad_encapsulation";
    case WriteError::oversize:
      return "oversize";
    case WriteError::no_memory:
      return "no_memory";
    case WriteError::timeout:
      return "timeout";
    case WriteError::failed:
      return "failed";
  }
  return "?";
}

Writer::Writer(std::shared_ptr<detail::WriterCore> core) noexcept : core_{std::move(core)} {}
Writer::Writer(Writer&&) noexcept = default;
Writer& Writer::operator=(Writer&&) noexcept = default;
Writer::~Writer() = default;

tl::expected<void, WriteError> Writer::write(std::span<const ByteView> pieces) {
  return core_->write(pieces);
}
std::size_t Writer::matched() const {
  return core_->matched();
}
bool Writer::wait_until_received(std::chrono::nanoseconds limit) const {
  return core_->wait_until_received(limit);
}
WriterCounters Writer::counters() const {
  return core_->counters();
}

Writer Participant::create_writer(std::string_view topic, std::string_view type, const Qos& qos,
                                  std::size_t max_sample_bytes) {
  detail::check_endpoint("writer", topic, type, qos);
  return Writer{std::make_shared<detail::WriterCore>(
      core_, detail::ParticipantCore::Endpoint{std::string{topic}, std::string{type}, qos, true},
      max_sample_bytes)};
}

}  // namespace trestle::dds
