#pragma once
#include <atomic>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "bridge/carry/runtime/dds_side.hpp"
#include "someip/wire/endpoint.hpp"

namespace trestle::carry {

/// Who could close a ring around a route or method without saying that he is a bridge: he reads the topic
/// that we write, or writes the one that we read, at a host with which we speak SOME/IP. Which hosts those
/// are is known by the addresses that discovery in DDS tells. On one thread, but for on_match().
class LoopSuspects {
 public:
  /// @param topic  on the DDS wire.
  /// @param writers  they write it, a reader of ours reads; else the other way round.
  LoopSuspects(std::string topic, bool writers) : topic_{std::move(topic)}, writers_{writers} {}

  /// For the reader or writer of ours: EndpointExtras::on_match.
  [[nodiscard]] dds::OnMatch on_match() const;
  /// The same for a ROS service or client of ours: ServiceConfig::on_request_match.
  [[nodiscard]] dds::ServiceConfig watching(dds::ServiceConfig ros) const;
  /// Looks again if some have come or gone. Cheap if not.
  void update(const DdsSide& dds) {
    if (changes_->load(std::memory_order_relaxed) != seen_) {
      look(dds);
    }
  }
  /// What update() finds. @param own  addresses of this host.
  void set(const std::vector<dds::Counterpart>& found, std::vector<IpAddress> own);

  [[nodiscard]] bool any() const noexcept { return !all_.empty(); }
  /// Whether one of them is at this host.
  [[nodiscard]] bool at(const IpAddress& host) noexcept {
    if (host != last_host_) {
      last_host_ = host;
      is_last_ = find(host);
    }
    return is_last_;
  }
  /// Whether the one of the participant that this reader or writer is of is at one of these hosts.
  [[nodiscard]] bool is_at(const dds::Guid& endpoint, std::span<const IpAddress> hosts) const noexcept;
  /// Words for the first one at this host, or else at any, for the log: "the ROS node /gateway".
  [[nodiscard]] std::string name_at(const IpAddress& host, const DdsSide& dds) const;

 private:
  /// Where one is.
  struct Suspect {
    dds::Guid endpoint{};
    std::vector<IpAddress> addresses{};  ///< sorted
    bool here = false;                   ///< on this host
  };
  void look(const DdsSide& dds);
  [[nodiscard]] Suspect suspect(const dds::Counterpart& found) const;
  [[nodiscard]] bool is_here(const IpAddress& host) const noexcept;
  [[nodiscard]] bool find(const IpAddress& host) const noexcept;
  [[nodiscard]] bool has(const Suspect& one, const IpAddress& host) const noexcept;

  const std::string topic_;
  const bool writers_;
  // Of those that match; shared, as an endpoint may end later than this.
  const std::shared_ptr<std::atomic<std::uint64_t>> changes_ =
      std::make_shared<std::atomic<std::uint64_t>>(0);
  std::uint64_t seen_ = 0;
  std::vector<Suspect> all_;      ///< sorted by endpoint
  std::vector<IpAddress> hosts_;  ///< of all of them, sorted, but for this one
  bool any_here_ = false;
  std::vector<IpAddress> own_;  ///< sorted
  IpAddress last_host_{};       ///< the last answer of at()
  bool is_last_ = false;
};

}  // namespace trestle::carry
