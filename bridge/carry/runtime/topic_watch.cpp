#include "bridge/carry/runtime/topic_watch.hpp"

#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>

namespace trestle::carry {

void TopicWatch::watch(std::string topic, End ours, std::function<void()> changed) {
  const std::lock_guard lock{mutex_};
  watched_.push_back({std::move(topic), ours, std::move(changed)});
}

void TopicWatch::watch_writers(std::function<void()> changed) {
  watch("", End::reader, std::move(changed));
}

void TopicWatch::stop() {
  const std::lock_guard lock{mutex_};
  stopped_ = true;
}

void TopicWatch::on_event(const dds::Happening& happening) {
  if (happening.kind != dds::Happening::Kind::matched && happening.kind != dds::Happening::Kind::unmatched) {
    return;
  }
  const End ours = happening.detail == "reader" ? End::reader : End::writer;
  const std::lock_guard lock{mutex_};
  for (Watched& one : watched_) {
    if (one.ours == ours && (one.topic.empty() || one.topic == happening.topic)) {
      call_soon(one);
    }
  }
}

void TopicWatch::on_writers() {
  const std::lock_guard lock{mutex_};
  for (Watched& one : watched_) {
    if (one.topic.empty()) {
      call_soon(one);
    }
  }
}

void TopicWatch::call_soon(Watched& one) {
  if (!stopped_ && !std::exchange(one.due, true)) {
    boost::asio::post(io_, [weak = weak_from_this(), &one] {
      if (const auto self = weak.lock()) {
        self->call(one);
      }
    });
  }
}

void TopicWatch::call(Watched& one) {
  {
    const std::lock_guard lock{mutex_};
    one.due = false;  // before it looks: what changes from now on is told of again
    if (stopped_) {
      return;
    }
  }
  one.changed();
}

}  // namespace trestle::carry
