#pragma once
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "dds_adapter/participant.hpp"

/// ROS 2 services on serialised messages: both ends, as both rmw_fastrtps and rmw_cyclonedds know them.
///
/// A service is two topics, one of requests and one of replies; every client sees the replies to all others.
/// What belongs together the two implementations say in different ways, RosForm, and do not understand each
/// other; these classes understand both.
///
/// Threads: use an object on one thread. `wake` is called on threads of DDS, as other callbacks of
/// participant.hpp, and asks for work() on that one thread; all other handlers are called by work() alone.
/// They may call anything here but not destroy the object. Nothing waits.
namespace trestle::dds {

using TimePoint = std::chrono::steady_clock::time_point;

/// How requests and replies find each other.
enum class RosForm : std::uint8_t {
  automatic,   ///< like the peer: cyclonedds if its participant is Cyclone DDS, otherwise fastrtps
  fastrtps,    ///< beside the message: the reply names the request's number and its receiver
  cyclonedds,  ///< ahead of the message's body: {uint64 client, int64 number}, which the reply repeats
};

/// The form's name in configurations: "auto", "fastrtps", "cyclonedds".
[[nodiscard]] const char* to_string(RosForm form) noexcept;

/// One end of a ROS 2 service, client or server: its name and type, and how much may wait.
struct ServiceConfig {
  std::string name;  ///< as ROS 2 has it: "/add_two_ints"
  std::string type;  ///< likewise: "example_interfaces/srv/AddTwoInts"
  RosForm form = RosForm::automatic;
  /// For a client: calls that wait for an answer. For a server: requests that wait for work(), and as many
  /// replies that wait for their reader; the participants of its clients share these places.
  std::size_t max_calls = 256;
  std::size_t max_sample_bytes = default_max_sample_bytes;  ///< the largest request or reply, as CDR
  /// How long a request or reply waits until its reader is found; discovery needs some milliseconds for that.
  std::chrono::nanoseconds match_timeout = std::chrono::seconds{1};
  /// User data of the reader or writer of requests, besides what the class sets itself.
  std::string request_user_data{};
  std::string reply_user_data{};  ///< likewise, of replies
  /// EndpointExtras::bridge of both: servers and clients of different bridges do not see each other.
  std::string bridge{};
  std::function<bool(std::string_view bridge)> takes_bridge{};  ///< likewise, EndpointExtras::takes_bridge
  /// Told of those at the other end of the topic of requests, as EndpointExtras::on_match.
  OnMatch on_request_match{};
};

/// A request or reply as CDR with its encapsulation header, whatever form it came in: on loan from DDS, or
/// copied where the form has something between the two.
class ServiceMessage {
 public:
  ServiceMessage() = default;
  explicit ServiceMessage(Sample sample) noexcept : sample_{std::move(sample)} {}
  explicit ServiceMessage(std::vector<std::byte> bytes) noexcept : bytes_{std::move(bytes)} {}

  /// As Sample::cdr().
  [[nodiscard]] ByteView cdr() const noexcept { return bytes_.empty() ? sample_.cdr() : ByteView{bytes_}; }

 private:
  Sample sample_;
  std::vector<std::byte> bytes_;
};

/// Why a call brought no answer.
enum class CallFault : std::uint8_t {
  unavailable,  ///< no server was found in time; the request was not sent
  too_many,     ///< ServiceConfig::max_calls wait for an answer; likewise
  not_written,  ///< DDS refused it, or it is too large; likewise
  timed_out,    ///< no answer came in time
  gone,         ///< the server has left since the request was sent
};

/// The fault's name as it stands above.
[[nodiscard]] const char* to_string(CallFault fault) noexcept;

/// What a client has seen since it was made.
struct ServiceClientCounters {
  std::uint64_t requests = 0;     ///< sent
  std::uint64_t replies = 0;      ///< handed over
  std::uint64_t foreign = 0;      ///< replies to others: not a loss
  std::uint64_t late = 0;         ///< replies to us that nobody waits for any more
  std::uint64_t malformed = 0;    ///< replies too short for their form
  std::uint64_t dropped = 0;      ///< replies that came faster than work() was called
  std::uint64_t unavailable = 0;  ///< calls, as CallFault; also what follows
  std::uint64_t too_many = 0;
  std::uint64_t not_written = 0;
  std::uint64_t timed_out = 0;
  std::uint64_t gone = 0;
  ReaderCounters reader;
  WriterCounters writer;
  /// What its writer refused is in `not_written`.
  template <typename Visit>
  constexpr void for_each_counter(Visit visit) const {
    using enum someip::CounterKind;
    visit("unavailable", unavailable, loss);
    visit("gone", gone, loss);
    visit("timed_out", timed_out, loss);
    visit("too_many", too_many, loss);
    visit("not_written", not_written, loss);
    visit("dds_requests", requests, traffic);
    visit("dds_replies", replies, traffic);
    visit("dds_foreign", foreign, traffic);
    visit("dds_late", late, loss);
    visit("dds_malformed", malformed + reader.bad_encapsulation, loss);
    visit("dds_dropped", dropped, loss);
    visit("dds_other_type", reader.other_type + writer.other_type, loss);
    visit("dds_oversize", reader.oversize, loss);
    visit("dds_lost", reader.lost + reader.rejected, loss);
    visit("dds_incompatible_qos", reader.incompatible_qos + writer.incompatible_qos, loss);
    visit("dds_overwritten", writer.overwritten, doubt);
  }
};

/// Calls a ROS 2 service. Each call ends with a reply or a CallFault; none is repeated.
class ServiceClient {
 public:
  /// Called exactly once for each call, but not after the end of the client.
  using Handler = std::function<void(tl::expected<ServiceMessage, CallFault> reply)>;

  /// @param participant  outlives the client.
  /// @param wake  see "Threads" above.
  /// @throws DdsError
  ServiceClient(Participant& participant, const ServiceConfig& config, std::function<void()> wake);
  ~ServiceClient();
  ServiceClient(const ServiceClient&) = delete;
  ServiceClient& operator=(const ServiceClient&) = delete;

  /// Whether a server's topics have been found and requests reach it. Changes with `wake` or in work().
  [[nodiscard]] bool ready() const;

  /// Sends a request, once a server is there. The slices together are a message as CDR, and copied.
  /// @param timeout  for the answer, waiting included.
  /// @param handler  is also told of every fault.
  void call(std::span<const ByteView> slices, std::chrono::nanoseconds timeout, TimePoint now,
            Handler handler);

  /// Hands over what has come, and gives up what is due.
  void work(TimePoint now);
  /// When work() has something to give up; nothing: never.
  [[nodiscard]] std::optional<TimePoint> deadline() const;

  [[nodiscard]] ServiceClientCounters counters() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// Names a request, for its reply.
struct RequestId {
  SampleId request;                  ///< its writer, and its number among that one's
  Guid reply_to{};                   ///< the client's reader, if it said so; else none
  RosForm form = RosForm::fastrtps;  ///< never automatic
  std::uint64_t client = 0;          ///< cyclonedds alone, to be repeated; as the next
  std::int64_t number = 0;
  bool from_bridge = false;  ///< as Sample::from_bridge()
  bool early = false;        ///< it came before DDS had told of its writer
};

/// What a server has seen since it was made.
struct ServiceServerCounters {
  std::uint64_t requests = 0;     ///< handed over
  std::uint64_t replies = 0;      ///< sent
  std::uint64_t malformed = 0;    ///< requests too short for their form
  std::uint64_t dropped = 0;      ///< requests that came faster than work() was called
  std::uint64_t client_gone = 0;  ///< replies whose client has left
  std::uint64_t unmatched = 0;    ///< replies whose client's reader was not found in time
  std::uint64_t too_many = 0;     ///< replies for which there was no room to wait, or not any longer
  std::uint64_t not_written = 0;  ///< replies that DDS refused
  ReaderCounters reader;
  WriterCounters writer;
  /// All but `requests`, which who answers them counts. What its writer refused is in `not_written`.
  template <typename Visit>
  constexpr void for_each_counter(Visit visit) const {
    using enum someip::CounterKind;
    visit("dds_from_bridge", reader.from_bridge, loss);
    visit("dds_replies", replies, traffic);
    visit("dds_malformed", malformed + reader.bad_encapsulation, loss);
    visit("dds_dropped", dropped, loss);
    visit("dds_other_type", reader.other_type + writer.other_type, loss);
    visit("dds_client_gone", client_gone, loss);
    visit("dds_unmatched", unmatched + too_many, loss);
    visit("dds_not_written", not_written, loss);
    visit("dds_oversize", reader.oversize, loss);
    visit("dds_lost", reader.lost + reader.rejected, loss);
    visit("dds_incompatible_qos", reader.incompatible_qos + writer.incompatible_qos, loss);
    visit("dds_overwritten", writer.overwritten, doubt);
  }

  /// With what another server has done.
  ServiceServerCounters& operator+=(const ServiceServerCounters& other) noexcept;
};

/// Offers a ROS 2 service: hands requests to a handler, and sends the replies, now or later.
class ServiceServer {
 public:
  using Handler = std::function<void(const RequestId& id, ServiceMessage request)>;

  /// @param participant  outlives the server.
  /// @param wake  see "Threads" above.
  /// @throws DdsError
  ServiceServer(Participant& participant, const ServiceConfig& config, std::function<void()> wake,
                Handler on_request);
  ~ServiceServer();
  ServiceServer(const ServiceServer&) = delete;
  ServiceServer& operator=(const ServiceServer&) = delete;

  /// Answers a request, at any time later. The slices as in ServiceClient::call(). A reply waits until the
  /// client's reader has been found; before that it would be lost.
  void reply(const RequestId& id, std::span<const ByteView> slices, TimePoint now);

  /// Hands over the requests that have come, sends replies whose readers are found, gives up what is due.
  void work(TimePoint now);
  [[nodiscard]] std::optional<TimePoint> deadline() const;

  [[nodiscard]] ServiceServerCounters counters() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace trestle::dds
