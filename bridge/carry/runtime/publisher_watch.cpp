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
  if (dds_ == nullptr || next_look_->armed()) {
    return;
  }
  if (const auto soonest = last_ + soonest_next_look; clock_.now() < soonest) {
    next_look_->set(soonest);
  } else {
    look();
  }
}

void PublisherWatch::stop() {
  dds_ = nullptr;
  next_look_->cancel();
}

void PublisherWatch::look() {
  last_ = clock_.now();
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
