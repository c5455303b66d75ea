#include <atomic>
#include <mutex>
#include <utility>
#include <vector>

#include "dds_adapter/participant_core.hpp"
#include "dds_adapter/policies.hpp"
#include "dds_adapter/raw_type.hpp"
#include "dds_adapter/ros_names.hpp"
#include "someip/wire/counters.hpp"

namespace trestle::dds {

namespace detail {

/// Keeps a received sample, and its reader too: the payload is on loan from it until it is given back.
struct Loan {
  fast::DataReader* from = nullptr;
  fast::LoanableSequence<RawSample> samples;
  fast::SampleInfoSeq infos;
  std::shared_ptr<ReaderCore> keeps;
};

void give_back(std::unique_ptr<Loan> loan) noexcept;

class ReaderCore final : public std::enable_shared_from_this<ReaderCore>, private fast::DataReaderListener {
 public:
  ReaderCore(std::shared_ptr<ParticipantCore> participant, ParticipantCore::Endpoint endpoint,
             OnSample on_sample, std::size_t max_sample_bytes, EndpointExtras extras)
      : participant_{std::move(participant)},
        endpoint_{std::move(endpoint)},
        on_sample_{std::move(on_sample)},
        max_sample_bytes_{max_sample_bytes},
        user_data_{with_bridge_entry(extras.user_data, extras.bridge)},
        on_match_{std::move(extras.on_match)},
        on_bridged_{std::move(extras.on_bridged)} {
    endpoint_.user_data = user_data_;
    endpoint_.bridge = !extras.bridge.empty();
    endpoint_.takes_bridge = std::move(extras.takes_bridge);
  }

  ReaderCore(const ReaderCore&) = delete;
  ReaderCore& operator=(const ReaderCore&) = delete;

  /// Apart from the constructor because callbacks need shared_from_this().
  void open() {
    fast::Topic* topic = participant_->use_topic(endpoint_.topic, endpoint_.type);
    participant_->count_own_matches(endpoint_);
    reader_ = participant_->subscriber()->create_datareader(topic, reader_qos(), this);
    if (reader_ == nullptr) {
      participant_->drop_topic(endpoint_.topic);
      throw DdsError{"Fast DDS could not make a reader of topic '" + endpoint_.topic + "'"};
    }
    participant_->add(&endpoint_, reader_->guid());
  }

  /// The reader stays until the last sample has been returned, but the callback is not called any more.
  void close() {
    reader_->set_listener(nullptr);
    {
      const std::lock_guard lock{gate_};
      on_sample_ = nullptr;
      on_bridged_ = nullptr;
    }
    const std::lock_guard lock{match_gate_};
    on_match_ = nullptr;
  }

  ~ReaderCore() override {
    if (reader_ != nullptr) {
      reader_->set_listener(nullptr);
      participant_->remove(&endpoint_, reader_->guid());
      participant_->subscriber()->delete_datareader(reader_);
      participant_->drop_topic(endpoint_.topic);
    }
  }

  [[nodiscard]] std::size_t matched() const { return endpoint_.foreign(matched_); }

  [[nodiscard]] ReaderCounters counters() const {
    const std::lock_guard lock{counters_mutex_};
    return counters_;
  }

  [[nodiscard]] Guid guid() const { return to_guid(reader_->guid()); }

  /// Keeps the object for the next sample.
  void keep(std::unique_ptr<Loan> unused) {
    const std::lock_guard lock{unused_mutex_};
    unused_.push_back(std::move(unused));
  }

 private:
  [[nodiscard]] std::unique_ptr<Loan> unused_loan() {
    const std::lock_guard lock{unused_mutex_};
    if (unused_.empty()) {
      return std::make_unique<Loan>();
    }
    std::unique_ptr<Loan> loan = std::move(unused_.back());
    unused_.pop_back();
    return loan;
  }

  [[nodiscard]] fast::DataReaderQos reader_qos() const {
    const Qos& wanted = endpoint_.qos;
    fast::DataReaderQos qos;
    fast::set_user_data(qos, user_data_);
    fast::set_common(qos, wanted);
    qos.history().kind = fast::KEEP_LAST_HISTORY_QOS;
    qos.history().depth = static_cast<std::int32_t>(wanted.depth);
    // The history holds `depth` samples; samples on loan come on top, as many as users keep.
    qos.resource_limits().max_samples = 0;
    qos.resource_limits().max_instances = 1;
    qos.resource_limits().max_samples_per_instance = 0;
    qos.resource_limits().allocated_samples = static_cast<std::int32_t>(wanted.depth);
    qos.endpoint().history_memory_policy =
        participant_->frees_samples() ? fast::dynamic_reserve : fast::dynamic_reusable;
    // Data sharing between processes corrupts loaned samples, and can loop for ever on too large a sample.
    qos.data_sharing().off();
    fast::set_heartbeat_delay(qos, fast::Duration{0, 1'000'000});
    return qos;
  }

  /// Takes all there is. DDS calls this with the reader's lock held, maybe before `reader_` is known.
  void on_data_available(fast::DataReader* reader) override {
    const std::lock_guard lock{gate_};
    while (on_sample_) {
      auto loan = unused_loan();
      if (!fast::is_ok(reader->take(loan->samples, loan->infos, 1))) {
        keep(std::move(loan));
        return;
      }
      loan->from = reader;
      loan->keeps = shared_from_this();
      const OtherEnd writer = judge(*loan);
      if (writer == OtherEnd::ignored) {
        if (on_bridged_) {
          on_bridged_(loan->samples[0].received, to_guid(loan->infos[0].sample_identity.writer_guid()));
        }
        give_back(std::move(loan));
      } else if (is_wanted(*loan)) {
        on_sample_(Sample{std::move(loan), writer == OtherEnd::taken});
      } else {
        give_back(std::move(loan));
      }
    }
  }

  /// Whether the sample comes from another bridge; counts those that are ignored.
  OtherEnd judge(const Loan& loan) {
    if (!endpoint_.bridge || !loan.infos[0].valid_data) {
      return OtherEnd::none;
    }
    const OtherEnd judged = bridge_check_.judge(
        participant_->bridge_ends(), loan.infos[0].sample_identity.writer_guid(), endpoint_.takes_bridge);
    if (judged == OtherEnd::ignored) {
      const std::lock_guard lock{counters_mutex_};
      ++counters_.from_bridge;
    }
    return judged;
  }

  /// Judges and counts a sample.
  bool is_wanted(Loan& loan) {
    const fast::SampleInfo& info = loan.infos[0];
    if (!info.valid_data) {
      return false;  // reports that a writer has gone
    }
    const ByteView bytes = loan.samples[0].received;
    const std::lock_guard lock{counters_mutex_};
    if (participant_->is_own(info.sample_identity.writer_guid())) {
      ++counters_.own;
    } else if (participant_->strict_types() && is_refused(info.sample_identity.writer_guid())) {
      ++counters_.other_type;
    } else if (!is_plain_cdr(bytes)) {
      ++counters_.bad_encapsulation;
    } else if (bytes.size() > max_sample_bytes_) {
      ++counters_.oversize;
    } else {
      ++counters_.received;
      counters_.received_bytes += bytes.size();
      is_late_ = false;
      return true;
    }
    return false;
  }

  /// Takes no lock as long as one writer's samples come.
  bool is_refused(const fast::Guid& writer) {
    if (writer != last_writer_) {
      refuses_last_ = participant_->refuses(endpoint_, writer);
      last_writer_ = writer;
    }
    return refuses_last_;
  }

  void on_subscription_matched(fast::DataReader* /*reader*/,
                               const fast::SubscriptionMatchedStatus& status) override {
    const fast::Guid peer = fast::guid_of(status.last_publication_handle);
    const bool counts = participant_->note_match(endpoint_, peer, status, matched_);
    const std::lock_guard lock{match_gate_};
    if (on_match_ && counts) {
      on_match_(to_guid(peer), status.current_count_change > 0);
    }
  }

  void on_requested_incompatible_qos(fast::DataReader* /*reader*/,
                                     const fast::RequestedIncompatibleQosStatus& status) override {
    participant_->report_incompatible(endpoint_, status.policies, counters_mutex_, seen_policies_,
                                      counters_.incompatible_qos);
  }

  /// Each missed deadline is counted; only the first one in a row is reported.
  void on_requested_deadline_missed(fast::DataReader* /*reader*/,
                                    const fast::RequestedDeadlineMissedStatus& status) override {
    {
      const std::lock_guard lock{counters_mutex_};
      counters_.deadlines_missed = status.total_count;
      if (std::exchange(is_late_, true)) {
        return;
      }
    }
    participant_->report(Happening::Kind::deadline_missed, endpoint_);
  }

  void on_liveliness_changed(fast::DataReader* /*reader*/,
                             const fast::LivelinessChangedStatus& status) override {
    const fast::Guid peer = fast::guid_of(status.last_publication_handle);
    if (status.not_alive_count_change <= 0 || participant_->is_own(peer)) {
      return;
    }
    {
      const std::lock_guard lock{counters_mutex_};
      counters_.liveliness_lost += static_cast<std::uint64_t>(status.not_alive_count_change);
    }
    participant_->report(Happening::Kind::liveliness_lost, endpoint_, to_hex(peer));
  }

  void on_sample_lost(fast::DataReader* /*reader*/, const fast::SampleLostStatus& status) override {
    const std::lock_guard lock{counters_mutex_};
    counters_.lost = static_cast<std::uint64_t>(status.total_count);
  }

  void on_sample_rejected(fast::DataReader* /*reader*/, const fast::SampleRejectedStatus& status) override {
    const std::lock_guard lock{counters_mutex_};
    counters_.rejected = static_cast<std::uint64_t>(status.total_count);
  }

  const std::shared_ptr<ParticipantCore> participant_;
  ParticipantCore::Endpoint endpoint_;  ///< does not change once it is open
  /// Held while the callback runs, so that closing waits for it.
  std::mutex gate_;
  OnSample on_sample_;
  const std::size_t max_sample_bytes_;
  const std::string user_data_;
  std::mutex match_gate_;  ///< like gate_, but for on_match_
  OnMatch on_match_;
  std::function<void(ByteView, const Guid&)> on_bridged_;  ///< under gate_
  BridgeCheck bridge_check_;                               ///< likewise
  fast::Guid last_writer_;                                 ///< likewise
  bool refuses_last_ = false;
  /// A query to DDS would reset the changes before the listener sees them: a match would look like an end.
  std::atomic<std::int32_t> matched_ = 0;
  fast::DataReader* reader_ = nullptr;
  mutable std::mutex counters_mutex_;
  ReaderCounters counters_;
  bool is_late_ = false;  ///< the deadline has been missed since the last sample
  fast::QosPolicyCountSeq seen_policies_;
  std::mutex unused_mutex_;
  std::vector<std::unique_ptr<Loan>> unused_;  ///< as many as were on loan at the same time
};

void give_back(std::unique_ptr<Loan> loan) noexcept {
  fast::given_back(loan->samples[0].received);
  loan->from->return_loan(loan->samples, loan->infos);
  const auto reader = std::move(loan->keeps);  // this may be the last one
  reader->keep(std::move(loan));
}

}  // namespace detail

Sample::Sample() noexcept = default;

Sample::Sample(std::unique_ptr<detail::Loan> loan, bool from_bridge) noexcept
    : from_bridge_{from_bridge}, loan_{std::move(loan)} {
  const auto& info = loan_->infos[0];
  cdr_ = loan_->samples[0].received;
  source_time_ = std::chrono::nanoseconds{fast::nanoseconds_of(info.source_timestamp)};
  sequence_ = fast::number_of(info.sample_identity.sequence_number());
}

Sample::Sample(ByteView cdr, std::chrono::nanoseconds source_time, std::uint64_t sequence) noexcept
    : cdr_{cdr}, source_time_{source_time}, sequence_{sequence} {}

Sample::Sample(Sample&& other) noexcept
    : cdr_{std::exchange(other.cdr_, {})},
      source_time_{other.source_time_},
      sequence_{other.sequence_},
      from_bridge_{other.from_bridge_},
      loan_{std::move(other.loan_)} {}

Sample& Sample::operator=(Sample&& other) noexcept {
  if (this != &other) {
    release();
    cdr_ = std::exchange(other.cdr_, {});
    source_time_ = other.source_time_;
    sequence_ = other.sequence_;
    from_bridge_ = other.from_bridge_;
    loan_ = std::move(other.loan_);
  }
  return *this;
}

Sample::~Sample() {
  release();
}

void Sample::release() noexcept {
  cdr_ = {};
  if (loan_) {
    detail::give_back(std::move(loan_));
  }
}

SampleId Sample::id() const noexcept {
  return loan_ ? SampleId{detail::to_guid(loan_->infos[0].sample_identity.writer_guid()), sequence_}
               : SampleId{};
}

SampleId Sample::related() const noexcept {
  if (!loan_) {
    return {};
  }
  const auto& identity = loan_->infos[0].related_sample_identity;
  return {detail::to_guid(identity.writer_guid()), fast::number_of(identity.sequence_number())};
}

std::string Sample::writer() const {
  return loan_ ? detail::to_hex(loan_->infos[0].sample_identity.writer_guid()) : std::string{};
}

Reader::Reader(std::shared_ptr<detail::ReaderCore> core) noexcept : core_{std::move(core)} {}
Reader::Reader(Reader&&) noexcept = default;

Reader& Reader::operator=(Reader&& other) noexcept {
  if (this != &other) {
    if (core_) {
      core_->close();
    }
    core_ = std::move(other.core_);
  }
  return *this;
}

Reader::~Reader() {
  if (core_) {
    core_->close();
  }
}

std::size_t Reader::matched() const {
  return core_->matched();
}
ReaderCounters Reader::counters() const {
  return core_->counters();
}
Guid Reader::guid() const {
  return core_->guid();
}

Reader Participant::create_reader(std::string_view topic, std::string_view type, const Qos& qos,
                                  OnSample on_sample, std::size_t max_sample_bytes, EndpointExtras extras) {
  detail::check_endpoint("reader", topic, type, qos);
  auto core = std::make_shared<detail::ReaderCore>(
      core_, detail::ParticipantCore::Endpoint{std::string{topic}, std::string{type}, qos, false},
      std::move(on_sample), max_sample_bytes, std::move(extras));
  core->open();
  return Reader{std::move(core)};
}

ReaderCounters& ReaderCounters::operator+=(const ReaderCounters& other) noexcept {
  someip::add_counters(*this, other);
  return *this;
}

}  // namespace trestle::dds
