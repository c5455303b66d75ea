#pragma once
#include <boost/asio/io_context.hpp>
#include <functional>
#include <memory>
#include <string>

namespace trestle::console {

/// Records of the routes' topics, made by a process of its own, `trestle record`: the bridge waits neither
/// for a disk nor for a DDS participant to begin, and what goes wrong there does not hurt it. One at a time.
/// Used on the thread of the io_context.
///
/// The recorder ends when it is told to, and when this process does, however that comes about: then nobody
/// reads what it prints.
class RecordProcess {
 public:
  /// @param configuration  of the bridge; the recorder reads it when it begins.
  /// @param tell  is given what is done, and whether that went well.
  RecordProcess(boost::asio::io_context& io, std::string configuration,
                std::function<void(bool good, const std::string& line)> tell);
  /// As finish().
  ~RecordProcess();
  RecordProcess(const RecordProcess&) = delete;
  RecordProcess& operator=(const RecordProcess&) = delete;

  /// The folder of the next records; empty: none may be made, and one that is made is stopped.
  void allow(std::string folder);
  [[nodiscard]] bool is_allowed() const noexcept;

  /// Begins a record.
  /// @return why not; empty: it begins. That it cannot write, for instance, is known later (state_json()).
  /// @throws std::system_error when the system has no process or descriptor left.
  [[nodiscard]] std::string start();
  /// Asks for the end, which comes when all is written.
  /// @return why not.
  [[nodiscard]] std::string stop();
  /// Stops, and waits for the end, 10 s at most. A slow disk may take longer: the recorder goes on without
  /// us.
  void finish();

  /// {"allowed", "recording", "stopping", "folder", "since_ns", "running_s", "messages", "bytes", "last":
  /// {"folder", "words", "ok"} or null}
  [[nodiscard]] std::string state_json() const;
  /// Where there is no such object.
  [[nodiscard]] static std::string none_json();

 private:
  class State;
  std::shared_ptr<State> state_;  ///< what waits in the io_context may outlive it
};

}  // namespace trestle::console
