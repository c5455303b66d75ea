#pragma once
#include <optional>
#include <string>
#include <vector>

#include "bridge/documents/problem.hpp"
#include "sd/net/access.hpp"
#include "someip/net/tls.hpp"

namespace trestle::documents {
class Problems;
class Section;
}  // namespace trestle::documents

namespace trestle::carry {

/// Reads `access` of `someip`: who may do what.
/// @param v6  the IP version of our address: peers of the other one would never come.
void load_access(documents::Section& someip, bool v6, sd::AccessControl& into, documents::Problems& problems);

/// Reads `tls` of `someip`: how TCP connections are encrypted, and who is trusted.
/// @param file  of the configuration, beside which relative paths begin.
void load_tls(documents::Section& someip, const std::string& file, std::optional<someip::TlsSettings>& into,
              documents::Problems& problems);

/// Reads `peers`: addresses and subnets, which may be missing but not be none. True if they are there and
/// good.
bool load_peers(documents::Section& section, std::vector<sd::Subnet>& into, documents::Problems& problems);

/// Tells of peers of the other IP version than that of our address: they would never come.
/// @param v6  the version of our address.
void check_peers(documents::Mark mark, const std::vector<sd::Subnet>& peers, bool v6,
                 documents::Problems& problems);

}  // namespace trestle::carry
