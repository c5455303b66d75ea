#pragma once
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "bridge/carry/runtime/someip_side.hpp"
#include "bridge/documents/problem.hpp"

namespace trestle::carry {

/// A service of ours: offered always, or only while all topics that it needs have a publisher. On the thread
/// that runs the io_context.
class ServiceOffer {
 public:
  /// @param mark  where the first of its routes and methods stands.
  ServiceOffer(sd::ServiceSpec spec, documents::Mark mark) : spec_{std::move(spec)}, mark_{mark} {}

  /// To be completed by routes and methods before it is opened.
  [[nodiscard]] sd::ServiceSpec& spec() noexcept { return spec_; }
  /// It is to be offered only while what its routes and methods need is there.
  void wait_for_needs(bool waits) { waits_ |= waits; }
  [[nodiscard]] const sd::ServiceSpec& spec() const noexcept { return spec_; }
  [[nodiscard]] bool is_of(someip::ServiceId service, someip::InstanceId instance) const noexcept {
    return spec_.service == service && spec_.instance == instance;
  }
  [[nodiscard]] documents::Mark mark() const noexcept { return mark_; }
  /// Opens its ports, and offers it unless it waits for what it needs: then update() does.
  /// @param someip  outlives this object.
  /// @throws as sd::Node::offer().
  void open(SomeipSide& someip);

  /// Offers it from now on only while this is true, too.
  void needs(std::function<bool()> published) { needs_.push_back(std::move(published)); }
  /// Offers or withdraws it, if what it needs has come or gone.
  void update();
  /// Ends the offer, if it is offered now. To be called before the end of one that ends before its node.
  void withdraw();
  /// Gives the field with this notifier a value, also while it is not offered: it is offered with it then.
  /// What was published goes with its publishers: a withdrawn offer forgets its values.
  sd::Notified set(someip::MethodId notifier, std::shared_ptr<const std::vector<std::byte>> value);
  /// The field with this notifier has no value any more.
  void forget(someip::MethodId notifier);
  /// The value of the field with this notifier; nothing while it has none.
  [[nodiscard]] std::shared_ptr<const std::vector<std::byte>> value(someip::MethodId notifier) const {
    return handle_ ? someip_->field(*handle_, notifier) : nullptr;
  }
  /// The node is about to withdraw it: it is not offered again.
  void stop() {
    stopped_ = true;
    handle_.reset();
  }

  /// Nothing: it is not offered now.
  [[nodiscard]] const std::optional<sd::OfferHandle>& handle() const noexcept { return handle_; }

 private:
  sd::ServiceSpec spec_;
  const documents::Mark mark_;
  bool waits_ = false;
  SomeipSide* someip_ = nullptr;
  std::vector<std::shared_ptr<const void>> ports_;
  std::vector<std::function<bool()>> needs_;
  std::optional<sd::OfferHandle> handle_;
  bool stopped_ = false;
};

/// Those of a bridge, one for each service instance.
class ServiceOffers {
 public:
  /// That of a route or method of the configuration; made if there is none yet.
  template <typename Configured>
  [[nodiscard]] ServiceOffer& of(const Configured& one) {
    return of({.service = one.service,
               .instance = one.instance,
               .major = one.major,
               .minor = one.minor,
               .udp_port = {}},
              one.mark);
  }
  /// Withdraws it and forgets it.
  template <typename Configured>
  void end(const Configured& one) {
    of(one).withdraw();
    std::erase_if(offers_, [&](const auto& offer) { return offer->is_of(one.service, one.instance); });
  }
  [[nodiscard]] auto begin() const noexcept { return offers_.begin(); }
  [[nodiscard]] auto end() const noexcept { return offers_.end(); }

 private:
  [[nodiscard]] ServiceOffer& of(sd::ServiceSpec service, documents::Mark mark);

  std::vector<std::unique_ptr<ServiceOffer>> offers_;
};

}  // namespace trestle::carry
