#include <algorithm>
#include <mutex>
#include <set>
#include <utility>

#include "dds_adapter/client_places.hpp"
#include "dds_adapter/ros_names.hpp"
#include "dds_adapter/service_end.hpp"
#include "dds_adapter/service_form.hpp"
#include "someip/wire/counters.hpp"

namespace trestle::dds {

struct ServiceServer::State {
  /// A request in its form.
  struct Request {
    Sample sample;
    RosForm form;
    bool early;  ///< as in RequestId
  };
  /// A reply whose reader has not been found yet.
  struct Waiting {
    RequestId id;
    std::vector<std::byte> reply;
    TimePoint give_up;
  };
  enum class Client : std::uint8_t { there, not_yet, gone };

  State(Participant& joined_with, const ServiceConfig& what, std::function<void()> wake_owner,
        Handler handler)
      : participant{joined_with},
        config{what},
        wake{std::move(wake_owner)},
        on_request{std::move(handler)},
        waiting{what.max_calls},
        requests{what.max_calls} {}

  void open() {
    const Qos qos = detail::service_qos(config);
    const std::string user_data = detail::pairing_user_data("serviceid", participant);
    // The writer first: a client that finds the reader may send a request at once.
    writer.emplace(participant.create_writer(
        ros_reply_topic(config.name), ros_type_name(config.type + "_Response"), qos, config.max_sample_bytes,
        {.on_match =
             [this](const Guid& peer, bool matched) {
               const Vendor vendor = participant.vendor(peer);
               changed([&] { reply_readers.change(peer, matched, vendor); });
             },
         .user_data = config.reply_user_data + user_data,
         .bridge = config.bridge,
         .takes_bridge = config.takes_bridge,
         .writes_related = true}));
    reader.emplace(participant.create_reader(
        ros_request_topic(config.name), ros_type_name(config.type + "_Request"), qos,
        [this](Sample sample) { take(std::move(sample)); }, config.max_sample_bytes,
        {.on_match =
             [this](const Guid& peer, bool matched) {
               if (config.on_request_match) {
                 config.on_request_match(peer, matched);
               }
               changed([&] {
                 if (matched) {
                   request_writers.insert(peer);
                 } else {
                   request_writers.erase(peer);
                 }
               });
             },
         .user_data = config.request_user_data + user_data,
         .bridge = config.bridge,
         .takes_bridge = config.takes_bridge}));
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

  void take(Sample sample) {
    const Guid sender = sample.id().writer;
    const RosForm form = detail::form_of(config.form, participant.vendor(sender));
    std::optional<Request> dropped;  // whose memory DDS gets back when nothing is locked
    {
      const std::lock_guard lock{mutex};
      const bool early = !request_writers.contains(sender);
      dropped = requests.add(participant_of(sender), {std::move(sample), form, early});
      counters.dropped += dropped ? 1 : 0;
    }
    wake();
  }

  // --- On the owner's thread ------------------------------------------------------------------------------

  void count(std::uint64_t ServiceServerCounters::*counter) {
    const std::lock_guard lock{mutex};
    ++(counters.*counter);
  }

  void hand_over(Request request) {
    RequestId id{.request = request.sample.id(),
                 .reply_to = {},
                 .form = request.form,
                 .from_bridge = request.sample.from_bridge(),
                 .early = request.early};
    if (request.form == RosForm::cyclonedds) {
      const auto header = detail::inline_header(request.sample.cdr());
      if (!header) {
        count(&ServiceServerCounters::malformed);
        return;
      }
      id.client = header->client;
      id.number = header->number;
      count(&ServiceServerCounters::requests);
      on_request(id, ServiceMessage{detail::without_inline_header(request.sample.cdr())});
      return;
    }
    id.reply_to = request.sample.related().writer;
    count(&ServiceServerCounters::requests);
    on_request(id, ServiceMessage{std::move(request.sample)});
  }

  [[nodiscard]] Client find(const RequestId& id) const {
    // The entity kinds of readers have this bit. (RTPS 9.3.1.2)
    constexpr std::byte reader_bit{0x04};
    const std::lock_guard lock{mutex};
    const bool names_reader =
        id.form == RosForm::fastrtps && (id.reply_to.back() & reader_bit) != std::byte{0};
    const bool found = names_reader
                           ? reply_readers.is_there(id.reply_to)
                           : reply_readers.any_there([&](const Guid& found_reader, Vendor /*vendor*/) {
                               return detail::same_participant(found_reader, id.request.writer);
                             });
    return found                                                     ? Client::there
           : id.early || request_writers.contains(id.request.writer) ? Client::not_yet
                                                                     : Client::gone;
  }

  void send(const RequestId& id, std::span<const ByteView> slices) {
    tl::expected<std::uint64_t, WriteError> written{0};
    if (id.form == RosForm::cyclonedds) {
      const detail::SlicesWithHeader whole{slices, {id.client, id.number}};
      written = writer->write_related(whole.slices(), {});
    } else {
      const bool named = id.reply_to != Guid{};
      written = writer->write_related(slices, {named ? id.reply_to : id.request.writer, id.request.sequence});
    }
    count(written ? &ServiceServerCounters::replies : &ServiceServerCounters::not_written);
  }

  Participant& participant;
  const ServiceConfig config;
  detail::WakeOnce wake;
  const Handler on_request;
  detail::ClientPlaces<Waiting> waiting;
  std::optional<TimePoint> look_again;  ///< when to check again whether replies reach the clients

  mutable std::mutex mutex;  ///< of what follows
  std::set<Guid> request_writers;
  detail::FoundReaders reply_readers;
  detail::ClientPlaces<Request> requests;
  ServiceServerCounters counters;

  // Last: their destructors wait for callbacks, which use the above.
  std::optional<Writer> writer;
  std::optional<Reader> reader;
};

ServiceServer::ServiceServer(Participant& participant, const ServiceConfig& config,
                             std::function<void()> wake, Handler on_request)
    : state_{std::make_unique<State>(participant, config, std::move(wake), std::move(on_request))} {
  state_->open();
}

ServiceServer::~ServiceServer() = default;

void ServiceServer::reply(const RequestId& id, std::span<const ByteView> slices, TimePoint now) {
  State& state = *state_;
  switch (state.find(id)) {
    case State::Client::there:
      state.send(id, slices);
      return;
    case State::Client::gone:
      state.count(&ServiceServerCounters::client_gone);
      return;
    case State::Client::not_yet:
      if (state.waiting.add(participant_of(id.request.writer),
                            {id, detail::joined(slices), now + state.config.match_timeout})) {
        state.count(&ServiceServerCounters::too_many);
      }
      return;
  }
}

void ServiceServer::work(TimePoint now) {
  State& state = *state_;
  detail::ClientPlaces<State::Request> requests{state.config.max_calls};
  state.wake.awake();
  {
    const std::lock_guard lock{state.mutex};
    std::swap(requests, state.requests);
  }
  state.look_again = detail::look_at(state.reply_readers, state.mutex, *state.writer, now);
  state.waiting.erase_if([&](const State::Waiting& waiting) {
    const State::Client client = state.find(waiting.id);
    if (client == State::Client::there) {
      const ByteView reply = waiting.reply;
      state.send(waiting.id, {&reply, 1});
    } else if (client == State::Client::gone) {
      state.count(&ServiceServerCounters::client_gone);
    } else if (waiting.give_up <= now) {
      state.count(&ServiceServerCounters::unmatched);
    } else {
      return false;
    }
    return true;
  });
  for (State::Request& request : requests.take_all()) {
    state.hand_over(std::move(request));
  }
}

std::optional<TimePoint> ServiceServer::deadline() const {
  const auto& waiting = state_->waiting.all();
  const auto first =
      std::ranges::min_element(waiting, {}, [](const auto& one) { return one.second.give_up; });
  return first == waiting.end() ? state_->look_again
                                : detail::earlier(state_->look_again, first->second.give_up);
}

ServiceServerCounters ServiceServer::counters() const {
  return detail::all_counters(state_->counters, state_->mutex, *state_->reader, *state_->writer);
}

ServiceServerCounters& ServiceServerCounters::operator+=(const ServiceServerCounters& other) noexcept {
  someip::add_counters(*this, other);
  return *this;
}

}  // namespace trestle::dds
