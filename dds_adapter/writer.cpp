#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <limits>
#include <map>
#include <mutex>
#include <optional>
#include <system_error>
#include <utility>

#include "dds_adapter/participant_core.hpp"
#include "dds_adapter/policies.hpp"
#include "dds_adapter/raw_type.hpp"
#include "dds_adapter/ros_names.hpp"
#include "dds_adapter/sending_thread.hpp"
#include "someip/wire/counters.hpp"
#include "someip/wire/enumerator_name.hpp"

namespace trestle::dds {

namespace detail {

/// Makes sure that a writer's new reader receives all that is written from a moment on.
///
/// RTPS does not say with which sample a volatile reader begins. Cyclone DDS's begin after the newest one
/// that the first heartbeat tells of. So a sample is lost, and acknowledged all the same, when that heartbeat
/// overtakes it, or when it is written before the reader's side has found the writer. And Fast DDS sends
/// heartbeats as long as a sample is not acknowledged, but none before there is a sample. So a sample is
/// written that no reader gets, and when the reader has acknowledged it the beginning is behind.
///
/// Where Fast DDS gives no way to do so, time has to do: enough for readers that were there before the
/// writer, as its first heartbeat finds them ready. Others may lose the first samples (docs/dds.md).
class SessionStart {
 public:
  /// @param writer  is deleted before this.
  explicit SessionStart(const fast::DataWriter& writer) : hidden_{writer} {}

  /// False also when there is no such reader.
  /// @param write  writes a sample that belongs to one of the same writer's, and tells its number or 0.
  template <typename Write>
  bool reaches(const fast::Guid& reader, const Write& write) {
    if constexpr (!fast::HiddenSamples::are_possible) {
      return has_settled(reader);
    }
    const fast::ReaderProgress progress = hidden_.progress_of(reader);
    if (progress.acknowledges_nothing) {
      return true;
    }
    if (const std::uint64_t began = began_with(reader); began != 0) {
      if (progress.acknowledged >= began) {
        return true;
      }
      if (is_time_to_ask(reader)) {
        hidden_.ask_readers();
      }
      return false;
    }
    if (const std::uint64_t number = progress.is_there ? write() : 0; number != 0) {
      const std::lock_guard lock{mutex_};
      began_.emplace(reader, Began{number, std::chrono::steady_clock::now()});
    }
    return false;
  }

  void forget(const fast::Guid& reader) {
    const std::lock_guard lock{mutex_};
    began_.erase(reader);
    first_asked_.erase(reader);
  }

 private:
  struct Began {
    std::uint64_t number = 0;                     ///< of the sample that no reader gets
    std::chrono::steady_clock::time_point asked;  ///< when the reader was last asked to acknowledge it
  };

  [[nodiscard]] std::uint64_t began_with(const fast::Guid& reader) const {
    const std::lock_guard lock{mutex_};
    const auto began = began_.find(reader);
    return began == began_.end() ? 0 : began->second.number;
  }

  /// Not at once: most readers acknowledge unasked.
  bool is_time_to_ask(const fast::Guid& reader) {
    constexpr std::chrono::milliseconds patience{50};
    const auto now = std::chrono::steady_clock::now();
    const std::lock_guard lock{mutex_};
    const auto began = began_.find(reader);
    if (began == began_.end() || now - began->second.asked < patience) {
      return false;
    }
    began->second.asked = now;
    return true;
  }

  /// Since the first question, which comes as soon as the writer has found the reader.
  bool has_settled(const fast::Guid& reader) {
    constexpr std::chrono::milliseconds settling_time{200};
    constexpr std::size_t max_readers = 4096;  // a question may come after the reader has been forgotten
    const auto now = std::chrono::steady_clock::now();
    const std::lock_guard lock{mutex_};
    if (first_asked_.size() >= max_readers) {
      first_asked_.clear();  // they wait anew
    }
    return now - first_asked_.try_emplace(reader, now).first->second >= settling_time;
  }

  fast::HiddenSamples hidden_;
  mutable std::mutex mutex_;
  std::map<fast::Guid, Began> began_;
  std::map<fast::Guid, std::chrono::steady_clock::time_point> first_asked_;
};

class WriterCore final : private fast::WriterListener {
 public:
  WriterCore(std::shared_ptr<ParticipantCore> participant, ParticipantCore::Endpoint endpoint,
             std::size_t max_sample_bytes, EndpointExtras extras)
      : participant_{std::move(participant)},
        forgets_{fast::leaving_reader_can_block && endpoint.qos.reliable && !endpoint.qos.transient_local},
        endpoint_{forgets_ ? as_announced(std::move(endpoint)) : std::move(endpoint)},
        max_sample_bytes_{std::min<std::size_t>(max_sample_bytes, std::numeric_limits<std::int32_t>::max())},
        leaves_to_dds_{max_sample_bytes_ >= one_datagram &&
                       (endpoint_.qos.keep_all || extras.writes_related)},
        on_match_{std::move(extras.on_match)},
        large_{[this](RawSample& sample) { send_given(sample); }} {
    const std::string user_data =
        with_bridge_entry(forgets_ ? extras.user_data + forgets_entry : extras.user_data, extras.bridge);
    fast::Topic* topic = participant_->use_topic(endpoint_.topic, endpoint_.type);
    endpoint_.user_data = user_data;
    endpoint_.bridge = !extras.bridge.empty();
    endpoint_.takes_bridge = std::move(extras.takes_bridge);
    endpoint_.refused = &refused_;
    fast::DataWriterQos qos = writer_qos();
    fast::set_user_data(qos, user_data);
    participant_->count_own_matches(endpoint_);
    writer_ = participant_->publisher()->create_datawriter(topic, qos, this);
    if (writer_ == nullptr) {
      participant_->drop_topic(endpoint_.topic);
      throw DdsError{"Fast DDS could not make a writer of topic '" + endpoint_.topic + "'"};
    }
    if (endpoint_.qos.reliable) {
      unacknowledged_.emplace(*writer_, endpoint_.qos.depth);
    }
    participant_->add(&endpoint_, writer_->guid());
  }

  WriterCore(const WriterCore&) = delete;
  WriterCore& operator=(const WriterCore&) = delete;

  ~WriterCore() override {
    large_.stop();
    writer_->set_listener(nullptr);
    // Deleting a writer gives its samples back one by one, and a heartbeat that is due meanwhile looks at
    // them: of some the number is gone, and Fast DDS 2.9 counts towards it for ever, with the writer locked.
    // Without samples it has nothing to count.
    writer_->clear_history(nullptr);
    participant_->remove(&endpoint_, writer_->guid());
    participant_->publisher()->delete_datawriter(writer_);
    participant_->drop_topic(endpoint_.topic);
  }

  /// @param related  the sample to which this one belongs; null: none, and the result means nothing.
  tl::expected<std::uint64_t, WriteError> write(std::span<const ByteView> slices, const SampleId* related) {
    RawSample sample;
    sample.slices = slices;
    for (const ByteView slice : slices) {
      sample.size += slice.size();
    }
    if (const auto good = judge(sample); !good) {
      const std::lock_guard lock{counters_mutex_};
      ++(good.error() == WriteError::oversize ? counters_.oversize : counters_.bad_encapsulation);
      return tl::unexpected{good.error()};
    }
    participant_->note_size(sample.size);
    if (related == nullptr && is_large(sample)) {
      return give(sample);
    }
    const auto number = send(sample, related);
    if (number) {
      count_sent(sample.size);
    } else {
      const std::lock_guard lock{counters_mutex_};
      ++counters_.refused;
    }
    return number;
  }

  [[nodiscard]] Guid guid() const { return to_guid(writer_->guid()); }

  [[nodiscard]] bool reaches(const Guid& reader) {
    if (!endpoint_.qos.reliable || participant_->vendor(to_fast(reader).guidPrefix) == Vendor::fast_dds) {
      return true;
    }
    return session_start().reaches(to_fast(reader), [this]() -> std::uint64_t {
      if (unacknowledged_->next_overwrites()) {
        return 0;  // not now: it would overwrite a sample
      }
      constexpr std::array header{std::byte{0}, std::byte{1}, std::byte{0}, std::byte{0}};
      const ByteView slice{header};
      RawSample sample;
      sample.slices = {&slice, 1};
      sample.size = slice.size();
      const SampleId ours{guid(), 0};
      return send(sample, &ours).value_or(0);
    });
  }

  [[nodiscard]] std::size_t matched() const { return endpoint_.foreign(matched_); }

  void forget_written() {
    if (keeps_read_) {
      const std::lock_guard lock{write_mutex_};
      drop_read();
    }
  }

  [[nodiscard]] bool wait_until_received(std::chrono::nanoseconds limit) const {
    const auto end = std::chrono::steady_clock::now() + limit;
    if (!large_.wait_until_idle(limit)) {
      return false;
    }
    const std::chrono::nanoseconds left =
        std::max(end - std::chrono::steady_clock::now(), std::chrono::nanoseconds{0});
    return fast::is_ok(writer_->wait_for_acknowledgments(fast::duration_of(left)));
  }

  [[nodiscard]] WriterCounters counters() const {
    const std::lock_guard lock{counters_mutex_};
    WriterCounters counters = counters_;
    counters.incompatible_qos += unserved_;
    counters.other_type = refused_;
    return counters;
  }

 private:
  ParticipantCore::Endpoint as_announced(ParticipantCore::Endpoint endpoint) {
    endpoint.qos.transient_local = true;
    endpoint.unserved = &unserved_;
    return endpoint;
  }

  [[nodiscard]] fast::DataWriterQos writer_qos() const {
    const Qos& offered = endpoint_.qos;
    fast::DataWriterQos qos;
    fast::set_common(qos, offered);
    qos.history().kind = offered.keep_all ? fast::KEEP_ALL_HISTORY_QOS : fast::KEEP_LAST_HISTORY_QOS;
    if (offered.keep_all) {  // the caller does not wait, but gets an error
      qos.reliability().max_blocking_time = fast::Duration{0, 0};
    }
    if (offered.lifespan.count() > 0) {
      qos.lifespan().duration = fast::duration_of(offered.lifespan);
    }
    qos.history().depth = static_cast<std::int32_t>(offered.depth);
    qos.resource_limits().max_samples = static_cast<std::int32_t>(offered.depth);
    qos.resource_limits().max_instances = 1;
    qos.resource_limits().max_samples_per_instance = static_cast<std::int32_t>(offered.depth);
    qos.resource_limits().allocated_samples = 1;
    qos.endpoint().history_memory_policy =
        participant_->frees_samples() ? fast::dynamic_reserve : fast::dynamic_reusable;
    qos.data_sharing().off();
    qos.publish_mode().kind =
        leaves_to_dds_ ? fast::ASYNCHRONOUS_PUBLISH_MODE : fast::SYNCHRONOUS_PUBLISH_MODE;
    // A large sample is a burst, of which a full socket buffer loses a part; these times say how soon that is
    // sent again. By default (3 s between heartbeats) one lost fragment would stop a stream for longer than
    // it is useful.
    fast::set_heartbeat_period(qos, fast::Duration{0, 50'000'000});
    fast::set_nack_delay(qos, fast::Duration{0, 1'000'000});
    return qos;
  }

  [[nodiscard]] tl::expected<void, WriteError> judge(const RawSample& sample) const {
    if (sample.size > max_sample_bytes_) {
      return tl::unexpected{WriteError::oversize};
    }
    if (!starts_with_plain_cdr(sample.slices)) {
      return tl::unexpected{WriteError::bad_encapsulation};
    }
    return {};
  }

  /// Whether another thread sends it.
  [[nodiscard]] bool is_large(const RawSample& sample) const {
    const auto readers = static_cast<std::size_t>(std::max(matched_.load(), 1));
    return !leaves_to_dds_ && sample.size > most_sent_by_caller / readers;
  }

  tl::expected<std::uint64_t, WriteError> give(const RawSample& sample) {
    count_sent(sample.size);
    try {
      large_.give(sample);
      return 0;
    } catch (const std::system_error&) {  // there is no thread
      take_back(sample.size);
      return tl::unexpected{WriteError::no_memory};
    }
  }

  /// Sends a sample that was given to the sending thread; runs on that thread.
  void send_given(RawSample& sample) {
    if (!send(sample, nullptr)) {
      take_back(sample.size);
    }
  }

  void count_sent(std::size_t size) {
    const std::lock_guard lock{counters_mutex_};
    ++counters_.sent;
    counters_.sent_bytes += size;
    is_late_ = false;
  }

  /// Corrects the counters for a sample that was counted as sent, but was not sent.
  void take_back(std::size_t size) {
    const std::lock_guard lock{counters_mutex_};
    --counters_.sent;
    counters_.sent_bytes -= size;
    ++counters_.refused;
  }

  tl::expected<std::uint64_t, WriteError> send(RawSample& sample, const SampleId* related) {
    const std::lock_guard lock{write_mutex_};
    if (refused_ != 0 && !std::exchange(is_separate_, true)) {
      fast::send_to_each_reader_alone(*writer_);
    }
    drop_read();
    const bool overwrites = unacknowledged_ && unacknowledged_->next_overwrites();
    const auto number = related == nullptr ? hand_over(sample) : hand_over(sample, *related);
    keeps_read_ = forgets_ && (keeps_read_ || number);
    if (number && overwrites) {
      on_overwritten();
    }
    return number;
  }

  /// Drops the samples that all readers have; under write_mutex_.
  void drop_read() {
    if (keeps_read_ && unacknowledged_->none()) {
      writer_->clear_history(nullptr);
      keeps_read_ = false;
    }
  }

  // The overload with a handle returns why it refuses.
  tl::expected<std::uint64_t, WriteError> hand_over(RawSample& sample) {
    const auto code = writer_->write(&sample, fast::HANDLE_NIL);
    if (fast::is_ok(code)) {
      return 0;
    }
    return tl::unexpected{fast::is_timeout(code)            ? WriteError::timeout
                          : fast::is_out_of_resources(code) ? WriteError::no_memory
                                                            : WriteError::failed};
  }

  tl::expected<std::uint64_t, WriteError> hand_over(RawSample& sample, const SampleId& related) {
    const std::uint64_t number =
        fast::write_related(*writer_, &sample, to_fast(related.writer), related.sequence);
    if (number == 0) {
      return tl::unexpected{WriteError::failed};
    }
    return number;
  }

  /// Made when it is first needed: most writers need none.
  SessionStart& session_start() {
    const std::lock_guard lock{session_start_mutex_};
    if (!session_start_) {
      session_start_.emplace(*writer_);
    }
    return *session_start_;
  }

  static bool starts_with_plain_cdr(std::span<const ByteView> slices) {
    std::array<std::byte, 4> front{};
    std::size_t filled = 0;
    for (const ByteView slice : slices) {
      for (const std::byte byte : slice.first(std::min(slice.size(), front.size() - filled))) {
        front[filled++] = byte;
      }
    }
    return is_plain_cdr(ByteView{front}.first(filled));
  }

  void on_publication_matched(fast::DataWriter* /*writer*/,
                              const fast::PublicationMatchedStatus& status) override {
    const fast::Guid peer = fast::guid_of(status.last_subscription_handle);
    const bool counts = participant_->note_match(endpoint_, peer, status, matched_);
    const bool is_new = status.current_count_change > 0;
    if (!is_new) {
      const std::lock_guard lock{session_start_mutex_};
      if (session_start_) {
        session_start_->forget(peer);
      }
    }
    if (on_match_ && counts) {
      on_match_(to_guid(peer), is_new);
    }
  }

  void on_offered_incompatible_qos(fast::DataWriter* /*writer*/,
                                   const fast::OfferedIncompatibleQosStatus& status) override {
    participant_->report_incompatible(endpoint_, status.policies, counters_mutex_, seen_policies_,
                                      counters_.incompatible_qos);
  }

  void on_offered_deadline_missed(fast::DataWriter* /*writer*/,
                                  const fast::OfferedDeadlineMissedStatus& status) override {
    {
      const std::lock_guard lock{counters_mutex_};
      counters_.deadlines_missed = status.total_count;
      if (std::exchange(is_late_, true)) {
        return;
      }
    }
    participant_->report(Happening::Kind::deadline_missed, endpoint_);
  }

  void on_liveliness_lost(fast::DataWriter* /*writer*/, const fast::LivelinessLostStatus& status) override {
    {
      const std::lock_guard lock{counters_mutex_};
      counters_.liveliness_lost = static_cast<std::uint64_t>(status.total_count);
    }
    participant_->report(Happening::Kind::liveliness_lost, endpoint_);
  }

  [[nodiscard]] bool has_reliable_reader() const override {
    return endpoint_.qos.reliable && participant_->has_reliable_reader(endpoint_);
  }

  void on_overwritten() override {
    const std::lock_guard lock{counters_mutex_};
    ++counters_.overwritten;
  }

  /// A sample of more than one datagram is not sent at once.
  static constexpr std::size_t one_datagram = 60'000;
  /// The most that a caller sends itself, to all readers together: five datagrams. On loopback the caller
  /// needs 90 µs for 65,536 bytes, 180 for 262,144; handing over takes 40 µs, and 40 more to arrive.
  static constexpr std::size_t most_sent_by_caller = 300'000;

  const std::shared_ptr<ParticipantCore> participant_;
  /// A volatile writer drops a sample when the last reader that lacks it leaves; in some versions of Fast DDS
  /// it then waits for itself for ever. A transient-local one never does. So we announce transient-local,
  /// which offers more than was asked for, and drop samples that all readers have when the next one comes, be
  /// it written or not. Readers that want samples which are not kept are then reported by the participant,
  /// not by DDS.
  const bool forgets_;
  std::atomic<std::uint64_t> unserved_ = 0;
  std::atomic<std::uint64_t> refused_ = 0;
  ParticipantCore::Endpoint endpoint_;  ///< does not change once it is open
  std::mutex write_mutex_;
  std::atomic<bool> keeps_read_ = false;  ///< perhaps samples that all readers have; set under write_mutex_
  bool is_separate_ = false;              ///< under write_mutex_
  const std::size_t max_sample_bytes_;
  /// DDS's own thread sends, which costs small samples a change of threads. Used where the caller must learn
  /// at once what becomes of a sample: whether there is room for it, or what its number is.
  const bool leaves_to_dds_;
  const OnMatch on_match_;
  fast::DataWriter* writer_ = nullptr;
  /// Matched readers, including our own. A query to Fast DDS would wait until it has sent a sample.
  std::atomic<std::int32_t> matched_ = 0;
  std::optional<fast::UnacknowledgedProbe> unacknowledged_;  ///< reliable writers only
  std::mutex session_start_mutex_;
  std::optional<SessionStart> session_start_;
  mutable std::mutex counters_mutex_;
  WriterCounters counters_;
  bool is_late_ = false;  ///< the deadline has been missed since the last sample
  fast::QosPolicyCountSeq seen_policies_;
  SendingThread large_;  ///< last, because its thread uses the others
};

}  // namespace detail

const char* to_string(WriteError error) noexcept {
  static constexpr std::array names{"bad_encapsulation", "oversize", "no_memory", "timeout", "failed"};
  return someip::enumerator_name<WriteError::failed>(names, error, "?");
}

Writer::Writer(std::shared_ptr<detail::WriterCore> core) noexcept : core_{std::move(core)} {}
Writer::Writer(Writer&&) noexcept = default;
Writer& Writer::operator=(Writer&&) noexcept = default;
Writer::~Writer() = default;

tl::expected<void, WriteError> Writer::write(std::span<const ByteView> slices) {
  const auto written = core_->write(slices, nullptr);
  if (!written) {
    return tl::unexpected{written.error()};
  }
  return {};
}
tl::expected<std::uint64_t, WriteError> Writer::write_related(std::span<const ByteView> slices,
                                                              const SampleId& related) {
  return core_->write(slices, &related);
}
bool Writer::reaches(const Guid& reader) {
  return core_->reaches(reader);
}
void Writer::forget_written() {
  core_->forget_written();
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
Guid Writer::guid() const {
  return core_->guid();
}

Writer Participant::create_writer(std::string_view topic, std::string_view type, const Qos& qos,
                                  std::size_t max_sample_bytes, EndpointExtras extras) {
  detail::check_endpoint("writer", topic, type, qos);
  return Writer{std::make_shared<detail::WriterCore>(
      core_, detail::ParticipantCore::Endpoint{std::string{topic}, std::string{type}, qos, true},
      max_sample_bytes, std::move(extras))};
}

WriterCounters& WriterCounters::operator+=(const WriterCounters& other) noexcept {
  someip::add_counters(*this, other);
  return *this;
}

}  // namespace trestle::dds
