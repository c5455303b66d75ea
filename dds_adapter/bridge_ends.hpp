#pragma once
#include <atomic>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "dds_adapter/fastdds_compat.hpp"
#include "dds_adapter/participant.hpp"

/// How bridges recognise each other's readers and writers, EndpointExtras::bridge: by an entry of the user
/// data that discovery tells of each, `trestle=TEXT;`, beside those of ROS 2.
namespace trestle::dds::detail {

/// User data with the entry; without one if `bridge` is empty.
/// @throws DdsError  when others could not read it.
[[nodiscard]] std::string with_bridge_entry(const std::string& user_data, const std::string& bridge);
/// The text of the entry; nothing: there is none.
[[nodiscard]] std::optional<std::string> bridge_entry(std::string_view user_data);

/// The ends of other bridges in the domain. For all threads.
class FoundBridgeEnds {
 public:
  /// Of an endpoint that has been found, told of again, or has left.
  void note(const fast::FoundEndpoint& endpoint);

  [[nodiscard]] bool contains(const fast::Guid& guid) const;
  /// The text of an end; nothing: it is none.
  [[nodiscard]] std::optional<std::string> text_of(const fast::Guid& guid) const;
  /// @param topic  empty: any.
  [[nodiscard]] std::vector<BridgeEnd> of_topic(std::string_view topic) const;
  [[nodiscard]] std::uint64_t changes() const noexcept { return changes_; }

 private:
  static constexpr std::size_t max_ends = 4096;
  struct End {
    std::string topic;
    std::string text;
    bool writer;
  };
  mutable std::mutex mutex_;
  std::map<fast::Guid, End> ends_;
  std::atomic<std::uint64_t> changes_ = 0;
};

/// Those that match an endpoint of ours and are no counterparts. For all threads.
class IgnoredMatches {
 public:
  /// @param ignored  the peer is none.
  /// @return whether it is, or was when it matched.
  bool change(const fast::Guid& peer, bool matched, bool ignored);
  [[nodiscard]] std::size_t count() const noexcept { return count_; }

 private:
  std::mutex mutex_;
  std::set<fast::Guid> peers_;
  std::atomic<std::size_t> count_ = 0;
};

/// EndpointExtras::takes_bridge.
using TakesBridge = std::function<bool(std::string_view)>;

/// What the end of a bridge makes of another one.
enum class OtherEnd : std::uint8_t {
  none,     ///< it is no end of a bridge
  ignored,  ///< they have nothing to do with each other
  taken,    ///< it is as any other
};
[[nodiscard]] OtherEnd judge(const FoundBridgeEnds& ends, const fast::Guid& peer, const TakesBridge& takes);

/// Whether a sample's writer is the end of another bridge. Asks again only for another writer, or when ends
/// have come or gone: as a rule it takes no lock. For one thread at a time.
class BridgeCheck {
 public:
  [[nodiscard]] OtherEnd judge(const FoundBridgeEnds& ends, const fast::Guid& writer,
                               const TakesBridge& takes) {
    const std::uint64_t changes = ends.changes();
    if (changes != changes_ || writer != writer_) {
      changes_ = changes;
      writer_ = writer;
      judged_ = changes != 0 ? detail::judge(ends, writer, takes) : OtherEnd::none;
    }
    return judged_;
  }

 private:
  std::uint64_t changes_ = 0;
  fast::Guid writer_;
  OtherEnd judged_ = OtherEnd::none;
};

}  // namespace trestle::dds::detail
