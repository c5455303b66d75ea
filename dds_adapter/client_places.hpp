#pragma once
#include <algorithm>
#include <cstddef>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "dds_adapter/participant.hpp"

namespace trestle::dds::detail {

/// What waits for clients of a service, in the order in which it came, at most so much. The participants that
/// the clients belong to share the places: when all are taken, the latest of the one that has the most gives
/// way to a participant that has less than its share.
template <typename T>
class ClientPlaces {
 public:
  explicit ClientPlaces(std::size_t places) : places_{places} {}

  /// Gives what there is no place for, which may be `one` itself; nothing: there was room.
  [[nodiscard]] std::optional<T> add(const GuidPrefix& client, T one) {
    std::optional<T> left_out;
    if (waiting_.size() >= places_) {
      const std::optional<std::size_t> gives_way = place_for(client);
      if (!gives_way) {
        return one;
      }
      left_out = take_out(*gives_way);
    }
    waiting_.emplace_back(client, std::move(one));
    ++count_of_[client];
    return left_out;
  }

  /// All that waits; nothing does any more.
  [[nodiscard]] std::vector<T> take_all() {
    std::vector<T> all;
    all.reserve(waiting_.size());
    for (auto& [client, one] : waiting_) {
      all.push_back(std::move(one));
    }
    waiting_.clear();
    count_of_.clear();
    return all;
  }

  template <typename Condition>
  void erase_if(const Condition& goes) {
    std::erase_if(waiting_, [&](const auto& waiting) {
      if (!goes(waiting.second)) {
        return false;
      }
      forget(waiting.first);
      return true;
    });
  }

  /// {client, what waits for it}.
  [[nodiscard]] const std::vector<std::pair<GuidPrefix, T>>& all() const noexcept { return waiting_; }

 private:
  /// Whose place it gets; nothing: it has its share.
  [[nodiscard]] std::optional<std::size_t> place_for(const GuidPrefix& client) const {
    const auto known = count_of_.find(client);
    const std::size_t has = known == count_of_.end() ? 0 : known->second;
    const std::size_t clients = count_of_.size() + (has == 0 ? 1 : 0);
    if (has * clients >= places_) {  // which also spares the search where one floods
      return std::nullopt;
    }
    const auto most = std::ranges::max_element(count_of_, {}, [](const auto& of) { return of.second; });
    if (most == count_of_.end() || most->second <= has + 1) {
      return std::nullopt;
    }
    std::size_t last = waiting_.size() - 1;
    while (waiting_[last].first != most->first) {
      --last;
    }
    return last;
  }

  T take_out(std::size_t place) {
    auto [client, one] = std::move(waiting_[place]);
    waiting_.erase(waiting_.begin() + static_cast<std::ptrdiff_t>(place));
    forget(client);
    return std::move(one);
  }

  void forget(const GuidPrefix& client) {
    const auto of = count_of_.find(client);
    if (--of->second == 0) {
      count_of_.erase(of);
    }
  }

  std::size_t places_;
  std::vector<std::pair<GuidPrefix, T>> waiting_;
  std::map<GuidPrefix, std::size_t> count_of_;  ///< of what waits
};

}  // namespace trestle::dds::detail
