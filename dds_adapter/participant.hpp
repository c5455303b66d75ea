// dds_adapter: Fast DDS behind types of our own. Samples stay bytes (CDR). Knows no SOME/IP.
//
//   participant.hpp     joins a domain; makes readers and writers of any type; tells what is discovered
//   reader.cpp, writer.cpp  samples in (on loan) and out; raw_type.hpp is the type that moves bytes only
//   service.hpp         ROS 2 services: request and reply topics that belong together
//   ros_names.hpp       names of topics and types; ros_graph.hpp: the ROS 2 graph
//   polled_udp.hpp, sample_sockets.hpp  receiving on the caller's thread
//   bridge_ends.hpp     readers and writers of other bridges, to avoid rings
//   fastdds_compat.hpp  differences between Fast DDS 2.x and 3.x
//   *_guard.cpp         guards against faults of Fast DDS (docs/dds.md)
#pragma once
#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <vector>

#include "someip/wire/counters.hpp"

/// DDS readers and writers of serialised samples, for any type that has a name: no generated code, no type
/// description. The DDS implementation (Fast DDS) stays behind these classes.
///
/// A sample is CDR as it is on the wire: a 4-byte encapsulation header (`00 00` big endian, `00 01` little
/// endian, then two option bytes), then the XCDR1 body. All types are keyless, as those of ROS 2 are.
///
/// Threads: all functions may be called from any thread. Callbacks come on threads of DDS, on the one that
/// calls Participant::receive(), or, between two participants of one process, on the thread that calls
/// create_… or write(), and while DDS holds locks of the reader: they must be quick and never wait for
/// something, and they must not create or destroy a participant, reader or writer. Don't hold a lock that a
/// callback takes while calling in here (which includes releasing a Sample).
namespace trestle::dds {

using ByteView = std::span<const std::byte>;

/// A participant, reader or writer could not be made; what() says which, why, and what to do about it.
class DdsError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Quality of service of a reader or writer. Of times, 0 is none: for ever.
struct Qos {
  bool reliable = true;          ///< else best effort
  bool transient_local = false;  ///< else volatile; transient-local needs `reliable`
  std::uint32_t depth = 10;      ///< samples kept, at least 1
  /// When the history of a writer is full: refuse the newest sample while a reader lacks the oldest
  /// (keep-all), instead of overwriting the oldest (keep-last).
  bool keep_all = false;
  std::chrono::nanoseconds deadline{0};  ///< a sample comes at least this often
  std::chrono::nanoseconds lifespan{0};  ///< of a writer: older samples are not delivered any more
  /// Writers show that they are alive by writing (MANUAL_BY_TOPIC), otherwise by existing (AUTOMATIC) ...
  bool manual_liveliness = false;
  std::chrono::nanoseconds liveliness_lease{0};  ///< ... at least this often
  friend constexpr bool operator==(const Qos&, const Qos&) = default;
};

/// Where DDS discovery has a server.
struct DiscoveryServer {
  std::string address{};  ///< IPv4, IPv6 or the name of a host; empty: no server has this number
  std::uint16_t port = 11811;
  friend bool operator==(const DiscoveryServer&, const DiscoveryServer&) = default;
};

/// Something that happened in the DDS network, for the log. Endpoints of the own participant never count.
struct Happening {
  /// What happened, and what the other members mean.
  enum class Kind : std::uint8_t {
    peer_found,         ///< a participant has appeared; `detail` is its name
    peer_lost,          ///< a participant has left, or has been silent for its lease time
    matched,            ///< a reader or writer has found a counterpart; `detail` is "reader" or "writer"
    unmatched,          ///< and has lost it
    incompatible_qos,   ///< a counterpart of the same topic and type will not match, or miss what was
                        ///< written before it came; `detail` names the policies
    incompatible_type,  ///< the same topic with another type; `detail` is the peer's type
    other_type_hash,    ///< a type of the same name that is another; `detail` is the peer's hash
    deadline_missed,    ///< longer than its deadline nothing came, or was written: the first time in a row
    liveliness_lost,    ///< a writer has not shown itself for its lease: one of theirs, or ours
    small_send_buffer,  ///< a sample is written for which the system should grant larger UDP send buffers:
                        ///< the first one; `detail` says so in words, with the sysctl that helps
  };
  Kind kind{};
  std::string topic;            ///< DDS name; empty for peers
  std::string type;             ///< DDS name; empty for peers
  std::string peer;             ///< GUID of the peer's participant or endpoint, as hexadecimal digits
  std::string detail;           ///< see Kind
  std::size_t matched = 0;      ///< matched, unmatched: how many counterparts there are now
  std::string node{};           ///< incompatible_qos, other_type_hash: the peer's ROS 2 node, once known
  bool ours_reads = false;      ///< likewise: our end is a reader, not a writer
  std::string hash{};           ///< other_type_hash: that of ours, from the user data
  bool refused = false;         ///< likewise: ParticipantConfig::strict_types
  std::optional<Qos> theirs{};  ///< incompatible_qos: the peer's, where it is known
  std::optional<Qos> ours{};    ///< likewise: that of our end
};

/// The kind's name as it stands above, for logs.
[[nodiscard]] const char* to_string(Happening::Kind kind) noexcept;

/// How a participant joins its domain. The constructor of Participant refuses impossible values.
struct ParticipantConfig {
  std::uint32_t domain = 0;  ///< 0 to 232
  std::string name = "trestle";
  /// IPv4 addresses of this host that DDS may use; empty: all interfaces. 127.0.0.1 keeps all on the host.
  std::vector<std::string> interfaces;
  /// Use shared memory beside UDP for peers on this host. It is a little faster, but a peer that was killed
  /// can leave segments behind that make its successors slow or deaf, and one with another build of Fast DDS
  /// can end the process, so it is off unless asked for, here or by a profile that lists it among its
  /// `userTransports`. See also shared_memory_can_abort().
  std::optional<bool> shared_memory{};
  /// How long others believe that we are alive after they last heard of us: at least 100 ms. It takes them
  /// this long to notice that the process was killed, or that the network is down.
  std::chrono::nanoseconds lease = std::chrono::seconds{20};
  /// The ROS 2 node that the participant and all its readers and writers appear as: "/trestle",
  /// "/front/trestle". Empty: none; ROS 2 then shows them as created by bare DDS.
  std::string node{};
  std::string enclave = "/";  ///< of ROS 2's security, which nodes tell each other; only with `node`
  /// Bytes of an id in ROS 2's graph messages: 24 up to Humble, 16 from Iron on. 0: 16 until a peer uses 24.
  std::size_t gid_bytes = 0;
  /// A file of Fast DDS's XML profiles, and the participant profile in it to start from. The settings above
  /// override it; the lease only if it is not the default. The transports that the profile lists are used
  /// unless `interfaces` or `shared_memory` is set; of the built-in ones only UDP is. Empty: none.
  std::string profiles_file{};
  std::string profile{};
  /// Discovery servers, by which participants find each other in place of multicast. Number 0 comes first.
  std::vector<DiscoveryServer> discovery_servers{};
  /// The folder of an enclave of ROS 2's security: certificates, key, governance, permissions. Empty: none.
  std::string security_folder{};
  /// UDP datagrams for readers and writers are received by Participant::receive(), not by a thread of DDS:
  /// call it whenever incoming() is readable. So samples need not be handed to the thread that works with
  /// them. Threads of DDS still receive discovery, multicast, shared memory, and what comes by transports or
  /// locators of a profile. (A profile that gives discovery a port of readers and writers mixes both.)
  bool polled = false;
  /// Readers and writers whose user data has another type hash are kept apart from ours: our readers take
  /// nothing from such writers, our writers send nothing to such readers, and neither counts as a
  /// counterpart. (With Fast DDS 2.10 to 2.14, writers send all the same. With 3.x they do so to readers that
  /// are found before the first writer of the topic is made.)
  bool strict_types = false;
  /// Frees the memory of a sample together with it. Otherwise the histories of readers and writers reuse it,
  /// and keep as much as they ever needed.
  bool frees_samples = false;
  std::function<void(const Happening&)> on_event;  ///< may be empty; see "Threads" above
  /// Participant::writers() has changed. As on_event.
  std::function<void()> on_writers{};
};

/// Whether this Fast DDS (before 2.10.2, and 2.11 before 2.11.2) ends the whole process when another process
/// with the same shared memory is killed, stopped or not scheduled for a second while it holds a lock there.
/// We cannot prevent it: the exception is thrown in a thread of Fast DDS.
[[nodiscard]] bool shared_memory_can_abort() noexcept;

/// How many bytes the system grants for samples that wait for Participant::receive(). 16 MB are asked for,
/// and granted to a process that may exceed net.core.rmem_max (CAP_NET_ADMIN).
[[nodiscard]] std::uint32_t polled_buffer_bytes() noexcept;

/// Whether Writer::reaches() really knows: with Fast DDS before 2.10. With later versions it only waits.
[[nodiscard]] bool sees_readers_begin() noexcept;

/// The largest sample, header included, that a reader or writer takes unless told otherwise.
inline constexpr std::size_t default_max_sample_bytes = std::size_t{64} << 20U;

/// Names a reader or writer: 12 bytes of its participant, then 4 of its own. All zero: none.
using Guid = std::array<std::byte, 16>;

/// Names a participant: what the GUIDs of all its readers and writers begin with.
using GuidPrefix = std::array<std::byte, 12>;
[[nodiscard]] GuidPrefix participant_of(const Guid& endpoint) noexcept;

/// Names a sample: its writer, and its number among that one's, from 1.
struct SampleId {
  Guid writer{};
  std::uint64_t sequence = 0;
  friend constexpr bool operator==(const SampleId&, const SampleId&) = default;
};

/// Told of each counterpart that a reader or writer finds and loses; not of those of its own participant.
using OnMatch = std::function<void(const Guid& peer, bool matched)>;

/// Somebody else's writer, as discovery tells of it. The names are those on the DDS wire.
struct FoundWriter {
  std::string topic{};
  std::string type{};
  Qos qos{};  ///< of which discovery tells neither depth nor history nor lifespan: those are as by default
  bool bridge = false;        ///< the end of another bridge ...
  std::string bridge_text{};  ///< ... and its EndpointExtras::bridge
  bool refused = false;  ///< by a reader of ours, for the hash of its type: ParticipantConfig::strict_types
  std::string node{};    ///< its ROS 2 node, once known
};

/// Somebody else's participant.
struct FoundParticipant {
  std::string guid{};                    ///< its GUID prefix, as hexadecimal digits
  std::string name{};                    ///< what it calls itself
  std::vector<std::string> addresses{};  ///< where it says that it is reached, without ports
};

/// Somebody else's reader or writer that one of ours matches, and that is not the end of a bridge.
struct Counterpart {
  Guid guid{};
  std::string node{};         ///< its ROS 2 node, once known
  std::string participant{};  ///< what its participant calls itself
  /// Where its participant says that it is reached, without ports; one on this host mostly at 127.0.0.1.
  std::vector<std::string> addresses{};
};

/// What a reader or writer may have beside its quality of service.
struct EndpointExtras {
  OnMatch on_match{};       ///< a callback as any other; never called again once the endpoint is gone
  std::string user_data{};  ///< told to everybody by discovery
  /// Not empty: this is the end of a bridge. The text says of what, and others read it in
  /// Participant::bridge_ends(). Two such ends of different participants ignore each other, though DDS
  /// matches them: the reader takes nothing from the writer, neither counts as a counterpart, and on_match is
  /// not called. So nothing that one bridge brought in is carried out by another. Printable characters except
  /// `;`; at most `max_bridge_text`.
  std::string bridge{};
  /// The exception: if this returns true for the text of such an end of another participant, it is a
  /// counterpart like any other. Called on threads of DDS, on several at once. Empty: no exception.
  std::function<bool(std::string_view bridge)> takes_bridge{};
  /// Of such a reader: told of each sample that it does not take for this reason. Valid during the call, on
  /// the same threads as `on_sample`.
  std::function<void(ByteView cdr, const Guid& writer)> on_bridged{};
  bool writes_related = false;  ///< of a writer: Writer::write_related() is used, and no other write()
};

/// The longest EndpointExtras::bridge; longer texts of others are cut.
inline constexpr std::size_t max_bridge_text = 448;

/// The end of another bridge, EndpointExtras::bridge.
struct BridgeEnd {
  std::string text{};
  bool writer = false;
  Guid guid{};
};

/// Which DDS a participant uses.
enum class Vendor : std::uint8_t { fast_dds, cyclone_dds, other };

namespace detail {
class ParticipantCore;
class ReaderCore;
class WriterCore;
struct Loan;
}  // namespace detail

/// A received sample, on loan from DDS: nothing has been copied.
///
/// May be moved, kept, handed to another thread and released there, at any time, also after its Reader and
/// Participant objects are gone (what DDS needs for it lives on until then). Different samples may be used
/// and released by different threads at once; one sample is not to be used by two threads at once.
/// Each sample that is kept keeps its memory: whoever keeps samples must bound how many.
class Sample {
 public:
  Sample() noexcept;
  /// @param from_bridge  see below.
  explicit Sample(std::unique_ptr<detail::Loan> loan, bool from_bridge = false) noexcept;
  /// One that did not come by DDS, and nothing was lent for: its writer is none.
  /// @param cdr  outlives the sample.
  Sample(ByteView cdr, std::chrono::nanoseconds source_time, std::uint64_t sequence) noexcept;
  Sample(Sample&&) noexcept;
  Sample& operator=(Sample&&) noexcept;
  ~Sample();

  /// The serialised sample with its encapsulation header: at least 4 bytes. Valid until this object is
  /// released, assigned to or destroyed; moving it does not move the bytes. Up to 3 bytes of padding may
  /// follow the CDR body. Empty for an empty object.
  [[nodiscard]] ByteView cdr() const noexcept { return cdr_; }
  /// When the writer wrote it, by the writer's wall clock: since 1970. Zero when it did not say.
  [[nodiscard]] std::chrono::nanoseconds source_time() const noexcept { return source_time_; }
  /// GUID of the writer: 32 hexadecimal digits. Made anew at each call.
  [[nodiscard]] std::string writer() const;
  /// Number of this sample among its writer's, from 1.
  [[nodiscard]] std::uint64_t sequence() const noexcept { return sequence_; }
  [[nodiscard]] SampleId id() const noexcept;
  /// The sample that the writer says this one belongs to, see Writer::write_related(). No writer: none.
  [[nodiscard]] SampleId related() const noexcept;

  /// Whether its writer is the end of another bridge, which the reader takes: EndpointExtras::takes_bridge.
  [[nodiscard]] bool from_bridge() const noexcept { return from_bridge_; }

  /// Gives the memory back to DDS early; cdr() is empty from then on.
  void release() noexcept;

 private:
  ByteView cdr_;
  std::chrono::nanoseconds source_time_{0};
  std::uint64_t sequence_ = 0;
  bool from_bridge_ = false;
  std::unique_ptr<detail::Loan> loan_;
};

/// What a reader has seen since it was made. All but `received` were not delivered.
struct ReaderCounters {
  std::uint64_t received = 0;  ///< given to the callback
  std::uint64_t received_bytes = 0;
  std::uint64_t own = 0;                ///< written by the own participant
  std::uint64_t from_bridge = 0;        ///< written by the end of another bridge, EndpointExtras::bridge
  std::uint64_t other_type = 0;         ///< of a type with another hash, ParticipantConfig::strict_types
  std::uint64_t bad_encapsulation = 0;  ///< too short for a header, or not plain XCDR1
  std::uint64_t oversize = 0;           ///< more than `max_sample_bytes`
  std::uint64_t lost = 0;              ///< DDS says that they will never arrive (best effort, or overwritten)
  std::uint64_t rejected = 0;          ///< DDS had no room for them at that moment
  std::uint64_t incompatible_qos = 0;  ///< writers that don't match for their quality of service
  std::uint64_t deadlines_missed = 0;  ///< how often the deadline passed without a sample
  std::uint64_t liveliness_lost = 0;   ///< how often a writer did not show itself for its lease
  template <typename Visit>
  constexpr void for_each_counter(Visit visit) const {
    using enum someip::CounterKind;
    visit("dds_received", received, traffic);
    visit("dds_received_bytes", received_bytes, traffic);
    visit("dds_own", own, loss);
    visit("dds_from_bridge", from_bridge, loss);
    visit("dds_other_type", other_type, loss);
    visit("dds_bad_encapsulation", bad_encapsulation, loss);
    visit("dds_oversize", oversize, loss);
    visit("dds_lost", lost, loss);
    visit("dds_rejected", rejected, loss);
    visit("dds_incompatible_qos", incompatible_qos, loss);
    visit("dds_deadlines_missed", deadlines_missed, loss);
    visit("dds_liveliness_lost", liveliness_lost, loss);
  }

  /// With what another reader has done.
  ReaderCounters& operator+=(const ReaderCounters& other) noexcept;
};

/// What a writer has done since it was made. What was refused was not sent.
struct WriterCounters {
  std::uint64_t sent = 0;  ///< taken, whether or not somebody reads them
  std::uint64_t sent_bytes = 0;
  std::uint64_t bad_encapsulation = 0;  ///< see WriteError, as for oversize
  std::uint64_t oversize = 0;
  std::uint64_t refused = 0;  ///< for any other WriteError, of large samples also after write()
  /// Sent, but overwritten by a newer one before every matched reliable reader had acknowledged it: a reader
  /// that is stuck or too slow lacks it. (One that got it and was only late to say so counts too.)
  std::uint64_t overwritten = 0;
  std::uint64_t other_type = 0;        ///< readers that get nothing, ParticipantConfig::strict_types
  std::uint64_t incompatible_qos = 0;  ///< readers that don't get all they want, by quality of service
  std::uint64_t deadlines_missed = 0;  ///< how often the deadline passed without a sample
  std::uint64_t liveliness_lost = 0;   ///< how often we did not show ourselves for the lease
  template <typename Visit>
  constexpr void for_each_counter(Visit visit) const {
    using enum someip::CounterKind;
    visit("dds_sent", sent, traffic);
    visit("dds_sent_bytes", sent_bytes, traffic);
    visit("dds_bad_encapsulation", bad_encapsulation, loss);
    visit("dds_oversize", oversize, loss);
    visit("dds_refused", refused, loss);
    visit("dds_other_type", other_type, loss);
    visit("dds_overwritten", overwritten, doubt);
    visit("dds_incompatible_qos", incompatible_qos, loss);
    visit("dds_deadlines_missed", deadlines_missed, loss);
    visit("dds_liveliness_lost", liveliness_lost, loss);
  }

  /// With what another writer has done.
  WriterCounters& operator+=(const WriterCounters& other) noexcept;
};

/// Why a sample was not written. Nothing of it has been sent.
enum class WriteError : std::uint8_t {
  bad_encapsulation,  ///< shorter than a header, or the header is not that of plain XCDR1
  oversize,           ///< more than the writer's `max_sample_bytes`
  no_memory,          ///< DDS could not get memory for it
  timeout,            ///< the history is full of samples that are still being sent
  failed,             ///< DDS refused it for another reason
};

/// The error's name as it stands above, for logs and counters.
[[nodiscard]] const char* to_string(WriteError error) noexcept;

/// Reads a topic until it is destroyed. Movable; a moved-from reader may only be destroyed or assigned to.
class Reader {
 public:
  explicit Reader(std::shared_ptr<detail::ReaderCore> core) noexcept;
  Reader(Reader&&) noexcept;
  Reader& operator=(Reader&&) noexcept;
  /// After this the callback is not running and will not be called again.
  ~Reader();

  /// Writers that this reader receives from, those of the own participant not counted.
  [[nodiscard]] std::size_t matched() const;
  [[nodiscard]] ReaderCounters counters() const;
  [[nodiscard]] Guid guid() const;

 private:
  std::shared_ptr<detail::ReaderCore> core_;
};

/// Writes to a topic. Movable; a moved-from writer may only be destroyed or assigned to.
class Writer {
 public:
  explicit Writer(std::shared_ptr<detail::WriterCore> core) noexcept;
  Writer(Writer&&) noexcept;
  Writer& operator=(Writer&&) noexcept;
  ~Writer();

  /// Sends a sample, given in slices that together are the encapsulation header and body. The slices are
  /// copied once, into DDS's own memory, and are free again on return. With no reader there it still counts
  /// as sent. The calling thread sends small samples itself. Large ones, above some 300 KB for all readers
  /// together, are copied and sent by a thread of this writer, and DDS may refuse such a sample after this
  /// has returned. While one is being sent, the next large one waits for that, but never for a reader that is
  /// slow or stuck.
  tl::expected<void, WriteError> write(std::span<const ByteView> slices);
  tl::expected<void, WriteError> write(ByteView sample) { return write(std::span{&sample, 1}); }
  /// The same for a sample that belongs to another one (0: unknown). Returns the number of the sample.
  tl::expected<std::uint64_t, WriteError> write_related(std::span<const ByteView> slices,
                                                        const SampleId& related);

  /// Whether a matched reader gets all that is written from now on. Readers of Fast DDS do. A reader of
  /// another DDS may lose what is written too soon after the two have found each other, though it is
  /// reliable. The first call makes it ready, which takes some tens of milliseconds; then ask again. (Built
  /// with Fast DDS 2.10 or later, it is true 200 ms after the first question, which may be too soon.)
  [[nodiscard]] bool reaches(const Guid& reader);

  /// Readers that receive from this writer, those of the own participant not counted.
  [[nodiscard]] std::size_t matched() const;
  /// To be called instead of write() with a sample that nobody would read: what was written before is old
  /// now, and no reader that comes late gets it. Without effect on a transient-local writer. Costs little
  /// where nothing is kept.
  void forget_written();
  /// Waits until all matched reliable readers have acknowledged everything; false when time ran out. (Of a
  /// participant that is polled somebody else has to receive() meanwhile.)
  [[nodiscard]] bool wait_until_received(std::chrono::nanoseconds limit) const;
  [[nodiscard]] WriterCounters counters() const;
  [[nodiscard]] Guid guid() const;

 private:
  std::shared_ptr<detail::WriterCore> core_;
};

/// Takes each new sample, one at a time and in each writer's order. The sample may be moved out and kept.
using OnSample = std::function<void(Sample)>;

/// Membership of a DDS domain. Its own readers don't get what its writers send, so a bridge can carry one
/// topic both ways. Movable; may be destroyed before its readers and writers, which go on working.
class Participant {
 public:
  /// @throws DdsError
  explicit Participant(const ParticipantConfig& config);
  Participant(Participant&&) noexcept;
  Participant& operator=(Participant&&) noexcept;
  /// After this `on_event` and `on_writers` are not running and will not be called again.
  ~Participant();

  /// `topic` and `type` are names on the DDS wire (see ros_names.hpp).
  /// @param max_sample_bytes  larger samples are dropped and counted.
  /// @throws DdsError  also when this participant already uses the topic with another type.
  [[nodiscard]] Reader create_reader(std::string_view topic, std::string_view type, const Qos& qos,
                                     OnSample on_sample,
                                     std::size_t max_sample_bytes = default_max_sample_bytes,
                                     EndpointExtras extras = {});

  /// @param max_sample_bytes  larger samples are refused.
  /// @throws DdsError  as above.
  [[nodiscard]] Writer create_writer(std::string_view topic, std::string_view type, const Qos& qos,
                                     std::size_t max_sample_bytes = default_max_sample_bytes,
                                     EndpointExtras extras = {});

  /// The writers of others that are there now, also those of topics that nobody here reads; in no order that
  /// means anything. At most 4096 readers and writers are remembered.
  [[nodiscard]] std::vector<FoundWriter> writers() const;
  /// Those that match a reader or writer of ours of this topic, are no ends of bridges, and are remembered.
  /// @param writers  they write, ours reads; else the other way round.
  [[nodiscard]] std::vector<Counterpart> counterparts(std::string_view topic, bool writers) const;
  /// The ends of other bridges on this topic; empty: on all. At most 4096 are remembered, of all topics.
  [[nodiscard]] std::vector<BridgeEnd> bridge_ends(std::string_view topic) const;
  /// Changes when ends of other bridges have come or gone. Cheap: takes no lock.
  [[nodiscard]] std::uint64_t bridge_changes() const noexcept;
  /// How many other participants are there now, as far as they are remembered.
  [[nodiscard]] std::size_t peers() const;
  /// These, one by one.
  [[nodiscard]] std::vector<FoundParticipant> participants() const;
  /// How many readers and writers were discovered when there was no room to remember them.
  [[nodiscard]] std::uint64_t not_remembered() const;

  /// A descriptor that is readable when receive() has something to do; -1: never, see
  /// ParticipantConfig::polled. Valid as long as the participant, its readers or its writers.
  [[nodiscard]] int incoming() const noexcept;
  /// Receives some of what has come: callbacks of samples come within it. Not to be called within a callback.
  void receive();

  /// GUID prefix of this participant, as hexadecimal digits: what others see as `peer`.
  [[nodiscard]] std::string guid() const;
  /// Whether it has shared memory, as configured or by its profile.
  [[nodiscard]] bool shares_memory() const;
  /// Receive buffers of its UDP sockets that the system does not grant in full, for the log: a line each with
  /// the sysctl that helps. Empty when all are granted. Send buffers matter only to programs that write large
  /// samples: see Happening::Kind::small_send_buffer.
  [[nodiscard]] std::vector<std::string> buffers_not_granted() const;
  /// Which DDS the participant of a reader or writer uses, as discovery says.
  [[nodiscard]] Vendor vendor(const Guid& endpoint) const;

 private:
  std::shared_ptr<detail::ParticipantCore> core_;
};

}  // namespace trestle::dds
