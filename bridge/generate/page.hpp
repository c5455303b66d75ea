#pragma once
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "bridge/generate/page_member.hpp"
#include "bridge/generate/page_question.hpp"
#include "bridge/generate/targets.hpp"
#include "bridge/web/server.hpp"
#include "sd/net/proxy.hpp"
#include "sd/net/service_spec.hpp"

namespace trestle::generate {

/// A method, getter or setter to call for the page, and how its answer is shown.
struct PageCall {
  sd::RequireSpec service{};
  sd::CallSpec call{};
  std::vector<std::byte> payload{};
  bool forget = false;  ///< no response comes
  std::string note{};   ///< what people should know of the call; empty: nothing
  std::function<web::Answer(const sd::Response& response)> show{};
};

/// The answers to what the page of `trestle generate --ui` asks, JSON to JSON:
///
///   GET  /api/start    what the program was started with
///   POST /api/system   files and edits: the model, the targets, what is wrong
///   POST /api/preview  the files of one target, and what it does not carry
///   POST /api/form     what values a payload has
///   POST /api/layout   the bytes of a payload, with values or without
///   POST /api/call     call(): the answer comes later
///
/// Opens no file and no socket: what files import is looked for among the files of the question alone. Of the
/// folders of --types it opens what the files name as types of ROS.
class Page {
 public:
  struct Settings {
    std::vector<describe::SourceText> files{};  ///< that the page begins with
    describe::Model captured{};                 ///< what captures told; without any file it is not there
    describe::IdLock lock{};                    ///< ids that were chosen before
    TargetOptions targets{};
    bool set_event_bit = true;
    std::vector<std::string> type_folders{};  ///< with packages of ROS types, "--types"
  };
  explicit Page(Settings settings);

  /// The answer to all but /api/call; 404 for what is not there, 400 for what is no question.
  [[nodiscard]] web::Answer answer(const web::Request& request);
  /// What /api/call asks for, or the answer that says why it cannot be.
  [[nodiscard]] tl::expected<PageCall, web::Answer> call(const web::Request& request);

 private:
  [[nodiscard]] std::shared_ptr<const PageSystem> load(const PageQuestion& question);
  [[nodiscard]] web::Answer start() const;
  [[nodiscard]] static web::Answer system(const PageSystem& loaded);
  [[nodiscard]] web::Answer preview(const PageSystem& loaded, const PageQuestion& question) const;

  Settings settings_;
  std::string started_;  ///< tells this program from others that had the same address
  /// Of the question before: questions come in rows about the same files.
  std::vector<describe::SourceText> files_{};
  describe::Reading reading_{};
  std::shared_ptr<const PageSystem> loaded_{};
  describe::Edits edits_{};
};

/// {"error": TEXT}, for what went wrong in a way that people should read.
[[nodiscard]] web::Answer error_answer(const std::string& text);

}  // namespace trestle::generate
