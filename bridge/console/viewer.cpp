#include "bridge/console/viewer.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>
#include <variant>

namespace trestle::console {
namespace {

using foxglove::Level;

constexpr std::array<const char*, 3> loss_words{
    "messages not sent, because this viewer reads too slowly",
    "messages not sent, because they are too large",
    "messages not sent, because they cannot be converted",
};
constexpr std::array<const char*, 3> loss_ids{"slow", "too_large", "unreadable"};

/// What is wrong with the elements of a list. One text tells it: a list may have thousands.
struct Faults {
  void add(std::string fault) {
    if (count++ == 0) {
      first = std::move(fault);
    }
  }
  [[nodiscard]] std::string text() const {
    return count == 1 ? first : fmt::format("{}; and {} more", first, count - 1);
  }
  std::string first{};
  std::size_t count = 0;
};

}  // namespace

Viewer::Viewer(std::string greeting, ViewerLimits limits) : limits_{limits} {
  push(std::move(greeting));
}

void Viewer::offer(std::span<const foxglove::Channel> channels) {
  for (const foxglove::Channel& one : channels) {
    topics_.insert_or_assign(one.id, one.topic);
  }
  push(foxglove::advertise(channels));
}

void Viewer::withdraw(std::span<const std::uint32_t> channels) {
  for (const std::uint32_t channel : channels) {
    topics_.erase(channel);
    if (const auto found = by_channel_.find(channel); found != by_channel_.end()) {
      end(found->second);
    }
  }
  push(foxglove::unadvertise(channels));
}

tl::expected<void, std::string> Viewer::on_text(std::string_view text) {
  return foxglove::read_text(text).map([this](const foxglove::Wish& wish) { fulfil(wish); });
}

tl::expected<void, std::string> Viewer::on_bytes(std::string_view bytes) {
  return foxglove::read_bytes(bytes).map([this](const foxglove::Wish& wish) { fulfil(wish); });
}

void Viewer::fulfil(const foxglove::Wish& wish) {
  if (const auto* const wanted = std::get_if<foxglove::Subscribe>(&wish)) {
    Faults faults;
    for (const auto& one : wanted->subscriptions) {
      if (std::string fault = fault_of(one); !fault.empty()) {
        faults.add(std::move(fault));
        continue;
      }
      channels_.emplace(one.id, one.channel);
      by_channel_.emplace(one.channel, one.id);
    }
    if (!faults.first.empty()) {
      tell(Level::error, faults.text(), "subscribe");
    }
  } else if (const auto* const unwanted = std::get_if<foxglove::Unsubscribe>(&wish)) {
    Faults faults;
    for (const std::uint32_t id : unwanted->ids) {
      if (!channels_.contains(id)) {
        faults.add(fmt::format("there is no subscription {}", id));
      }
      end(id);
    }
    if (!faults.first.empty()) {
      tell(Level::warning, faults.text(), "unsubscribe");
    }
  } else {
    tell(Level::error,
         fmt::format("{}: this bridge only shows; see its capabilities",
                     std::get<foxglove::NotOffered>(wish).what),
         "not_offered");
  }
}

std::string Viewer::fault_of(const foxglove::Subscribe::One& one) const {
  return !topics_.contains(one.channel) ? fmt::format("there is no channel {}", one.channel)
         : channels_.contains(one.id)   ? fmt::format("subscription {} is there already", one.id)
         : by_channel_.contains(one.channel)
             ? fmt::format("channel {} has a subscription already", one.channel)
         : channels_.size() >= limits_.subscriptions
             ? fmt::format("a viewer may have {} subscriptions", limits_.subscriptions)
             : std::string{};
}

// What waits of it would be of no use: a client does not know the number any more.
void Viewer::end(std::uint32_t subscription) {
  const auto found = channels_.find(subscription);
  if (found == channels_.end()) {
    return;
  }
  by_channel_.erase(found->second);
  channels_.erase(found);
  std::erase_if(messages_, [&](const Message& one) {
    const bool is_of_it = one.subscription == subscription;
    queued_bytes_ -= is_of_it ? one.bytes->size() : 0;
    return is_of_it;
  });
}

std::vector<std::uint32_t> Viewer::wanted() const {
  std::vector<std::uint32_t> result;
  result.reserve(by_channel_.size());
  std::ranges::transform(by_channel_, std::back_inserter(result), [](const auto& one) { return one.first; });
  return result;
}

void Viewer::add(std::uint32_t channel, std::int64_t at_ns, const MessageBytes& bytes) {
  const auto found = by_channel_.find(channel);
  if (found == by_channel_.end()) {
    return;
  }
  if (bytes->size() > limits_.queued_bytes) {
    return lose(channel, ViewerLoss::too_large);
  }
  while (!messages_.empty() && (messages_.size() >= limits_.queued_messages ||
                                queued_bytes_ + bytes->size() > limits_.queued_bytes)) {
    drop_oldest();
  }
  queued_bytes_ += bytes->size();
  messages_.push_back({found->second, channel, at_ns, bytes});
}

void Viewer::drop_oldest() {
  const Message oldest = std::move(messages_.front());
  messages_.pop_front();
  queued_bytes_ -= oldest.bytes->size();
  lose(oldest.channel, ViewerLoss::slow);
}

void Viewer::lose(std::uint32_t channel, ViewerLoss reason, std::uint64_t count, const std::string& why) {
  if (!wants(channel)) {
    return;
  }
  const auto index = static_cast<std::size_t>(reason);
  std::uint64_t& lost = lost_.at(index);
  std::uint64_t next = 1;
  while (next <= lost) {
    next *= 10;
  }
  lost += count;
  if (lost >= next) {
    tell(Level::warning,
         fmt::format("{}: {}; the last one of {}{}{}", loss_words.at(index), lost, topics_.at(channel),
                     why.empty() ? "" : ": ", why),
         loss_ids.at(index));
  }
}

void Viewer::push(std::string text) {
  if (is_lost_) {
    return;
  }
  const std::size_t first = texts_.empty() ? 0 : texts_.front().size();
  text_bytes_ += text.size();
  texts_.push_back(std::move(text));
  is_lost_ = texts_.size() > limits_.queued_texts ||
             (texts_.size() > 1 && text_bytes_ - first > limits_.queued_text_bytes);
}

void Viewer::give_up() {
  is_lost_ = true;
  texts_.clear();
  text_bytes_ = 0;
  messages_.clear();
  queued_bytes_ = 0;
  channels_.clear();
  by_channel_.clear();
}

void Viewer::tell(Level level, const std::string& text, const std::string& id) {
  push(foxglove::status(level, text, id));
}

std::optional<Viewer::Frame> Viewer::next() {
  if (!texts_.empty()) {
    Frame frame{true, std::move(texts_.front()), nullptr};
    texts_.pop_front();
    text_bytes_ -= frame.head.size();
    return frame;
  }
  if (messages_.empty()) {
    return std::nullopt;
  }
  Message& first = messages_.front();
  Frame frame{false, foxglove::message_head(first.subscription, first.at_ns), std::move(first.bytes)};
  queued_bytes_ -= frame.bytes->size();
  messages_.pop_front();
  ++sent_;
  return frame;
}

}  // namespace trestle::console
