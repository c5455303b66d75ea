#include "bridge/carry/runtime/publisher_watch.hpp"

namespace trestle::carry {
namespace {

// A look at all writers costs up to some milliseconds, and others decide how often they change.
constexpr auto soonest_next_look = std::chrono::milliseconds{50};

}  // namespace

void PublisherWatch::open(const DdsSide& dds) {
  dds_ = &dds;
  look();
}

void PublisherWatch::changed() {
  if (dds_ == nullptr || std::exchange(due_, true)) {
    return;
  }
  const auto now = std::chrono::steady_clock::now();
  if (now >= last_ + soonest_next_look) {
    look();
    return;
  }
  timer_.expires_at(last_ + soonest_next_look);
  timer_.async_wait([this](const boost::system::error_code& cancelled) {
    if (!cancelled) {  // else this object may be gone
      look();
    }
  });
}

void PublisherWatch::stop() {
  dds_ = nullptr;
  timer_.cancel();
}

void PublisherWatch::look() {
  due_ = false;
  if (dds_ == nullptr) {
    return;
  }
  last_ = std::chrono::steady_clock::now();
  for (auto& [what, told] : told_) {
    told.published = {};
  }
  for (const dds::FoundWriter& writer : dds_->writers()) {
    const auto found = told_.find({writer.topic, writer.type});
    if (found != told_.end() && is_carried(found->second.mark, writer)) {
      found->second.published.add(writer.qos);
    }
  }
  for (const auto& [what, told] : told_) {
    told.tell(told.published);
  }
}

}  // namespace trestle::carry
