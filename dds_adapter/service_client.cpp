#include <algorithm>
#include <map>
#include <mutex>
#include <set>
#include <utility>

#include "dds_adapter/ros_names.hpp"
#include "dds_adapter/service_end.hpp"
#include "dds_adapter/service_form.hpp"

namespace trestle::dds {

namespace {

/// Readers of requests and writers of replies that match ours. A server is a participant that has both.
class FoundServers {
 public:
  void reader(const Guid& guid, bool matched, Vendor vendor) {
    readers_.change(guid, matched, vendor);
    update();
  }
  void writer(const Guid& guid, bool matched) {
    if (matched) {
      writers_.insert(guid);
    } else {
      writers_.erase(guid);
    }
    update();
  }
  [[nodiscard]] detail::FoundReaders& readers() { return readers_; }

  /// To be called after a change of readers().
  void update() {
    const bool before = any_;
    any_ = readers_.any_there([&](const Guid& reader, Vendor /*vendor*/) { return is_complete(reader); });
    times_lost_ += before && !any_ ? 1U : 0U;
  }

  [[nodiscard]] bool any() const { return any_; }
  /// How often the last server has left.
  [[nodiscard]] std::uint64_t times_lost() const { return times_lost_; }

  /// There is one form for all servers of the name, because each request goes to all of them.
  [[nodiscard]] RosForm form(RosForm configured) const {
    const bool any_other = readers_.any_there([&](const Guid& reader, Vendor vendor) {
      return vendor != Vendor::cyclone_dds && is_complete(reader);
    });
    return detail::form_of(configured, any_other ? Vendor::fast_dds : Vendor::cyclone_dds);
  }

 private:
  [[nodiscard]] bool is_complete(const Guid& reader) const {
    return std::ranges::any_of(writers_,
                               [&](const Guid& writer) { return detail::same_participant(reader, writer); });
  }

  detail::FoundReaders readers_;
  std::set<Guid> writers_;
  bool any_ = false;
  std::uint64_t times_lost_ = 0;
};

/// As unique among all clients of the domain as GUIDs are: the FNV-1a hash of a GUID.
std::uint64_t client_number(const Guid& guid) {
  std::uint64_t hash = 0xcbf29ce484222325U;
  for (const std::byte byte : guid) {
    hash = (hash ^ std::to_integer<std::uint64_t>(byte)) * 0x100000001b3U;
  }
  return hash;
}

}  // namespace

struct ServiceClient::State {
  /// Identifies a request: its form, and its number in this form.
  using Key = std::pair<RosForm, std::uint64_t>;
  struct Sent {
    TimePoint end;
    std::uint64_t times_lost;  ///< FoundServers::times_lost() when it was sent
    Handler handler;
  };
  /// A request for which there is no server yet.
  struct Waiting {
    std::vector<std::byte> request;
    TimePoint give_up;
    TimePoint end;
    Handler handler;
  };
  /// A reply to us, in its form.
  struct Reply {
    Sample sample;
    RosForm form;
    std::uint64_t number;
  };

  State(Participant& joined_with, const ServiceConfig& what, std::function<void()> wake_owner)
      : participant{joined_with}, config{what}, wake{std::move(wake_owner)} {}

  void open() {
    const Qos qos = detail::service_qos(config);
    const std::string user_data = detail::pairing_user_data("clientid", participant);
    writer.emplace(participant.create_writer(
        ros_request_topic(config.name), ros_type_name(config.type + "_Request"), qos, config.max_sample_bytes,
        {.on_match =
             [this](const Guid& peer, bool matched) {
               if (config.on_request_match) {
                 config.on_request_match(peer, matched);
               }
               const Vendor vendor = participant.vendor(peer);
               changed([&] { servers.reader(peer, matched, vendor); });
             },
         .user_data = config.request_user_data + user_data,
         .bridge = config.bridge,
         .takes_bridge = config.takes_bridge,
         .writes_related = true}));
    {
      const std::lock_guard lock{mutex};
      writer_guid = writer->guid();
      client = client_number(writer_guid);
    }
    reader.emplace(participant.create_reader(
        ros_reply_topic(config.name), ros_type_name(config.type + "_Response"), qos,
        [this](Sample sample) { on_reply(std::move(sample)); }, config.max_sample_bytes,
        {.on_match = [this](const Guid& peer,
                            bool matched) { changed([&] { servers.writer(peer, matched); }); },
         .user_data = config.reply_user_data + user_data,
         .bridge = config.bridge,
         .takes_bridge = config.takes_bridge}));
    const std::lock_guard lock{mutex};
    reader_guid = reader->guid();
  }

  // --- On threads of DDS ----------------------------------------------------------------------------------

  template <typename Change>
  void changed(const Change& apply) {
    {
      const std::lock_guard lock{mutex};
      apply();
    }
    wake();
  }

  void on_reply(Sample sample) {
    const RosForm form = detail::form_of(config.form, participant.vendor(sample.id().writer));
    {
      const std::lock_guard lock{mutex};
      const auto number = number_of_ours(sample, form);
      if (!number) {
        return;  // number_of_ours() has counted it
      }
      if (replies.size() >= config.max_calls) {
        ++counters.dropped;
        return;
      }
      replies.push_back({std::move(sample), form, *number});
    }
    wake();
  }

  /// The number of our request to which this is the reply.
  std::optional<std::uint64_t> number_of_ours(const Sample& sample, RosForm form) {
    if (form == RosForm::cyclonedds) {
      const auto header = detail::inline_header(sample.cdr());
      if (!header) {
        ++counters.malformed;
        return std::nullopt;
      }
      if (header->client == client) {
        return static_cast<std::uint64_t>(header->number);
      }
    } else if (const SampleId id = sample.related(); id.writer == reader_guid || id.writer == writer_guid) {
      return id.sequence;
    }
    ++counters.foreign;
    return std::nullopt;
  }

  // --- On the owner's thread ------------------------------------------------------------------------------

  struct Network {
    bool ready;
    RosForm form;
    std::uint64_t times_lost;
  };
  [[nodiscard]] Network network() const {
    const std::lock_guard lock{mutex};
    return {servers.any(), servers.form(config.form), servers.times_lost()};
  }

  void count(std::uint64_t ServiceClientCounters::*counter) {
    const std::lock_guard lock{mutex};
    ++(counters.*counter);
  }

  void fail(const Handler& handler, CallFault fault) {
    count(fault == CallFault::unavailable   ? &ServiceClientCounters::unavailable
          : fault == CallFault::too_many    ? &ServiceClientCounters::too_many
          : fault == CallFault::not_written ? &ServiceClientCounters::not_written
          : fault == CallFault::timed_out   ? &ServiceClientCounters::timed_out
                                            : &ServiceClientCounters::gone);
    handler(tl::unexpected{fault});
  }

  void later(CallFault fault, Handler handler) { refused.emplace_back(fault, std::move(handler)); }

  void send(std::span<const ByteView> slices, TimePoint end, Handler handler, const Network& to) {
    tl::expected<std::uint64_t, WriteError> number{0};
    if (to.form == RosForm::cyclonedds) {
      const detail::SlicesWithHeader whole{slices, {client, static_cast<std::int64_t>(++last_number)}};
      number = writer->write_related(whole.slices(), {}).map([&](std::uint64_t) { return last_number; });
    } else {
      // Names the reader for the answer, which has no sequence number.
      number = writer->write_related(slices, {reader_guid, 0});
    }
    if (!number) {
      later(CallFault::not_written, std::move(handler));
      return;
    }
    const Key key{to.form, *number};
    due.emplace(end, key);
    sent.insert_or_assign(key, Sent{end, to.times_lost, std::move(handler)});
    count(&ServiceClientCounters::requests);
  }

  void hand_over(std::vector<Reply> come) {
    for (Reply& reply : come) {
      const auto call = sent.find({reply.form, reply.number});
      if (call == sent.end()) {
        count(&ServiceClientCounters::late);
        continue;
      }
      const Handler handler = end_call(call);
      count(&ServiceClientCounters::replies);
      handler(reply.form == RosForm::cyclonedds
                  ? ServiceMessage{detail::without_inline_header(reply.sample.cdr())}
                  : ServiceMessage{std::move(reply.sample)});
    }
  }

  Handler end_call(std::map<Key, Sent>::iterator call) {
    Handler handler = std::move(call->second.handler);
    due.erase({call->second.end, call->first});
    sent.erase(call);
    return handler;
  }

  void give_up(TimePoint now, std::uint64_t times_lost) {
    if (std::exchange(seen_lost, times_lost) != times_lost) {
      std::vector<Handler> lost;
      for (auto call = sent.begin(); call != sent.end();) {
        const auto next = std::next(call);
        if (call->second.times_lost != times_lost) {
          lost.push_back(end_call(call));
        }
        call = next;
      }
      for (const Handler& handler : lost) {
        fail(handler, CallFault::gone);
      }
    }
    while (!due.empty() && due.begin()->first <= now) {
      fail(end_call(sent.find(due.begin()->second)), CallFault::timed_out);
    }
    std::vector<Waiting> ended;
    std::erase_if(waiting, [&](Waiting& call) {
      const bool over = call.give_up <= now;
      if (over) {
        ended.push_back(std::move(call));
      }
      return over;
    });
    for (const Waiting& call : ended) {
      fail(call.handler, CallFault::unavailable);
    }
  }

  void send_waiting(const Network& to) {
    if (to.ready) {
      for (Waiting& call : std::exchange(waiting, {})) {
        const ByteView request = call.request;
        send({&request, 1}, call.end, std::move(call.handler), to);
      }
    }
  }

  Participant& participant;
  const ServiceConfig config;
  detail::WakeOnce wake;

  std::map<Key, Sent> sent;
  std::set<std::pair<TimePoint, Key>> due;  ///< of `sent`
  std::vector<Waiting> waiting;
  std::vector<std::pair<CallFault, Handler>> refused;  ///< work() reports them
  std::uint64_t last_number = 0;                       ///< in the form of cyclonedds
  std::uint64_t seen_lost = 0;
  std::optional<TimePoint> look_again;  ///< when to check again whether requests reach the servers

  mutable std::mutex mutex;  ///< of what follows
  FoundServers servers;
  std::vector<Reply> replies;
  ServiceClientCounters counters;
  Guid writer_guid{};
  Guid reader_guid{};
  std::uint64_t client = 0;

  // Last: their destructors wait for callbacks, which use the above.
  std::optional<Writer> writer;
  std::optional<Reader> reader;
};

ServiceClient::ServiceClient(Participant& participant, const ServiceConfig& config,
                             std::function<void()> wake)
    : state_{std::make_unique<State>(participant, config, std::move(wake))} {
  state_->open();
}

ServiceClient::~ServiceClient() = default;

bool ServiceClient::ready() const {
  return state_->network().ready;
}

void ServiceClient::call(std::span<const ByteView> slices, std::chrono::nanoseconds timeout, TimePoint now,
                         Handler handler) {
  State& state = *state_;
  const State::Network network = state.network();
  if (state.sent.size() + state.waiting.size() + state.refused.size() >= state.config.max_calls) {
    state.later(CallFault::too_many, std::move(handler));
  } else if (network.ready) {
    state.send(slices, now + timeout, std::move(handler), network);
  } else {
    state.waiting.push_back({detail::joined(slices), now + std::min(timeout, state.config.match_timeout),
                             now + timeout, std::move(handler)});
  }
  if (!state.refused.empty()) {
    state.wake();
  }
}

void ServiceClient::work(TimePoint now) {
  State& state = *state_;
  std::vector<State::Reply> replies;
  state.wake.awake();
  {
    const std::lock_guard lock{state.mutex};
    replies.swap(state.replies);
  }
  state.look_again = detail::look_at(state.servers.readers(), state.mutex, *state.writer, now);
  {
    const std::lock_guard lock{state.mutex};
    state.servers.update();
  }
  const State::Network network = state.network();
  state.hand_over(std::move(replies));
  state.send_waiting(network);
  state.give_up(now, network.times_lost);
  for (const auto& [fault, handler] : std::exchange(state.refused, {})) {
    state.fail(handler, fault);
  }
}

std::optional<TimePoint> ServiceClient::deadline() const {
  std::optional<TimePoint> first = state_->look_again;
  if (!state_->due.empty()) {
    first = detail::earlier(first, state_->due.begin()->first);
  }
  for (const State::Waiting& call : state_->waiting) {
    first = detail::earlier(first, call.give_up);
  }
  return first;
}

ServiceClientCounters ServiceClient::counters() const {
  return detail::all_counters(state_->counters, state_->mutex, *state_->reader, *state_->writer);
}

}  // namespace trestle::dds
