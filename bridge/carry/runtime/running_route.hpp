#pragma once
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "bridge/carry/runtime/e2e_status.hpp"
#include "bridge/carry/runtime/interface.hpp"
#include "bridge/carry/runtime/published_qos.hpp"
#include "bridge/carry/runtime/service_offer.hpp"
#include "bridge/carry/runtime/surroundings.hpp"

namespace trestle::carry {

class Onlooker;

/// A route, method or getter of the configuration while it runs. Each kind has a file, named by what it does:
/// topic_to_event, event_to_topic, service_to_method, method_to_service, getter_to_topic. (Fields and actions
/// are made of these.) Made by make_routes(); then it joins SOME/IP, then DDS, before the io_context runs or
/// on its thread, on which all else happens, too.
class RunningRoute : public Interface {
 public:
  /// Describes what it offers in SOME/IP, by offers that outlive the route.
  virtual void describe(ServiceOffers& /*offers*/) {}
  /// Looks for what it uses in SOME/IP.  @throws someip::NetError
  virtual void join_someip() {}
  /// Opens its ends in DDS.  @throws dds::DdsError
  virtual void join_dds() {}
  /// Carries nothing from now on, and begins nothing.
  virtual void stop() {}

  /// To be called when writers of others in DDS have come or gone, among which may be those of bridges.
  virtual void writers_changed() {}
  /// The same for a route that follows the publishers of its topic, with what they offer now.
  virtual void follow(const PublishedQos& /*published*/) {}

  [[nodiscard]] virtual CounterGroup counters() const = 0;
  /// Its state, and what the checks of its end-to-end protection have found.
  /// @param all  also states that are only told if that is wanted: there may be a thousand.
  virtual void append_diagnoses(std::vector<Diagnosis>& diagnoses, bool all) const = 0;
  /// Whether it has checks of end-to-end protection, which are published even if no states are wanted.
  [[nodiscard]] bool has_checks() const noexcept { return e2e_.has_value(); }
  /// Calls `changed` when what append_diagnoses() tells has another level.
  void on_change(std::function<void()> changed) {
    if (e2e_) {
      e2e_->on_change(changed);
    }
    changed_ = std::move(changed);
  }

  /// The topic, if a person should be told when nothing comes; null if silence is normal.
  [[nodiscard]] virtual const std::string* awaited() const { return nullptr; }
  /// Messages that have come.
  [[nodiscard]] virtual std::uint64_t received() const { return 0; }
  /// What it is, and how it is now: all but counters, state and cause.
  [[nodiscard]] virtual RoutePicture picture(const Surroundings& around) const = 0;

  /// What it carries, if its messages can be looked at; null if not.
  [[nodiscard]] virtual const Route* looked_at() const { return nullptr; }
  /// Each message that comes is shown to this one from now on. Null: to nobody.
  void shown_to(Onlooker* onlooker) noexcept { onlooker_ = onlooker; }

 protected:
  RunningRoute() = default;
  /// @param checks  of what comes; nothing: none.
  explicit RunningRoute(const std::optional<E2eSettings>& checks) {
    if (checks) {
      e2e_.emplace(checks->pass_failed);
    }
  }
  void tell_change() const {
    if (changed_) {
      changed_();
    }
  }
  /// @param of, at  as of E2eStatus::diagnosis().
  void append_checks(std::vector<Diagnosis>& diagnoses, const std::string& of, const std::string& at) const {
    if (e2e_) {
      diagnoses.push_back(e2e_->diagnosis(of, at));
    }
  }

  std::optional<E2eStatus> e2e_;
  Onlooker* onlooker_ = nullptr;  ///< of messages that come, if somebody looks

 private:
  std::function<void()> changed_;
};

}  // namespace trestle::carry
