#pragma once
#include <optional>
#include <string>
#include <vector>

#include "someip/wire/endpoint.hpp"
#include "someip/wire/types.hpp"

namespace trestle::sd {

/// Whether the link that a Node needs is there, by what the kernel tells of interfaces and their addresses
/// (rtnetlink). Linux's idea of it is taken: switched on (IFF_UP) and able to carry packets (IFF_RUNNING),
/// which an interface without a carrier, or one that waits for 802.1X, is not.  [feat_req_someipsd_1221]
class LinkState {
 public:
  /// What a message of the kernel is.
  enum class Message : std::uint8_t {
    news,         ///< of an interface or an address, ours or another; or of something else
    interrupted,  ///< a part of an answer that contradicts itself, as things changed meanwhile: ask again
    end,          ///< of an answer
    refusal,      ///< of a question
  };
  struct Verdict {
    bool up = false;
    std::string interface;  ///< its name; empty when there is none, nor a name was given
    std::string why;        ///< if it is not up
  };

  /// @param own        address that some interface must have, ready for use.
  /// @param interface  that must be up; empty: one that has `own`.
  LinkState(const IpAddress& own, std::string interface);

  /// Takes the first message off the front of what was read from the kernel's socket; nothing: it was the
  /// last one. Whatever is no whole message ends them, and is ignored.
  std::optional<Message> take(ByteView& messages);

  [[nodiscard]] Verdict verdict() const;

 private:
  struct Link {
    unsigned index = 0;
    unsigned flags = 0;
    std::string name;
  };
  /// `own`, or an address in the same subnet: all of a loopback interface's subnet is this host's.
  struct Address {
    unsigned index = 0;  ///< of its interface
    IpAddress address;
    bool ready = false;
  };

  void on_link(ByteView body, bool gone);
  void on_address(ByteView body, bool gone);
  [[nodiscard]] const Link* find(unsigned index) const;

  IpAddress own_;
  std::string interface_;
  std::vector<Link> links_;         ///< all of this host
  std::vector<Address> addresses_;  ///< only those that matter
};

}  // namespace trestle::sd
