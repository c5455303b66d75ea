#pragma once
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <vector>

/// DDS readers and writers of serialised samples, for any type that has a name: no generated code, no type
/// description. The DDS implementation (Fast DDS) stays behind these classes.
///
/// A sample is CDR as it is on the wire: a 4-byte encapsulation header (`00 00` big endian, `00 01` little
/// endian, then two option bytes), then the XCDR1 body. All types are keyless, as those of ROS 2 are.
///
/// Threads: all functions may be called from any thread. Callbacks come on threads of DDS, or, between two
/// participants of one process, on the thread that calls create_… or write(), and while DDS holds locks of
/// the reader: they must be quick and never wait for something, and they must not create or destroy a
/// participant, reader or writer. Don't hold a lock that a callback takes while calling in here (which
/// includes releasing a Sample).
namespace trestle::dds {

using ByteView = std::span<const std::byte>;

/// A participant, reader or writer could not be made; what() says which, why, and what to do about it.
class DdsError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Something that happened in the DDS network, for the log. Endpoints of the own participant never count.
struct Event {
  enum class Kind : std::uint8_t {
    peer_found,         ///< a participant has appeared; `detail` is its name
    peer_lost,          ///< a participant has left, or has been silent for its lease time
    matched,            ///< a reader or writer has found a counterpart; `detail` is "reader" or "writer"
    unmatched,          ///< and has lost it
    incompatible_qos,   ///< a counterpart of the same topic and type will not match; `detail` names the
                        ///< policies
    incompatible_type,  ///< the same topic with another type; `detail` is the peer's type
  };
  Kind kind{};
  std::string topic;        ///< DDS name; empty for peers
  std::string type;         ///< DDS name; empty for peers
  std::string peer;         ///< GUID of the peer's participant or endpoint, as hexadecimal digits
  std::string detail;       ///< see Kind
  std::size_t matched = 0;  ///< matched, unmatched: how many counterparts there are now
};

/// The kind's name as it stands above, for logs.
[[nodiscard]] const char* to_string(Event::Kind kind) noexcept;

/// How a participant joins its domain. The constructor of Participant refuses what cannot be.
struct ParticipantConfig {
  std::uint32_t domain = 0;  ///< 0 to 232
  std::string name = "trestle";
  /// IPv4 addresses of this host that DDS may use; empty: all interfaces. 127.0.0.1 keeps everything on the
  /// host.
  std::vector<std::string> interfaces;
  /// Use shared memory beside UDP for peers on this host. It is a little faster, but a peer that was killed
  /// can leave segments behind that make its successors slow or deaf, so it is off unless asked for.
  bool shared_memory = false;
  std::function<void(const Event&)> on_event;  ///< may be empty; see "Threads" above
};

/// Quality of service of a reader or writer. History is always keep-last.
struct Qos {
  bool reliable = true;          ///< else best effort
  bool transient_local = false;  ///< else volatile; transient-local needs `reliable`
  std::uint32_t depth = 10;      ///< samples kept, at least 1
  friend constexpr bool operator==(const Qos&, const Qos&) = default;
};

/// The largest sample, header included, that a reader or writer takes unless told otherwise.
inline constexpr std::size_t default_max_sample_bytes = std::size_t{64} << 20U;

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
  explicit Sample(std::unique_ptr<detail::Loan> loan) noexcept;
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

  /// Gives the memory back to DDS early; cdr() is empty from then on.
  void release() noexcept;

 private:
  ByteView cdr_;
  std::chrono::nanoseconds source_time_{0};
  std::uint64_t sequence_ = 0;
  std::unique_ptr<detail::Loan> loan_;
};

/// What a reader has seen since it was made. All but `received` were not delivered.
struct ReaderCounters {
  std::uint64_t received = 0;  ///< given to the callback
  std::uint64_t received_bytes = 0;
  std::uint64_t own = 0;                ///< written by the own participant
  std::uint64_t bad_encapsulation = 0;  ///< too short for a header, or not plain XCDR1
  std::uint64_t oversize = 0;           ///< more than `max_sample_bytes`
  std::uint64_t lost = 0;              ///< DDS says that they will never arrive (best effort, or overwritten)
  std::uint64_t rejected = 0;          ///< DDS had no room for them at that moment
  std::uint64_t incompatible_qos = 0;  ///< writers that don't match for their quality of service
};

/// What a writer has done since it was made. What was refused was not sent.
struct WriterCounters {
  std::uint64_t sent = 0;  ///< handed to DDS, whether or not somebody reads them
  std::uint64_t sent_bytes = 0;
  std::uint64_t bad_encapsulation = 0;  ///< see WriteError, as for oversize
  std::uint64_t oversize = 0;
  std::uint64_t refused = 0;  ///< for any other WriteError
  /// Sent, but overwritten by a newer one before every matched reliable reader had acknowledged it: a reader
  /// that is stuck or too slow lacks it. (One that got it and was only late to say so counts too.)
  std::uint64_t overwritten = 0;
  std::uint64_t incompatible_qos = 0;  ///< readers that don't match for their quality of service
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

  /// Sends a sample, given in pieces that together are the encapsulation header and body. The pieces are
  /// copied once, into DDS's own memory, and are free again on return. With no reader there it still counts
  /// as sent. Samples above about 64 KB leave from a thread of DDS, after this has returned.
  tl::expected<void, WriteError> write(std::span<const ByteView> pieces);
  tl::expected<void, WriteError> write(ByteView sample) { return write(std::span{&sample, 1}); }

  /// Readers that receive from this writer, those of the own participant not counted.
  [[nodiscard]] std::size_t matched() const;
  /// Waits until all matched reliable readers have acknowledged everything; false when time ran out.
  [[nodiscard]] bool wait_until_received(std::chrono::nanoseconds limit) const;
  [[nodiscard]] WriterCounters counters() const;

 private:
  std::shared_ptr<detail::WriterCore> core_;
};

/// Takes each new sample, one at a time and in each writer's order. The sample may be moved out and kept.
using OnSample = std::function<void(Sample)>;

/// Membership of a DDS domain. Samples that are written through a participant are not delivered to its own
/// readers, so a bridge can carry one topic both ways. Movable; may be destroyed before its readers and
/// writers, which then go on working.
class Participant {
 public:
  /// @throws DdsError
  explicit Participant(const ParticipantConfig& config);
  Participant(Participant&&) noexcept;
  Participant& operator=(Participant&&) noexcept;
  /// After this `on_event` is not running and will not be called again.
  ~Participant();

  /// `topic` and `type` are names on the DDS wire (see ros_names.hpp).
  /// @param max_sample_bytes  larger samples are dropped and counted.
  /// @throws DdsError  also when this participant already uses the topic with another type.
  [[nodiscard]] Reader create_reader(std::string_view topic, std::string_view type, const Qos& qos,
                                     OnSample on_sample,
                                     std::size_t max_sample_bytes = default_max_sample_bytes);

  /// @param max_sample_bytes  larger samples are refused; a limit below 60,000 has samples sent by the
  ///                          calling thread, which is quicker for small ones.
  /// @throws DdsError  as above.
  [[nodiscard]] Writer create_writer(std::string_view topic, std::string_view type, const Qos& qos,
                                     std::size_t max_sample_bytes = default_max_sample_bytes);

  /// GUID prefix of this participant, as hexadecimal digits: what others see as `peer`.
  [[nodiscard]] std::string guid() const;

 private:
  std::shared_ptr<detail::ParticipantCore> core_;
};

}  // namespace trestle::dds
