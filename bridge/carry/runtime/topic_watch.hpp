#pragma once
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <string>

#include "dds_adapter/participant.hpp"

namespace boost::asio {
class io_context;
}

namespace trestle::carry {

/// Says, on the thread that runs the io_context, that the readers or writers of a topic have come or gone.
/// DDS tells of them on threads of its own, while it holds locks.
class TopicWatch : public std::enable_shared_from_this<TopicWatch> {
 public:
  /// To be held by a shared_ptr.
  explicit TopicWatch(boost::asio::io_context& io) : io_{io} {}

  enum class End : std::uint8_t { reader, writer };
  /// `changed` is called after the number of counterparts of our reader or writer of this topic has changed:
  /// once for changes that come together.
  /// @param topic  its DDS name.
  void watch(std::string topic, End ours, std::function<void()> changed);
  /// The same after writers of others have come or gone, whatever their topic, and after the number of
  /// counterparts of any of our readers has changed.
  void watch_writers(std::function<void()> changed);
  /// Nothing is called any more.
  void stop();

  /// From any thread.
  void on_event(const dds::Happening& happening);
  void on_writers();

 private:
  struct Watched {
    std::string topic;  ///< empty: all
    End ours{};
    std::function<void()> changed;
    bool due = false;  ///< it is going to be called
  };
  void call_soon(Watched& one);
  void call(Watched& one);

  boost::asio::io_context& io_;
  std::mutex mutex_;             ///< of what follows; not held during calls
  std::deque<Watched> watched_;  ///< whose elements stay where they are
  bool stopped_ = false;
};

}  // namespace trestle::carry
