#pragma once
#include <span>
#include <string_view>

namespace trestle::describe {

/// The keys that an object of a vsomeip configuration can have, those of older releases and those that say
/// nothing of interfaces included.
struct VsomeipKeys {
  std::string_view of;  ///< "a service"
  std::span<const std::string_view> names;
};

namespace vsomeip_keys {
extern const VsomeipKeys root;
extern const VsomeipKeys discovery;
extern const VsomeipKeys npdu_defaults;
extern const VsomeipKeys group_of_services;
extern const VsomeipKeys delays;
extern const VsomeipKeys initial_delays;
extern const VsomeipKeys service;
extern const VsomeipKeys port;
extern const VsomeipKeys event;
extern const VsomeipKeys eventgroup;
extern const VsomeipKeys multicast;
extern const VsomeipKeys tp;
extern const VsomeipKeys tp_of_method;
extern const VsomeipKeys debounce;
extern const VsomeipKeys debounce_of_method;
extern const VsomeipKeys client;
extern const VsomeipKeys e2e;
extern const VsomeipKeys protection;
}  // namespace vsomeip_keys

}  // namespace trestle::describe
