#pragma once
#include <list>
#include <memory>
#include <span>
#include <vector>

#include "sd/net/e2e_spec.hpp"
#include "someip/core/e2e/protector.hpp"
#include "someip/wire/endpoint.hpp"
#include "someip/wire/header.hpp"

namespace trestle::sd {

/// Who is at the other end.
struct E2ePeer {
  Endpoint at{};
  Transport transport = Transport::udp;
  someip::ClientId client{};  ///< of requests that are received: clients of one host may share an endpoint
  friend bool operator==(const E2ePeer&, const E2ePeer&) = default;
};

/// A Protector or Checker for each of so many peers.
template <typename T>
class E2ePeers {
 public:
  E2ePeers(const T& fresh, std::size_t max) : fresh_{fresh}, max_{max} {}

  [[nodiscard]] const T& fresh() const noexcept { return fresh_; }
  /// Nothing if this one is not known.
  [[nodiscard]] T* find(const E2ePeer& peer) noexcept {
    for (auto one = peers_.begin(); one != peers_.end(); ++one) {
      if (one->first == peer) {
        peers_.splice(peers_.begin(), peers_, one);
        return &one->second;
      }
    }
    return nullptr;
  }
  /// The one that was used longest ago makes room.
  T& add(const E2ePeer& peer, const T& state) {
    if (peers_.size() >= max_) {
      peers_.pop_back();
    }
    peers_.emplace_front(peer, state);
    return peers_.front().second;
  }
  T& operator[](const E2ePeer& peer) {
    T* const known = find(peer);
    return known != nullptr ? *known : add(peer, fresh_);
  }
  void forget(const Endpoint& at) {
    peers_.remove_if([&](const auto& one) { return one.first.at == at; });
  }

 private:
  T fresh_;
  std::size_t max_;
  std::list<std::pair<E2ePeer, T>> peers_;  ///< used latest first
};

/// The protection of one event or method: puts the E2E header into what is sent, checks and takes it out.
class E2eChannel : public std::enable_shared_from_this<E2eChannel> {
 public:
  /// @throws std::invalid_argument naming the field that cannot be.
  explicit E2eChannel(const E2eSpec& spec);

  [[nodiscard]] const E2eSpec& spec() const noexcept { return spec_; }
  [[nodiscard]] bool protects() const noexcept { return sending_.has_value(); }
  [[nodiscard]] bool checks() const noexcept { return receiving_.has_value(); }
  /// By how much protect() makes a payload longer.
  [[nodiscard]] std::size_t added_bytes() const noexcept { return sending_ ? sending_->place.bytes : 0; }

  using Bytes = std::shared_ptr<const std::vector<std::byte>>;
  /// A payload with its E2E header; null if the profile does not allow it. For channels that protect, as the
  /// next three.
  [[nodiscard]] Bytes protect(const E2ePeer& to, const someip::Header& header,
                              std::span<const ByteView> payload, const someip::e2e::MethodInfo& method = {});
  /// What was protected last was not sent.
  void take_back(const E2ePeer& to);
  /// As protect(), with the counter of a request, for its answer.
  [[nodiscard]] Bytes protect_as(std::uint32_t counter, const someip::Header& header,
                                 std::span<const ByteView> payload, const someip::e2e::MethodInfo& method);
  /// As protect(), with the counter of the last event if there was one: the initial event is for one
  /// subscriber, and the others must not miss a number.
  [[nodiscard]] Bytes protect_again(const someip::Header& header, ByteView payload);

  /// Checks a message, of channels that check, and takes the E2E header out of its payload, which may then
  /// lie in `room`.
  /// @param known  the sender is one that discovery told of. Others are only remembered if all is well.
  [[nodiscard]] someip::e2e::CheckResult check(const E2ePeer& from, someip::Message& message,
                                               const someip::e2e::MethodExpectation& expected, bool known,
                                               std::vector<std::byte>& room);
  /// Whether a message with this result is handed over.
  [[nodiscard]] bool passes(const someip::e2e::CheckResult& result) const noexcept;
  /// This peer has begun anew, or is gone.
  void forget(const Endpoint& peer);

 private:
  /// Of the E2E header, in bytes of the payload.
  struct Place {
    std::size_t at = 0;
    std::size_t bytes = 0;
  };
  struct Sending {
    Place place;
    E2ePeers<someip::e2e::Protector> peers;
  };
  struct Receiving {
    Place place;
    E2ePeers<someip::e2e::Checker> peers;
  };
  [[nodiscard]] static Place place_of(const someip::e2e::Config& config, const E2eSpec& spec,
                                      const char* which);
  [[nodiscard]] Bytes protect(someip::e2e::Protector& protector, const someip::Header& header,
                              std::span<const ByteView> payload, const someip::e2e::MethodInfo& method) const;

  E2eSpec spec_;
  std::optional<Sending> sending_;
  std::optional<Receiving> receiving_;
  std::optional<std::uint32_t> last_;  ///< counter of the last event that was sent
};

/// The channels of a service, a requirement or a subscription; mostly there are none.
class E2eChannels {
 public:
  E2eChannels() = default;
  void add(std::shared_ptr<E2eChannel> channel) { channels_.push_back(std::move(channel)); }
  /// Null if it has no protection.
  [[nodiscard]] E2eChannel* find(someip::MethodId id) const noexcept {
    for (const auto& channel : channels_) {
      if (channel->spec().id == id) {
        return channel.get();
      }
    }
    return nullptr;
  }
  [[nodiscard]] std::size_t added_bytes(someip::MethodId id) const noexcept {
    const E2eChannel* const channel = find(id);
    return channel == nullptr ? 0 : channel->added_bytes();
  }
  void forget(const std::optional<Endpoint>& udp, const std::optional<Endpoint>& tcp) const;

 private:
  std::vector<std::shared_ptr<E2eChannel>> channels_;
};

/// What the protection of an answer needs.
struct E2eReply {
  std::shared_ptr<E2eChannel> channel;
  someip::e2e::CheckResult request;  ///< what its check found out
};

}  // namespace trestle::sd
